//! What `mbd_model!` says about wrong arguments and wrong models (`tests/ui/*.stderr`).

use std::path::Path;

#[test]
fn messages() {
    // Paths in the macro are relative to the crate that is compiled, here the one that trybuild makes.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target directory");
    let models = target.join("tests/trybuild").join(env!("CARGO_PKG_NAME")).join("models");
    std::fs::create_dir_all(&models).expect("room for the models");
    for entry in std::fs::read_dir("tests/ui/models").expect("the models") {
        let file = entry.expect("a model").path();
        std::fs::copy(&file, models.join(file.file_name().expect("a name"))).expect("a copy");
    }
    trybuild::TestCases::new().compile_fail("tests/ui/*.rs");
}

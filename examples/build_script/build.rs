//! Generates the code of a robot before the crate is compiled: it is made once for each change of the description, and
//! an editor that checks the crate does not generate it again, as it does with `mbd_model!`.

use std::path::{Path, PathBuf};

use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{generate, Options, Output};

fn main() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/iiwa14.urdf");
    println!("cargo::rerun-if-changed={}", file.display());
    let text = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    // The findings of the reader say file, line, column and what to do.
    let reading = read::model("iiwa14.urdf", &text, &ImportOptions::default());
    let model = reading.unwrap_or_else(|findings| panic!("{findings}")).model;
    let options = Options {
        type_name: "Iiwa".to_string(),
        outputs: vec![Output::Rates, Output::Energy],
        runtime: "::multibody::runtime".to_string(),
        ..Options::default()
    };
    let generated = generate(&model, &options).unwrap_or_else(|error| panic!("{error}"));
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR for build scripts"));
    std::fs::write(out.join("iiwa.rs"), generated.source).expect("OUT_DIR can be written");
}

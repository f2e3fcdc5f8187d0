//! `mbd generate --lang wasm`, and the example that uses what it writes.

use std::path::Path;
use std::process::Command;

use crate::run::*;

/// The last block of text in a page.
fn block(page: &str) -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join(page)).expect("a page");
    let (_, rest) = text.rsplit_once("```text\n").expect("a block");
    rest.split_once("```").expect("the end of the block").0.to_string()
}

#[test]
fn module_wrapper_and_types() {
    let folder = folder("webassembly");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let generate = |file: &str| run_in(&folder, &["generate", &model, "--lang", "wasm", "-o", file]);
    let output = good(generate("double_pendulum.wasm"));
    assert!(out(&output).is_empty());
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a file");
    let commented: String = block("book/src/webassembly.md").lines().map(|line| format!("// {line}\n")).collect();
    for name in ["double_pendulum.js", "double_pendulum.d.ts"] {
        assert!(read(name).contains(&commented), "book/src/webassembly.md should have the table of\n{}", read(name));
    }
    if !is_there("node") {
        return;
    }
    for name in ["pendulum.js", "package.json"] {
        std::fs::copy(format!("{ROOT}/examples/wasm/{name}"), folder.join(name)).expect("the example");
    }
    let output = Command::new("node").arg("pendulum.js").current_dir(&folder).output().expect("there is Node");
    let output = good(output);
    assert_eq!(out(&output), block("examples/wasm/README.md"));
}

#[test]
fn files_are_written_together_or_not_at_all() {
    let folder = folder("webassembly_files");
    let model = format!("{ROOT}/models/ur5.urdf");
    let generate = |more: &[&str]| run_in(&folder, &[&["generate", &model, "--lang", "wasm"], more].concat());
    bad(generate(&[]), &["WebAssembly needs the name of a file that ends with `.wasm`", "-o robot.wasm"]);
    bad(generate(&["-o", "ur5.js"]), &["ends with `.wasm`"]);
    bad(generate(&["-o", "ur5.wasm", "--frames", "nose", "--outputs", "frames"]), &["`nose`"]);
    // The wrapper cannot be written.
    std::fs::create_dir(folder.join("ur5.js")).expect("a folder");
    bad(generate(&["-o", "ur5.wasm"]), &["cannot write `ur5.js`"]);
    let files: Vec<_> = std::fs::read_dir(&folder).expect("a folder").map(|f| f.expect("a file").file_name()).collect();
    assert_eq!(files, ["ur5.js"]);
    let unknown = run(&["generate", "models/ur5.urdf", "--lang", "wasn"]);
    assert!(err(&unknown).contains("did you mean") || err(&unknown).contains("wasm"), "{}", err(&unknown));
}

//! Generates Rust, C and WebAssembly of the models of the comparison, and compiles the C with each compiler that the
//! environment variable `TARGETS_CC` names, between spaces.

use std::fmt::Write;

use mbd_codegen::options::PlanOptions;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{c, search, wasm, Options, Output};

include!("src/models.rs");

fn main() {
    println!("cargo:rerun-if-changed=src/models.rs");
    println!("cargo:rerun-if-env-changed=TARGETS_CC");
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    let native = std::env::var("CARGO_CFG_TARGET_FEATURE").is_ok_and(|features| features.contains("avx2"));
    let compilers = std::env::var("TARGETS_CC").unwrap_or_else(|_| "cc".to_string());
    let mut list = String::new();
    for (name, file) in MODELS {
        let path = format!("../../models/{file}");
        println!("cargo:rerun-if-changed={path}");
        let text = std::fs::read_to_string(&path).expect("the model");
        let model =
            read::model(&path, &text, &ImportOptions::default()).unwrap_or_else(|findings| panic!("{findings}"));
        let plan = search::plan(&model.model, PlanOptions::default());
        let options = Options { outputs: vec![Output::Rates], source: file.to_string(), ..Options::default() };
        let write = |file: String, text: &[u8]| std::fs::write(format!("{out}/{file}"), text).expect("written");

        let rust = Options { type_name: "Rust".to_string(), ..options.clone() };
        let code = mbd_codegen::generate::generate_from(&plan, &rust).expect("Rust").source;
        write(format!("{name}.rs"), code.as_bytes());

        let module = Options { type_name: "Module".to_string(), ..options.clone() };
        let module = wasm::generate_from(&plan, &module).expect("WebAssembly");
        write(format!("{name}.wasm"), &module.module);
        write(format!("{name}.mjs"), module.wrapper.as_bytes());

        let mut calls = String::new();
        for (k, compiler) in compilers.split_whitespace().enumerate() {
            let whose = format!("{name}{k}");
            let code = Options { type_name: whose.clone(), ..options.clone() };
            let (prefix, code) = (c::prefix(&whose), c::generate_from(&plan, &code, &whose).expect("C"));
            write(format!("{whose}.c"), code.source.as_bytes());
            write(format!("{whose}.h"), code.header.as_bytes());
            let mut build = cc::Build::new();
            build
                .compiler(compiler)
                .file(format!("{out}/{whose}.c"))
                .opt_level(3)
                .flag("-std=c99")
                .flag("-ffp-contract=fast");
            if native {
                build.flag("-march=native");
            }
            build.compile(&whose);
            let _ = writeln!(calls, "            {compiler:?} => {prefix}_rates,");
        }
        let _ = writeln!(list, "    {name}, {name:?} {{\n{calls}        }}");
    }
    std::fs::write(format!("{out}/models.rs"), format!("models! {{\n{list}}}\n")).expect("written");
}

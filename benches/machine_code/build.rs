//! Generates exact and fast code of the models of the comparison.

use std::fmt::Write;

use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{generate, Arithmetic, Options, Output};

include!("src/models.rs");

fn main() {
    println!("cargo:rerun-if-changed=src/models.rs");
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    let mut list = String::from("models! {\n");
    for (name, file, floating) in MODELS {
        let path = format!("../../models/{file}");
        println!("cargo:rerun-if-changed={path}");
        let text = std::fs::read_to_string(&path).expect("the model");
        let base = if floating { Base::Floating } else { Base::Fixed };
        let model = read::model(&path, &text, &ImportOptions { base, ..ImportOptions::default() });
        let model = model.unwrap_or_else(|findings| panic!("{findings}")).model;
        for (type_name, arithmetic) in [("Exact", Arithmetic::Exact), ("Fast", Arithmetic::Fast)] {
            let options = Options {
                type_name: type_name.to_string(),
                outputs: vec![Output::Rates],
                arithmetic,
                source: file.to_string(),
                ..Options::default()
            };
            let code = generate(&model, &options).expect("code").source;
            std::fs::write(format!("{out}/{name}_{}.rs", arithmetic.name()), code).expect("written");
        }
        let _ = writeln!(list, "    {name}, {path:?}, {floating};");
    }
    list.push_str("}\n");
    std::fs::write(format!("{out}/models.rs"), list).expect("written");
}

//! Generates the rates of legged robots, like branches together and apart.

use mbd_codegen::options::LikeBranches;
use mbd_codegen::read::{self, Base, ImportOptions};
use mbd_codegen::{generate::generate_from, search, Arithmetic, Options, Output};

fn main() {
    let out = std::env::var("OUT_DIR").expect("cargo sets it");
    for name in ["solo12", "g1"] {
        let path = format!("../../models/{name}.urdf");
        println!("cargo:rerun-if-changed={path}");
        let text = std::fs::read_to_string(&path).expect("the model");
        let model = read::model(&path, &text, &ImportOptions { base: Base::Floating, ..ImportOptions::default() });
        let model = model.unwrap_or_else(|findings| panic!("{findings}")).model;
        let mut options = Options { outputs: vec![Output::Rates], ..Options::default() };
        let plan = search::plan(&model, options.searches());
        for arithmetic in [Arithmetic::Exact, Arithmetic::Fast] {
            for branches in [LikeBranches::Apart, LikeBranches::Together] {
                options.arithmetic = arithmetic;
                options.plan.branches = branches;
                let code = generate_from(&plan, &options).expect("code").source;
                let file = format!("{out}/{name}_{}_{}.rs", arithmetic.name(), branches.name());
                std::fs::write(file, code).expect("written");
            }
        }
    }
}

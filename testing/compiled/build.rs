//! Generates code for random trees as a user's build script would; `tests/compiled.rs` includes the code.

use std::fmt::Write;
use std::path::PathBuf;

use mbd_codegen::model::Gravity;
use mbd_codegen::search;
use mbd_testing::batch;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets it"));
    let mut all = String::new();
    for k in 0..batch::TREES {
        let (model, options) = batch::tree(k);
        let code = mbd_codegen::generate(&model, &options).unwrap_or_else(|e| panic!("tree {k}: {e}"));
        let file = out.join(format!("tree{k}.rs"));
        std::fs::write(&file, code.source).expect("OUT_DIR can be written");
        let plan = search::plan(&model, options.plan);
        let mut fields = Vec::new();
        if options.efforts && plan.dims.nv > 0 {
            fields.push("tau");
        }
        if plan.dims.drive_q > 0 {
            fields.extend(["drive_q", "drive_v", "drive_a"]);
        }
        if plan.dims.wrenches > 0 {
            fields.push("wrenches");
        }
        if !model.params.is_empty() {
            fields.push("params");
        }
        if model.gravity == Gravity::Input {
            fields.push("gravity");
        }
        let number = options.precision.name();
        let (frames, joints) = (plan.frames.len(), plan.joint_nodes.len());
        let params = model.params.len();
        let outputs: Vec<&str> = options.outputs.iter().map(|output| output.name()).collect();
        let outputs = outputs.join(", ");
        let lanes = if batch::has_lanes(k) { "lanes" } else { "" };
        let _ = writeln!(all, "pub mod tree{k} {{\n    include!({:?});\n}}", file.display().to_string());
        let _ = writeln!(
            all,
            "runner!(run{k}, tree{k}, {number}, [{}], [{outputs}], [{lanes}], {frames}, {joints}, {params});",
            fields.join(", ")
        );
    }
    let names: Vec<String> = (0..batch::TREES).map(|k| format!("run{k}")).collect();
    let _ = writeln!(all, "pub const RUNNERS: [Runner; {}] = [{}];", names.len(), names.join(", "));
    std::fs::write(out.join("all.rs"), all).expect("OUT_DIR can be written");
}

//! Makes a system at its start from the text of a model.

use multibody::codegen::model::Model;
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::Interpreter;

use mbd_cli::{Failure, Outcome};

/// A mechanism whose joints have one degree of freedom each.
pub struct Mechanism {
    /// Equations of motion.
    pub system: Interpreter<f64>,
    /// Coordinates at the start; loops are closed to the digits of the file.
    pub q: Vec<f64>,
}

/// Reads a model that this program wrote or contains.
pub fn read(text: &str) -> Outcome<Mechanism> {
    let built_in = "report this: the model is built in";
    let read = read::model("model.toml", text, &ImportOptions::default());
    let model = read.map_err(|findings| Failure::new(findings.to_string(), built_in))?.model;
    let plan = search::plan(&model, PlanOptions::default());
    let system = plan.default_interpreter();
    let q = start(&model, &plan);
    Ok(Mechanism { system, q })
}

/// The initial coordinates of the file, except that the branches at the forks of trees start at ±0.3 rad.
fn start(model: &Model, plan: &Plan) -> Vec<f64> {
    let mut q = plan.start();
    for (q, joint) in q.iter_mut().zip(&model.joints) {
        match joint.name.as_str() {
            name if name.ends_with("left") => *q = 0.3,
            name if name.ends_with("right") => *q = -0.3,
            _ => {}
        }
    }
    q
}

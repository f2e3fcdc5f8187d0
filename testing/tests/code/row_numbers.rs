//! Rows of contacts and stops, which are added after the search, and rows in passes, in plans with another elimination for
//! accelerations: the rows have other numbers there.

use mbd_codegen::code::compile;
use mbd_codegen::factored::factored;
use mbd_codegen::generate::{Arithmetic, Options, Output};
use mbd_codegen::model::Model;
use mbd_codegen::options::{PlanOptions, DEFAULT_SNAP};
use mbd_codegen::plan::Plan;
use mbd_codegen::read;
use mbd_codegen::search;
use mbd_runtime::sweep::FrameState;
use mbd_testing::conformance::evaluate;
use mbd_testing::eliminations::random_plan;
use mbd_testing::relative_error;
use mbd_testing::state::random_state;

/// A planar chain of ten links whose last joint stands at a stop, with a ball that touches the floor.
fn chain() -> Model {
    let path = format!("{}/../models/chain10_planar.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("the model is there");
    let text = format!(
        "{text}limits = [-1, 1]

[[shape]]
name = \"floor\"
type = \"plane\"

[[shape]]
name = \"ball\"
body = \"link10\"
type = \"sphere\"
radius = 0.1

[[contact]]
name = \"touch\"
between = [\"floor\", \"ball\"]
friction = 0.5
"
    );
    read::model("chain.toml", &text, &Default::default()).unwrap_or_else(|e| panic!("{e}")).model
}

/// Accelerations and forces of the rows by the interpreter of a plan, and by its programs, whose bits are the same.
fn computed(plan: &Plan, seed: u64) -> [Vec<f64>; 2] {
    let state = random_state(plan, seed);
    let mut interpreter = state.interpreter(plan);
    let (mut a, mut lambda) = (vec![0.0; plan.dims.nv], vec![0.0; plan.dims.rows]);
    interpreter.accelerations(&state.q, &state.v, &mut a);
    interpreter.constraint_multipliers(&state.q, &state.v, &mut lambda);
    for (output, expected) in [(Output::Accelerations, &a), (Output::Multipliers, &lambda)] {
        let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
        let code = compile(plan, output, &options).expect("the plan has the output");
        let given = state.inputs_of(&code.inputs, &[], &[]);
        let results = evaluate(&code.program, &given);
        assert_eq!(&results[..expected.len()], &expected[..], "seed {seed}: {output:?}");
    }
    [a, lambda]
}

#[test]
fn rows_that_are_added_after_the_search_have_numbers_of_their_own_for_accelerations() {
    let model = chain();
    let searched = search::plan(&model, PlanOptions::default());
    assert!(searched.accelerations.is_some(), "the search finds another elimination for accelerations");
    let plain = Plan::new(&model, DEFAULT_SNAP);
    let mut other = 0;
    for seed in 0..40 {
        let plan = if seed == 0 { searched.clone() } else { random_plan(&model, seed) };
        let full = plan.with_contacts();
        let different = full.accelerations.as_ref().is_some_and(|of| of.unknowns.len() != full.unknowns.len());
        other += usize::from(different);
        // All rows act, or one after the other.
        for row in 0..=full.dims.rows {
            let acts: Vec<bool> = (0..full.dims.rows).map(|r| row == full.dims.rows || r == row).collect();
            let [found, reference] = [&full, &plain.with_contacts()].map(|plan| computed(&plan.acting(&acts), seed));
            for (found, reference) in found.iter().zip(&reference) {
                let difference = relative_error(found, reference, 1.0);
                assert!(difference < 1e-9, "seed {seed}, rows {acts:?}: {difference:.1e}\n{reference:?}\n{found:?}");
            }
        }
        assert!(factored(&full, Output::Multipliers, &Options::default()).is_some(), "seed {seed}");
    }
    assert!(other > 5, "{other} plans have another number of unknowns for accelerations");
}

#[test]
fn contacts_keep_their_rows_in_plans_in_which_some_rows_act() {
    let full = Plan::new(&chain(), DEFAULT_SNAP).with_contacts();
    let rows = |plan: &Plan| plan.contacts::<f64>().iter().map(|contact| contact.row).collect::<Vec<usize>>();
    for row in 0..=full.dims.rows {
        let acts: Vec<bool> = (0..full.dims.rows).map(|r| r == row).collect();
        assert_eq!(rows(&full.acting(&acts)), rows(&full), "{acts:?}");
    }
}

/// Without snapping, every angle of the description is there; with it, numbers and parameters alike.
#[test]
fn angles_are_snapped_as_asked() {
    let read =
        |text: &str| read::model("model.toml", text, &Default::default()).unwrap_or_else(|e| panic!("{e}")).model;
    let text = "[[body]]
name = \"link\"
mass = 2
inertia = [0.1, 0.2, 0.3]
inertia_rpy = [1.5707963, 0, 0]

[[joint]]
name = \"pin\"
type = \"revolute\"
child = \"link\"
rpy = [0, 0, 5e-9]
axis = [1, 0, 0]
";
    let model = read(text);
    let turned = |snap: f64| {
        let plan = Plan::new(&model, snap);
        let mut i = plan.default_interpreter::<f64>();
        let mut frames = vec![FrameState::ground(); plan.frames.len()];
        i.frames(&[0.0], &[0.0], &mut frames);
        frames[0].rotation[1][0]
    };
    assert_eq!(turned(0.0), 5e-9);
    assert_eq!(turned(DEFAULT_SNAP), 0.0);
    let with_parameter = read(&format!("[params]\nm = 2\n\n{}", text.replace("mass = 2", "mass = { param = \"m\" }")));
    let moments = [&model, &with_parameter].map(|model| {
        let plan = Plan::new(model, DEFAULT_SNAP);
        plan.tree::<f64>(&plan.default_params()).nodes[0].inertia.inertia
    });
    assert_eq!(moments[0], moments[1]);
}

//! Comparison with Pinocchio: p, q̇, ṗ, q̈, τ(q̈), energies, M, frames, reactions and centroidal quantities of
//! nineteen mechanisms (`tests/reference/README.md`).

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::state_layout;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::layout::Layout;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::tree::Source;
use multibody::runtime::{Interpreter, System};
use serde_json::Value;

/// Largest error of a state, relative to the largest entry of the quantity.
const TOLERANCE: f64 = 1e-11;

/// The numbers of a list of lists, or one number.
pub fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        v => vec![v.as_f64().expect("a number")],
    }
}

struct Case {
    name: String,
    data: Value,
    plan: Plan,
    layout: Layout,
    interpreter: Interpreter<f64>,
}

/// A file of the reference data.
fn data(name: &str) -> Value {
    let path = format!("{}/tests/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("the reference data");
    serde_json::from_str(&text).expect("JSON")
}

impl Case {
    fn read(name: &str) -> Case {
        let root = env!("CARGO_MANIFEST_DIR");
        let data = data(name);
        let file = data["file"].as_str().expect("a file");
        let base = match data["base"].as_str().expect("a base") {
            "floating" => Base::Floating,
            "planar" => Base::Planar,
            _ => Base::Fixed,
        };
        let model_text = std::fs::read_to_string(format!("{root}/{file}")).expect("the model");
        let mut model = read::model(file, &model_text, &ImportOptions { base, ..ImportOptions::default() })
            .unwrap_or_else(|findings| panic!("{name}: {findings}"))
            .model;
        for wrench in data["wrenches"].as_array().expect("wrenches") {
            if file.ends_with(".urdf") {
                let link = wrench["link"].as_str().expect("a link").to_string();
                let body = model.bodies.iter().position(|b| b.name == link).expect("the link");
                let axes = multibody::codegen::model::WrenchAxes::Body;
                model.wrenches.push(multibody::codegen::model::Wrench { name: link, body, axes });
            }
        }
        // Pinocchio does not snap angles, so the plan must not either.
        let plan = search::plan(&model, PlanOptions { snap: 0.0, ..PlanOptions::default() });
        let mut params = plan.default_params();
        for (value, param) in params.iter_mut().zip(plan.params()) {
            *value = data["params"][&param.name].as_f64().unwrap_or(*value);
        }
        let gravity: Vec<f64> = numbers(&data["gravity"]);
        let interpreter = Interpreter::new(plan.tree(&params), [gravity[0], gravity[1], gravity[2]]);
        let mut layout = state_layout::pinocchio(&plan);
        if file.ends_with(".toml") {
            // The order of joints is that of the data; only the coordinates of each joint follow Pinocchio's layout.
            layout = by_name(&plan, &data, layout);
        }
        Case { name: name.to_string(), data, plan, layout, interpreter }
    }
}

/// The layout with the indices that the data gives for each joint.
fn by_name(plan: &Plan, data: &Value, mut layout: Layout) -> Layout {
    for joint in data["joints"].as_array().expect("joints") {
        let name = joint["name"].as_str().expect("a name");
        let slot = plan.slots.iter().find(|s| plan.model.joints[s.joint].name == name).expect("the joint");
        let Some(Source::State { q, .. }) = slot.at else { panic!("{name} is free") };
        let part = layout.parts.iter_mut().find(|p| p.q.0 == q).expect("the part");
        part.q.1 = joint["iq"].as_u64().expect("iq") as usize;
        part.v.1 = joint["iv"].as_u64().expect("iv") as usize;
    }
    layout
}

/// Quantities and their largest errors.
pub struct Worst(pub Vec<(String, f64)>);

impl Worst {
    /// Compares, relative to the largest entry or 1e-3.
    pub fn compare(&mut self, what: &str, ours: &[f64], theirs: &[f64]) {
        assert_eq!(ours.len(), theirs.len(), "{what}");
        let size = theirs.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        let error = ours.iter().zip(theirs).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs() / size));
        let error = if ours.iter().all(|x| x.is_finite()) { error } else { f64::INFINITY };
        match self.0.iter_mut().find(|(w, _)| w == what) {
            Some((_, worst)) => *worst = worst.max(error),
            None => self.0.push((what.to_string(), error)),
        }
    }
}

fn check(name: &str) {
    let Case { name, data, plan, layout, mut interpreter } = Case::read(name);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let (their_nq, their_nv) = layout.sizes();
    let mut worst = Worst(Vec::new());
    let centroidal = &self::data("centroidal")["systems"][&name];
    for (k, state) in data["states"].as_array().expect("states").iter().enumerate() {
        let (mut q, mut v, mut tau) = (vec![0.0; nq], vec![0.0; nv], vec![0.0; nv]);
        layout.q_from(&numbers(&state["q"]), &mut q);
        layout.v_from(&q, &numbers(&state["v"]), &mut v);
        layout.v_from(&q, &numbers(&state["tau"]), &mut tau);
        interpreter.tau.copy_from_slice(&tau);
        if let Some(list) = state.get("wrenches").and_then(Value::as_array) {
            for (to, from) in interpreter.wrenches.iter_mut().zip(list) {
                to.copy_from_slice(&numbers(from));
            }
        }
        set_drives(&plan, &data, state, &mut interpreter);
        let ours = |here: &[f64]| {
            let mut there = vec![0.0; their_nv];
            layout.v_to(&q, here, &mut there);
            there
        };
        let mut p = vec![0.0; nv];
        interpreter.momenta(&q, &v, &mut p);
        worst.compare("p", &ours(&p), &numbers(&state["p"]));
        // The inputs are the momenta of the reference, so that errors do not add up.
        layout.v_from(&q, &numbers(&state["p"]), &mut p);
        let (mut v2, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        interpreter.rates(&q, &p, &mut v2, &mut qd, &mut pd);
        worst.compare("v", &ours(&v2), &numbers(&state["v"]));
        worst.compare("pd", &ours(&pd), &numbers(&state["pd"]));
        let mut qd_there = vec![0.0; their_nq];
        layout.qd_to(&q, &qd, &mut qd_there);
        worst.compare("qd", &qd_there, &numbers(&state["qd"]));
        let mut a = vec![0.0; nv];
        interpreter.accelerations(&q, &v, &mut a);
        worst.compare("qdd", &ours(&a), &numbers(&state["qdd"]));
        // From the accelerations of the reference, inverse dynamics must give its joint forces.
        layout.v_from(&q, &numbers(&state["qdd"]), &mut a);
        let mut inverse = vec![0.0; nv];
        interpreter.inverse_dynamics(&q, &v, &a, &mut inverse);
        worst.compare("tau", &ours(&inverse), &numbers(&state["tau"]));
        let (kinetic, potential) = interpreter.energy(&q, &p);
        worst.compare("kinetic", &[kinetic], &numbers(&state["kinetic"]));
        worst.compare("potential", &[potential], &numbers(&state["potential"]));
        let mut m = vec![0.0; nv * nv];
        interpreter.mass_matrix(&q, &mut m);
        let rows: Vec<Vec<f64>> = m.chunks(nv.max(1)).map(&ours).collect();
        let columns: Vec<Vec<f64>> =
            (0..their_nv).map(|k| ours(&rows.iter().map(|r| r[k]).collect::<Vec<_>>())).collect();
        worst.compare("M", &columns.concat(), &numbers(&state["M"]));
        if let Some(given) = centroidal.get(k) {
            let (mut center, mut matrix, mut bias) = ([0.0; 3], vec![0.0; 6 * nv], [0.0; 6]);
            interpreter.centroidal(&q, &v, &mut center, &mut matrix, &mut bias);
            worst.compare("center of mass", &center, &numbers(&given["center"]));
            let rows: Vec<Vec<f64>> = matrix.chunks(nv.max(1)).map(&ours).collect();
            worst.compare("centroidal matrix", &rows.concat(), &numbers(&given["matrix"]));
            worst.compare("centroidal bias", &bias, &numbers(&given["bias"]));
        }
        compare_frames(&plan, &data, state, &mut interpreter, (&q, &v), &mut worst);
        compare_reactions(&plan, &data, state, &mut interpreter, (&q, &v), &mut worst);
    }
    let shown: Vec<String> = worst.0.iter().map(|(w, e)| format!("{w} {e:.0e}")).collect();
    println!("{name}: {}", shown.join(", "));
    for (what, error) in &worst.0 {
        assert!(*error <= TOLERANCE, "{name}: {what} differs by {error:.1e}");
    }
}

fn set_drives(plan: &Plan, data: &Value, state: &Value, interpreter: &mut Interpreter<f64>) {
    let drives = data["drives"].as_array().expect("drives");
    for (drive, given) in drives.iter().zip(state.get("drive").and_then(Value::as_array).unwrap_or(&Vec::new())) {
        let name = drive["name"].as_str().expect("a name");
        let slot = plan.slots.iter().find(|s| plan.model.joints[s.joint].name == name).expect("the drive");
        let Some(Source::Drive { q, v }) = slot.at else { panic!("{name} is prescribed") };
        let mut position = numbers(&given["q"]);
        if drive["kind"] == "planar" {
            position = vec![position[0], position[1], position[3].atan2(position[2])];
        }
        let inputs = &mut *interpreter;
        for (to, key) in [(&mut inputs.drive_v, "v"), (&mut inputs.drive_a, "a")] {
            let rates = numbers(&given[key]);
            to[v..v + rates.len()].copy_from_slice(&rates);
        }
        inputs.drive_q[q..q + position.len()].copy_from_slice(&position);
    }
}

fn compare_frames(
    plan: &Plan,
    data: &Value,
    state: &Value,
    interpreter: &mut Interpreter<f64>,
    (q, v): (&[f64], &[f64]),
    worst: &mut Worst,
) {
    let mut frames = vec![FrameState::ground(); plan.frames.len()];
    interpreter.frames(q, v, &mut frames);
    for (link, given) in data["links"].as_array().expect("links").iter().zip(state["links"].as_array().expect("links"))
    {
        let at = plan.frames.iter().position(|f| Some(f.name.as_str()) == link.as_str()).expect("the frame");
        let frame = &frames[at];
        worst.compare("frame R", &frame.rotation.concat(), &numbers(&given["R"]));
        worst.compare("frame r", &frame.position, &numbers(&given["r"]));
        worst.compare("frame v", &[frame.velocity.lin, frame.velocity.ang].concat(), &numbers(&given["v"]));
    }
}

fn compare_reactions(
    plan: &Plan,
    data: &Value,
    state: &Value,
    interpreter: &mut Interpreter<f64>,
    (q, v): (&[f64], &[f64]),
    worst: &mut Worst,
) {
    let mut a = vec![0.0; v.len()];
    let mut wrenches = vec![[0.0; 6]; plan.joint_nodes.len()];
    interpreter.reactions(q, v, &mut a, &mut wrenches);
    let joints = data["reactions"].as_array().expect("reactions");
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for (joint, given) in joints.iter().zip(state["reaction"].as_array().expect("reactions")) {
        let name = joint.as_str().expect("a name");
        let at = plan.slots.iter().position(|s| plan.model.joints[s.joint].name == name).expect("the joint");
        ours.extend(wrenches[at]);
        theirs.extend(numbers(given));
    }
    worst.compare("reaction", &ours, &theirs);
}

macro_rules! robots {
    ($($name:ident),* $(,)?) => {$(
        #[test]
        fn $name() {
            check(stringify!($name));
        }
    )*};
}

robots!(
    ur5,
    panda,
    iiwa14,
    solo12,
    g1,
    romeo,
    hyq,
    anymal_c,
    kinova,
    baxter,
    ur10,
    pr2,
    double_pendulum,
    chain6,
    chain10_planar,
    spherical_pendulum,
    satellite,
    mixed_tree,
    driven_tree,
);

/// The names in the file of centroidal quantities are those of mechanisms above.
#[test]
fn centroidal_quantities_are_compared() {
    let all = data("centroidal");
    let systems = all["systems"].as_object().expect("systems");
    let states: usize = systems.values().map(|states| states.as_array().expect("states").len()).sum();
    assert_eq!((systems.len(), states), (11, 33));
    for name in systems.keys() {
        assert!(Case::read(name).data["states"].as_array().is_some_and(|states| states.len() >= 3), "{name}");
    }
}

#[test]
fn neutral_states_are_on_the_manifold() {
    let case = Case::read("mixed_tree");
    let q = case.interpreter.neutral();
    for k in case.interpreter.quaternions() {
        assert_eq!(q[k..k + 4], [0.0, 0.0, 0.0, 1.0], "{}", case.name);
    }
    let _ = &case.data;
}

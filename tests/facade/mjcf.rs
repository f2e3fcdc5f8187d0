//! Comparison with MuJoCo: momenta, bias and passive forces, energies, mass matrices of the models of gymnasium and
//! dm-control (`tests/reference/mjcf/README.md`).

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::{state_layout, Plan};
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::layout::{Form, Layout};
use multibody::runtime::Interpreter;
use serde_json::Value;

use crate::reference::{numbers, Worst};

/// Largest error of a state, relative to the largest entry of the quantity.
const TOLERANCE: f64 = 1e-10;

/// Files that are refused, and a part of the reason.
const REFUSED: &[(&str, &str)] = &[
    (
        "dm_control/suite/ball_in_cup.xml",
        "ball_in_cup.xml:47:50: error: tendon `string`: the limit of a tendon is not modelled",
    ),
    ("dm_control/suite/fish.xml", "fish.xml:66:39: error: tendon `fins_sym`: `stiffness` of a tendon is not modelled"),
];

#[test]
fn models_of_gymnasium_and_dm_control() {
    let folder = format!("{}/tests/reference/mjcf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(format!("{folder}/data.json")).expect("the reference data");
    let data: Value = serde_json::from_str(&text).expect("JSON");
    let (mut right, mut wrong) = (0, Vec::new());
    for model in data["models"].as_array().expect("models") {
        let file = model["file"].as_str().expect("a file");
        let refused = REFUSED.iter().find(|(name, _)| *name == file);
        match (check(&folder, file, model), refused) {
            (Ok(worst), None) => {
                let shown: Vec<String> = worst.0.iter().map(|(what, error)| format!("{what} {error:.0e}")).collect();
                println!("{file}: {}", shown.join(", "));
                match worst.0.iter().all(|(_, error)| *error <= TOLERANCE) {
                    true => right += 1,
                    false => wrong.push(format!("{file}: {}", shown.join(", "))),
                }
            }
            (Err(findings), Some((_, reason))) if findings.contains(reason) => println!("{file}: refused: {reason}"),
            (Err(findings), _) => wrong.push(format!("{file} is refused:\n{findings}")),
            (Ok(_), Some(_)) => wrong.push(format!("{file} is not refused")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(right >= 36, "{right} files are read");
}

/// Height fields stand where MuJoCo's do, with its heights: those of the model, whose first row is at the greatest y, and those
/// of a file, whose first row is at the least.
#[test]
fn height_fields_are_those_of_mujoco() {
    use multibody::codegen::model::{Rotation, ShapeKind};

    let folder = format!("{}/tests/reference/mjcf/hfield", env!("CARGO_MANIFEST_DIR"));
    let text = |file: &str| std::fs::read_to_string(format!("{folder}/{file}")).expect("a file");
    let data: Value = serde_json::from_str(&text("data.json")).expect("JSON");
    let path = format!("{folder}/hills.xml");
    let model = read::model(&path, &text("hills.xml"), &ImportOptions::default()).expect("a model").model;
    let mut worst = 0.0_f64;
    for field in data["fields"].as_array().expect("fields") {
        let shape = model.shapes.iter().find(|shape| shape.name == field["name"]).expect("a shape");
        let ShapeKind::HeightField { heights, field: surface } = &shape.kind else { panic!("no height field") };
        assert_eq!(
            field["rows"].as_u64().zip(field["columns"].as_u64()),
            Some((heights.len() as u64, heights[0].len() as u64))
        );
        assert_eq!(heights.concat(), numbers(&field["heights"]), "{}", shape.name);
        // The second field stands on a body that nothing moves.
        let mut mounts = vec![shape.mount.placement];
        mounts.extend(
            shape
                .mount
                .body
                .map(|body| model.joints.iter().find(|joint| joint.child == body).expect("a joint").placement),
        );
        let value = |x: multibody::codegen::model::Value| x.constant().expect("a constant");
        let world = |mut point: [f64; 3]| {
            for placement in &mounts {
                let Rotation::AxisAngle { axis, angle } = placement.rotation else { panic!("no axis and angle") };
                let (size, angle) = (axis.iter().map(|x| x * x).sum::<f64>().sqrt(), value(angle));
                let n = axis.map(|x| x / size);
                let along: f64 = n.iter().zip(point).map(|(n, x)| n * x).sum();
                let across = [
                    n[1] * point[2] - n[2] * point[1],
                    n[2] * point[0] - n[0] * point[2],
                    n[0] * point[1] - n[1] * point[0],
                ];
                let turned =
                    |k: usize| along * n[k] + (point[k] - along * n[k]) * angle.cos() + across[k] * angle.sin();
                point = [0, 1, 2].map(|k| turned(k) + value(placement.xyz[k]));
            }
            point
        };
        let points = field["points"].as_array().expect("points");
        let count = |axis: usize| if axis == 0 { heights[0].len() } else { heights.len() };
        let at = |k: usize, axis: usize| (k as f64 - 0.5 * (count(axis) - 1) as f64) * surface.spacing[axis];
        for (k, wanted) in points.iter().enumerate() {
            let (x, y) = (at(k % count(0), 0), at(k / count(0), 1));
            let point = world([x, y, surface.at([x, y]).height]);
            for (got, wanted) in point.iter().zip(numbers(wanted)) {
                worst = worst.max((got - wanted).abs());
            }
        }
    }
    // Rays pass 1e-10 m beside the corners of triangles, whose slope is below 10.
    println!("places differ by {worst:.1e} m");
    assert!(worst < 1e-9, "{worst}");
}

mod made {
    multibody::mbd_model! {
        mjcf = r#"<mujoco>
            <worldbody><body name="rod"><joint name="pivot" axis="0 1 0"/><geom size="0.1" mass="2" pos="0 0 -0.5"/></body></worldbody>
        </mujoco>"#,
        name = Pendulum,
        outputs = [energy]
    }
    multibody::mbd_model! { path = "models/mjcf/hopping_leg.xml", name = HoppingLeg, outputs = [energy] }
}

#[test]
fn types_are_made_of_models_of_mujoco() {
    let rod = made::Pendulum::new();
    let [kinetic, potential] = rod.energy(&[0.0], &[0.0]);
    assert!(kinetic == 0.0 && (potential + 9.81).abs() < 1e-14, "{potential}");
    assert_eq!((made::HoppingLeg::NQ, made::HoppingLeg::Q_KNEE), (6, 4));
}

/// Reads a file and compares it in all states; the findings where it is refused.
fn check(folder: &str, file: &str, data: &Value) -> Result<Worst, String> {
    let path = format!("{folder}/{file}");
    let text = std::fs::read_to_string(&path).expect("the model");
    let model = read::model(&path, &text, &ImportOptions::default()).map_err(|findings| findings.to_string())?.model;
    let plan = search::plan(&model, PlanOptions { snap: 0.0, ..PlanOptions::quick() });
    let layout = state_layout::mujoco(&plan);
    let mut interpreter = plan.default_interpreter();
    let mut worst = Worst(Vec::new());
    let sizes = [data["nq"].as_u64().expect("nq"), data["nv"].as_u64().expect("nv")];
    if [layout.sizes().0 as u64, layout.sizes().1 as u64] != sizes {
        return Err(format!("{:?} coordinates and velocities, {sizes:?} in MuJoCo", layout.sizes()));
    }
    for state in data["states"].as_array().expect("states") {
        compare(&plan, &layout, &mut interpreter, state, &mut worst);
    }
    Ok(worst)
}

fn compare(plan: &Plan, layout: &Layout, interpreter: &mut Interpreter<f64>, state: &Value, worst: &mut Worst) {
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let given = |key: &str| numbers(&state[key]);
    let (mut q, mut v) = (vec![0.0; nq], vec![0.0; nv]);
    layout.q_from(&given("q"), &mut q);
    layout.v_from(&q, &given("v"), &mut v);
    let theirs = |here: &[f64]| {
        let mut there = vec![0.0; nv];
        layout.v_to(&q, here, &mut there);
        there
    };
    let mut p = vec![0.0; nv];
    interpreter.momenta(&q, &v, &mut p);
    worst.compare("p", &theirs(&p), &given("p"));
    let (mut kinetic, potential) = interpreter.energy(&q, &p);
    if !plan.model.constraints.is_empty() {
        // The energy here is that of the nearest velocities that the constraints allow; MuJoCo's are any.
        kinetic = 0.5 * p.iter().zip(&v).map(|(p, v)| p * v).sum::<f64>();
    }
    worst.compare("kinetic", &[kinetic], &given("kinetic"));
    worst.compare("potential", &[potential], &given("potential"));
    // No acceleration in MuJoCo's axes: the linear velocity of a free joint is that in the world.
    let mut a = vec![0.0; nv];
    for part in layout.parts.iter().filter(|part| part.form == Form::FloatingWorld) {
        let (x, w) = v[part.v.0..part.v.0 + 6].split_at(3);
        let turned = [x[1] * w[2] - x[2] * w[1], x[2] * w[0] - x[0] * w[2], x[0] * w[1] - x[1] * w[0]];
        a[part.v.0..part.v.0 + 3].copy_from_slice(&turned);
    }
    let mut tau = vec![0.0; nv];
    interpreter.inverse_dynamics(&q, &v, &a, &mut tau);
    let forces: Vec<f64> = given("bias").iter().zip(given("passive")).map(|(bias, passive)| bias - passive).collect();
    worst.compare("bias - passive", &theirs(&tau), &forces);
    if state.get("M").is_some() {
        let mut m = vec![0.0; nv * nv];
        interpreter.mass_matrix(&q, &mut m);
        let rows: Vec<Vec<f64>> = m.chunks(nv).map(theirs).collect();
        let columns: Vec<Vec<f64>> = (0..nv).map(|k| theirs(&rows.iter().map(|r| r[k]).collect::<Vec<_>>())).collect();
        worst.compare("M", &columns.concat(), &given("M"));
    }
}

//! The biped of the thesis in every formulation, and the command that repeats the experiments of the thesis.

mod biped;
mod breaking;
#[allow(dead_code)]
#[path = "../../../cli/tests/command/documented.rs"]
mod documented;
#[path = "../../../cli/tests/command/run.rs"]
mod run;
mod stability;

use std::path::Path;

use biped::{absolute, relative, Biped, Vector};
use multibody::codegen::options::PlanOptions;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::constrained::CoordinatePartition;
use multibody::runtime::integrate::{Rk4, Stepper, Verner9};
use multibody::runtime::{AccelerationForm, Conjugate, Constrained, Energetic, Interpreter, System};
use run::{bad, files, folder, good, out, read, run, run_in};

const END: f64 = 0.85;

/// The shipped model with its loop closed.
fn shipped() -> (Interpreter<f64>, Vec<f64>) {
    let text = read(Path::new(run::ROOT), "models/biped.toml");
    let (model, findings) = read::load("biped.toml", &text, &ImportOptions::default());
    assert!(findings.0.is_empty(), "{findings}");
    let model = model.expect("a model");
    let plan = search::plan(&model, PlanOptions::default());
    let params = plan.default_params();
    let system = Interpreter::new(plan.tree(&params), plan.gravity(&params));
    let mut q = system.neutral();
    model.starts.iter().for_each(|s| q[s.joint] = s.q[0]);
    assert_eq!(q[..3], [1.7, -0.7, 0.3]);
    // In the file, the dependent angles have three digits.
    let closed = relative(&Biped::new().theta);
    for k in 3..5 {
        assert!((q[k] - closed[k]).abs() < 1e-3, "{q:?} {closed:?}");
        q[k] = closed[k];
    }
    (system, q)
}

/// The largest absolute value; NaN where one is NaN, over which `f64::max` passes.
fn largest(list: impl IntoIterator<Item = f64>) -> f64 {
    list.into_iter().map(f64::abs).max_by(f64::total_cmp).unwrap_or(0.0)
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(a.iter().zip(b).map(|(a, b)| a - b))
}

/// Angles of the joints at the end by the equations that are written by hand.
fn by_hand() -> Vector {
    let mut biped = Biped::new();
    let (mut q, mut v) = (biped.neutral(), biped.zero_momenta());
    let (theta, omega) = biped.whole(&q, &v);
    let start = biped.energy(&theta, &omega);
    let mut method = Verner9::new(&biped);
    let steps = 1700;
    for k in 0..steps {
        let h = END / f64::from(steps);
        method.step(&mut biped, f64::from(k) * h, h, &mut q, &mut v).expect("a step");
    }
    let (theta, omega) = biped.whole(&q, &v);
    assert!((biped.energy(&theta, &omega) - start).abs() < 1e-11);
    relative(&theta)
}

fn energy(
    system: &mut impl Energetic<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>,
    q: &Vec<f64>,
    p: &Vec<f64>,
) -> f64 {
    let (kinetic, potential) = system.energies(q, p);
    kinetic + potential
}

#[test]
fn every_way_leads_to_the_same_end() {
    let reference = by_hand();
    let (mut system, start) = shipped();
    let steps = 1700;
    let h = END / f64::from(steps);

    // Method 1 has augmented momenta, with momentum projection after every step.
    let (mut q, mut p, mut v, mut sigma) =
        (start.clone(), system.zero_momenta(), system.zero_momenta(), system.zero_rows());
    let mut method = Verner9::new(&system);
    let before = energy(&mut system, &q, &p);
    for k in 0..steps {
        method.step(&mut system, f64::from(k) * h, h, &mut q, &mut p).expect("a step");
        system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
        assert!((energy(&mut system, &q, &p) - before).abs() < 1e-10);
    }
    assert!(apart(&q, &reference) < 1e-9, "method 1: {q:?} {reference:?}");

    // Method 2 has minimal coordinates. First the library chooses and switches the dependent ones, then they are those
    // of the thesis for the whole motion.
    for thesis in [false, true] {
        let (mut q, mut p) = (start.clone(), system.zero_momenta());
        let minimal = CoordinatePartition::new(system.clone(), &mut q, &mut p).expect("closed");
        let mut minimal = if thesis { minimal.with_ratio(f64::INFINITY) } else { minimal };
        if thesis {
            minimal.choose_among(&[3, 4], &mut q, &mut p).expect("a choice of the thesis");
        }
        let mut method = Verner9::new(&minimal);
        for k in 0..steps {
            let t = f64::from(k) * h;
            method.step(&mut minimal, t, h, &mut q, &mut p).expect("a step");
            minimal.watch(t + h, &q, Some(&mut p)).expect("dependents");
            assert!((energy(&mut minimal, &q, &p) - before).abs() < 1e-10);
        }
        minimal.close(&mut q).expect("closed");
        assert!(apart(&q, &reference) < 1e-9, "method 2, {thesis}: {q:?} {reference:?}");
        assert!(thesis == (minimal.switches().0 == 0), "{:?}", minimal.switches());
    }

    // The last formulation has accelerations, with the index of the constraints reduced.
    let mut accelerated = AccelerationForm::new(system);
    let (mut q, mut v) = (start, accelerated.zero_momenta());
    let mut method = Verner9::new(&accelerated);
    for k in 0..steps {
        method.step(&mut accelerated, f64::from(k) * h, h, &mut q, &mut v).expect("a step");
    }
    assert!(apart(&q, &reference) < 1e-9, "accelerations: {q:?} {reference:?}");
    assert!((energy(&mut accelerated, &q, &v) - before).abs() < 1e-10);
}

/// Largest residual of the loop over the motion with RK4 steps of 1 ms.
fn drift<Y>(
    system: &mut Y,
    q: &[f64],
    gap: impl Fn(&[f64]) -> f64,
    mut after: impl FnMut(&mut Y, &mut Vec<f64>, &mut Vec<f64>),
) -> f64
where
    Y: System<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>>,
{
    let (mut q, mut p, mut worst) = (q.to_vec(), system.zero_momenta(), 0.0_f64);
    let mut method = Rk4::new(system);
    for k in 0..850 {
        method.step(system, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p).expect("a step");
        after(system, &mut q, &mut p);
        worst = largest([worst, gap(&q)]);
    }
    worst
}

#[test]
fn momenta_drift_less_than_accelerations_and_projection_stops_it() {
    let gap = |q: &[f64]| {
        let q: &Vector = q.try_into().expect("five angles");
        largest(Biped::residual(&absolute(q)))
    };
    let (mut system, q) = shipped();
    let (mut v, mut sigma, mut pivots) = (system.zero_momenta(), system.zero_rows(), system.zero_rows());
    let momenta = drift(&mut system, &q, gap, |system, q, p| system.project_momenta(0.0, q, p, &mut v, &mut sigma));
    let projected = drift(&mut system, &q, gap, |system, q, p| {
        system.project_momenta(0.0, q, p, &mut v, &mut sigma);
        // Two iterations of Newton's method are needed: the first one leaves an error of the order of 1e-8 squared.
        for _ in 0..2 {
            system.position_correction(q, &mut sigma, &mut v, &mut pivots);
            q.iter_mut().zip(&v).for_each(|(q, dq)| *q += dq);
        }
    });
    let accelerated = drift(&mut AccelerationForm::new(system), &q, gap, |_, _, _| ());
    assert!(accelerated > 30.0 * momenta, "{accelerated:e} {momenta:e}");
    assert!(projected <= 1e-13, "{projected:e}");
}

/// The momenta of zero velocities are zero.
#[test]
fn the_start_is_at_rest() {
    let (mut system, q) = shipped();
    let mut p = system.zero_momenta();
    let v = system.zero_momenta();
    system.conjugate_momenta(&q, &v, &mut p);
    assert!(p.iter().all(|p| *p == 0.0));
}

/// Cells of the row that begins with `first`, in the table whose title begins with `title`.
fn cells(text: &str, title: &str, first: &str) -> Vec<String> {
    let table = text.split("### ").find(|t| t.starts_with(title)).unwrap_or_else(|| panic!("no `{title}` in\n{text}"));
    let row = table.lines().find(|l| l.starts_with(&format!("| {first}")));
    let row = row.unwrap_or_else(|| panic!("no `{first}` in\n{table}"));
    row.split('|').map(|c| c.trim().to_string()).collect()
}

/// The number at the start of a cell.
fn number(cell: &str) -> f64 {
    cell.split_whitespace().next().and_then(|w| w.parse().ok()).unwrap_or_else(|| panic!("no number: {cell}"))
}

#[test]
fn the_command_repeats_the_biped() {
    let folder = folder("experiments_biped");
    let output = good(run_in(&folder, &["experiments", "biped", "--quick", "--out", "figures"]));
    let text = out(&output);
    for way in ["minimal coordinates, momenta", "augmented momenta", "accelerations, index reduced"] {
        let row = cells(text, "Coordinates", way);
        assert!(number(&row[7]) < 1e-9 && number(&row[8]) < 1e-10, "{row:?}");
    }
    // Truncation errors depend only on the equations and the method. They agree with those of the thesis within its
    // rounding and 10 %.
    for (step, errors) in [("0.005", [4.3e-8, 3.9e-8]), ("0.001", [1.4e-11, 1.3e-11])] {
        let row = cells(text, "Table 7.1", step);
        for (cell, theirs) in row[4..6].iter().zip(errors) {
            assert!((number(cell) / theirs - 1.0).abs() < 0.15, "{row:?}");
        }
    }
    for (tolerance, [accelerations, hamilton]) in [("1e-5", [457.0, 320.0]), ("1e-6", [661.0, 434.0])] {
        let row = cells(text, "Table 7.2", tolerance);
        assert!((number(&row[5]) / accelerations - 1.0).abs() < 0.07, "{row:?}");
        assert!((number(&row[6]) / hamilton - 1.0).abs() < 0.07, "{row:?}");
    }
    assert!(number(&cells(text, "Drift", "Runge-Kutta 4")[4]) > 30.0);
    let names = files(&folder.join("figures"));
    let wanted = ["10", "11", "12", "13", "14", "15", "9"].map(|n| format!("figure_7_{n}.svg"));
    assert_eq!(names, wanted);
    for name in names {
        assert!(read(&folder.join("figures"), &name).starts_with("<svg"));
    }
}

#[test]
fn the_command_measures_scaling() {
    let folder = folder("experiments_scaling");
    let output = good(run_in(&folder, &["experiments", "scaling", "--quick", "--out", "figures"]));
    let text = out(&output);
    assert_eq!(cells(text, "Figure 7.6", "30").len(), 6);
    assert!(number(&cells(text, "Figures 7.5", "10")[2]) > 1000.0);
    assert!(number(&cells(text, "Four-bars", "4")[2]) > 0.0);
    assert_eq!(files(&folder.join("figures")), ["figure_7_4.svg", "figure_7_5.svg", "figure_7_6.svg", "loops.svg"]);
}

#[test]
fn thrown_boxes_come_to_the_floor_and_stay_above_it() {
    let text = out(&good(run(&["experiments", "drops", "--count", "3", "--only", "box"]))).to_string();
    let row = cells(&text, "3 throws of each", "box");
    // Throws, those that were followed to the end, typed errors, those of them with time steps, silent failures.
    assert_eq!(row[2..7], ["3", "3", "0", "0", "0"], "{text}");
    // A bounce far below rounding errors follows one that is seen: the first two fell through the floor. Corners that settle
    // turn the slip of others round: the last two gained energy.
    for first in ["1453", "1756", "91201", "96064"] {
        let text =
            out(&good(run(&["experiments", "drops", "--count", "1", "--only", "box", "--first", first]))).to_string();
        assert_eq!(cells(&text, "1 throws of each", "box")[2..7], ["1", "1", "0", "0", "0"], "{text}");
    }
    bad(run(&["experiments", "drops", "--only", "cat"]), &["no such mechanism", "take box or leg"]);
}

#[test]
fn pairs_and_corners_have_a_cost_and_instants_their_closed_forms() {
    let text = out(&good(run(&["experiments", "pairs", "--quick", "--balls", "3", "--corners", "8,12"]))).to_string();
    let row = cells(&text, "Balls that fall", "3");
    // Three pairs, and the floor three times. Nothing is looked at where all are far.
    assert_eq!((row[2].as_str(), &row[4]), ("6", &row[6]), "{text}");
    assert!(number(&row[11]) > 5.0, "{text}");
    for offset in ["0", "0.5", "0.999999"] {
        let row = cells(&text, "A ball of radius", offset);
        assert!(row[3] == "1" && number(&row[4]) < 1e-14, "{text}");
    }
    assert_eq!(cells(&text, "A ball of radius", "1.000001")[3..5], ["0", "passes"], "{text}");
    let bounces = cells(&text, "A ball is dropped", "1e-9");
    assert!(bounces[3] == "6" && number(&bounces[4]) < 1e-12 && number(&bounces[5]) < 1e-9, "{text}");
    let [few, more] = ["8", "12"].map(|corners| number(&cells(&text, "A hull of 2000 points", corners)[2]));
    assert!(more < few, "{text}");
}

#[test]
fn the_interpreter_is_called() {
    let mechanism = ["interpreter", "--mechanisms", "double_pendulum", "--calls", "3"];
    assert_eq!(out(&good(run(&mechanism))), "");
    good(run(&[&mechanism[..], &["--searched"]].concat()));
    bad(run(&["interpreter", "--mechanisms", "pendulum"]), &["no mechanism `pendulum`", "double_pendulum, ur5"]);
}

//! The shipped mechanisms with loops: their loops close and stay closed, their mobility is right, and their energy is
//! conserved.

use std::path::{Path, PathBuf};

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::catalogue;
use multibody::runtime::constrained::{close, complete, Closing, Effort, Projection, Stabilisation, WithPostStep};
use multibody::runtime::integrate::{Solver, Step, Stepper, Tolerances};
use multibody::runtime::tree::Source;
use multibody::runtime::{Constrained, Interpreter, System};

/// A mechanism and its motion, which starts with one given velocity.
struct Case {
    name: &'static str,
    /// Number of rows, redundant ones included.
    rows: usize,
    /// Number of independent velocities.
    mobility: usize,
    /// Length of the motion, s.
    time: f64,
    /// Index and value of the given velocity, which the others follow.
    thrown: (usize, f64),
}

/// All shipped mechanisms. Their mobility is Grübler's `f − r`, with `f` freedoms of the tree and `r` independent rows:
/// planar four-bars and the slider-crank 3 − 2; Strandbeest leg 7 − 3·2; Stewart platform 6 + 6·3 − 6·3; Delta robot
/// 3 + 6 − 6; spring leg 9 − 2; disc 6 − 3; bicycle 9 − 2·3. A revolute joint that closes a loop has 5 rows, of which
/// 3 are redundant if the mechanism is planar.
const CASES: [Case; 10] = [
    Case { name: "fourbar", rows: 5, mobility: 1, time: 1.0, thrown: (0, 8.0) },
    Case { name: "fourbar_3d", rows: 5, mobility: 1, time: 1.0, thrown: (0, 8.0) },
    // This motion passes a change point.
    Case { name: "fourbar_equal", rows: 5, mobility: 1, time: 0.9, thrown: (0, 6.0) },
    Case { name: "slider_crank", rows: 5, mobility: 1, time: 1.0, thrown: (0, 10.0) },
    Case { name: "strandbeest_leg", rows: 15, mobility: 1, time: 1.0, thrown: (0, 6.0) },
    Case { name: "stewart", rows: 18, mobility: 6, time: 0.2, thrown: (0, 0.1) },
    Case { name: "delta", rows: 6, mobility: 3, time: 1.0, thrown: (0, 0.1) },
    // The springs are stiff and need short steps, so the motion is short.
    Case { name: "spring_leg", rows: 2, mobility: 7, time: 0.1, thrown: (0, 0.1) },
    Case { name: "rolling_disc", rows: 3, mobility: 3, time: 1.0, thrown: (0, 1.0) },
    Case { name: "bicycle", rows: 6, mobility: 3, time: 1.0, thrown: (0, 5.0) },
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models/mechanisms")
}

fn plan(name: &str) -> Plan {
    let file = format!("{name}.toml");
    let text = std::fs::read_to_string(folder().join(&file)).expect("the file");
    let (model, findings) = read::load(&file, &text, &ImportOptions::default());
    assert!(findings.0.is_empty(), "{findings}");
    search::plan(&model.expect("a model"), PlanOptions::default())
}

/// The mechanism and the coordinates that close it.
fn closed(plan: &Plan) -> (Interpreter<f64>, Vec<f64>) {
    let mut interpreter = Interpreter::new(plan.tree(&[]), plan.gravity(&[]));
    let mut q = interpreter.neutral();
    let mut held = vec![false; plan.dims.nv];
    for start in &plan.model.starts {
        let slot = plan.slots.iter().find(|s| s.joint == start.joint).expect("a free joint");
        let Some(Source::State { q: at, v, .. }) = slot.at else { panic!("a free joint") };
        q[at..at + start.q.len()].copy_from_slice(&start.q);
        held[v..v + plan.model.joints[start.joint].kind.nv()].fill(start.held);
    }
    for at in interpreter.quaternions().collect::<Vec<_>>() {
        let norm = q[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
        q[at..at + 4].iter_mut().for_each(|x| *x /= norm);
    }
    let start = q.clone();
    let closing = Closing::holding(&held);
    let found = close(&mut interpreter, &mut q, &closing).unwrap_or_else(|e| panic!("{}: {e}", plan.model.name));
    assert!(found.residual <= 1e-12, "{}: {}", plan.model.name, found.residual);
    for slot in &plan.slots {
        let Some(Source::State { q: at, v, .. }) = slot.at else { continue };
        if held[v] {
            let n = plan.model.joints[slot.joint].kind.nq();
            assert_eq!(q[at..at + n], start[at..at + n], "{}: what is held has moved", plan.model.name);
        }
    }
    (interpreter, q)
}

/// Number of independent rows of `Φ`, by elimination with complete pivoting, independent of the sweeps.
fn rank(interpreter: &mut Interpreter<f64>, q: &[f64]) -> usize {
    let (mut residual, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
    interpreter.constraint_residuals(&q.to_vec(), &mut residual, &mut entries);
    let nv = interpreter.zero_momenta().len();
    let row = |row: &multibody::runtime::system::Row| {
        let mut dense = vec![0.0; nv];
        (row.first..row.first + row.len).for_each(|e| dense[interpreter.entry_columns()[e]] += entries[e]);
        dense
    };
    let mut rows: Vec<Vec<f64>> = interpreter.rows().iter().map(row).collect();
    let mut rank = 0;
    while rank < rows.len() {
        let all = (rank..rows.len()).flat_map(|i| (0..nv).map(move |j| (i, j)));
        let Some((i, j)) = all.max_by(|a, b| rows[a.0][a.1].abs().total_cmp(&rows[b.0][b.1].abs())) else { break };
        // Entries are metres and radians of order one: rounding leaves 1e-16, and independent rows leave more than
        // 1e-3.
        if rows[i][j].abs() < 1e-9 {
            break;
        }
        rows.swap(rank, i);
        let pivot = rows[rank].clone();
        for row in &mut rows[rank + 1..] {
            let factor = row[j] / pivot[j];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
            row[j] = 0.0;
        }
        rank += 1;
    }
    rank
}

#[test]
fn all_files_are_cases() {
    let mut files: Vec<String> = std::fs::read_dir(folder())
        .expect("the folder")
        .map(|e| e.expect("an entry").path().file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    let mut cases: Vec<String> = CASES.iter().map(|c| c.name.to_string()).collect();
    files.sort();
    cases.sort();
    assert_eq!(files, cases);
}

#[test]
fn they_close_and_have_the_mobility_that_mechanics_says() {
    for case in &CASES {
        let plan = plan(case.name);
        let (mut interpreter, q) = closed(&plan);
        assert_eq!(plan.dims.rows, case.rows, "{}", case.name);
        let independent = plan.dims.nv - case.mobility;
        assert_eq!(rank(&mut interpreter, &q), independent, "{}: rank of the rows", case.name);
        let (mut residual, mut dq, mut pivots) =
            (interpreter.zero_rows(), interpreter.zero_momenta(), interpreter.zero_rows());
        interpreter.position_correction(&q, &mut residual, &mut dq, &mut pivots);
        let used = pivots.iter().filter(|p| **p != 0.0).count();
        assert_eq!(used, independent, "{}: rows that are not left out: {pivots:?}", case.name);
    }
}

/// Largest rate of a row at given velocities.
fn broken(interpreter: &mut Interpreter<f64>, q: &[f64], v: &[f64]) -> f64 {
    let (mut residual, mut entries) = (interpreter.zero_rows(), interpreter.zero_entries());
    interpreter.constraint_residuals(&q.to_vec(), &mut residual, &mut entries);
    let columns = interpreter.entry_columns();
    let rate = |row: &multibody::runtime::system::Row| {
        (row.first..row.first + row.len).map(|e| entries[e] * v[columns[e]]).sum::<f64>()
    };
    interpreter.rows().iter().fold(0.0, |m: f64, row| m.max(rate(row).abs()))
}

/// A method of the catalogue that keeps the loops closed, at time zero and a state.
fn solver(
    system: &mut Interpreter<f64>,
    method: &str,
    step: Step,
    (q, p): (&Vec<f64>, &Vec<f64>),
) -> Solver<Interpreter<f64>, impl Stepper<Interpreter<f64>>> {
    let method = catalogue::explicit(method, system, false).expect("a method of the catalogue");
    let hold = Projection::new(system, Stabilisation::default(), Effort::default());
    let method = WithPostStep::new(system, method, hold);
    Solver::new(system, method, step, 0.0, q, p).expect("a start")
}

#[test]
fn they_keep_their_loops_and_their_energy() {
    for case in &CASES {
        let plan = plan(case.name);
        let (mut system, q) = closed(&plan);
        let (mut v, mut p, mut sigma) = (system.zero_momenta(), system.zero_momenta(), system.zero_rows());
        v[case.thrown.0] = case.thrown.1;
        system.momenta(&q, &v, &mut p);
        system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
        let tolerance = 1e-9;
        let mut driver = solver(&mut system, "verner9", Step::Adaptive(Tolerances::new(tolerance)), (&q, &p));
        let energy = |system: &mut Interpreter<f64>, q: &[f64], p: &[f64]| system.energy(q, p);
        let (kinetic, potential) = energy(&mut system, &q, &p);
        let (before, mut scale, mut worst, mut open, mut rate) =
            (kinetic + potential, kinetic, 0.0_f64, 0.0_f64, 0.0_f64);
        let (mut q, mut p) = (q.clone(), p.clone());
        let (mut residual, mut entries) = (system.zero_rows(), system.zero_entries());
        while driver.time() < case.time {
            driver.advance(&mut system, case.time).unwrap_or_else(|e| panic!("{}: {e}", case.name));
            driver.state(&system, &mut q, &mut p);
            let (kinetic, potential) = energy(&mut system, &q, &p);
            (scale, worst) = (scale.max(kinetic), worst.max((kinetic + potential - before).abs()));
            system.constraint_residuals(&q, &mut residual, &mut entries);
            open = residual.iter().fold(open, |m, x| m.max(x.abs()));
            system.velocities(&q, &p, &mut v);
            let size = v.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            rate = rate.max(broken(&mut system, &q, &v) / size);
        }
        // Projection closes positions to 1e-14, apart from rounding of rows of some metres and radians.
        assert!(open <= 4e-14, "{}: open by {open:e}", case.name);
        // Rates of rows are zero up to rounding of sums of some ten terms. Near a change point rows become dependent: a
        // row counts as independent down to a pivot of 1e-10, that is 1e-5 of its size, and rounding grows by this
        // factor.
        let round_off = if case.name == "fourbar_equal" { 1e-10 } else { 1e-12 };
        assert!(rate <= round_off, "{}: velocities break the rows by {rate:e}", case.name);
        // The error of momenta in every step may be the tolerance, and T is quadratic in momenta.
        let steps = driver.statistics().steps as f64;
        assert!(
            worst <= 2.0 * tolerance * steps * scale,
            "{}: energy {worst:e} of {scale:e} in {steps} steps",
            case.name
        );
        assert!(steps >= 5.0, "{}: {steps} steps", case.name);
    }
}

/// Fixed steps that jump over the change points stay on their branch of the motion: the bars stay parallel.
#[test]
fn a_parallelogram_passes_its_change_points() {
    let plan = plan("fourbar_equal");
    let (mut system, mut q) = closed(&plan);
    let (mut v, mut p, mut sigma) = (vec![6.0, 0.0, 0.0], system.zero_momenta(), system.zero_rows());
    system.momenta(&q, &v, &mut p);
    system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
    let sum = |(kinetic, potential): (f64, f64)| kinetic + potential;
    let before = sum(system.energy(&q, &p));
    let mut driver = solver(&mut system, "dop853", Step::Fixed(0.002), (&q, &p));
    let (mut apart, mut lost, mut passed, mut above) = (0.0_f64, 0.0_f64, 0, true);
    while driver.time() < 2.0 {
        driver.advance(&mut system, 2.0).expect("a step");
        driver.state(&system, &mut q, &mut p);
        apart = apart.max((q[0] - q[2]).abs());
        lost = lost.max((sum(system.energy(&q, &p)) - before).abs());
        passed += u32::from((q[0].sin() > 0.0) != above);
        above = q[0].sin() > 0.0;
    }
    assert!(passed >= 4, "{passed} change points");
    // Positions are closed to 1e-14, but across the direction of motion only to 1e-14 divided by the distance from the
    // change point, which is at least 1e-5 rad.
    assert!(apart < 1e-9, "bars at {apart:e} rad");
    assert!(lost < 1e-8 * 3.5, "{lost:e} J of 3.5 J");
}

/// With steps by error control too, the motion passes its change points on its branch and keeps its energy: what is left
/// of a residual does not turn it.
#[test]
fn a_change_point_takes_no_energy() {
    let plan = plan("fourbar_equal");
    let (mut system, mut q) = closed(&plan);
    let (mut v, mut p) = (vec![0.1; 3], system.zero_momenta());
    complete(&mut system, 0.0, &q, &mut v, &[true], 1e-9).expect("velocities");
    system.momenta(&q, &v, &mut p);
    let sum = |(kinetic, potential): (f64, f64)| kinetic + potential;
    let before = sum(system.energy(&q, &p));
    let mut driver = solver(&mut system, "verner9", Step::Adaptive(Tolerances::new(1e-9)), (&q, &p));
    let (mut apart, mut lost) = (0.0_f64, 0.0_f64);
    while driver.time() < 4.5 {
        driver.advance(&mut system, 4.5).expect("a step");
        driver.state(&system, &mut q, &mut p);
        apart = apart.max((q[0] - q[2]).abs());
        lost = lost.max((sum(system.energy(&q, &p)) - before).abs());
    }
    // 1.1e-11 rad were measured: residuals of 1e-14 m across the direction of motion, divided by the distance from the
    // change point, at which a row is left out when it is less than 6e-5 rad.
    assert!(apart < 1e-9, "bars at {apart:e} rad");
    // The bound is 1e-8 of some joules.
    assert!(lost < 3e-8, "{lost:e} J");
}

/// Small motions of the bicycle at 5 m/s have the four published eigenvalues `λ` (Meijaard et al. 2007, table 2): the
/// lean, sampled at equal times, satisfies the recursion whose roots are `e^{λh}`.
#[test]
fn the_bicycle_rides_as_published() {
    const WEAVE: (f64, f64) = (-0.775_341_882_195_85, 4.464_867_713_788_23);
    const CAPSIZE: f64 = -0.322_866_429_004_09;
    const CASTERING: f64 = -14.078_389_692_798_22;
    let misfit = |lean: &[f64], h: f64, weave: (f64, f64)| {
        let mut polynomial = vec![1.0];
        let (size, angle) = ((weave.0 * h).exp(), weave.1 * h);
        let factors = [
            vec![-(CAPSIZE * h).exp(), 1.0],
            vec![-(CASTERING * h).exp(), 1.0],
            vec![size * size, -2.0 * size * angle.cos(), 1.0],
        ];
        for factor in factors {
            let mut product = vec![0.0; polynomial.len() + factor.len() - 1];
            for (i, a) in polynomial.iter().enumerate() {
                factor.iter().enumerate().for_each(|(j, b)| product[i + j] += a * b);
            }
            polynomial = product;
        }
        let sums = lean.windows(5).map(|w| w.iter().zip(&polynomial).map(|(x, c)| x * c).sum::<f64>());
        sums.fold(0.0, |m: f64, x| m.max(x.abs())) / lean.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
    };
    let plan = plan("bicycle");
    let (mut system, q) = closed(&plan);
    let mut v = vec![5.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 5.0 / 0.3, 0.0, 5.0 / 0.35];
    let (mut p, mut sigma) = (system.zero_momenta(), system.zero_rows());
    system.momenta(&q, &v, &mut p);
    system.project_momenta(0.0, &q, &mut p, &mut v, &mut sigma);
    let mut driver = solver(&mut system, "verner9", Step::Adaptive(Tolerances::new(1e-11)), (&q, &p));
    let (mut q, mut p) = (q.clone(), p.clone());
    let h = 0.1;
    let lean = |q: &[f64]| 2.0 * (q[4] * q[5] + q[6] * q[3]);
    let mut leans = vec![lean(&q)];
    for k in 1..=20 {
        let end = h * f64::from(k);
        while driver.time() < end {
            driver.advance(&mut system, end).expect("a step");
        }
        driver.state(&system, &mut q, &mut p);
        leans.push(lean(&q));
    }
    // Leans are 1e-3 rad. As the bicycle is symmetric, nonlinear terms are of third order, 1e-6 of the leans.
    let found = misfit(&leans, h, WEAVE);
    assert!(found < 1e-5, "misfit {found:e}");
    // The test must detect an error of a thousandth of a frequency.
    let other = misfit(&leans, h, (WEAVE.0, 1.001 * WEAVE.1));
    assert!(other > 1e-5, "misfit {other:e} of another frequency");
}

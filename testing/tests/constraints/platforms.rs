//! Rows of legs that are solved at the platform that the legs carry.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;
use std::path::Path;

use mbd_codegen::jit::Compiled;
use mbd_codegen::options::{PlanOptions, RowElimination};
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{search, Arithmetic, Options};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::row_order::{early_rows, solve_late};
use mbd_runtime::{Accelerated, Constrained};
use mbd_testing::random::Rng;

/// The Stewart platform as it is shipped.
fn text() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/mechanisms/stewart.toml");
    std::fs::read_to_string(path).expect("a model of the repository")
}

fn plan(text: &str) -> Plan {
    let read = read::model("stewart.toml", text, &ImportOptions::default());
    Plan::new(&read.unwrap_or_else(|e| panic!("{e}")).model, 1e-6)
}

/// The same platform with a contact far below, which leaves all rows at the ground.
fn with_contact() -> Plan {
    plan(&format!(
        "{}\n[[shape]]\nname = \"floor\"\ntype = \"plane\"\nxyz = [0, 0, -9]\n\n[[shape]]\nname = \"seat\"\ntype = \"point\"\n\
         body = \"platform\"\n\n[[contact]]\nname = \"fall\"\nbetween = [\"floor\", \"seat\"]\n",
        text()
    ))
}

/// The same platform, described after its legs.
fn described_last() -> Plan {
    let all = text();
    let (moved, rest): (Vec<&str>, Vec<&str>) =
        all.split("\n\n").partition(|block| block.contains("name = \"motion\""));
    assert_eq!(moved.len(), 1);
    plan(&[rest, moved].concat().join("\n\n"))
}

/// Numbers in the order of one list of names, from those in the order of another.
fn in_order(x: &[f64], from: &[String], to: &[String]) -> Vec<f64> {
    let at = |name: &String| from.iter().position(|other| other == name).expect("the same names");
    to.iter().map(|name| x[at(name)]).collect()
}

/// What is known of a state.
struct Motion {
    rates: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    forces: Vec<f64>,
    rank: usize,
}

impl Motion {
    fn of<Y>(y: &mut Y, q: &[f64], p: &[f64]) -> Motion
    where
        Y: Constrained<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>> + Accelerated,
    {
        let (q, p) = (q.to_vec(), p.to_vec());
        let (mut qd, mut rates) = (q.clone(), p.clone());
        y.rates_at(0.0, &q, &p, &mut qd, &mut rates);
        let (mut own, mut velocities, mut sigma) = (p, y.zero_momenta(), y.zero_rows());
        y.project_momenta(0.0, &q, &mut own, &mut velocities, &mut sigma);
        let mut accelerations = y.zero_momenta();
        y.generalized_accelerations(&q, &velocities, &mut accelerations);
        let mut forces = y.zero_rows();
        y.multipliers(0.0, &q, &velocities, &mut forces);
        let (mut residual, mut dq, mut pivots) = (y.zero_rows(), y.zero_momenta(), y.zero_rows());
        y.position_correction(&q, &mut residual, &mut dq, &mut pivots);
        let rank = pivots.as_ref().iter().filter(|pivot| **pivot != 0.0).count();
        Motion { rates, velocities, accelerations, forces: forces.as_ref().to_vec(), rank }
    }

    /// The largest difference from another motion, relative to the largest number of its kind.
    fn error(&self, other: &Motion) -> f64 {
        let lists = |m: &Motion| [&m.rates, &m.velocities, &m.accelerations, &m.forces].map(Clone::clone);
        lists(self).iter().zip(&lists(other)).fold(0.0, |worst, (a, b)| {
            let size = b.iter().fold(0.0_f64, |most, x| x.abs().max(most));
            let off = a.iter().zip(b).fold(0.0_f64, |most, (x, y)| (x - y).abs().max(most));
            worst.max(off / size)
        })
    }
}

/// A state near the start; the second angle of the first leg is `short` of a quarter turn where that is given, and the
/// platform stands where that leg meets it. At a quarter turn the leg points along its first axis, and cannot follow the
/// platform across it.
fn state(plan: &Plan, seed: u64, short: Option<f64>) -> (Vec<f64>, Vec<f64>) {
    let mut rng = Rng::new(seed, 1);
    let mut q = plan.start();
    q.iter_mut().for_each(|x| *x += rng.around(0.1));
    let names = plan.coordinate_names();
    let quaternion: Vec<usize> = (0..q.len()).filter(|&k| names[k].starts_with("motion.q")).collect();
    let size = quaternion.iter().map(|&k| q[k] * q[k]).sum::<f64>().sqrt();
    quaternion.iter().for_each(|&k| q[k] /= size);
    assert_eq!(names[..3], ["motion.x", "motion.y", "motion.z"]);
    if let Some(short) = short {
        let second = names.iter().rposition(|name| name.starts_with("base1")).expect("a leg");
        q[second] = FRAC_PI_2 - short;
        let mut frames = vec![FrameState::ground(); plan.frames.len()];
        plan.default_interpreter().frames(&q, &vec![0.0; plan.dims.nv], &mut frames);
        let at = |name: &str| frames[plan.frames.iter().position(|f| f.name == name).expect("a frame")].position;
        let (rod, platform) = (at("rod1"), at("platform1"));
        (0..3).for_each(|k| q[k] += rod[k] - platform[k]);
    }
    (q, (0..plan.dims.nv).map(|_| rng.around(10.0)).collect())
}

#[test]
fn rows_of_legs_are_solved_at_the_platform() {
    let (early, late) = (plan(&text()), with_contact());
    assert_eq!(early_rows(&early).len(), 18);
    assert_eq!(early_rows(&late).len(), 0);
    let mut machine =
        Compiled::from_plan(early.clone(), Options { arithmetic: Arithmetic::Exact, ..Options::default() });
    let machine = machine.as_mut().expect("a model without frames");
    for seed in 0..50 {
        let (q, p) = state(&early, seed, None);
        let ours = Motion::of(&mut early.default_interpreter(), &q, &p);
        let other = Motion::of(&mut late.default_interpreter(), &q, &p);
        assert_eq!((ours.rank, other.rank), (18, 18));
        let error = ours.error(&other);
        assert!(error < 1e-11, "seed {seed}: {error:e}");
        let made = Motion::of(machine, &q, &p);
        assert_eq!((made.rates, made.accelerations), (ours.rates, ours.accelerations), "seed {seed}");
    }
}

/// The state has the order of the description, the sweeps have that of the elimination.
#[test]
fn a_platform_may_be_described_after_its_legs() {
    let (first, last) = (plan(&text()), described_last());
    assert_eq!(early_rows(&last).len(), 18);
    let (names, coordinates) = (last.velocity_names(), last.coordinate_names());
    assert_eq!(coordinates.last().map(String::as_str), Some("motion.qw"));
    let (q, p) = state(&first, 1, None);
    let ours = Motion::of(&mut first.default_interpreter(), &q, &p);
    let q = in_order(&q, &first.coordinate_names(), &coordinates);
    let p = in_order(&p, &first.velocity_names(), &names);
    let other = Motion::of(&mut last.default_interpreter(), &q, &p);
    for (a, b) in [(&ours.rates, &other.rates), (&ours.accelerations, &other.accelerations)] {
        assert_eq!(&in_order(a, &first.velocity_names(), &names), b);
    }
    assert_eq!(ours.forces, other.forces);
    let frames = |plan: &Plan| plan.frames.iter().map(|frame| frame.name.clone()).collect::<Vec<_>>();
    assert_eq!(frames(&last)[12], "platform", "bodies are listed in the order of the joints that move them");
}

/// Where rows are eliminated in passes no order may matter, not even that of platform and legs.
#[test]
fn rows_in_passes_are_solved_at_the_ground() {
    let model = plan(&text()).model;
    let passes = |rows| search::plan(&model, PlanOptions { rows, ..PlanOptions::default() });
    let [once, passes] = [RowElimination::Once, RowElimination::Passes].map(passes);
    assert_eq!(early_rows(&once).len(), 18);
    assert_eq!(early_rows(&passes).len(), 0);
    for (seed, short) in [None, None, Some(0.3), Some(1e-4), Some(1e-9), Some(0.0)].into_iter().enumerate() {
        let (q, p) = state(&once, seed as u64, short);
        let ours = Motion::of(&mut passes.default_interpreter(), &q, &p);
        let other = Motion::of(&mut with_contact().default_interpreter(), &q, &p);
        assert_eq!(ours.rank, 18);
        let error = ours.error(&other);
        assert!(error < 1e-11, "{short:?}: {error:e}");
    }
}

/// A row that its leg can hardly follow is solved at the ground from then on.
#[test]
fn rows_that_a_leg_cannot_follow_wait_for_the_ground() {
    let (early, late) = (plan(&text()), with_contact());
    for (k, short) in [1e-5, 1e-7, 1e-9, 0.0].into_iter().enumerate() {
        let (q, p) = state(&early, k as u64, Some(short));
        let (mut fixed, mut ordered) = (early.default_interpreter(), early.default_interpreter());
        assert!(ordered.reorder_rows(&q), "{short:e}");
        // Rows of other legs, which are far from closed, may wait too.
        assert!((12..18).contains(&early_rows(ordered.tree()).len()), "{short:e}");
        assert!(!ordered.reorder_rows(&q), "the order is good already");
        let other = Motion::of(&mut late.default_interpreter(), &q, &p);
        let ours = Motion::of(&mut ordered, &q, &p);
        assert_eq!((ours.rank, other.rank), (18, 18));
        let error = ours.error(&other);
        assert!(error < 1e-11, "{short:e}: {error:e}");
        // In the order of the plan digits are lost, and right next to such a position the row, which then counts as redundant.
        let fixed = Motion::of(&mut fixed, &q, &p);
        let error = fixed.error(&other);
        println!("short of a quarter turn by {short:e}: {error:e} and {} rows in the order of the plan", fixed.rank);
        assert!(error < 1e-14 / short || fixed.rank == 17, "{short:e}: {error:e}");
    }
}

/// Legs that are chains of many links, which would be loops over links without the platform.
#[test]
fn legs_may_have_many_links() {
    let mut text =
        String::from("name = \"long\"\n\n[[body]]\nname = \"platform\"\nmass = 3\ninertia = [0.1, 0.2, 0.25]\n");
    text += "\n[[joint]]\nname = \"motion\"\ntype = \"floating\"\nchild = \"platform\"\n";
    for leg in 0..3 {
        let mut parent = String::from("ground");
        for k in 0..40 {
            let (name, axis) = (format!("b{leg}_{k}"), [[0, 0, 1], [0, 1, 0]][k % 2]);
            let _ = write!(
                text,
                "\n[[body]]\nname = \"{name}\"\nmass = 0.1\ncom = [0.02, 0, 0.01]\ninertia = [1e-4, 2e-4, 2e-4]\n\n[[joint]]\n\
                 name = \"j{leg}_{k}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{name}\"\nxyz = [0.05, 0, 0]\naxis = {axis:?}\n"
            );
            parent = name;
        }
        let _ = write!(
            text,
            "\n[[frame]]\nname = \"seat{leg}\"\nbody = \"platform\"\nxyz = [{}, 0.1, 0]\n\n[[loop]]\nname = \"ball{leg}\"\ntype = \"spherical\"\n\
             between = [\"{parent}\", \"seat{leg}\"]\n",
            0.1 * leg as f64
        );
    }
    let model = plan(&text).model;
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let plan = search::plan(&model, options.searches());
    assert_eq!(early_rows(&plan).len(), 6, "at the start the legs are straight, and cannot follow along themselves");
    let mut machine = Compiled::from_plan(plan.clone(), options).expect("a model without frames");
    let mut reference = plan.clone();
    solve_late(&mut reference);
    assert_eq!(early_rows(&reference).len(), 0);
    let mut rng = Rng::new(3, 2);
    let mut q: Vec<f64> = plan.start().iter().map(|x| x + rng.around(0.2)).collect();
    let size = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
    q[3..7].iter_mut().for_each(|x| *x /= size);
    let p: Vec<f64> = (0..plan.dims.nv).map(|_| rng.around(0.1)).collect();
    let ours = Motion::of(&mut plan.default_interpreter(), &q, &p);
    let made = Motion::of(&mut machine, &q, &p);
    assert_eq!((made.rates, made.accelerations), (ours.rates.clone(), ours.accelerations.clone()));
    let error = ours.error(&Motion::of(&mut reference.default_interpreter(), &q, &p));
    assert!(error < 1e-9, "{error:e}");
}

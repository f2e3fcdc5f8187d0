//! Rows of legs that are solved where the legs end: at the platform that they carry, or where they begin on a trunk.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;
use std::path::Path;

use mbd_codegen::jit::Compiled;
use mbd_codegen::model::Model;
use mbd_codegen::options::{PlanOptions, RowElimination};
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{code, search, Arithmetic, Options, Output};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::row_order::{early_rows, solve_late};
use mbd_runtime::{Accelerated, Constrained};
use mbd_testing::random::Rng;
use mbd_testing::relative_error;

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
        let each = lists(self).into_iter().zip(lists(other)).map(|(a, b)| relative_error(&a, &b, 0.0));
        each.fold(0.0, f64::max)
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

/// In the order of the plan, the rates lose digits at a small distance from a position in which a leg cannot follow a row; right
/// next to it, the row counts as redundant.
fn loses_digits_only(error: f64, distance: f64, left_out: bool) -> bool {
    if left_out {
        return distance < 2e-7;
    }
    error < 1e-15 / (distance * distance)
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
        let fixed = Motion::of(&mut fixed, &q, &p);
        let error = fixed.error(&other);
        println!("short of a quarter turn by {short:e}: {error:e} and {} rows in the order of the plan", fixed.rank);
        assert!(loses_digits_only(error, short, fixed.rank == 17), "{short:e}: {error:e}");
    }
}

/// A trunk on legs of so many links, whose feet are pinned to the ground where a foot of the first leg stands in.
fn quadruped(links: usize, feet: usize, legs: usize) -> String {
    let mut text =
        String::from("name = \"legs\"\n\n[[body]]\nname = \"trunk\"\nmass = 3\ninertia = [0.1, 0.2, 0.25]\n");
    text += "\n[[joint]]\nname = \"motion\"\ntype = \"floating\"\nchild = \"trunk\"\n";
    for leg in 0..legs {
        let mut parent = String::from("trunk");
        let at = [[0.2, 0.1, 0.0], [0.2, -0.1, 0.0], [-0.2, 0.1, 0.0], [-0.2, -0.1, 0.0]][leg];
        for k in 0..links {
            let name = format!("b{leg}_{k}");
            let (axis, xyz) = if k == 0 { ([1, 0, 0], at) } else { ([0, 1, 0], [0.0, 0.0, -0.15]) };
            let start = [0.1, 0.7, -1.2][k.min(2)] / if k < 2 { 1.0 } else { (links - 2) as f64 };
            let _ = write!(
                text,
                "\n[[body]]\nname = \"{name}\"\nmass = 0.2\ncom = [0, 0.01, -0.07]\ninertia = [4e-4, 4e-4, 3e-5]\n\n[[joint]]\n\
                 name = \"j{leg}_{k}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{name}\"\nxyz = {xyz:?}\naxis = {axis:?}\n\
                 start = {start:?}\n"
            );
            parent = name;
        }
        if leg < feet {
            let _ = write!(
                text,
                "\n[[frame]]\nname = \"toe{leg}\"\nbody = \"{parent}\"\nxyz = [0, 0, -0.15]\n\n[[loop]]\nname = \"pin{leg}\"\n\
                 type = \"spherical\"\nbetween = [\"ground\", \"toe{leg}\"]\n"
            );
        }
    }
    text
}

/// A platform on three legs of so many links.
fn platform(links: usize) -> String {
    let mut text =
        String::from("name = \"long\"\n\n[[body]]\nname = \"platform\"\nmass = 3\ninertia = [0.1, 0.2, 0.25]\n");
    text += "\n[[joint]]\nname = \"motion\"\ntype = \"floating\"\nchild = \"platform\"\n";
    for leg in 0..3 {
        let mut parent = String::from("ground");
        for k in 0..links {
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
    text
}

/// Near its start a mechanism moves as with all rows at the ground, and as its machine code does, bit for bit. Gives the number of
/// early rows.
fn moves_as_with_late_rows(model: &Model, tolerance: f64) -> usize {
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let early = search::plan(model, options.searches());
    let mut late = early.clone();
    solve_late(&mut late);
    assert_eq!(early_rows(&late).len(), 0);
    let mut machine = Compiled::from_plan(early.clone(), options).expect("a model without frames");
    for seed in 0..5 {
        let mut rng = Rng::new(seed, 2);
        let mut q: Vec<f64> = early.start().iter().map(|x| x + rng.around(0.1)).collect();
        if model.joints[0].kind.nq() == 7 {
            let size = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
            q[3..7].iter_mut().for_each(|x| *x /= size);
        }
        let p: Vec<f64> = (0..early.dims.nv).map(|_| rng.around(0.1)).collect();
        let ours = Motion::of(&mut early.default_interpreter(), &q, &p);
        let made = Motion::of(&mut machine, &q, &p);
        assert_eq!((&made.rates, &made.accelerations), (&ours.rates, &ours.accelerations), "seed {seed}");
        let error = ours.error(&Motion::of(&mut late.default_interpreter(), &q, &p));
        assert!(error < tolerance, "seed {seed}: {error:e}");
    }
    early_rows(&early).len()
}

#[test]
fn rows_of_feet_are_solved_where_their_legs_begin() {
    let counted = |feet| {
        let model = plan(&quadruped(3, feet, 4)).model;
        assert_eq!(moves_as_with_late_rows(&model, 1e-11), 3 * feet, "{feet} feet");
        let options = Options::default();
        let plan = search::plan(&model, options.searches());
        let mut late = plan.clone();
        solve_late(&mut late);
        [plan, late].map(|plan| code::compile(&plan, Output::Rates, &options).expect("code").program.counts().total())
    };
    let all: Vec<[usize; 2]> = (0..5).map(counted).collect();
    println!("operations of the rates with 0 to 4 feet on the ground, rows early and at the ground: {all:?}");
    let flight = all[0][0] as f64;
    assert!((all[3][0] as f64) < 1.5 * flight && all[3][1] as f64 > 1.8 * flight, "{all:?}");
}

/// Legs of many links: those of a trunk are loops over links, those of a platform are not.
#[test]
fn legs_may_have_many_links() {
    // At the start the legs of the platform are straight, and cannot follow along themselves.
    assert_eq!(moves_as_with_late_rows(&plan(&platform(40)).model, 1e-9), 6);
    assert_eq!(moves_as_with_late_rows(&plan(&quadruped(40, 3, 4)).model, 1e-9), 9);
}

/// The inner links of a long chain do not carry the rows at its end.
#[test]
fn rows_of_a_long_chain_are_solved_after_its_outer_third() {
    let mut operations = Vec::new();
    for closed in [false, true] {
        let mut text = String::from("name = \"arc\"\ngravity = [0, -9.81, 0]\n");
        let mut parent = String::from("ground");
        for k in 0..100 {
            let name = format!("link{k}");
            let (angle, x) = if k == 0 { (1.2, 0.0) } else { (-0.024, 0.05) };
            let _ = write!(
                text,
                "\n[[body]]\nname = \"{name}\"\nmass = 0.01\ncom = [0.025, 0, 0]\ninertia = [0, 2e-6, 2e-6]\n\n[[joint]]\nname = \"j{k}\"\n\
                 type = \"revolute\"\nparent = \"{parent}\"\nchild = \"{name}\"\nxyz = [{x}, 0, 0]\naxis = [0, 0, 1]\nstart = {angle}\n"
            );
            parent = name;
        }
        if closed {
            text += "\n[[frame]]\nname = \"end\"\nbody = \"link99\"\nxyz = [0.05, 0, 0]\n\n[[frame]]\nname = \"wall\"\nbody = \"ground\"\nxyz = [3.883, 0, 0]\n\n\
                     [[loop]]\nname = \"hold\"\ntype = \"revolute\"\naxis = [0, 0, 1]\nbetween = [\"wall\", \"end\"]\n";
        }
        let options = Options::default();
        let model = plan(&text).model;
        let plan = search::plan(&model, options.searches());
        // Along three of the five rows nothing can move in a plane.
        assert_eq!(early_rows(&plan).len(), if closed { 2 } else { 0 });
        if closed {
            moves_as_with_late_rows(&model, 1e-10);
        }
        let mut late = plan.clone();
        solve_late(&mut late);
        for plan in [plan, late] {
            let code = code::compile(&plan, Output::Rates, &options).expect("code").program;
            assert!(matches!(code, code::Code::Rolled(_)));
            operations.push(code.counts().total());
        }
    }
    println!("operations of the rates of a chain of 100 links, open (twice), closed, with late rows: {operations:?}");
    assert!((operations[2] as f64) < 1.2 * operations[0] as f64, "{operations:?}");
}

/// A leg with a straight knee cannot follow along itself.
#[test]
fn rows_of_straight_legs_wait_for_the_ground() {
    let early = plan(&quadruped(3, 3, 4));
    let mut late = early.clone();
    solve_late(&mut late);
    let knee = early.coordinate_names().iter().position(|name| name == "j1_2").expect("a knee");
    for bent in [1e-3, 1e-5, 1e-6, 1e-9, 0.0] {
        let mut q = early.start();
        q[knee] = bent;
        let p: Vec<f64> = (0..early.dims.nv).map(|k| (k as f64).sin()).collect();
        let other = Motion::of(&mut late.default_interpreter(), &q, &p);
        let fixed = Motion::of(&mut early.default_interpreter(), &q, &p);
        let mut ordered = early.default_interpreter();
        let changed = ordered.reorder_rows(&q);
        let ours = Motion::of(&mut ordered, &q, &p);
        println!(
            "knee bent by {bent:e}: {:e} and {} rows, {:e} when ordered anew",
            fixed.error(&other),
            fixed.rank,
            ours.error(&other)
        );
        assert_eq!((other.rank, ours.rank), (9, 9), "{bent:e}");
        assert!(changed && ours.error(&other) < 1e-11, "{bent:e}: {:e}", ours.error(&other));
        assert!(loses_digits_only(fixed.error(&other), bent, fixed.rank == 8), "{bent:e}: {:e}", fixed.error(&other));
    }
    let straight = quadruped(3, 3, 4).replace("start = -1.2", "start = 0");
    assert_eq!(early_rows(&plan(&straight)).len(), 6, "each leg keeps the rows that it can follow");
}

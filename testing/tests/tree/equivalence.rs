//! Two descriptions of the same mechanism give the same motion.

use mbd_codegen::model::{JointMotion, Model, Rotation, Value, Wrench, WrenchAxes};
use mbd_codegen::plan::Plan;
use mbd_codegen::read;
use mbd_runtime::sweep::pass::{passes, SweepList};
use mbd_runtime::sweep::{FrameState, Sweeps};
use mbd_runtime::tree::Source;
use mbd_runtime::workspace::Workspace;
use mbd_runtime::Interpreter;
use mbd_testing::eliminations::{random_plan, random_plan_snapped};
use mbd_testing::newton::joint_rates;
use mbd_testing::random::{random_model, Distribution, Rng};
use mbd_testing::state::{random_state, State};
use mbd_testing::toml::to_toml;
use mbd_testing::{largest, relative_error, substituted, value};

const TREES: u64 = 300;

/// All outputs of the interpreter, by name.
type Results = Vec<(&'static str, Vec<f64>)>;

fn results(plan: &Plan, s: &State) -> Results {
    let mut i = s.interpreter(plan);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let (mut p, mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
    i.momenta(&s.q, &s.v, &mut p);
    i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
    let (kinetic, potential) = i.energy(&s.q, &p);
    let mut a = vec![0.0; nv];
    let mut reactions = vec![[0.0; 6]; plan.joint_nodes.len()];
    i.reactions(&s.q, &s.v, &mut a, &mut reactions);
    i.accelerations(&s.q, &s.v, &mut a);
    let mut tau = vec![0.0; nv];
    i.inverse_dynamics(&s.q, &s.v, &p, &mut tau);
    let mut m = vec![0.0; nv * nv];
    i.mass_matrix(&s.q, &mut m);
    let mut frames = vec![FrameState::ground(); plan.frames.len()];
    i.frames(&s.q, &s.v, &mut frames);
    let frames = frames.iter().flat_map(|f| {
        [f.rotation.concat(), f.position.to_vec(), f.velocity.lin.to_vec(), f.velocity.ang.to_vec()].concat()
    });
    let frames = frames.collect();
    vec![
        ("p", p),
        ("v", v),
        ("qd", qd),
        ("pd", pd),
        ("T", vec![kinetic]),
        ("V", vec![potential]),
        ("a", a),
        ("tau", tau),
        ("reactions", reactions.concat()),
        ("M", m),
        ("frames", frames),
    ]
}

/// Largest difference relative to the largest entry (at least 1).
fn difference(a: &[f64], b: &[f64]) -> f64 {
    relative_error(a, b, largest(a, 1.0))
}

fn compare(seed: u64, model: &Model, a: &Results, b: &Results, tolerance: f64) -> f64 {
    let mut worst = 0.0_f64;
    for ((what, a), (_, b)) in a.iter().zip(b) {
        let d = difference(a, b);
        assert!(d <= tolerance, "seed {seed}: {what} differs by {d:.1e}\n{a:?}\n{b:?}\n{}", to_toml(model));
        worst = worst.max(d);
    }
    worst
}

/// Parameters with values, or constants with the same values: the plans choose different frames, but the motion is the
/// same.
#[test]
fn parameters_are_as_good_as_constants() {
    let mut worst = 0.0_f64;
    for seed in 0..TREES {
        let model = random_model(seed, &Distribution { params: 0.4, ..Distribution::everything(seed, 8) });
        let plan = random_plan_snapped(&model, 0.0, seed);
        let s = random_state(&plan, seed);
        let plain = random_plan_snapped(&substituted(&model, &s.params), 0.0, seed + TREES);
        let mut s2 = s.clone();
        s2.params.clear();
        worst = worst.max(compare(seed, &model, &results(&plan, &s), &results(&plain, &s2), 1e-11));
    }
    println!("parameters against constants: {worst:.1e}");
}

/// Moving parts of the base parameters from a body to its parent does not change the motion.
#[test]
fn regrouped_trees_move_as_described_ones() {
    let mut worst = 0.0_f64;
    for seed in 0..TREES {
        let model = random_model(seed, &Distribution::everything(seed, 8));
        let plan = random_plan(&model, seed);
        let s = random_state(&plan, seed);
        let regrouped = results(&plan, &s);
        let tree = plan.tree(&s.params);
        let sweeps = Sweeps { tree: &tree, trace: &() };
        let mut w = Workspace::new(&tree);
        let i = s.interpreter(&plan);
        let u = i.inputs();
        let (nq, nv) = (plan.dims.nq, plan.dims.nv);
        let (mut p, mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        let (mut a, mut m) = (vec![0.0; nv], vec![0.0; nv * nv]);
        sweeps.momenta(&s.q, &s.v, &u, &mut w, &mut p);
        sweeps.rates(&s.q, &p, &u, &mut w, &mut v, &mut qd, &mut pd);
        let (kinetic, potential) = sweeps.energy(&s.q, &p, &u, &mut w, &mut v);
        sweeps.accelerations(&s.q, &s.v, &u, &mut w, &mut a);
        let mut tau = vec![0.0; nv];
        sweeps.inverse_dynamics(&s.q, &s.v, &p, &u, &mut w, &mut tau);
        sweeps.mass_matrix(&s.q, &u, &mut w, &mut m);
        for (what, described) in [
            ("p", p),
            ("v", v),
            ("qd", qd),
            ("pd", pd),
            ("T", vec![kinetic]),
            ("V", vec![potential]),
            ("a", a),
            ("tau", tau),
            ("M", m),
        ] {
            let (_, ours) = regrouped.iter().find(|(name, _)| *name == what).expect("it is there");
            let d = difference(ours, &described);
            assert!(d <= 1e-11, "seed {seed}: {what} differs by {d:.1e}\n{}", to_toml(&model));
            worst = worst.max(d);
        }
    }
    println!("regrouped against described: {worst:.1e}");
}

/// Plain trees have sweeps that are compiled apart ([`mbd_runtime::tree::Tree::is_plain`]). A wrench of zero makes the
/// same tree one that is not plain, and adds zeros: everything else must be equal.
#[test]
fn plain_trees_move_as_others_do() {
    let mut plain = 0;
    for seed in 0..TREES {
        let distribution = Distribution { mimic: 0.0, wrenches: 0.0, ..Distribution::everything(seed, 8) };
        let model = random_model(seed, &distribution);
        let mut pulled = model.clone();
        pulled.wrenches.push(Wrench { name: "none".into(), body: 0, axes: WrenchAxes::Body });
        let [one, other] = [&model, &pulled].map(|model| Plan::new(model, 0.0));
        let s = random_state(&one, seed);
        let still = State { wrenches: vec![[0.0; 6]], ..s.clone() };
        assert!(!other.tree(&s.params).is_plain());
        let tree = one.tree(&s.params);
        if tree.is_plain() {
            plain += 1;
            // This is why all sweeps of one direction may visit a node together.
            assert!(passes(&SweepList::<f64, (), 14>::RATES.sweeps, &tree).len() <= 2, "seed {seed}");
        }
        for ((what, a), (_, b)) in results(&one, &s).iter().zip(&results(&other, &still)) {
            assert_eq!(a, b, "seed {seed}: {what}\n{}", to_toml(&model));
        }
    }
    println!("{plain} plain trees");
    assert!(plain > 200);
}

/// With `x_free = G x + offset`: `M = Gᵀ M_free G`, `p = Gᵀ p_free`, `ṗ = Gᵀ ṗ_free`. The forces that keep the mimic
/// joints in step with their leaders do no work: `Gᵀ M_free (a − a_free) = 0`.
#[test]
fn mimics_are_projections_of_free_joints() {
    let (mut worst, mut seen) = (0.0_f64, 0);
    for seed in 0..2 * TREES {
        let model = random_model(seed, &Distribution { mimic: 0.7, ..Distribution::everything(seed, 8) });
        let plan = random_plan(&model, seed);
        seen += usize::from(!plan.unknowns.is_empty());
        let s = random_state(&plan, seed);
        let mut released = model.clone();
        for joint in &mut released.joints {
            if let JointMotion::Mimic { .. } = joint.motion {
                joint.motion = JointMotion::Free;
            }
        }
        let free = random_plan(&released, seed + TREES);
        let n = free.dims.nv;
        let at = |v: &[f64], drive: &[f64]| on_free(&free, &joint_rates(&plan, &s.params, v, drive));
        let mut s_free = s.clone();
        s_free.v = at(&s.v, &s.drive[1]);
        s_free.q = coordinates_on_free(&plan, &free, &s);
        // Joint forces act on leaders only. The drives are unchanged.
        s_free.tau = leaders_only(&plan, &free, &s.tau);
        let (ours, theirs) = (results(&plan, &s), results(&free, &s_free));
        let of = |r: &Results, name: &str| r.iter().find(|(n, _)| *n == name).expect("it is there").1.clone();
        let none = vec![0.0; plan.dims.drive_v];
        let nv = plan.dims.nv;
        let g: Vec<Vec<f64>> =
            (0..nv).map(|k| at(&(0..nv).map(|j| f64::from(u8::from(j == k))).collect::<Vec<_>>(), &none)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let m_free = of(&theirs, "M");
        let mg: Vec<Vec<f64>> =
            g.iter().map(|g| (0..n).map(|r| dot(&m_free[r * n..(r + 1) * n], g)).collect()).collect();
        let m: Vec<f64> = g.iter().flat_map(|a| mg.iter().map(|b| dot(a, b)).collect::<Vec<_>>()).collect();
        let project = |x: &[f64]| g.iter().map(|g| dot(g, x)).collect::<Vec<f64>>();
        // Accelerations are compared as forces.
        let a = at(&of(&ours, "a"), &s.drive[2]);
        let left: Vec<f64> = mg.iter().map(|mg| dot(mg, &a)).collect();
        let right: Vec<f64> = mg.iter().map(|mg| dot(mg, &of(&theirs, "a"))).collect();
        for (what, ours, theirs) in [
            ("M", of(&ours, "M"), m),
            ("p", of(&ours, "p"), project(&of(&theirs, "p"))),
            ("pd", of(&ours, "pd"), project(&of(&theirs, "pd"))),
            ("T", of(&ours, "T"), of(&theirs, "T")),
            ("V", of(&ours, "V"), of(&theirs, "V")),
            ("G M a", left, right),
        ] {
            let d = difference(&ours, &theirs);
            assert!(d <= 1e-11, "seed {seed}: {what} differs by {d:.1e}\n{ours:?}\n{theirs:?}\n{}", to_toml(&model));
            worst = worst.max(d);
        }
    }
    println!("mimic joints against projections: {worst:.1e} on {seen} trees with shared coordinates");
    assert!(seen > 100, "only {seen} trees have a mimic to test");
}

/// Values of every joint, in the order of the free model's state.
fn on_free(free: &Plan, joints: &[Vec<f64>]) -> Vec<f64> {
    let mut out = vec![0.0; free.dims.nv];
    for slot in &free.slots {
        if let Some(Source::State { v, .. }) = slot.at {
            out[v..v + joints[slot.joint].len()].copy_from_slice(&joints[slot.joint]);
        }
    }
    out
}

fn coordinates_on_free(plan: &Plan, free: &Plan, s: &State) -> Vec<f64> {
    let joints = mbd_testing::newton::joint_coordinates(plan, &s.params, &s.q, &s.drive[0]);
    let mut out = vec![0.0; free.dims.nq];
    for slot in &free.slots {
        if let Some(Source::State { q, .. }) = slot.at {
            out[q..q + joints[slot.joint].len()].copy_from_slice(&joints[slot.joint]);
        }
    }
    out
}

fn leaders_only(plan: &Plan, free: &Plan, tau: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; free.dims.nv];
    for slot in &plan.slots {
        let Some(Source::State { v: from, .. }) = slot.at else { continue };
        let there = free.slots.iter().find(|s| s.joint == slot.joint).and_then(|s| s.at);
        let Some(Source::State { v: to, .. }) = there else { panic!("a free joint stays free") };
        let n = plan.model.joints[slot.joint].kind.nv();
        out[to..to + n].copy_from_slice(&tau[from..from + n]);
    }
    out
}

/// Angles close to right angles are snapped to right angles. The motion changes by the order of these differences.
#[test]
fn snapping_changes_no_more_than_the_angles() {
    const OFF: f64 = 1e-8;
    let (mut worst, mut noticed) = (0.0_f64, 0);
    for seed in 0..TREES {
        let distribution = Distribution { skew: 0.0, params: 0.0, ..Distribution::everything(seed, 6) };
        let mut model = random_model(seed, &distribution);
        let mut rng = Rng::new(seed, 7);
        for joint in &mut model.joints {
            let angles: &mut [Value] = match &mut joint.placement.rotation {
                Rotation::Rpy(rpy) => rpy,
                Rotation::AxisAngle { angle, .. } => std::slice::from_mut(angle),
            };
            for angle in angles {
                *angle = Value::Const(value(*angle, &[]) + rng.around(OFF));
            }
        }
        let snapped = random_plan(&model, seed);
        let exact = random_plan_snapped(&model, 0.0, seed);
        noticed += usize::from(!snapped.notices.is_empty());
        assert!(exact.notices.is_empty(), "seed {seed}: {:?}", exact.notices);
        let s = random_state(&exact, seed);
        // The tolerance is a few thousand times the difference of one angle: each of six joints has three angles, and
        // velocities and accelerations depend on the condition of M. The number 1.5707963 itself is 2.7e-8 off.
        worst = worst.max(compare(seed, &model, &results(&exact, &s), &results(&snapped, &s), 5e3 * OFF));
    }
    println!("snapped against exact: {worst:.1e} for angles {OFF:.0e} off, {noticed} models with a notice");
    assert!(noticed > 200);
}

/// Two equal pendulums on the ground that move together swing as each of them would alone. The sweeps represent gravity
/// by an acceleration of the ground, which must also reach a coordinate that is solved at the ground.
#[test]
fn coupled_pendulums_on_the_ground_feel_gravity() {
    let body =
        |k: usize| format!("[[body]]\nname = \"b{k}\"\nmass = 2\ncom = [0.3, 0, 0]\ninertia = [0.1, 0.2, 0.3]\n");
    let joint =
        |k: usize| format!("[[joint]]\nname = \"j{k}\"\ntype = \"revolute\"\nchild = \"b{k}\"\naxis = [0, 1, 0]\n");
    let alone = body(0) + &joint(0);
    let coupled = alone.clone() + &body(1) + &joint(1) + "xyz = [1, 2, 3]\nmimic = { joint = \"j0\" }\n";
    let acceleration = |text: &str| {
        let read =
            read::model("pendulum.toml", text, &Default::default()).unwrap_or_else(|findings| panic!("{findings}"));
        let plan = Plan::new(&read.model, 0.0);
        let mut i: Interpreter<f64> = plan.interpreter(&[]);
        let mut a = [0.0];
        i.accelerations(&[0.4], &[0.7], &mut a);
        a[0]
    };
    let expected = 2.0 * 9.81 * 0.3 * 0.4_f64.cos() / (0.2 + 2.0 * 0.3 * 0.3);
    for text in [&alone, &coupled] {
        assert!((acceleration(text) - expected).abs() < 1e-13 * expected, "{} {expected}", acceleration(text));
    }
}

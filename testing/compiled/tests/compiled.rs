//! Compiled code against the interpreter: bit for bit in double precision, within rounding errors in single precision.

#[allow(dead_code)]
mod batch {
    use mbd_runtime::batch::RatesBatch;
    use mbd_runtime::{MomentumDerivatives, StateDerivatives};
    use mbd_testing::state::State;

    /// Results by name, in a fixed order.
    pub type Results = Vec<(&'static str, Vec<f64>)>;
    /// Runs one tree on a state and its momenta.
    pub type Runner = fn(&State, &[f64]) -> Results;

    /// A number type of generated code.
    pub trait Number: Copy + Default + Into<f64> {
        fn of(x: f64) -> Self;
    }
    impl Number for f64 {
        fn of(x: f64) -> Self {
            x
        }
    }
    impl Number for f32 {
        fn of(x: f64) -> Self {
            x as f32
        }
    }

    fn array<T: Number, const N: usize>(x: &[f64]) -> [T; N] {
        assert_eq!(x.len(), N);
        std::array::from_fn(|k| T::of(x[k]))
    }

    fn numbers<T: Number>(x: &[T]) -> Vec<f64> {
        x.iter().map(|x| (*x).into()).collect()
    }

    /// A batch for a tree with any numbers of coordinates, velocities and joint forces.
    trait Batch<T, const NQ: usize, const NV: usize, const NT: usize>: RatesBatch<T, NQ, NV, NT> {
        fn batch<const S: usize>(
            &self,
            q: &[[T; S]; NQ],
            p: &[[T; S]; NV],
            tau: &[[T; S]; NV],
            qd: [&mut [T]; NQ],
            pd: [&mut [T]; NV],
        ) {
            let (q, p) = (q.each_ref().map(|c| &c[..]), p.each_ref().map(|c| &c[..]));
            let tau = std::array::from_fn(|k| &tau[k][..]);
            self.rates_batch(q, p, tau, qd, pd).unwrap();
        }
    }
    impl<T, S: RatesBatch<T, NQ, NV, NT>, const NQ: usize, const NV: usize, const NT: usize> Batch<T, NQ, NV, NT> for S {}

    /// Runs one output of a tree on a state and adds its results.
    macro_rules! output {
        (momenta, $x:ident) => {
            let mut p = [0.0; NV];
            $x.tree.momenta(&$x.q, &$x.v, &mut p);
            $x.add("p", &p);
        };
        (rates, $x:ident) => {
            let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
            $x.tree.rates(&$x.q, &$x.p, &mut qd, &mut pd);
            $x.add("qd", &qd);
            $x.add("pd", &pd);
        };
        (velocities, $x:ident) => {
            let mut v = [0.0; NV];
            $x.tree.velocities(&$x.q, &$x.p, &mut v);
            $x.add("v", &v);
        };
        (energy, $x:ident) => {
            $x.add("energy", &$x.tree.energy(&$x.q, &$x.p));
        };
        (accelerations, $x:ident) => {
            let mut a = [0.0; NV];
            $x.tree.accelerations(&$x.q, &$x.v, &mut a);
            $x.add("a", &a);
        };
        (reactions, $x:ident) => {
            let mut reactions = [[0.0; 6]; JOINTS];
            $x.tree.reactions(&$x.q, &$x.v, &mut reactions);
            $x.add("reactions", &reactions.concat());
        };
        (mass_matrix, $x:ident) => {
            let mut m = [[0.0; NV]; NV];
            $x.tree.mass_matrix(&$x.q, &mut m);
            $x.add("M", &m.concat());
        };
        (frames, $x:ident) => {
            let (mut rotation, mut position, mut velocity) =
                ([[[0.0; 3]; 3]; FRAMES], [[0.0; 3]; FRAMES], [[0.0; 6]; FRAMES]);
            $x.tree.frames(&$x.q, &$x.v, &mut rotation, &mut position, &mut velocity);
            $x.add("rotations", &rotation.concat().concat());
            $x.add("positions", &position.concat());
            $x.add("frame velocities", &velocity.concat());
        };
        (inverse_dynamics, $x:ident) => {
            let mut tau = [0.0; NV];
            $x.tree.inverse_dynamics(&$x.q, &$x.v, &$x.p, &mut tau);
            $x.add("tau", &tau);
        };
        (bias, $x:ident) => {
            let mut h = [0.0; NV];
            $x.tree.bias(&$x.q, &$x.v, &mut h);
            $x.add("h", &h);
        };
        (regressor, $x:ident) => {
            let mut y = [[0.0; 10 * JOINTS + 2 * NV]; NV];
            $x.tree.regressor(&$x.q, &$x.v, &$x.p, &mut y);
            $x.add("regressor", &y.concat());
        };
        (jacobians, $x:ident) => {
            let mut jacobian = [[[0.0; NV]; 6]; FRAMES];
            $x.tree.jacobians(&$x.q, &mut jacobian);
            $x.add("jacobians", &jacobian.concat().concat());
        };
        (bias_accelerations, $x:ident) => {
            let mut bias = [[0.0; 6]; FRAMES];
            $x.tree.bias_accelerations(&$x.q, &$x.v, &mut bias);
            $x.add("bias accelerations", &bias.concat());
        };
        (centroidal, $x:ident) => {
            let (mut center, mut matrix, mut bias) = ([0.0; 3], [[0.0; NV]; 6], [0.0; 6]);
            $x.tree.centroidal(&$x.q, &$x.v, &mut center, &mut matrix, &mut bias);
            $x.add("center", &center);
            $x.add("centroidal matrix", &matrix.concat());
            $x.add("centroidal bias", &bias);
        };
        (derivatives, $x:ident) => {
            let mut d = StateDerivatives::zero();
            $x.tree.derivatives(&$x.q, &$x.p, &mut d);
            $x.add("v beside derivatives", &d.v);
            $x.add("pd beside derivatives", &d.pd);
            $x.add("derivatives", &[d.dv_dq, d.dv_dp, d.dpd_dq, d.dpd_dp].concat().concat());
        };
        (momentum_derivatives, $x:ident) => {
            let mut d = MomentumDerivatives::zero();
            $x.tree.momentum_derivatives(&$x.q, &$x.v, &mut d);
            $x.add("p beside derivatives", &d.p);
            $x.add("pd beside derivatives, given v", &d.pd);
            $x.add("momentum derivatives", &[d.dp_dq, d.dp_dv, d.dpd_dq, d.dpd_dv].concat().concat());
        };
        (parameter_derivatives, $x:ident) => {
            let (mut dv, mut dpd) = ([[0.0; PARAMS]; NV], [[0.0; PARAMS]; NV]);
            $x.tree.parameter_derivatives(&$x.q, &$x.p, &mut dv, &mut dpd);
            $x.add("dv_dparams", &dv.concat());
            $x.add("dpd_dparams", &dpd.concat());
        };
    }

    /// A generated type, a state of it, and the results so far.
    struct Run<Tree, T, const NQ: usize, const NV: usize> {
        tree: Tree,
        q: [T; NQ],
        v: [T; NV],
        p: [T; NV],
        results: Results,
    }

    impl<Tree, T: Number, const NQ: usize, const NV: usize> Run<Tree, T, NQ, NV> {
        fn add(&mut self, name: &'static str, values: &[T]) {
            self.results.push((name, numbers(values)));
        }
    }

    macro_rules! runner {
        ($run:ident, $tree:ident, $t:ty, [$($field:ident),*], [$($output:ident),*], [$($lanes:ident)?], $frames:literal, $joints:literal, $params:literal) => {
            #[allow(unused)]
            pub fn $run(s: &State, p: &[f64]) -> Results {
                use $tree::Tree;
                const NQ: usize = Tree::NQ;
                const NV: usize = Tree::NV;
                const FRAMES: usize = $frames;
                const JOINTS: usize = $joints;
                const PARAMS: usize = $params;
                let mut tree = Tree::new();
                $(runner!(@field $field tree s);)*
                let (q, v, p): ([$t; NQ], [$t; NV], [$t; NV]) = (array(&s.q), array(&s.v), array(p));
                let mut x = Run { tree, q, v, p, results: Vec::new() };
                $(output!($output, x);)*
                let Run { tree, results, .. } = x;
                $(runner!(@$lanes tree s q p $t);)?
                results
            }
        };
        // Lanes and batches must give the bits of single states. Neighbouring states differ, so that mixed-up lanes show.
        (@lanes $tree:ident $s:ident $q:ident $p:ident $t:ty) => {{
            const STATES: usize = 21;
            let state = |s: usize| {
                let shift = <$t>::of(0.01 * s as f64);
                let (q, p) = ($q.map(|x| x + shift), $p.map(|x| x - shift));
                let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
                $tree.rates(&q, &p, &mut qd, &mut pd);
                (q, p, qd, pd)
            };
            let states: [_; STATES] = std::array::from_fn(state);
            let lanes = $tree.lanes::<STATES>();
            let (mut qd, mut pd) = ([[0.0; STATES]; NQ], [[0.0; STATES]; NV]);
            let column = |get: &dyn Fn(usize) -> $t| -> [$t; STATES] { std::array::from_fn(get) };
            let q: [_; NQ] = std::array::from_fn(|k| column(&|s| states[s].0[k]));
            let p: [_; NV] = std::array::from_fn(|k| column(&|s| states[s].1[k]));
            let expected = (
                std::array::from_fn(|k| column(&|s| states[s].2[k])),
                std::array::from_fn(|k| column(&|s| states[s].3[k])),
            );
            lanes.rates(&q, &p, &mut qd, &mut pd);
            assert_eq!((qd, pd), expected, "lanes");
            let (mut qd, mut pd) = ([[0.0; STATES]; NQ], [[0.0; STATES]; NV]);
            let tau: [[$t; STATES]; NV] = std::array::from_fn(|k| [<$t>::of($s.tau[k]); STATES]);
            let (mut qds, mut pds) = (qd.iter_mut(), pd.iter_mut());
            $tree.batch(&q, &p, &tau, std::array::from_fn(|_| &mut qds.next().unwrap()[..]), std::array::from_fn(|_| &mut pds.next().unwrap()[..]));
            assert_eq!((qd, pd), expected, "batch");
            let (mut m, mut a) = ([[[0.0; STATES]; NV]; NV], [[0.0; NV]; NV]);
            lanes.mass_matrix(&q, &mut m);
            $tree.mass_matrix(&states[7].0, &mut a);
            assert_eq!(m.map(|row| row.map(|x| x[7])), a, "mass matrix of a lane");
            assert_eq!(lanes.energy(&q, &p).map(|x| x[20]), $tree.energy(&states[20].0, &states[20].1));
        }};
        (@field tau $tree:ident $s:ident) => { $tree.tau = array(&$s.tau); };
        (@field drive_q $tree:ident $s:ident) => { $tree.drive_q = array(&$s.drive[0]); };
        (@field drive_v $tree:ident $s:ident) => { $tree.drive_v = array(&$s.drive[1]); };
        (@field drive_a $tree:ident $s:ident) => { $tree.drive_a = array(&$s.drive[2]); };
        (@field params $tree:ident $s:ident) => { $tree.params = array(&$s.params); };
        (@field gravity $tree:ident $s:ident) => { $tree.gravity = array(&$s.gravity); };
        (@field wrenches $tree:ident $s:ident) => {
            for (to, from) in $tree.wrenches.iter_mut().zip(&$s.wrenches) {
                *to = array(from);
            }
        };
    }

    include!(concat!(env!("OUT_DIR"), "/all.rs"));
}

use batch::{Results, RUNNERS};
use mbd_codegen::plan::Plan;
use mbd_codegen::{search, Output};
use mbd_runtime::sweep::{Derivatives, FrameState, ParameterDerivatives};
use mbd_runtime::{Interpreter, MomentumDerivatives, Scalar};
use mbd_testing::assert_same_bits;
use mbd_testing::batch::{is_single, tree, TREES};
use mbd_testing::state::{parameter, random_state, State};

/// Results of the interpreter for the given momenta.
fn interpreted<S: Scalar + Into<f64>>(plan: &Plan, s: &State, p: &[f64]) -> Results {
    let of = |x: &[f64]| x.iter().map(|x| S::constant(*x)).collect::<Vec<S>>();
    let back = |x: &[S]| x.iter().map(|x| (*x).into()).collect::<Vec<f64>>();
    let mut i: Interpreter<S> = s.interpreter_of(plan, |x, _| S::constant(x));
    let (q, v, p) = (of(&s.q), of(&s.v), of(p));
    let (mut qd, mut pd, mut out, mut m) = (q.clone(), v.clone(), v.clone(), of(&vec![0.0; v.len() * v.len()]));
    let mut results = Vec::new();
    i.momenta(&q, &v, &mut out);
    results.push(("p", back(&out)));
    i.rates(&q, &p, &mut out, &mut qd, &mut pd);
    results.push(("qd", back(&qd)));
    results.push(("pd", back(&pd)));
    i.velocities(&q, &p, &mut out);
    results.push(("v", back(&out)));
    let (kinetic, potential) = i.energy(&q, &p);
    results.push(("energy", back(&[kinetic, potential])));
    i.accelerations(&q, &v, &mut out);
    results.push(("a", back(&out)));
    let mut reactions = vec![[S::zero(); 6]; plan.joint_nodes.len()];
    i.reactions(&q, &v, &mut out, &mut reactions);
    results.push(("reactions", back(&reactions.concat())));
    i.mass_matrix(&q, &mut m);
    results.push(("M", back(&m)));
    let mut d = Derivatives::new(i.tree());
    i.derivatives(&q, &p, &mut d);
    results.push(("v beside derivatives", back(&d.v)));
    results.push(("pd beside derivatives", back(&d.pd)));
    results.push(("derivatives", back(&[&d.dv_dq[..], &d.dv_dp, &d.dpd_dq, &d.dpd_dp].concat())));
    let mut at = MomentumDerivatives::new(i.tree());
    i.momentum_derivatives(&q, &v, &mut Derivatives::new(&i.tree().clone()), &mut at);
    results.push(("p beside derivatives", back(&at.p)));
    results.push(("pd beside derivatives, given v", back(&at.pd)));
    results.push(("momentum derivatives", back(&[&at.dp_dq[..], &at.dp_dv, &at.dpd_dq, &at.dpd_dv].concat())));
    let n = s.params.len();
    let columns: Vec<_> = (0..n).map(|k| parameter(plan, s, &i, &q, &d, k).0).collect();
    let rows = |half: fn(&ParameterDerivatives<S>) -> &Vec<S>| {
        let entries = (0..v.len()).flat_map(|a| columns.iter().map(move |c| half(c)[a]));
        back(&entries.collect::<Vec<S>>())
    };
    results.push(("dv_dparams", rows(|c| &c.dv)));
    results.push(("dpd_dparams", rows(|c| &c.dpd)));
    let (mut center, mut matrix, mut bias) = (of(&[0.0; 3]), of(&vec![0.0; 6 * v.len()]), of(&[0.0; 6]));
    i.centroidal(&q, &v, &mut center, &mut matrix, &mut bias);
    results.push(("center", back(&center)));
    results.push(("centroidal matrix", back(&matrix)));
    results.push(("centroidal bias", back(&bias)));
    let mut y = of(&vec![0.0; i.tree().regressor_columns() * v.len()]);
    i.regressor(&q, &v, &p, &mut y);
    results.push(("regressor", back(&y)));
    let mut frames = vec![FrameState::ground(); plan.frames.len()];
    i.frames(&q, &v, &mut frames);
    let all = |f: &dyn Fn(&FrameState<S>) -> Vec<S>| back(&frames.iter().flat_map(f).collect::<Vec<S>>());
    results.push(("rotations", all(&|f| f.rotation.concat())));
    results.push(("positions", all(&|f| f.position.to_vec())));
    results.push(("frame velocities", all(&|f| [f.velocity.lin, f.velocity.ang].concat())));
    i.inverse_dynamics(&q, &v, &p, &mut out);
    results.push(("tau", back(&out)));
    i.bias(&q, &v, &mut out);
    results.push(("h", back(&out)));
    let n = plan.frames.len();
    let (mut jacobians, mut biases) = (of(&vec![0.0; 6 * n * v.len()]), vec![[S::zero(); 6]; n]);
    i.jacobians(&q, &mut jacobians);
    results.push(("jacobians", back(&jacobians)));
    i.bias_accelerations(&q, &v, &mut biases);
    results.push(("bias accelerations", back(&biases.concat())));
    results
}

/// The result of a name.
fn named<'a>(results: &'a Results, name: &str) -> &'a [f64] {
    &results.iter().find(|(what, _)| *what == name).expect("both have a result of this name").1
}

/// Plan, state and momenta of tree `k`, both rounded to the precision of its code.
fn case(k: u64, state: u64) -> (Plan, State, Vec<f64>) {
    let (model, options) = tree(k);
    let plan = search::plan(&model, options.plan);
    let mut s = random_state(&plan, 100 * k + state);
    if !options.efforts {
        s.tau.fill(0.0);
    }
    if is_single(k) {
        let lists = [&mut s.q, &mut s.v, &mut s.tau, &mut s.params].into_iter().chain(&mut s.drive);
        let wrenches = s.wrenches.iter_mut().flatten().chain(&mut s.gravity);
        lists.flatten().chain(wrenches).for_each(|x| *x = f64::from(*x as f32));
    }
    let mut p = vec![0.0; s.v.len()];
    s.interpreter(&plan).momenta(&s.q, &s.v, &mut p);
    if is_single(k) {
        p.iter_mut().for_each(|x| *x = f64::from(*x as f32));
    }
    (plan, s, p)
}

#[test]
fn every_output_is_compiled() {
    for output in Output::available(false) {
        let has = |k: &u64| !is_single(*k) && tree(*k).1.outputs.contains(&output);
        assert!((0..TREES).any(|k| has(&k)), "{}", output.name());
    }
}

#[test]
fn double_precision_is_the_same_bit_for_bit() {
    // Without optimisation, 21 states of the largest tree at once need more than the 2 MiB of a test's thread.
    let thread = std::thread::Builder::new().stack_size(1 << 26).spawn(compare_double_precision);
    thread.expect("a thread").join().expect("all numbers are the same");
}

fn compare_double_precision() {
    let mut numbers = 0;
    for (k, run) in (0..).zip(RUNNERS).filter(|(k, _)| !is_single(*k)) {
        for state in 0..5 {
            let (plan, s, p) = case(k, state);
            let interpreted = interpreted::<f64>(&plan, &s, &p);
            for (what, compiled) in &run(&s, &p) {
                let expected = named(&interpreted, what);
                assert_same_bits(&format!("tree {k}, state {state}"), what, &plan.model, compiled, expected);
                numbers += compiled.len();
            }
        }
    }
    println!("{numbers} numbers compared");
}

/// Generated code folds constants in double precision and rounds them once; the interpreter rounds every step. Both
/// differ from the exact result by rounding errors of the same size. The error of the compiled code may therefore be at
/// most eight times that of the interpreter in single precision (the largest of a result, against the interpreter in
/// double precision); an error of a hundred roundings is always allowed. A bound from condition numbers would be far
/// too wide.
#[test]
fn single_precision_is_as_good_as_the_interpreters() {
    let mut worst = (0.0_f64, String::new());
    for (k, run) in (0..).zip(RUNNERS).filter(|(k, _)| is_single(*k)) {
        for state in 0..5 {
            let (plan, s, p) = case(k, state);
            let exact = interpreted::<f64>(&plan, &s, &p);
            let single = interpreted::<f32>(&plan, &s, &p);
            for (what, compiled) in &run(&s, &p) {
                let [single, exact] = [&single, &exact].map(|results| named(results, what));
                let size = exact.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
                let off = |x: &[f64]| x.iter().zip(exact).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                let (ours, theirs) = (off(compiled), off(single));
                let allowed = 8.0 * theirs + 100.0 * f64::from(f32::EPSILON) * size;
                assert!(compiled.iter().all(|x| x.is_finite()), "tree {k}: {what}");
                assert!(ours <= allowed, "tree {k}, state {state}: {what}: {ours:e} off, interpreter {theirs:e}");
                if ours / size > worst.0 {
                    worst = (ours / size, format!("{what} of tree {k}, interpreter {:.1e}", theirs / size));
                }
            }
        }
    }
    println!("single precision: largest relative error {:.1e} ({})", worst.0, worst.1);
}

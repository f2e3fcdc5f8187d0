//! Derivatives of the rates of mechanisms with loops, couplings and rolling against dual numbers.
//!
//! The reference runs the sweeps of the rates on `q + ε N(q) e_k` and `p + ε e_k`: it differentiates the elimination of the
//! multipliers itself and knows nothing of the implicit function theorem. Random mechanisms may be nearly singular, and
//! derivatives divide by small pivots twice. How much rounding errors grow thereby, the reference shows itself: by how much
//! it changes with a change of the state by a few units in the last place.

use mbd_codegen::plan::Plan;
use mbd_runtime::{Differentiable, Dual, Interpreter, Scalar, StateDerivatives, System};
use mbd_testing::closed::{random_loops, LoopKnobs, LoopSystem};
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::Rng;
use mbd_testing::relative_error;
use mbd_testing::toml::to_toml;

const SYSTEMS: u64 = 400;

/// Tolerance relative to the largest entry of a block, where rounding errors hardly grow.
const TOLERANCE: f64 = 1e-11;
/// How many times the change of the reference with the last places of the state the difference may be, beyond that.
const GROWTH: f64 = 30.0;

/// A mechanism with a plan and momenta.
struct Case {
    system: LoopSystem,
    plan: Plan,
    p: Vec<f64>,
    acting: Acting,
}

/// Which rows of the constraints act.
enum Acting {
    All,
    /// Rows are removed, or act by numbers.
    Some(Vec<bool>),
    ByNumbers(Vec<bool>),
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|j| f64::from(u8::from(j == k))).collect()
}

/// `∂v/∂q`, `∂v/∂p`, `∂ṗ/∂q`, `∂ṗ/∂p`, column by column, `v` and `ṗ`.
type Blocks = [Vec<f64>; 6];

/// Largest difference of blocks, relative to the largest entry of each.
fn difference(a: &Blocks, b: &Blocks) -> f64 {
    a.iter().zip(b).map(|(a, b)| relative_error(a, b, 1e-3)).fold(0.0, f64::max)
}

impl Case {
    /// A random mechanism with random eliminations; none if it has a freedom without inertia.
    fn new(seed: u64) -> Option<Case> {
        let knobs = match seed % 8 {
            7 => LoopKnobs::platforms(seed),
            k => LoopKnobs::everything(seed, [3, 4, 6, 8][k as usize % 4]),
        };
        let system = random_loops(seed, &knobs);
        let plan = random_plan(&system.model, seed);
        system.state.interpreter(&plan).check_rank(&system.state.q).ok()?;
        let mut rng = Rng::new(seed, 8);
        let p = (0..plan.dims.nv).map(|_| rng.around(2.0)).collect();
        Some(Case { system, plan, p, acting: Acting::All })
    }

    /// The interpreter with the rows that act, in place of one with all.
    fn acting<S: Scalar>(&self, i: Interpreter<S>) -> Interpreter<S> {
        let mut own = match &self.acting {
            Acting::All => return i,
            Acting::Some(acts) => i.acting(acts),
            Acting::ByNumbers(acts) => {
                let params: Vec<S> = self.system.state.params.iter().map(|x| S::constant(*x)).collect();
                let factors = acts.iter().map(|acts| S::constant(f64::from(u8::from(*acts)))).collect();
                Interpreter::new(self.plan.tree(&params).with_row_factors(factors), i.gravity)
            }
        };
        own.tau = i.tau;
        (own.drive_q, own.drive_v, own.drive_a) = (i.drive_q, i.drive_v, i.drive_a);
        own.wrenches = i.wrenches;
        own
    }

    /// The state a few units in the last place away.
    fn rounded(mut self) -> Case {
        let lists = [&mut self.system.state.q, &mut self.p];
        lists
            .into_iter()
            .flatten()
            .zip([3.0, -4.0, 2.0].iter().cycle())
            .for_each(|(x, n)| *x *= 1.0 + n * f64::EPSILON);
        self
    }

    fn derivatives(&self) -> StateDerivatives<Vec<f64>, Vec<Vec<f64>>> {
        let mut i = self.acting(self.system.state.interpreter(&self.plan));
        let mut d = i.zero_derivatives();
        i.rate_derivatives(0.0, &self.system.state.q, &self.p, &mut d);
        d
    }

    fn ours(&self) -> Blocks {
        let d = self.derivatives();
        let columns =
            |block: &[Vec<f64>]| (0..self.p.len()).flat_map(|k| block.iter().map(move |row| row[k])).collect();
        let [a, b, c, e] = [&d.dv_dq, &d.dv_dp, &d.dpd_dq, &d.dpd_dp].map(|block| columns(block));
        [a, b, c, e, d.v, d.pd]
    }

    /// The same by dual numbers.
    fn reference(&self) -> Blocks {
        let (s, plan) = (&self.system.state, &self.plan);
        let (nq, nv) = (plan.dims.nq, plan.dims.nv);
        let mut dual = self.acting(s.interpreter_of(plan, |x, _| Dual::new(x, 0.0)));
        let i = s.interpreter(plan);
        let mut along = |dq: &[f64], dp: &[f64]| {
            let moving = |x: &[f64], dx: &[f64]| -> Vec<Dual<f64>> {
                x.iter().zip(dx).map(|(x, dx)| Dual::new(*x, *dx)).collect()
            };
            let zeros = |n: usize| vec![Dual::new(0.0, 0.0); n];
            let (mut v, mut qd, mut pd) = (zeros(nv), zeros(nq), zeros(nv));
            dual.rates(&moving(&s.q, dq), &moving(&self.p, dp), &mut v, &mut qd, &mut pd);
            [v, pd]
        };
        let mut out = Blocks::default();
        for k in 0..nv {
            let mut dq = vec![0.0; nq];
            i.coordinate_rates(&s.q, &unit(nv, k), &mut dq);
            let [vq, pdq] = along(&dq, &vec![0.0; nv]);
            let [vp, pdp] = along(&vec![0.0; nq], &unit(nv, k));
            for (to, from) in out.iter_mut().zip([vq, vp, pdq, pdp]) {
                to.extend(from.iter().map(|x| x.du));
            }
        }
        let [v, pd] = along(&vec![0.0; nq], &vec![0.0; nv]).map(|x| x.iter().map(|x| x.re).collect());
        (out[4], out[5]) = (v, pd);
        out
    }
}

/// Compares some mechanisms; says how many there were and how many differ by less than [`TOLERANCE`].
fn compare(seeds: std::ops::Range<u64>, acting: impl Fn(u64, usize) -> Acting) -> (usize, usize) {
    let (mut kept, mut errors, mut largest) = (0, Vec::new(), 0.0_f64);
    for seed in seeds {
        let Some(mut case) = Case::new(seed) else { continue };
        case.acting = acting(seed, case.plan.dims.rows);
        let model = case.plan.model.clone();
        let (ours, reference) = (case.ours(), case.reference());
        let error = difference(&ours, &reference);
        let spread = difference(&case.rounded().reference(), &reference);
        let allowed = TOLERANCE + GROWTH * spread;
        largest = largest.max(error / allowed);
        assert!(error < allowed, "seed {seed}: {error:e}, {spread:e}\n{}", to_toml(&model));
        kept += usize::from(error < TOLERANCE);
        errors.push(error);
    }
    errors.sort_by(f64::total_cmp);
    let [median, last] = [errors[errors.len() / 2], errors[errors.len() - 1]];
    println!("{} mechanisms: median {median:.1e}, worst {last:.1e}, {largest:.1e} of what is allowed", errors.len());
    (errors.len(), kept)
}

#[test]
fn derivatives_are_those_of_dual_numbers() {
    let (all, kept) = compare(0..SYSTEMS, |_, _| Acting::All);
    assert!(all as u64 > SYSTEMS * 9 / 10, "{all} mechanisms");
    assert!(kept * 10 > all * 9, "{kept} of {all} below {TOLERANCE:e}");
}

/// As contacts that are open, rows may not act: they are not there, or their numbers are zero.
#[test]
fn rows_that_do_not_act_have_no_part_in_derivatives() {
    let (all, kept) = compare(0..120, |seed, rows| {
        let mut rng = Rng::new(seed, 9);
        let acts = (0..rows).map(|_| rng.around(1.0) > -0.3).collect();
        match seed % 2 {
            0 => Acting::Some(acts),
            _ => Acting::ByNumbers(acts),
        }
    });
    assert!(all > 100 && kept * 10 > all * 9, "{kept} of {all} below {TOLERANCE:e}");
}

/// Without dampers, and with constraints all of which are canonical, on joints whose velocities are coordinate rates.
#[test]
fn conservative_loops_are_canonical() {
    let mut found = 0;
    for seed in 0..200 {
        let knobs = LoopKnobs {
            kinds: std::array::from_fn(|k| f64::from(u8::from((8..12).contains(&k)))),
            ..LoopKnobs::plain()
        };
        let mut system = random_loops(seed, &knobs);
        system.model.wrenches.clear();
        system.model.joints.iter_mut().for_each(|j| j.damping.fill(mbd_codegen::model::Value::ZERO));
        let plan = random_plan(&system.model, seed);
        system.state.wrenches.clear();
        if plan.tree::<f64>(&plan.default_params()).nodes.iter().any(|n| n.kind.nv() > 1) {
            continue;
        }
        let nv = plan.dims.nv;
        let p = (0..nv).map(|k| (k as f64).cos()).collect();
        let d = Case { system, plan, p, acting: Acting::All }.derivatives();
        for a in 0..nv {
            for b in 0..nv {
                assert_eq!(d.dpd_dp[a][b], -d.dv_dq[b][a], "seed {seed}");
                assert_eq!(d.dv_dp[a][b], d.dv_dp[b][a], "seed {seed}");
                let (x, y) = (d.dpd_dq[a][b], d.dpd_dq[b][a]);
                let size = d.dpd_dq.iter().flatten().fold(1.0, |m: f64, x| m.max(x.abs()));
                assert!((x - y).abs() < 1e-12 * size, "seed {seed}: {x} {y}");
            }
        }
        found += 1;
    }
    assert!(found > 100, "{found}");
}

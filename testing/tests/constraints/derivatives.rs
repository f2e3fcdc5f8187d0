//! Derivatives of the rates of mechanisms with loops, couplings and rolling against dual numbers.
//!
//! The reference runs the sweeps of the rates on `q + ε N(q) e_k` and `p + ε e_k`: it differentiates the elimination of the
//! multipliers itself and knows nothing of the implicit function theorem.

use mbd_codegen::plan::Plan;
use mbd_runtime::{Differentiable, Dual, Interpreter, System};
use mbd_testing::closed::{random_loops, LoopKnobs};
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::Rng;
use mbd_testing::state::State;
use mbd_testing::toml::to_toml;

type D = Dual<f64>;

/// Columns of the derivatives along changes of the state.
struct Reference<'a> {
    plan: &'a Plan,
    s: &'a State,
    p: &'a [f64],
}

impl Reference<'_> {
    fn along(&self, dq: &[f64], dp: &[f64]) -> [Vec<f64>; 2] {
        let dual = |x: &[f64], dx: &[f64]| x.iter().zip(dx).map(|(x, dx)| Dual::new(*x, *dx)).collect::<Vec<D>>();
        let mut i: Interpreter<D> = self.s.interpreter_of(self.plan, |x, _| Dual::new(x, 0.0));
        let (q, p) = (dual(&self.s.q, dq), dual(self.p, dp));
        let zeros = |n: usize| vec![Dual::new(0.0, 0.0); n];
        let (mut v, mut qd, mut pd) = (zeros(p.len()), zeros(q.len()), zeros(p.len()));
        i.rates(&q, &p, &mut v, &mut qd, &mut pd);
        [v, pd].map(|list| list.iter().map(|x| x.du).collect())
    }
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|j| f64::from(u8::from(j == k))).collect()
}

/// Largest difference of two blocks, relative to the largest entry.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
    a.iter().zip(b).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs() / size))
}

/// Largest differences of `∂v/∂q`, `∂v/∂p`, `∂ṗ/∂q`, `∂ṗ/∂p`, `v` and `ṗ`.
fn differences(seed: u64, knobs: &LoopKnobs) -> Option<([f64; 6], String)> {
    let system = random_loops(seed, knobs);
    let plan = random_plan(&system.model, seed);
    let s = system.state;
    let mut i = s.interpreter(&plan);
    i.check_rank(&s.q).ok()?;
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let mut rng = Rng::new(seed, 8);
    let p: Vec<f64> = (0..nv).map(|_| rng.around(2.0)).collect();
    let mut d = i.zero_derivatives();
    i.rate_derivatives(0.0, &s.q, &p, &mut d);
    let reference = Reference { plan: &plan, s: &s, p: &p };
    let mut columns = [const { Vec::new() }; 4];
    let mut ours = [const { Vec::new() }; 4];
    for k in 0..nv {
        let mut dq = vec![0.0; nq];
        i.coordinate_rates(&s.q, &unit(nv, k), &mut dq);
        let [vq, pq] = reference.along(&dq, &vec![0.0; nv]);
        let [vp, pp] = reference.along(&vec![0.0; nq], &unit(nv, k));
        for (to, from) in columns.iter_mut().zip([vq, vp, pq, pp]) {
            to.extend(from);
        }
        for (to, from) in ours.iter_mut().zip([&d.dv_dq, &d.dv_dp, &d.dpd_dq, &d.dpd_dp]) {
            to.extend(from.iter().map(|row| row[k]));
        }
    }
    let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
    i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
    let [a, b, c, e] = std::array::from_fn(|k| difference(&ours[k], &columns[k]));
    Some(([a, b, c, e, difference(&d.v, &v), difference(&d.pd, &pd)], to_toml(&plan.model)))
}

#[test]
fn derivatives_are_those_of_dual_numbers() {
    let (mut errors, mut left_out) = (Vec::new(), 0);
    for seed in 0..SYSTEMS {
        let knobs = LoopKnobs::everything(seed, [3, 4, 6, 8][seed as usize % 4]);
        let Some((each, model)) = differences(seed, &knobs) else {
            left_out += 1;
            continue;
        };
        let worst = each.iter().fold(0.0, |m, x| f64::max(m, *x));
        if !(worst < TOLERANCE) {
            println!(
                "seed {seed}: {each:?} {}",
                model.lines().filter(|l| l.starts_with("type") || l.contains("[[")).collect::<Vec<_>>().join(";")
            );
        }
        errors.push((worst, seed));
    }
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [median, most, worst] = [errors[errors.len() / 2], errors[errors.len() * 99 / 100], errors[errors.len() - 1]];
    println!("median {:.1e}, 99 % {:.1e}, worst {:.1e} (seed {})", median.0, most.0, worst.0, worst.1);
    assert!(left_out <= SYSTEMS / 10, "{left_out} left out");
    assert!(worst.0 < TOLERANCE);
}

const SYSTEMS: u64 = 300;
const TOLERANCE: f64 = 1e-8;

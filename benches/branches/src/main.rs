//! Times of the rates with like branches together, relative to one after the other: random states, independent of each
//! other or each dependent on the results before it, and eight lanes. Every round times both; the medians of the rounds'
//! ratios are printed, with lower quartiles of the times.
//!
//! `cargo run --release --manifest-path benches/branches/Cargo.toml`

use std::hint::black_box;
use std::time::Instant;

const STATES: usize = 256;

macro_rules! code {
    ($($module:ident),+) => {
        $(mod $module {
            include!(concat!(env!("OUT_DIR"), "/", stringify!($module), ".rs"));
        })+
    };
}
code!(solo12_exact_apart, solo12_exact_together, solo12_fast_apart, solo12_fast_together);
code!(g1_exact_apart, g1_exact_together, g1_fast_apart, g1_fast_together);
code!(arms_exact_apart, arms_exact_together, arms_fast_apart, arms_fast_together);
code!(five_bars_exact_apart, five_bars_exact_together, five_bars_fast_apart, five_bars_fast_together);
code!(feet_fast_apart, feet_fast_together);
code!(four_bars_exact_apart, four_bars_exact_together, four_bars_fast_apart, four_bars_fast_together);

/// Numbers in (−1, 1).
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    }
}

/// Coordinates with a unit quaternion, and momenta.
fn state<const NQ: usize, const NV: usize>(rng: &mut Rng) -> ([f64; NQ], [f64; NV]) {
    let mut q = [(); NQ].map(|()| rng.next());
    let length = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
    q[3..7].iter_mut().for_each(|x| *x /= length);
    (q, [(); NV].map(|()| rng.next()))
}

fn quantile(mut all: Vec<f64>, part: usize) -> f64 {
    all.sort_by(f64::total_cmp);
    all[all.len() / part]
}

/// Nanoseconds for one state.
fn time(run: impl FnOnce()) -> f64 {
    let start = Instant::now();
    run();
    start.elapsed().as_nanos() as f64 / STATES as f64
}

macro_rules! compare {
    ($what:literal, $apart:ident, $together:ident, $rounds:literal) => {{
        const NQ: usize = $apart::Model::NQ;
        const NV: usize = $apart::Model::NV;
        let mut rng = Rng(88_172_645_463_325_252);
        let states: Vec<([f64; NQ], [f64; NV])> = (0..STATES).map(|_| state(&mut rng)).collect();
        let lanes: Vec<([[f64; 8]; NQ], [[f64; 8]; NV])> = states
            .chunks(8)
            .map(|s| (std::array::from_fn(|k| std::array::from_fn(|l| s[l].0[k])), std::array::from_fn(|k| std::array::from_fn(|l| s[l].1[k]))))
            .collect();
        macro_rules! times {
            ($module:ident) => {{
                let (one, eight) = ($module::Model::new(), $module::ModelLanes::<8>::new());
                let independent = time(|| {
                    for (q, p) in &states {
                        let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
                        one.rates(black_box(q), p, &mut qd, &mut pd);
                        black_box((&qd, &pd));
                    }
                });
                let dependent = time(|| {
                    let mut change = 0.0;
                    for (q, p) in &states {
                        let (mut q, mut qd, mut pd) = (*q, [0.0; NQ], [0.0; NV]);
                        q[7] += change;
                        one.rates(black_box(&q), p, &mut qd, &mut pd);
                        black_box((&qd, &pd));
                        change = (qd[NQ - 1] + pd[0]) * 1e-300;
                    }
                });
                let in_lanes = time(|| {
                    for (q, p) in &lanes {
                        let (mut qd, mut pd) = ([[0.0; 8]; NQ], [[0.0; 8]; NV]);
                        eight.rates(black_box(q), p, &mut qd, &mut pd);
                        black_box((&qd, &pd));
                    }
                });
                [independent, dependent, in_lanes]
            }};
        }
        let rounds: Vec<[[f64; 3]; 2]> = (0..$rounds).map(|_| [times!($apart), times!($together)]).collect();
        print!("{}:", $what);
        for (k, kind) in ["independent", "dependent", "8 lanes"].into_iter().enumerate() {
            let [a, b] = [0, 1].map(|which| quantile(rounds.iter().map(|r| r[which][k]).collect(), 4));
            let ratio = quantile(rounds.iter().map(|r| r[1][k] / r[0][k]).collect(), 2);
            print!("  {kind} {a:.0} -> {b:.0} ns, {ratio:.3}");
        }
        println!();
    }};
}

fn main() {
    for _ in 0..3 {
        compare!("solo12, fast ", solo12_fast_apart, solo12_fast_together, 401);
        compare!("solo12, exact", solo12_exact_apart, solo12_exact_together, 401);
        compare!("g1, fast     ", g1_fast_apart, g1_fast_together, 201);
        compare!("g1, exact    ", g1_exact_apart, g1_exact_together, 201);
        compare!("two UR5, fast ", arms_fast_apart, arms_fast_together, 401);
        compare!("two UR5, exact", arms_exact_apart, arms_exact_together, 401);
        compare!("five-bar legs, fast ", five_bars_fast_apart, five_bars_fast_together, 401);
        compare!("five-bar legs, exact", five_bars_exact_apart, five_bars_exact_together, 401);
        compare!("pinned feet, fast ", feet_fast_apart, feet_fast_together, 401);
        compare!("fifty four-bars, fast ", four_bars_fast_apart, four_bars_fast_together, 201);
        compare!("fifty four-bars, exact", four_bars_exact_apart, four_bars_exact_together, 201);
    }
}

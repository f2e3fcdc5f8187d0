//! Times of the rates with like branches together, relative to one after the other: random states, independent of each
//! other or each dependent on the results before it, and eight lanes. Every round times both; the medians of the rounds'
//! ratios are printed, with lower quartiles of the times.
//!
//! `cargo run --release --manifest-path benches/branches/Cargo.toml`

use std::hint::black_box;
use std::time::Instant;

use mbd_runtime::contact::Touching;

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
code!(feet_exact_apart, feet_exact_together, feet_fast_apart, feet_fast_together);
code!(centipede_apart, centipede_together, centipede_rolled);
code!(quadruped_apart, quadruped_together);
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

/// Times of some independent states and of states that depend on the results before, `rates` being those of a model.
fn one_state<const NQ: usize, const NV: usize>(
    states: &[([f64; NQ], [f64; NV])],
    rates: impl Fn(&[f64; NQ], &[f64; NV], &mut [f64; NQ], &mut [f64; NV]),
) -> [f64; 2] {
    let independent = time(|| {
        for (q, p) in states {
            let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
            rates(black_box(q), p, &mut qd, &mut pd);
            black_box((&qd, &pd));
        }
    });
    let dependent = time(|| {
        let mut change = 0.0;
        for (q, p) in states {
            let (mut q, mut qd, mut pd) = (*q, [0.0; NQ], [0.0; NV]);
            q[7] += change;
            rates(black_box(&q), p, &mut qd, &mut pd);
            black_box((&qd, &pd));
            change = (qd[NQ - 1] + pd[0]) * 1e-300;
        }
    });
    [independent, dependent]
}

/// Prints what rounds of times apart and together give.
fn print<const N: usize>(what: &str, rounds: &[[[f64; N]; 2]]) {
    print!("{what}:");
    for (k, kind) in ["independent", "dependent", "8 lanes"].into_iter().enumerate().take(N) {
        let [a, b] = [0, 1].map(|which| quantile(rounds.iter().map(|r| r[which][k]).collect(), 4));
        let ratio = quantile(rounds.iter().map(|r| r[1][k] / r[0][k]).collect(), 2);
        print!("  {kind} {a:.0} -> {b:.0} ns, {ratio:.3}");
    }
    println!();
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
                let [independent, dependent] = one_state(&states, |q, p, qd, pd| one.rates(q, p, qd, pd));
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
        print($what, &rounds);
    }};
}

/// The quadruped in its sets of modes.
fn with_contacts() {
    let mut rng = Rng(88_172_645_463_325_252);
    let mut states: Vec<([f64; 19], [f64; 18])> = (0..STATES).map(|_| state(&mut rng)).collect();
    // A straight leg cannot follow its foot, and would leave it to the function for all modes.
    states.iter_mut().for_each(|(q, _)| (9..19).step_by(3).for_each(|knee| q[knee] = -1.4 + 0.5 * q[knee]));
    let (mut apart, mut together) = (quadruped_apart::Model::new(), quadruped_together::Model::new());
    let sets = quadruped_apart::Model::MODES;
    for (set, what) in sets.iter().zip(["in the air", "standing", "trotting", "sliding"]) {
        apart.act(set);
        together.act(set);
        let rounds: Vec<[[f64; 2]; 2]> = (0..401)
            .map(|_| {
                let a = one_state(&states, |q, p, qd, pd| apart.rates(q, p, qd, pd));
                [a, one_state(&states, |q, p, qd, pd| together.rates(q, p, qd, pd))]
            })
            .collect();
        print(&format!("quadruped with contacts, {what}"), &rounds);
    }
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
        compare!("pinned feet, exact", feet_exact_apart, feet_exact_together, 401);
        with_contacts();
        compare!("fifty four-bars, fast ", four_bars_fast_apart, four_bars_fast_together, 201);
        compare!("fifty four-bars, exact", four_bars_exact_apart, four_bars_exact_together, 201);
        compare!("centipede, legs together", centipede_apart, centipede_together, 201);
        compare!("centipede, loops over links", centipede_apart, centipede_rolled, 201);
    }
}

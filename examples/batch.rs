//! Many motions of one robot at once: eight states side by side in vector registers, and a block of columns for every
//! thread.
//!
//! `cargo run --release --example batch`

use std::time::Instant;

multibody::mbd_model! { path = "models/ur5.urdf", name = Ur5, outputs = [rates, energy] }

const N: usize = Ur5::NQ;

/// Columns of some states: `q[k][s]` is coordinate `k` of state `s`.
type Columns = [Vec<f64>; N];

/// Arms that start at rest at angles of their own, rad, by their numbers.
fn starts(numbers: std::ops::Range<usize>) -> [Columns; 2] {
    let angle = |k: usize, s: usize| 0.8 * ((1 + k + N * s) as f64 * 0.618_033_988_75).fract() - 0.4;
    let at_rest = core::array::from_fn(|_| vec![0.0; numbers.len()]);
    [core::array::from_fn(|k| numbers.clone().map(|s| angle(k, s)).collect()), at_rest]
}

/// `steps` steps of the midpoint rule of `h` seconds for all states of the columns.
fn roll_out(arm: &Ur5, q: &mut Columns, p: &mut Columns, h: f64, steps: usize) {
    let tau: Columns = core::array::from_fn(|_| vec![0.0; q[0].len()]);
    let (mut qd, mut pd, mut q_mid, mut p_mid) = (q.clone(), p.clone(), q.clone(), p.clone());
    let advance = |to: &mut Columns, from: &Columns, rates: &Columns, h: f64| {
        for ((to, from), rate) in to.iter_mut().zip(from).zip(rates) {
            to.iter_mut().zip(from).zip(rate).for_each(|((to, from), rate)| *to = from + h * rate);
        }
    };
    for _ in 0..steps {
        rates(arm, q, p, &tau, &mut qd, &mut pd);
        advance(&mut q_mid, q, &qd, h / 2.0);
        advance(&mut p_mid, p, &pd, h / 2.0);
        rates(arm, &q_mid, &p_mid, &tau, &mut qd, &mut pd);
        let (q0, p0) = (q.clone(), p.clone());
        advance(q, &q0, &qd, h);
        advance(p, &p0, &pd, h);
    }
}

/// Rates of all states of the columns.
fn rates(arm: &Ur5, q: &Columns, p: &Columns, tau: &Columns, qd: &mut Columns, pd: &mut Columns) {
    let [q, p, tau] = [q, p, tau].map(|c| c.each_ref().map(|c| &c[..]));
    let [qd, pd] = [qd, pd].map(|c| c.each_mut().map(|c| &mut c[..]));
    arm.rates_batch(q, p, tau, qd, pd).expect("all columns have the same length");
}

/// Mean of the energies of all states, J.
fn mean_energy(arm: &Ur5, q: &Columns, p: &Columns) -> f64 {
    let state = |c: &Columns, s: usize| core::array::from_fn(|k| c[k][s]);
    let states = q[0].len();
    (0..states).map(|s| arm.energy(&state(q, s), &state(p, s)).iter().sum::<f64>()).sum::<f64>() / states as f64
}

/// Lets 4096 arms fall for a tenth of a second.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (states, steps, h) = (4096, 100, 1e-3);
    let threads = std::thread::available_parallelism()?.get().min(states / 8);
    let arm = Ur5::new();
    let share = states.div_ceil(threads);
    let clock = Instant::now();
    let errors: Vec<f64> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|worker| {
                let arm = arm.clone();
                scope.spawn(move || {
                    let [mut q, mut p] = starts(worker * share..(worker + 1) * share);
                    let before = mean_energy(&arm, &q, &p);
                    roll_out(&arm, &mut q, &mut p, h, steps);
                    (mean_energy(&arm, &q, &p) - before).abs()
                })
            })
            .collect();
        workers.into_iter().map(|w| w.join().expect("no thread panics")).collect()
    });
    let worst = errors.into_iter().fold(0.0, f64::max);
    let rate = (2 * steps * share * threads) as f64 / clock.elapsed().as_secs_f64();
    println!("{} motions on {threads} threads: {:.1} million evaluations a second", share * threads, rate * 1e-6);
    println!("error of the mean energy: {worst:.1e} J");
    assert!(worst < 1e-2);
    Ok(())
}

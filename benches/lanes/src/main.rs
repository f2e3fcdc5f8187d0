//! Times of one state a call, of eight lanes and of batches, in one process.
//!
//!     cargo run --release --manifest-path benches/lanes/Cargo.toml [ROUNDS]
//!     LANES=ur5,planar100 LANES_MORE=talos_reduced.urdf cargo run --release --manifest-path benches/lanes/Cargo.toml
//!
//! All variants of a mechanism run in turns on the same random states. The lower quartile of many rounds counts, in
//! cycles of a chain of integer operations (a cycle each) that is timed in the same rounds, for each state. In brackets: that time
//! divided by the cycles of the busiest pipe, for one state with two pipes that multiply and two that add, for lanes and
//! batches with two pipes of 64 bytes. Processors that compute vectors of 64 bytes in two halves, or have none, need up to
//! twice the latter. `chain`: each state waits for the rates of the one before it; in brackets, by the critical path if that
//! is longer. Loops over like branches may take less for one state.

use std::hint::black_box;
use std::time::Instant;

use mbd_runtime::kernel::{Fused, Kernel};

const L: usize = 8;

/// Random numbers between −1 and 1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Runs a kernel with vectors of 32 bytes, whatever the processor has.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
#[inline(never)]
unsafe fn narrow<K: Kernel<ID, L, X>, const ID: usize, X>(arguments: X) {
    K::run::<Fused>(arguments);
}

/// Nanoseconds of a cycle: rotations and exclusive ors that wait for one another take one each on all processors of today.
fn cycle() -> f64 {
    const N: usize = 2000;
    let (mut x, other) = (black_box(0x9e37_79b9_7f4a_7c15_u64), black_box(0x2545_f491_4f6c_dd1d));
    let from = Instant::now();
    for _ in 0..N {
        x = x.rotate_left(7) ^ other;
    }
    black_box(x);
    from.elapsed().as_secs_f64() * 1e9 / (2 * N) as f64
}

fn quartile(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 4]
}

/// Lower quartiles of the times of some functions that run in turns, divided by the number of states and by the length
/// of a cycle; each function comes with the cycles that it cannot do without.
fn race(rounds: usize, states: usize, variants: &mut [(&str, f64, &mut dyn FnMut())]) {
    let mut times = vec![Vec::new(); variants.len()];
    let mut clock = Vec::new();
    for round in 0..rounds {
        clock.push(cycle());
        for k in 0..variants.len() {
            let k = (k + round) % variants.len();
            let from = Instant::now();
            (variants[k].2)();
            times[k].push(from.elapsed().as_secs_f64() * 1e9 / states as f64);
        }
    }
    let cycle = quartile(&mut clock);
    for (k, (name, bound, _)) in variants.iter().enumerate() {
        let cycles = quartile(&mut times[k]) / cycle;
        print!("  {name} {cycles:8.1} ({:4.2})", cycles / bound);
    }
    println!("  ({cycle:.3} ns)");
}

/// Eight numbers that begin where a cache line begins.
#[derive(Clone, Copy, PartialEq)]
#[repr(align(64))]
struct Line([f64; L]);

/// Numbers of eight states.
#[derive(Clone, PartialEq)]
#[repr(align(64))]
struct Block<const N: usize>([[f64; L]; N]);

/// Random columns of a batch; zeros for the seed 0.
fn columns<const N: usize>(states: usize, seed: &mut u64) -> [Vec<Line>; N] {
    let zero = *seed == 0;
    let mut number = || if zero { 0.0 } else { random(seed) };
    [(); N].map(|()| (0..states / L).map(|_| Line([(); L].map(|()| number()))).collect())
}

/// The numbers of every column.
fn parts<const N: usize>(columns: &[Vec<Line>; N]) -> [&[f64]; N] {
    columns.each_ref().map(|lines| {
        // SAFETY: a line is eight numbers and nothing else.
        unsafe { std::slice::from_raw_parts(lines.as_ptr().cast(), lines.len() * L) }
    })
}

fn parts_mut<const N: usize>(columns: &mut [Vec<Line>; N]) -> [&mut [f64]; N] {
    columns.each_mut().map(|lines| {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(lines.as_mut_ptr().cast(), lines.len() * L) }
    })
}

fn states<const N: usize>(columns: &[Vec<Line>; N]) -> Vec<[f64; N]> {
    (0..columns[0].len() * L).map(|s| std::array::from_fn(|k| columns[k][s / L].0[s % L])).collect()
}

fn blocks<const N: usize>(columns: &[Vec<Line>; N]) -> Vec<Block<N>> {
    (0..columns[0].len()).map(|b| Block(std::array::from_fn(|k| columns[k][b].0))).collect()
}

macro_rules! models {
    ($($name:ident [$one:literal $chain:literal $lane:literal $lane_q:literal];)*) => {
        $(
            mod $name {
                include!(concat!(env!("OUT_DIR"), "/", stringify!($name), ".rs"));

                pub fn run(rounds: usize) {
                    use super::*;
                    const NQ: usize = Robot::NQ;
                    const NV: usize = Robot::NV;
                    const STATES: usize = if NV > 50 { 64 } else { 256 };
                    let mut seed = 1;
                    let robot = Robot::new();
                    // Columns, and the same numbers state by state and block by block.
                    let (qs, ps, taus) = (columns::<NQ>(STATES, &mut seed), columns::<NV>(STATES, &mut seed), columns::<NV>(STATES, &mut 0));
                    let (q1, p1) = (states(&qs), states(&ps));
                    let (q8, p8) = (blocks(&qs), blocks(&ps));
                    let lanes = robot.lanes::<L>();
                    let mut moved = ([0.0; NQ], [0.0; NV]);
                    let (mut qd1, mut pd1) = (q1.clone(), p1.clone());
                    let (mut qd8, mut pd8, mut a8) = (q8.clone(), p8.clone(), p8.clone());
                    let (mut qd9, mut pd9) = (q8.clone(), p8.clone());
                    let (mut qds, mut pds) = (qs.clone(), ps.clone());
                    let has = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
                    print!("{:<16}", stringify!($name));
                    race(rounds, STATES, &mut [
                        ("one", $one, &mut || for k in 0..STATES {
                            robot.rates(black_box(&q1[k]), black_box(&p1[k]), &mut qd1[k], &mut pd1[k]);
                        }),
                        ("chain", $chain, &mut || for k in 0..STATES {
                            // Each state is moved a little by the rates of the one before it.
                            let (mut q, mut p) = (q1[k], p1[k]);
                            q.iter_mut().zip(&moved.0).for_each(|(q, qd)| *q += 1e-9 * qd);
                            p.iter_mut().zip(&moved.1).for_each(|(p, pd)| *p += 1e-9 * pd);
                            robot.rates(&q, &p, &mut moved.0, &mut moved.1);
                        }),
                        ("lanes", $lane, &mut || for k in 0..STATES / L {
                            lanes.rates(black_box(&q8[k].0), black_box(&p8[k].0), &mut qd8[k].0, &mut pd8[k].0);
                        }),
                        ("AVX2", $lane, &mut || for k in 0..STATES / L {
                            if has {
                                // SAFETY: the processor has both.
                                unsafe { narrow::<Robot, 0, _>((black_box(&q8[k].0), black_box(&p8[k].0), &lanes.tau, &mut qd9[k].0, &mut pd9[k].0)) };
                            }
                        }),
                        ("batch", $lane, &mut || {
                            let (q, p, tau) = (parts(black_box(&qs)), parts(&ps), parts(&taus));
                            robot.rates_batch(q, p, tau, parts_mut(&mut qds), parts_mut(&mut pds)).expect("columns of one length");
                        }),
                        ("lanes q''", $lane_q, &mut || for k in 0..STATES / L {
                            lanes.accelerations(black_box(&q8[k].0), black_box(&p8[k].0), &mut a8[k].0);
                        }),
                    ]);
                    // The bits of a lane and of a batch are those of one state.
                    assert!(blocks(&qds) == qd8 && blocks(&pds) == pd8);
                    assert!(!has || qd8 == qd9 && pd8 == pd9);
                    assert!(states(&qds) == qd1 && states(&pds) == pd1);
                }
            }
        )*

        fn main() {
            let rounds = std::env::args().nth(1).map_or(200, |n| n.parse().expect("a number of rounds"));
            println!("cycles for each state");
            $($name::run(rounds);)*
        }
    };
}

include!(concat!(env!("OUT_DIR"), "/models.rs"));

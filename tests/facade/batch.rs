//! Many states in one call have the results of single states, bit for bit, for any number of states.

use multibody::runtime::batch::{BatchError, RatesBatch};
use multibody::runtime::kernel::{Kernel, Plain};

multibody::mbd_model! { path = "models/ur5.urdf", name = Ur5, outputs = [rates, energy] }
multibody::mbd_model! { path = "models/double_pendulum.toml", name = Single, outputs = [rates], scalar = f32 }
multibody::mbd_model! { path = "models/chain100.toml", name = Chain, outputs = [rates, energy] }

/// One column of `n` different numbers for each coordinate. The 5th and 12th state have angles so large that sine and
/// cosine leave their main path.
fn columns<const N: usize>(n: usize, shift: f64) -> [Vec<f64>; N] {
    std::array::from_fn(|k| {
        let number = |s: usize| (shift + 0.7 * k as f64 + 1.3 * s as f64).sin() * if s % 7 == 5 { 1e9 } else { 2.0 };
        (0..n).map(number).collect()
    })
}

fn slices<T, const N: usize>(columns: &[Vec<T>; N]) -> [&[T]; N] {
    columns.each_ref().map(|c| c.as_slice())
}

fn slices_mut<T, const N: usize>(columns: &mut [Vec<T>; N]) -> [&mut [T]; N] {
    columns.each_mut().map(|c| c.as_mut_slice())
}

fn state<T: Copy, const N: usize>(columns: &[Vec<T>; N], s: usize) -> [T; N] {
    columns.each_ref().map(|c| c[s])
}

/// Batches of every length have the bits of single states.
#[test]
fn every_length() {
    let mut arm = Ur5::new();
    arm.tau = [1.0, -2.0, 0.5, 0.25, -0.125, 0.0];
    for n in 0..=41 {
        let (q, p) = (columns::<6>(n, 0.0), columns::<6>(n, 0.3));
        let tau = arm.tau.map(|x| vec![x; n]);
        let (mut qd, mut pd) = ([0.0; 6].map(|x| vec![x; n]), [0.0; 6].map(|x| vec![x; n]));
        arm.rates_batch(slices(&q), slices(&p), slices(&tau), slices_mut(&mut qd), slices_mut(&mut pd)).unwrap();
        for s in 0..n {
            let (mut qd1, mut pd1) = ([0.0; 6], [0.0; 6]);
            arm.rates(&state(&q, s), &state(&p, s), &mut qd1, &mut pd1);
            assert_eq!((state(&qd, s), state(&pd, s)), (qd1, pd1), "state {s} of {n}");
        }
        let arm = Single::new();
        let (q, p) = (columns::<2>(n, 0.0), columns::<2>(n, 0.3));
        let (q, p) = [q, p].map(|c| c.map(|c| c.iter().map(|x| *x as f32).collect::<Vec<_>>())).into();
        let [tau, mut qd, mut pd] = [(); 3].map(|()| [0.0_f32; 2].map(|x| vec![x; n]));
        arm.rates_batch(slices(&q), slices(&p), slices(&tau), slices_mut(&mut qd), slices_mut(&mut pd)).unwrap();
        for s in 0..n {
            let (mut qd1, mut pd1) = ([0.0; 2], [0.0; 2]);
            arm.rates(&state(&q, s), &state(&p, s), &mut qd1, &mut pd1);
            assert_eq!((state(&qd, s), state(&pd, s)), (qd1, pd1), "state {s} of {n}, f32");
        }
    }
}

/// Any number of lanes has the bits of single states.
#[test]
fn any_lanes() {
    fn lanes<const L: usize>() {
        let arm = Ur5::new();
        let (q, p) = (columns::<6>(L, 0.0), columns::<6>(L, 0.3));
        let [q_lanes, p_lanes] = [&q, &p].map(|c| c.each_ref().map(|c| <[f64; L]>::try_from(c.as_slice()).unwrap()));
        let (mut qd, mut pd) = ([[0.0; L]; 6], [[0.0; L]; 6]);
        arm.lanes::<L>().rates(&q_lanes, &p_lanes, &mut qd, &mut pd);
        let energy = arm.lanes::<L>().energy(&q_lanes, &p_lanes);
        for l in 0..L {
            let (mut qd1, mut pd1) = ([0.0; 6], [0.0; 6]);
            arm.rates(&state(&q, l), &state(&p, l), &mut qd1, &mut pd1);
            assert_eq!((qd.map(|x| x[l]), pd.map(|x| x[l])), (qd1, pd1), "lane {l} of {L}");
            assert_eq!(energy.map(|x| x[l]), arm.energy(&state(&q, l), &state(&p, l)), "energy, lane {l} of {L}");
        }
    }
    lanes::<1>();
    lanes::<3>();
    lanes::<4>();
    lanes::<8>();
    lanes::<16>();
}

/// The loops of rolled code compute sines turn by turn for several states, and all together for one: the bits are the
/// same, also where sine and cosine leave their main path.
#[test]
fn rolled_code() {
    fn lanes<const L: usize>() {
        let mut chain = Chain::new();
        chain.tau[7] = 0.5;
        let (q, p) = (columns::<100>(L, 0.0), columns::<100>(L, 0.3));
        let [q_lanes, p_lanes] = [&q, &p].map(|c| c.each_ref().map(|c| <[f64; L]>::try_from(c.as_slice()).unwrap()));
        let (mut qd, mut pd) = ([[0.0; L]; 100], [[0.0; L]; 100]);
        chain.lanes::<L>().rates(&q_lanes, &p_lanes, &mut qd, &mut pd);
        let energy = chain.lanes::<L>().energy(&q_lanes, &p_lanes);
        let tau = chain.tau.map(|x| vec![x; L]);
        let (mut qds, mut pds) = ([0.0; 100].map(|x| vec![x; L]), [0.0; 100].map(|x| vec![x; L]));
        chain.rates_batch(slices(&q), slices(&p), slices(&tau), slices_mut(&mut qds), slices_mut(&mut pds)).unwrap();
        for l in 0..L {
            let (mut qd1, mut pd1) = ([0.0; 100], [0.0; 100]);
            chain.rates(&state(&q, l), &state(&p, l), &mut qd1, &mut pd1);
            assert!(qd1.iter().chain(&pd1).all(|x| x.is_finite()), "lane {l} of {L}");
            assert_eq!((qd.map(|x| x[l]), pd.map(|x| x[l])), (qd1, pd1), "lane {l} of {L}");
            assert_eq!((state(&qds, l), state(&pds, l)), (qd1, pd1), "state {l} of {L}");
            assert_eq!(energy.map(|x| x[l]), chain.energy(&state(&q, l), &state(&p, l)), "energy, lane {l} of {L}");
        }
    }
    lanes::<1>();
    lanes::<7>();
    lanes::<8>();
    lanes::<9>();
}

/// Plain arithmetic and the fastest arithmetic of the processor differ by rounding only.
#[test]
fn levels_agree() {
    let arm = Ur5::new();
    let (q, p) = (columns::<6>(5, 0.0), columns::<6>(5, 0.3));
    for s in 0..5 {
        let (q, p) = (state(&q, s), state(&p, s));
        let (mut best, mut plain) = ([[0.0; 6]; 2], [[0.0; 6]; 2]);
        let [qd, pd] = &mut best;
        arm.rates(&q, &p, qd, pd);
        let [qd, pd] = &mut plain;
        <Ur5 as Kernel<0, 1, _>>::run::<Plain>((&q, &p, &arm.tau, qd, pd));
        for (best, plain) in best.iter().zip(&plain) {
            let size = plain.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (a, b) in best.iter().zip(plain) {
                // The bound allows for some hundred roundings and for the condition of the arm's inertia.
                assert!((a - b).abs() <= 1e-12 * size, "{a} and {b} in state {s}");
            }
        }
    }
}

#[test]
fn lengths_are_checked() {
    let arm = Ur5::new();
    let (q, p) = (columns::<6>(10, 0.0), columns::<6>(10, 0.3));
    let tau = [0.0; 6].map(|x| vec![x; 10]);
    let (mut qd, mut pd) = ([7.0; 6].map(|x| vec![x; 10]), [7.0; 6].map(|x| vec![x; 10]));
    pd[3].pop();
    let result = arm.rates_batch(slices(&q), slices(&p), slices(&tau), slices_mut(&mut qd), slices_mut(&mut pd));
    assert_eq!(result, Err(BatchError::Lengths { expected: 10, found: 9 }));
    assert_eq!(result.unwrap_err().to_string(), "a column has 9 numbers, the first has 10");
    assert!(qd.iter().chain(&pd).flatten().all(|x| *x == 7.0), "nothing is written");
}

/// Computation by the threads of rayon gives the numbers of one thread.
#[cfg(feature = "rayon")]
#[test]
fn threads() {
    let arm = Ur5::new();
    for n in [0, 5, 511, 512, 5003] {
        let (q, p) = (columns::<6>(n, 0.0), columns::<6>(n, 0.3));
        let tau = [0.5; 6].map(|x| vec![x; n]);
        let mut rates = [(); 4].map(|()| [0.0; 6].map(|x| vec![x; n]));
        let [qd, pd, qd1, pd1] = &mut rates;
        let parallel = multibody::runtime::batch::rates_parallel;
        parallel(&arm, slices(&q), slices(&p), slices(&tau), slices_mut(qd), slices_mut(pd)).unwrap();
        RatesBatch::rates_batch(&arm, slices(&q), slices(&p), slices(&tau), slices_mut(qd1), slices_mut(pd1)).unwrap();
        assert_eq!((qd, pd), (qd1, pd1), "{n} states");
    }
}

/// Generic code can use batches through the trait.
#[test]
fn through_the_trait() {
    fn count<S: RatesBatch<f64, 6, 6, 6>>(system: &S, n: usize) -> usize {
        let (q, p) = (columns::<6>(n, 0.0), columns::<6>(n, 0.3));
        let tau = [0.0; 6].map(|x| vec![x; n]);
        let (mut qd, mut pd) = ([0.0; 6].map(|x| vec![x; n]), [0.0; 6].map(|x| vec![x; n]));
        system.rates_batch(slices(&q), slices(&p), slices(&tau), slices_mut(&mut qd), slices_mut(&mut pd)).unwrap();
        qd[0].iter().filter(|x| **x != 0.0).count()
    }
    assert_eq!(count(&Ur5::new(), 20), 20);
}

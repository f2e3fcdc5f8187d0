//! Counts the instructions of one evaluation of our code and of CasADi's, in the same states, and compares the
//! accelerations.
#![no_std]
#![no_main]

use core::hint::black_box;

use firmware::{exit, print_line, read_counter, start_counter};

mbd_macros::mbd_model! {
    path = "../../../models/ur5.urdf",
    name = Ur5,
    scalar = f64,
    outputs = [rates, accelerations, momenta]
}

const STATES: usize = 64;
/// Number of passes through all states. It is limited because the counter has 24 bits, each tick being 40 instructions.
const ROUNDS: u32 = 16;

type Kernel = unsafe extern "C" fn(q: *const f64, v: *const f64, tau: *const f64, out: *mut f64);

extern "C" {
    /// CasADi's code with the sine and cosine of the C library.
    fn ur5_casadi(q: *const f64, v: *const f64, tau: *const f64, out: *mut f64);
    /// The same code with our sine and cosine.
    fn ur5_casadi_own(q: *const f64, v: *const f64, tau: *const f64, out: *mut f64);
}

/// Our sine, for CasADi's code.
#[no_mangle]
extern "C" fn own_sin(x: f64) -> f64 {
    mbd_runtime::trig::sincos_f64(x).0
}

/// Our cosine, for CasADi's code.
#[no_mangle]
extern "C" fn own_cos(x: f64) -> f64 {
    mbd_runtime::trig::sincos_f64(x).1
}

#[derive(Clone, Copy)]
struct State {
    q: [f64; 6],
    v: [f64; 6],
    p: [f64; 6],
    tau: [f64; 6],
}

/// Random states with angles up to 3 rad, velocities up to 1 rad/s and joint forces up to 5 N m.
fn states(system: &mut Ur5) -> [State; STATES] {
    let mut seed = 1_u32;
    let mut random = |size: f64| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        size * (f64::from(seed >> 8) / f64::from(1_u32 << 23) - 1.0)
    };
    let mut states = [State { q: [0.0; 6], v: [0.0; 6], p: [0.0; 6], tau: [0.0; 6] }; STATES];
    for s in &mut states {
        s.q.iter_mut().for_each(|x| *x = random(3.0));
        s.v.iter_mut().for_each(|x| *x = random(1.0));
        s.tau.iter_mut().for_each(|x| *x = random(5.0));
        system.momenta(&s.q, &s.v, &mut s.p);
    }
    states
}

/// Instructions of one call, with its share of the loop over states. `None` if the counter overflowed.
fn count(states: &[State; STATES], mut call: impl FnMut(&State, &mut [f64; 12])) -> Option<u64> {
    let mut out = [0.0; 12];
    start_counter();
    for _ in 0..ROUNDS {
        for state in states {
            call(black_box(state), &mut out);
            black_box(&mut out);
        }
    }
    let (ticks, wrapped) = read_counter();
    // The simulated processor makes one instruction a nanosecond, and the counter one tick in 40 instructions.
    (!wrapped).then_some(u64::from(ticks) * 40 / (u64::from(ROUNDS) * STATES as u64))
}

fn theirs(kernel: Kernel, s: &State, out: &mut [f64; 12]) {
    // SAFETY: the kernel reads arrays of 6, 6 and 6 numbers, and writes 6 of the 12 numbers of `out`.
    unsafe { kernel(s.q.as_ptr(), s.v.as_ptr(), s.tau.as_ptr(), out.as_mut_ptr()) }
}

/// Largest difference of accelerations, relative to the largest acceleration of each state, in units of 1e-18.
fn difference(states: &[State; STATES], system: &mut Ur5, kernel: Kernel) -> u64 {
    let mut worst = 0.0_f64;
    for s in states {
        let (mut ours, mut other) = ([0.0; 6], [0.0; 12]);
        system.tau = s.tau;
        system.accelerations(&s.q, &s.v, &mut ours);
        theirs(kernel, s, &mut other);
        let size = ours.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
        let off = ours.iter().zip(&other).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        worst = worst.max(off / size);
    }
    (worst * 1e18) as u64
}

/// Called by the reset handler.
#[no_mangle]
pub extern "C" fn main() -> ! {
    let mut system = Ur5::new();
    let states = states(&mut system);
    print_line("difference", difference(&states, &mut system, ur5_casadi));
    print_line("difference_own", difference(&states, &mut system, ur5_casadi_own));
    let counts = [
        ("empty", count(&states, |_, _| ())),
        ("rates", {
            let system = &mut system;
            count(&states, move |s, out| {
                system.tau = s.tau;
                let (qd, pd) = out.split_at_mut(6);
                if let (Ok(qd), Ok(pd)) = (qd.try_into(), pd.try_into()) {
                    system.rates(&s.q, &s.p, qd, pd);
                }
            })
        }),
        ("accelerations", {
            let system = &mut system;
            count(&states, move |s, out| {
                system.tau = s.tau;
                if let Ok(a) = (&mut out[..6]).try_into() {
                    system.accelerations(&s.q, &s.v, a);
                }
            })
        }),
        ("casadi", count(&states, |s, out| theirs(ur5_casadi, s, out))),
        ("casadi_own", count(&states, |s, out| theirs(ur5_casadi_own, s, out))),
    ];
    for (name, instructions) in counts {
        match instructions {
            Some(n) => print_line(name, n),
            None => exit(false),
        }
    }
    exit(true)
}

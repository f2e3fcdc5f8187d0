//! `latency [ROUNDS [MODEL ...]]`: generated rates called one by one on independent states, in a chain where each state
//! depends on the rates before it, and within steps of integration.
//!
//! In each round every contestant is timed once, in an order that is drawn anew; the table has quartiles over the
//! rounds. Processor time of this process is measured, and beside it a chain of products, each of which waits for the
//! one before: its time tells how fast the processor was.

use std::hint::black_box;

use mbd_runtime::integrate::{Dop853, Rk4, Stepper, Verner9};

/// States of a batch; they are in the first-level cache.
const STATES: usize = 64;

/// Evaluations between two looks at the clock, about.
const EVALUATIONS: usize = 512;

/// What is timed: it makes about so many evaluations, and returns how many.
type Contestant = (&'static str, Box<dyn FnMut() -> usize>);

macro_rules! models {
    ($($name:ident)*) => {
        $(mod $name {
            use super::*;

            include!(concat!(env!("LATENCY"), "/", stringify!($name), ".rs"));

            type State = ([f64; Robot::NQ], [f64; Robot::NV]);

            fn states(random: &mut Random) -> Vec<State> {
                let state = |_| (std::array::from_fn(|_| 3.0 * random.next()), std::array::from_fn(|_| random.next()));
                (0..STATES).map(state).collect()
            }

            fn independent(states: Vec<State>) -> Contestant {
                let system = Robot::new();
                let mut rates: State = ([0.0; Robot::NQ], [0.0; Robot::NV]);
                ("independent", Box::new(move || {
                    for _ in 0..EVALUATIONS / STATES {
                        for (q, p) in &states {
                            system.rates(q, p, &mut rates.0, &mut rates.1);
                            black_box(&mut rates);
                        }
                    }
                    EVALUATIONS
                }))
            }

            /// Every state is moved a little by the rates of the one before it.
            fn dependent(states: Vec<State>) -> Contestant {
                let system = Robot::new();
                let mut rates: State = ([0.0; Robot::NQ], [0.0; Robot::NV]);
                ("dependent", Box::new(move || {
                    for _ in 0..EVALUATIONS / STATES {
                        for state in &states {
                            let (mut q, mut p) = *state;
                            q.iter_mut().zip(&rates.0).for_each(|(q, qd)| *q += 1e-9 * qd);
                            p.iter_mut().zip(&rates.1).for_each(|(p, pd)| *p += 1e-9 * pd);
                            system.rates(&q, &p, &mut rates.0, &mut rates.1);
                        }
                    }
                    black_box(&mut rates);
                    EVALUATIONS
                }))
            }

            /// Steps of a method, from state to state.
            fn steps<M: Stepper<Robot> + 'static>(name: &'static str, mut method: M, states: Vec<State>) -> Contestant {
                let mut system = Robot::new();
                let mut next = 0;
                (name, Box::new(move || {
                    let start = method.statistics().evaluations;
                    let (mut q, mut p) = states[next % STATES];
                    next += 1;
                    let mut done = 0;
                    while done < EVALUATIONS {
                        method.step(black_box(&mut system), 0.0, 1e-4, &mut q, &mut p).expect("a short step");
                        done = (method.statistics().evaluations - start) as usize;
                    }
                    black_box((&mut q, &mut p));
                    done
                }))
            }

            pub fn contestants(random: &mut Random) -> Vec<Contestant> {
                let system = Robot::new();
                vec![
                    independent(states(random)),
                    dependent(states(random)),
                    steps("Rk4", Rk4::new(&system), states(random)),
                    steps("Dop853", Dop853::new(&system), states(random)),
                    steps("Verner9", Verner9::new(&system), states(random)),
                ]
            }
        })*

        fn contestants(model: &str, random: &mut Random) -> Option<Vec<Contestant>> {
            match model {
                $(stringify!($name) => Some($name::contestants(random)),)*
                _ => None,
            }
        }

        const MODELS: &[&str] = &[$(stringify!($name)),*];
    };
}

models! { double_pendulum ur5 panda_arm }

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Uniform in -1..1.
    fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn shuffle<T>(&mut self, list: &mut [T]) {
        for k in (1..list.len()).rev() {
            list.swap(k, (self.bits() % (k as u64 + 1)) as usize);
        }
    }
}

/// Processor time of this process, ns: what others do on the machine is not counted.
fn now() -> f64 {
    #[repr(C)]
    struct Time {
        seconds: i64,
        nanoseconds: i64,
    }
    extern "C" {
        fn clock_gettime(clock: i32, time: *mut Time) -> i32;
    }
    let mut time = Time { seconds: 0, nanoseconds: 0 };
    // SAFETY: the layout is that of 64-bit Linux, whose clock 2 is the processor time of the process.
    unsafe { clock_gettime(2, &mut time) };
    1e9 * time.seconds as f64 + time.nanoseconds as f64
}

/// Products that wait for one another.
fn products() -> Contestant {
    let mut x = 1.0_f64;
    ("a product", Box::new(move || {
        for _ in 0..EVALUATIONS * 8 {
            x *= black_box(1.0);
        }
        black_box(&mut x);
        EVALUATIONS * 8
    }))
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let rounds = arguments.next().map_or(201, |n| n.parse().expect("a number of rounds"));
    let chosen: Vec<String> = arguments.collect();
    println!("{:<16} {:<12} {:>8} {:>8} {:>8} {:>10}", "model", "ns", "lower", "median", "upper", "dependent");
    for model in MODELS.iter().filter(|m| chosen.is_empty() || chosen.iter().any(|c| c == *m)) {
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let mut all = contestants(model, &mut random).expect("in the list");
        all.push(products());
        let mut times = vec![Vec::new(); all.len()];
        let mut order: Vec<usize> = (0..all.len()).collect();
        for _ in 0..rounds {
            random.shuffle(&mut order);
            for &k in &order {
                all[k].1(); // code and data back into the caches
                let begin = now();
                let mut done = 0;
                for _ in 0..8 {
                    done += all[k].1();
                }
                times[k].push((now() - begin) / done as f64);
            }
        }
        times.iter_mut().for_each(|t| t.sort_by(f64::total_cmp));
        let quartile = |k: usize, n: usize| times[k][(times[k].len() - 1) * n / 4];
        for (k, (name, _)) in all.iter().enumerate() {
            let [lower, median, upper] = [1, 2, 3].map(|n| quartile(k, n));
            let ratio = lower / quartile(1, 1);
            println!("{model:<16} {name:<12} {lower:>8.2} {median:>8.2} {upper:>8.2} {ratio:>10.2}");
        }
    }
}

//! `mbd-lab interpreter`: time of the interpreter's rates.
//!
//! The rates are called in two ways: with states that are ready before the first call, and with states of which each
//! is made of the results before it, as an explicit method of integration calls them.

use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

use mbd_cli::{Failure, Outcome};
use multibody::codegen::options::{PlanOptions, DEFAULT_SNAP};
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::Interpreter;

use crate::args::interpreter::InterpreterArgs;

/// Mechanisms: name, file, text, what a URDF's root is connected to.
const MECHANISMS: [(&str, &str, &str, Base); 7] = [
    ("double_pendulum", "double_pendulum.toml", include_str!("../../models/double_pendulum.toml"), Base::Fixed),
    ("ur5", "ur5.urdf", include_str!("../../models/ur5.urdf"), Base::Fixed),
    ("panda", "panda_arm.urdf", include_str!("../../models/panda_arm.urdf"), Base::Fixed),
    ("solo12", "solo12.urdf", include_str!("../../models/solo12.urdf"), Base::Floating),
    ("g1", "g1.urdf", include_str!("../../models/g1.urdf"), Base::Floating),
    ("chain100", "chain100.toml", include_str!("../../models/chain100.toml"), Base::Fixed),
    ("stewart", "stewart.toml", include_str!("../../models/mechanisms/stewart.toml"), Base::Fixed),
];

/// Least time of one measurement, s, and the number of them, of which the fastest counts.
const ROUND: f64 = 0.05;
const ROUNDS: usize = 12;

/// Runs the bench.
pub(crate) fn run(args: &InterpreterArgs, out: &mut dyn Write) -> Outcome {
    for name in &args.mechanisms {
        if !MECHANISMS.iter().any(|m| m.0 == name) {
            let all = MECHANISMS.map(|m| m.0).join(", ");
            return Err(Failure::new(format!("there is no mechanism `{name}`"), format!("one of {all}")));
        }
    }
    if args.calls.is_none() {
        writeln!(
            out,
            "| mechanism | velocities | rates a second, states ready | rates a second, one after the other |"
        )?;
        writeln!(out, "| --- | ---: | ---: | ---: |")?;
    }
    let chosen = |name: &str| args.mechanisms.is_empty() || args.mechanisms.iter().any(|m| m == name);
    for (name, file, text, base) in MECHANISMS.into_iter().filter(|m| chosen(m.0)) {
        let mut subject = Subject::new(plan(file, text, base, args.searched)?);
        match args.calls {
            Some(calls) => subject.ready(calls),
            None => {
                // The two ways take turns, so that they share the machine's quiet and busy times.
                let mut best = [0.0_f64; 2];
                for _ in 0..ROUNDS {
                    best[0] = best[0].max(speed(|calls| subject.ready(calls)));
                    best[1] = best[1].max(speed(|calls| subject.in_turn(calls)));
                }
                writeln!(out, "| {name} | {} | {:.0} | {:.0} |", subject.pd.len(), best[0], best[1])?;
                out.flush()?;
            }
        }
    }
    Ok(())
}

fn plan(file: &str, text: &str, base: Base, searched: bool) -> Outcome<Plan> {
    let import = ImportOptions { base, ..ImportOptions::default() };
    let reading = read::model(file, text, &import).map_err(|findings| {
        Failure::new(findings.to_string(), "mend the file of the mechanism and build the bench again")
    })?;
    Ok(match searched {
        true => search::plan(&reading.model, PlanOptions::default()),
        false => Plan::new(&reading.model, DEFAULT_SNAP),
    })
}

/// Calls a second.
fn speed(mut run: impl FnMut(u64)) -> f64 {
    let mut calls = 16;
    loop {
        let clock = Instant::now();
        run(calls);
        let seconds = clock.elapsed().as_secs_f64();
        if seconds > ROUND {
            return calls as f64 / seconds;
        }
        calls *= 2;
    }
}

/// A mechanism and its state.
struct Subject {
    interpreter: Interpreter<f64>,
    q: Vec<f64>,
    p: Vec<f64>,
    v: Vec<f64>,
    qd: Vec<f64>,
    pd: Vec<f64>,
}

impl Subject {
    fn new(plan: Plan) -> Subject {
        let interpreter = plan.interpreter(&plan.default_params());
        let mut q = plan.start();
        q.iter_mut().enumerate().filter(|(_, q)| **q == 0.0).for_each(|(k, q)| *q = 0.1 + 0.01 * k as f64);
        let p: Vec<f64> = (0..plan.dims.nv).map(|k| 0.05 + 0.001 * k as f64).collect();
        Subject { interpreter, v: p.clone(), qd: q.clone(), pd: p.clone(), q, p }
    }

    fn rates(&mut self) {
        let (q, p) = (black_box(&self.q), black_box(&self.p));
        self.interpreter.rates(q, p, &mut self.v, &mut self.qd, &mut self.pd);
    }

    /// Rates of the same state, all calls independent of one another.
    fn ready(&mut self, calls: u64) {
        (0..calls).for_each(|_| self.rates());
        black_box(&self.pd);
    }

    /// Rates of states that move by so little that they stay what they are, but wait for the results of the call before.
    fn in_turn(&mut self, calls: u64) {
        const LITTLE: f64 = 1e-300;
        for _ in 0..calls {
            self.rates();
            self.q.iter_mut().zip(&self.qd).for_each(|(q, qd)| *q += LITTLE * qd);
            self.p.iter_mut().zip(&self.pd).for_each(|(p, pd)| *p += LITTLE * pd);
        }
        black_box(&self.pd);
    }
}

//! Several rows at once, in vector registers: rollouts and outputs.

use multibody::codegen::jit::{best_lanes, CompileError, Compiled, CompiledLanes};
use multibody::codegen::output::Output;
use multibody::runtime::integrate::{Euler, Midpoint, Rk4, Stepper};
use multibody::runtime::{Packed, Scalar, System};

use crate::arrays::Rows;
use crate::driver::{begin, complete, rates_tell_velocities};
use crate::rollout::{Item, Motion, State};
use crate::rows::Beat;

/// Several states at once, as many as the vectors of the processor have numbers or fewer.
#[derive(Clone)]
pub enum AnyLanes {
    /// Vectors of 16 bytes.
    Two(CompiledLanes<2>),
    /// Of 32.
    Four(CompiledLanes<4>),
    /// Of 64.
    Eight(CompiledLanes<8>),
}

impl AnyLanes {
    /// `most` states or more, if there are such vectors. `None` where the mechanism is too large.
    pub fn new(of: &Compiled, most: usize) -> Option<AnyLanes> {
        let eight = || of.lanes().ok().map(AnyLanes::Eight);
        let four = || of.lanes().ok().map(AnyLanes::Four);
        let best = match most.min(best_lanes()).next_power_of_two() {
            8 => eight().or_else(four),
            4 => four(),
            _ => None,
        };
        best.or_else(|| of.lanes().ok().map(AnyLanes::Two))
    }

    /// Compiles an output.
    ///
    /// # Errors
    /// Those of the compiler.
    pub fn prepare(&mut self, output: Output) -> Result<(), CompileError> {
        match self {
            AnyLanes::Two(lanes) => lanes.prepare(output),
            AnyLanes::Four(lanes) => lanes.prepare(output),
            AnyLanes::Eight(lanes) => lanes.prepare(output),
        }
    }

    /// Number of states.
    pub fn width(&self) -> usize {
        match self {
            AnyLanes::Two(_) => 2,
            AnyLanes::Four(_) => 4,
            AnyLanes::Eight(_) => 8,
        }
    }
}

type Method<const L: usize> = Box<dyn Stepper<CompiledLanes<L>>>;

/// The methods whose steps do not depend on what the states are.
fn method<const L: usize>(name: &str, lanes: &CompiledLanes<L>) -> Option<Method<L>> {
    Some(match name {
        "euler" => Box::new(Euler::new(lanes)),
        "midpoint" => Box::new(Midpoint::new(lanes)),
        "rk4" => Box::new(Rk4::new(lanes)),
        _ => return None,
    })
}

/// Whether rows of these settings can be computed several at once.
pub fn possible(method: &str, tolerance: Option<f64>) -> bool {
    tolerance.is_none() && ["euler", "midpoint", "rk4"].contains(&method)
}

/// States side by side.
struct Block<const L: usize> {
    q: Vec<Packed<L>>,
    p: Vec<Packed<L>>,
    v: Vec<Packed<L>>,
}

/// States that are kept before they are written: each row then gets a run of its memory at once.
const KEPT: usize = 16;

/// The last of the states that are recorded, one after the other: coordinates, and velocities or momenta.
struct Record<const L: usize> {
    q: Vec<Packed<L>>,
    second: Vec<Packed<L>>,
    /// Number of states that it holds, and of those that are written.
    kept: usize,
    written: usize,
}

fn pack<const L: usize>(lanes: &mut [Packed<L>], lane: usize, from: &[f64]) {
    lanes.iter_mut().zip(from).for_each(|(to, from)| to.0[lane] = *from);
}

fn unpack<const L: usize>(lanes: &[Packed<L>], lane: usize, to: &mut [f64]) {
    to.iter_mut().zip(lanes).for_each(|(to, from)| *to = from.0[lane]);
}

impl Motion<'_> {
    /// Computes as many rows as there are lanes, or fewer. `None` where one of them fails: they have to be computed one by
    /// one.
    pub fn rows_at_once(
        &self,
        machine: &mut Compiled,
        lanes: &mut AnyLanes,
        items: &mut [Item],
        beat: &mut Beat,
    ) -> Option<()> {
        match lanes {
            AnyLanes::Two(lanes) => self.rows_in_lanes(machine, lanes, items, beat),
            AnyLanes::Four(lanes) => self.rows_in_lanes(machine, lanes, items, beat),
            AnyLanes::Eight(lanes) => self.rows_in_lanes(machine, lanes, items, beat),
        }
    }

    fn rows_in_lanes<const L: usize>(
        &self,
        machine: &mut Compiled,
        lanes: &mut CompiledLanes<L>,
        items: &mut [Item],
        beat: &mut Beat,
    ) -> Option<()> {
        let mut block = Block { q: lanes.neutral(), p: lanes.zero_momenta(), v: lanes.zero_momenta() };
        let mut states = Vec::with_capacity(L);
        for (lane, (k, ..)) in items.iter().enumerate() {
            self.fields.iter().for_each(|(field, rows)| machine.set_field(*field, rows.row(*k)));
            machine.efforts().fill(0.0);
            let state = self.begin(machine, *k).ok()?;
            // Lengths of quaternions are only seen of the first lane.
            self.check_units(machine, &state.q).ok()?;
            // Lanes without a row compute the last one once more.
            let end = if lane + 1 == items.len() { L } else { lane + 1 };
            for lane in lane..end {
                lanes.take_inputs(lane, machine);
                pack(&mut block.q, lane, &state.q);
                pack(&mut block.p, lane, &state.p);
            }
            states.push(state);
        }
        let mut method = method(&self.settings.method, lanes)?;
        let (h, mut record) = (Packed::constant(self.settings.dt), Record::new(&block));
        let told = rates_tell_velocities(self.settings, lanes);
        for step in 0..=self.settings.steps {
            let (t, ends) = (Packed::constant(step as f64 * self.settings.dt), step == self.settings.steps);
            for (lane, (k, ..)) in items.iter().enumerate() {
                let (Some(u), false) = (self.u, ends) else { break };
                let u = &u.row(*k)[step * self.sizes.1..(step + 1) * self.sizes.1];
                let Some(layout) = self.layout else {
                    lanes.set_efforts(lane, u);
                    continue;
                };
                let State { q, v: tau, .. } = &mut states[lane];
                unpack(&block.q, lane, q);
                layout.v_from(q, u, tau);
                lanes.set_efforts(lane, tau);
            }
            let recorded = step.is_multiple_of(self.settings.every);
            if recorded {
                if told {
                    let rates = begin(&mut *method, lanes, t, &block.q, &block.p).ok()?;
                    block.v.copy_from_slice(&rates.x);
                } else if !self.settings.momenta {
                    lanes.velocities(&block.q, &block.p, &mut block.v);
                }
                record.keep(&block.q, if self.settings.momenta { &block.p } else { &block.v });
                if record.kept == KEPT {
                    self.write_rows(&mut record, &mut states, items);
                }
            }
            if ends || !beat.goes_on() {
                break;
            }
            match told && recorded {
                true => complete(&mut *method, lanes, (t, h), &mut block.q, &mut block.p).ok()?,
                false => method.step(lanes, t, h, &mut block.q, &mut block.p).ok()?,
            }
        }
        self.write_rows(&mut record, &mut states, items);
        Some(())
    }

    /// Writes the states that are kept to the rows of the results.
    fn write_rows<const L: usize>(&self, record: &mut Record<L>, states: &mut [State], items: &mut [Item]) {
        let (nq, nv) = self.sizes;
        let (first, end) = (record.written, record.written + record.kept);
        for (lane, ((_, q, v), state)) in items.iter_mut().zip(states).enumerate() {
            let (q, v) = (&mut q[first * nq..end * nq], &mut v[first * nv..end * nv]);
            let Some(layout) = self.layout else {
                unpack(&record.q, lane, q);
                unpack(&record.second, lane, v);
                continue;
            };
            let kept = record.q.chunks(state.q.len().max(1)).zip(record.second.chunks(state.v.len().max(1)));
            for ((q, v), kept) in q.chunks_mut(nq.max(1)).zip(v.chunks_mut(nv.max(1))).zip(kept) {
                unpack(kept.0, lane, &mut state.q);
                unpack(kept.1, lane, &mut state.v);
                layout.q_to(&state.q, q);
                layout.v_to(&state.q, &state.v, v);
            }
        }
        (record.kept, record.written) = (0, end);
    }
}

impl<const L: usize> Record<L> {
    /// With memory for states of this length.
    fn new(of: &Block<L>) -> Self {
        let memory = |len: usize| vec![Packed::zero(); KEPT * len];
        Record { q: memory(of.q.len()), second: memory(of.v.len()), kept: 0, written: 0 }
    }

    /// Keeps a state; there is room for it.
    fn keep(&mut self, q: &[Packed<L>], second: &[Packed<L>]) {
        let (n, m) = (q.len(), second.len());
        self.q[self.kept * n..(self.kept + 1) * n].copy_from_slice(q);
        self.second[self.kept * m..(self.kept + 1) * m].copy_from_slice(second);
        self.kept += 1;
    }
}

/// Entries that are written to one row after the other, as many as fill a cache line.
const LINE: usize = 8;

/// Computes an output of `count` rows, `L` of them at a time: `fields` are the inputs beside the arguments. `results` have
/// one row after the other.
fn evaluate_in_lanes<const L: usize>(
    lanes: &mut CompiledLanes<L>,
    output: Output,
    (arguments, fields): (&[Rows], &[(usize, Rows)]),
    count: usize,
    results: &mut [&mut [f64]],
) -> Result<(), CompileError> {
    let lengths: Vec<usize> = results.iter().map(|all| all.len() / count).collect();
    let memory = |len: usize| vec![Packed::<L>::zero(); len];
    let mut given: Vec<Vec<Packed<L>>> = arguments.iter().map(|rows| memory(rows.row(0).len())).collect();
    let mut found: Vec<Vec<Packed<L>>> = lengths.iter().map(|len| memory(*len)).collect();
    for begin in (0..count).step_by(L) {
        for lane in 0..L {
            // Lanes without a row compute the last one once more.
            let row = (begin + lane).min(count - 1);
            fields.iter().for_each(|(field, rows)| lanes.set_field(lane, *field, rows.row(row)));
            arguments.iter().zip(&mut given).for_each(|(rows, to)| pack(to, lane, rows.row(row)));
        }
        let given: Vec<&[Packed<L>]> = given.iter().map(Vec::as_slice).collect();
        let mut places: Vec<&mut [Packed<L>]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        lanes.evaluate(output, &given, &mut places)?;
        for ((to, from), len) in results.iter_mut().zip(&found).zip(&lengths) {
            let to = &mut to[begin * len..((begin + L).min(count)) * len];
            for (block, from) in from.chunks(LINE).enumerate() {
                let at = block * LINE;
                let rows = to.chunks_exact_mut(*len).enumerate();
                rows.for_each(|(lane, to)| unpack(from, lane, &mut to[at..at + from.len()]));
            }
        }
    }
    Ok(())
}

impl AnyLanes {
    /// Computes an output of `count` rows.
    ///
    /// # Errors
    /// Those of the compiler.
    pub fn evaluate(
        &mut self,
        output: Output,
        given: (&[Rows], &[(usize, Rows)]),
        count: usize,
        results: &mut [&mut [f64]],
    ) -> Result<(), CompileError> {
        match self {
            AnyLanes::Two(lanes) => evaluate_in_lanes(lanes, output, given, count, results),
            AnyLanes::Four(lanes) => evaluate_in_lanes(lanes, output, given, count, results),
            AnyLanes::Eight(lanes) => evaluate_in_lanes(lanes, output, given, count, results),
        }
    }
}

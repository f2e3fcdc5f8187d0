//! Several rows at once, in vector registers.

use multibody::codegen::jit::{Compiled, CompiledLanes, LANES};
use multibody::runtime::integrate::{Euler, Midpoint, Rk4, Stepper};
use multibody::runtime::{Packed, Scalar, System};

use crate::machines::set;
use crate::rollout::{Item, Motion, State};
use crate::rows::Beat;

type Method = Box<dyn Stepper<CompiledLanes>>;

/// The methods whose steps do not depend on what the states are.
fn method(name: &str, lanes: &CompiledLanes) -> Option<Method> {
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
struct Block {
    q: Vec<Packed<LANES>>,
    p: Vec<Packed<LANES>>,
    v: Vec<Packed<LANES>>,
}

fn pack(lanes: &mut [Packed<LANES>], lane: usize, from: &[f64]) {
    lanes.iter_mut().zip(from).for_each(|(to, from)| to.0[lane] = *from);
}

fn unpack(lanes: &[Packed<LANES>], lane: usize, to: &mut [f64]) {
    to.iter_mut().zip(lanes).for_each(|(to, from)| *to = from.0[lane]);
}

impl Motion<'_> {
    /// Computes as many rows as there are lanes. `None` where one of them fails: they have to be computed one by one.
    pub fn rows_at_once(
        &self,
        (machine, lanes): (&mut Compiled, &mut CompiledLanes),
        items: &mut [Item; LANES],
        beat: &mut Beat,
    ) -> Option<()> {
        let mut block = Block { q: lanes.neutral(), p: lanes.zero_momenta(), v: lanes.zero_momenta() };
        let mut states = Vec::with_capacity(LANES);
        for (lane, (k, ..)) in items.iter().enumerate() {
            self.fields.iter().for_each(|(field, rows)| set(machine, *field, rows.row(*k)));
            machine.inputs().tau.fill(0.0);
            lanes.take_inputs(lane, machine);
            let state = self.begin(machine, *k).ok()?;
            // Lengths of quaternions are only seen of the first lane.
            self.check_units(machine, &state.q).ok()?;
            pack(&mut block.q, lane, &state.q);
            pack(&mut block.p, lane, &state.p);
            states.push(state);
        }
        let mut method = method(&self.settings.method, lanes)?;
        let (h, mut written) = (Packed::constant(self.settings.dt), 0);
        for step in 0..=self.settings.steps {
            if step.is_multiple_of(self.settings.every) {
                self.store_block(lanes, &mut block, &mut states, items, written);
                written += 1;
            }
            if step == self.settings.steps || !beat.goes_on() {
                break;
            }
            for (lane, (k, ..)) in items.iter().enumerate() {
                let Some(u) = self.u else { break };
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
            let t = Packed::constant(step as f64 * self.settings.dt);
            method.step(lanes, t, h, &mut block.q, &mut block.p).ok()?;
        }
        Some(())
    }

    /// Writes the states as rows of the results.
    fn store_block(
        &self,
        lanes: &mut CompiledLanes,
        block: &mut Block,
        states: &mut [State],
        items: &mut [Item; LANES],
        written: usize,
    ) {
        if !self.settings.momenta {
            lanes.velocities(&block.q, &block.p, &mut block.v);
        }
        let second = if self.settings.momenta { &block.p } else { &block.v };
        let (nq, nv) = self.sizes;
        for (lane, ((_, q, v), state)) in items.iter_mut().zip(states).enumerate() {
            let (q, v) = (&mut q[written * nq..(written + 1) * nq], &mut v[written * nv..(written + 1) * nv]);
            match self.layout {
                None => {
                    unpack(&block.q, lane, q);
                    unpack(second, lane, v);
                }
                Some(layout) => {
                    unpack(&block.q, lane, &mut state.q);
                    unpack(second, lane, &mut state.v);
                    layout.q_to(&state.q, q);
                    layout.v_to(&state.q, &state.v, v);
                }
            }
        }
    }
}

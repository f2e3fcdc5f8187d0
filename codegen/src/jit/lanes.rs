//! Several states of one mechanism at once, in vector registers.

use std::sync::Arc;

use mbd_runtime::system::{LieJoint, Part, System};
use mbd_runtime::{Interpreter, Packed, Scalar};

use super::compiled::Shared;
use super::instructions::{ARGUMENTS, INPUTS};
use super::memory::MachineCode;
use super::{CompileError, Compiled};
use crate::output::{Output, FIELDS};

/// Number of states that are computed at once: the doubles of a vector of 16 bytes, the longest that machine code made at
/// run time has.
pub const LANES: usize = 2;

/// Numbers of all states.
type Lanes = Packed<LANES>;

/// The machine code of several states.
#[derive(Debug)]
pub(super) struct LanesCode {
    rates: MachineCode<f64>,
    velocities: MachineCode<f64>,
    coordinate_rates: MachineCode<f64>,
}

/// [`LANES`] states of a mechanism at once, for methods of integration: a [`System`] over [`Packed`]. Every state has the
/// bits that [`Compiled`] gives it.
#[derive(Clone, Debug)]
pub struct CompiledLanes {
    shared: Arc<Shared<f64>>,
    /// Names of parts, joints on Lie groups.
    interpreter: Interpreter<f64>,
    neutral: Vec<Lanes>,
    /// Arguments, then fields: [`LANES`] numbers for each entry.
    inputs: [Vec<f64>; INPUTS],
    results: [Vec<f64>; 2],
    scratch: Vec<f64>,
}

impl Compiled<f64> {
    /// Several states at once, with the inputs of this one.
    ///
    /// # Errors
    /// [`CompileError`]; it is `TooLarge` where [`Compiled`] uses the interpreter.
    pub fn lanes(&self) -> Result<CompiledLanes, CompileError> {
        let shared = &self.shared;
        let make = || {
            Ok(LanesCode {
                rates: shared.compiled(Output::Rates, LANES)?,
                velocities: shared.compiled(Output::Velocities, LANES)?,
                coordinate_rates: shared.compiled_coordinate_rates(LANES)?,
            })
        };
        let code = shared.lanes.get_or_init(make).as_ref().map_err(CompileError::clone)?;
        let scratch = code.rates.scratch().max(code.velocities.scratch()).max(code.coordinate_rates.scratch());
        let sizes = self.sizes();
        let mut lanes = CompiledLanes {
            shared: shared.clone(),
            neutral: self.interpreter.neutral().into_iter().map(Lanes::constant).collect(),
            interpreter: self.interpreter.clone(),
            inputs: Default::default(),
            results: [vec![0.0; LANES * sizes.nq], vec![0.0; LANES * sizes.nv]],
            scratch: vec![0.0; scratch],
        };
        (0..LANES).for_each(|lane| lanes.take_inputs(lane, self));
        Ok(lanes)
    }
}

impl CompiledLanes {
    /// Gives a lane the inputs and parameters of a mechanism of the same model.
    pub fn take_inputs(&mut self, lane: usize, of: &Compiled<f64>) {
        let Interpreter { tau, drive_q, drive_v, drive_a, wrenches, gravity, .. } = &of.interpreter;
        let gravity = if of.sizes().gravity > 0 { &gravity[..] } else { &[] };
        // In the order of the table of fields.
        let fields: [&[f64]; FIELDS.len()] =
            [tau, drive_q, drive_v, drive_a, wrenches.as_flattened(), of.parameters(), &of.acts, gravity];
        for (to, from) in self.inputs[ARGUMENTS..].iter_mut().zip(fields) {
            set(to, lane, from);
        }
    }

    /// Sets the joint forces of a lane, `nv` numbers, N m or N.
    pub fn set_efforts(&mut self, lane: usize, tau: &[f64]) {
        set(&mut self.inputs[ARGUMENTS], lane, tau);
    }

    /// Velocities from momenta, `(q, p) → v`.
    pub fn velocities(&mut self, q: &[Lanes], p: &[Lanes], v: &mut [Lanes]) {
        let CompiledLanes { shared, inputs, results, scratch, .. } = self;
        let Some(Ok(code)) = shared.lanes.get() else { return };
        call(&code.velocities, inputs, [q, p], (results, &mut [&mut [], v]), scratch);
    }
}

/// Calls machine code: copies in, copies out.
fn call(
    code: &MachineCode<f64>,
    inputs: &mut [Vec<f64>; INPUTS],
    arguments: [&[Lanes]; 2],
    (results, out): (&mut [Vec<f64>; 2], &mut [&mut [Lanes]; 2]),
    scratch: &mut [f64],
) {
    for (to, from) in inputs.iter_mut().zip(arguments) {
        to.resize(LANES * from.len(), 0.0);
        to.as_chunks_mut().0.iter_mut().zip(from).for_each(|(to, from)| *to = from.0);
    }
    let given: [&[f64]; INPUTS] = std::array::from_fn(|k| &inputs[k][..]);
    let [first, second] = results;
    match (out[0].is_empty(), out[1].is_empty()) {
        (false, false) => code.call(&given, &mut [&mut first[..], &mut second[..]], scratch),
        (false, true) => code.call(&given, &mut [&mut first[..]], scratch),
        _ => code.call(&given, &mut [&mut second[..]], scratch),
    }
    for (to, from) in out.iter_mut().zip([&*first, &*second]) {
        to.iter_mut().zip(from.as_chunks().0).for_each(|(to, from)| *to = Packed(*from));
    }
}

/// Writes one lane of an array.
fn set(to: &mut Vec<f64>, lane: usize, from: &[f64]) {
    to.resize(LANES * from.len(), 0.0);
    to.chunks_exact_mut(LANES).zip(from).for_each(|(to, from)| to[lane] = *from);
}

impl System for CompiledLanes {
    type Scalar = Lanes;
    type Coordinates = Vec<Lanes>;
    type Momenta = Vec<Lanes>;

    fn neutral(&self) -> Vec<Lanes> {
        self.neutral.clone()
    }

    fn zero_momenta(&self) -> Vec<Lanes> {
        vec![Lanes::zero(); self.results[1].len() / LANES]
    }

    fn lie_joints(&self) -> &[LieJoint] {
        self.interpreter.lie_joints()
    }

    fn rates_at(&mut self, _t: Lanes, q: &Vec<Lanes>, p: &Vec<Lanes>, qd: &mut Vec<Lanes>, pd: &mut Vec<Lanes>) {
        let CompiledLanes { shared, inputs, results, scratch, .. } = self;
        let Some(Ok(code)) = shared.lanes.get() else { return };
        call(&code.rates, inputs, [q, p], (results, &mut [&mut qd[..], &mut pd[..]]), scratch);
    }

    fn part_name(&self, part: Part) -> Option<&str> {
        self.interpreter.part_name(part)
    }

    fn coordinate_rates(&self, q: &Vec<Lanes>, v: &Vec<Lanes>, qd: &mut Vec<Lanes>) {
        let Some(Ok(code)) = self.shared.lanes.get() else { return };
        let (mut inputs, mut results) = (self.inputs.clone(), self.results.clone());
        let mut scratch = vec![0.0; code.coordinate_rates.scratch()];
        call(&code.coordinate_rates, &mut inputs, [q, v], (&mut results, &mut [&mut qd[..], &mut []]), &mut scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{Arithmetic, Options, PlanOptions, RolledCode};
    use crate::plan::Plan;
    use crate::read::{model, ImportOptions};
    use crate::sample::State;

    /// Both lanes have the bits of single states: of a tree, of a chain in rolled code, with parameters, with loops.
    #[test]
    fn lanes_have_the_bits_of_single_states() {
        for (file, text, rolled) in [
            ("solo12.urdf", include_str!("../../../models/solo12.urdf"), RolledCode::Auto),
            ("chain100.toml", include_str!("../../../models/chain100.toml"), RolledCode::Always),
            ("satellite.toml", include_str!("../../../models/satellite.toml"), RolledCode::Auto),
            ("stewart.toml", include_str!("../../../models/mechanisms/stewart.toml"), RolledCode::Auto),
        ] {
            for arithmetic in Arithmetic::ALL {
                let base = if file.ends_with("urdf") { crate::read::Base::Floating } else { Default::default() };
                let import = ImportOptions { base, ..ImportOptions::default() };
                let model = model(file, text, &import).expect("a sound model").model;
                let options = Options { arithmetic, ..Options::default() };
                let quick = PlanOptions { rolled, ..PlanOptions::quick() };
                let plan = crate::search::plan(&model, quick);
                compare(file, Compiled::from_plan(plan.clone(), options).expect("machine code"), &plan);
            }
        }
    }

    fn compare(file: &str, mut single: Compiled, plan: &Plan) {
        let mut lanes = single.lanes().expect("machine code for lanes");
        let states: Vec<State> = (0..LANES as u64).map(|seed| State::new(plan, seed)).collect();
        let mut wanted = Vec::new();
        for (lane, state) in states.iter().enumerate() {
            state.set_inputs(plan, single.inputs(), true);
            lanes.take_inputs(lane, &single);
            // One lane has an angle for which the main path of sines is not made.
            let mut q = state.q.clone();
            if lane == 1 && single.lie_joints().is_empty() {
                q[0] = 1e9;
            }
            let (mut v, mut qd, mut pd) = (single.zero_momenta(), q.clone(), single.zero_momenta());
            single.rates(&q, &state.v, &mut v, &mut qd, &mut pd);
            let mut turned = q.clone();
            single.coordinate_rates(&q, &v, &mut turned);
            wanted.push((q, state.v.clone(), v, qd, pd, turned));
        }
        let pack = |of: fn(&Wanted) -> &Vec<f64>| -> Vec<Lanes> {
            (0..of(&wanted[0]).len()).map(|k| Packed(std::array::from_fn(|l| of(&wanted[l])[k]))).collect()
        };
        let (q, p) = (pack(|w| &w.0), pack(|w| &w.1));
        let (mut v, mut qd, mut pd) = (lanes.zero_momenta(), lanes.neutral(), lanes.zero_momenta());
        lanes.velocities(&q, &p, &mut v);
        lanes.rates_at(Lanes::zero(), &q, &p, &mut qd, &mut pd);
        assert_eq!((&v, &qd, &pd), (&pack(|w| &w.2), &pack(|w| &w.3), &pack(|w| &w.4)), "{file}");
        let mut turned = q.clone();
        lanes.coordinate_rates(&q, &v, &mut turned);
        assert_eq!(turned, pack(|w| &w.5), "{file}");
    }

    /// Coordinates, momenta, velocities, rates of both, coordinate rates of the velocities.
    type Wanted = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);
}

//! Several states of one mechanism at once, in vector registers.

use std::sync::{Arc, OnceLock};

use mbd_runtime::system::{LieJoint, Part, System};
use mbd_runtime::{Interpreter, Packed, Scalar};

use super::compiled::Shared;
use super::instructions::{ARGUMENTS, INPUTS};
use super::memory::{numbers, numbers_mut, MachineCode, RESULTS};
use super::vectors::Width;
use super::{CompileError, Compiled};
use crate::output::{Output, FIELDS};

/// Numbers of states that can be computed at once, in vectors of 16, 32 and 64 bytes.
const WIDTHS: [usize; 3] = [2, 4, 8];

/// Number of states that are best computed at once: eight where the processor has AVX-512, four where it has AVX2 and FMA,
/// otherwise two.
pub fn best_lanes() -> usize {
    WIDTHS.into_iter().filter(|lanes| Width::of_lanes(*lanes).is_some()).max().unwrap_or(WIDTHS[0])
}

/// Code of a function, once somebody has asked for it.
type Made = OnceLock<Result<MachineCode<f64>, CompileError>>;

/// The machine code of several states, for each of [`WIDTHS`].
#[derive(Debug, Default)]
pub(super) struct AllLanes([OfWidth; WIDTHS.len()]);

#[derive(Debug, Default)]
struct OfWidth {
    /// One for each of [`Output::ALL`].
    outputs: [Made; Output::ALL.len()],
    coordinate_rates: Made,
}

impl AllLanes {
    fn of_width(&self, lanes: usize) -> Option<&OfWidth> {
        let known = lanes == WIDTHS[0] || Width::of_lanes(lanes).is_some();
        self.0.get(WIDTHS.iter().position(|width| *width == lanes).filter(|_| known)?)
    }
}

/// `L` states of a mechanism at once: every output, and for methods of integration a [`System`] over [`Packed`]. `L` is
/// 2, or up to [`best_lanes`] 4 or 8. Every state has the bits that [`Compiled`] gives it.
#[derive(Clone, Debug)]
pub struct CompiledLanes<const L: usize> {
    shared: Arc<Shared<f64>>,
    /// Names of parts, joints on Lie groups.
    interpreter: Interpreter<f64>,
    neutral: Vec<Packed<L>>,
    /// The fields: `L` numbers for each entry.
    fields: [Vec<f64>; FIELDS.len()],
    sizes: [usize; 2],
    scratch: Vec<f64>,
}

impl Compiled<f64> {
    /// Several states at once, with the inputs of this one.
    ///
    /// # Errors
    /// [`CompileError`]; it is `TooLarge` where [`Compiled`] uses the interpreter, and `Machine` where the processor has
    /// no vectors of `L` numbers, or where prescribed joints follow a motion ([`Compiled::set_drives`]), which lanes do not know.
    pub fn lanes<const L: usize>(&self) -> Result<CompiledLanes<L>, CompileError> {
        if self.is_driven() {
            return Err(CompileError::machine("several states at once cannot follow a prescribed motion"));
        }
        let shared = &self.shared;
        let sizes = self.sizes();
        let mut lanes = CompiledLanes {
            shared: shared.clone(),
            neutral: self.interpreter.neutral().into_iter().map(Packed::constant).collect(),
            interpreter: self.interpreter.clone(),
            fields: Default::default(),
            sizes: [sizes.nq, sizes.nv],
            scratch: Vec::new(),
        };
        lanes.prepare(Output::Rates)?;
        lanes.prepare(Output::Velocities)?;
        shared.coordinate_rates_in_lanes(L)?;
        (0..L).for_each(|lane| lanes.take_inputs(lane, self));
        Ok(lanes)
    }

    /// The fields, in the order of their table.
    pub(super) fn fields(&self) -> [&[f64]; FIELDS.len()] {
        let Interpreter { tau, drive_q, drive_v, drive_a, wrenches, gravity, .. } = &self.interpreter;
        let gravity = if self.sizes().gravity > 0 { &gravity[..] } else { &[] };
        [tau, drive_q, drive_v, drive_a, wrenches.as_flattened(), self.parameters(), &self.acts, gravity]
    }
}

impl<const L: usize> CompiledLanes<L> {
    /// Gives a lane the inputs and parameters of a mechanism of the same model; prescribed joints stay where they are there.
    pub fn take_inputs(&mut self, lane: usize, of: &Compiled<f64>) {
        for (to, from) in self.fields.iter_mut().zip(of.fields()) {
            set::<L>(to, lane, from);
        }
    }

    /// Sets the joint forces of a lane, `nv` numbers, N m or N.
    pub fn set_efforts(&mut self, lane: usize, tau: &[f64]) {
        set::<L>(&mut self.fields[0], lane, tau);
    }

    /// Sets a field of the functions ([`FIELDS`], by its number) of a lane.
    pub fn set_field(&mut self, lane: usize, field: usize, row: &[f64]) {
        set::<L>(&mut self.fields[field], lane, row);
    }

    /// Compiles an output now, in place of at its first evaluation.
    ///
    /// # Errors
    /// [`CompileError`]; it is `TooLarge` where [`Compiled`] uses the interpreter.
    pub fn prepare(&self, output: Output) -> Result<(), CompileError> {
        self.shared.in_lanes(output, L).map(|_| ())
    }

    /// Computes an output of all states: its arguments and results are those of the generated function ([`Output::spec`]),
    /// as flat slices.
    ///
    /// # Errors
    /// As of [`CompiledLanes::prepare`].
    ///
    /// # Panics
    /// If an array has another length than that of the function.
    pub fn evaluate(
        &mut self,
        output: Output,
        arguments: &[&[Packed<L>]],
        results: &mut [&mut [Packed<L>]],
    ) -> Result<(), CompileError> {
        let CompiledLanes { shared, fields, scratch, .. } = self;
        let code = shared.in_lanes(output, L)?;
        if scratch.len() < code.scratch() {
            scratch.resize(code.scratch(), 0.0);
        }
        call(code, || shared.without_early_rows(output), (arguments, fields), results, scratch);
        Ok(())
    }

    /// Velocities from momenta, `(q, p) → v`.
    pub fn velocities(&mut self, q: &[Packed<L>], p: &[Packed<L>], v: &mut [Packed<L>]) {
        let done = self.evaluate(Output::Velocities, &[q, p], &mut [v]);
        debug_assert!(done.is_ok(), "the code was made with the lanes");
    }
}

impl Shared<f64> {
    fn of_width(&self, lanes: usize) -> Result<&OfWidth, CompileError> {
        let none = || CompileError::machine(format!("there are no vectors of {lanes} numbers"));
        self.lanes.of_width(lanes).ok_or_else(none)
    }

    /// The code of an output for several states, made when it is first asked for.
    pub(super) fn in_lanes(&self, output: Output, lanes: usize) -> Result<&MachineCode<f64>, CompileError> {
        let make = || self.compiled(output, lanes);
        // The list has the order of the enumeration.
        self.of_width(lanes)?.outputs[output as usize].get_or_init(make).as_ref().map_err(CompileError::clone)
    }

    fn coordinate_rates_in_lanes(&self, lanes: usize) -> Result<&MachineCode<f64>, CompileError> {
        let make = || self.compiled_coordinate_rates(lanes);
        self.of_width(lanes)?.coordinate_rates.get_or_init(make).as_ref().map_err(CompileError::clone)
    }
}

/// Calls machine code with arguments and fields, or that of one state for one after the other.
fn call<'a, const L: usize>(
    code: &MachineCode<f64>,
    one: impl FnOnce() -> Option<&'a MachineCode<f64>>,
    (arguments, fields): (&[&[Packed<L>]], &[Vec<f64>; FIELDS.len()]),
    results: &mut [&mut [Packed<L>]],
    scratch: &mut [f64],
) {
    let mut given: [&[f64]; INPUTS] = [&[]; INPUTS];
    for (to, from) in given.iter_mut().zip(arguments) {
        *to = numbers(from);
    }
    for (to, from) in given[ARGUMENTS..].iter_mut().zip(fields) {
        *to = from;
    }
    let (n, mut places): (usize, [&mut [f64]; RESULTS]) = (results.len(), Default::default());
    for (to, from) in places.iter_mut().zip(results.iter_mut()) {
        *to = numbers_mut(from);
    }
    let done = code.call(&given, &mut places[..n], scratch);
    // Too large angles: its code is made of the same program.
    if let (false, Some(one)) = (done, one()) {
        one_by_one::<L>(one, &given, results);
    }
}

/// Computes the states one after the other.
#[cold]
fn one_by_one<const L: usize>(code: &MachineCode<f64>, given: &[&[f64]; INPUTS], results: &mut [&mut [Packed<L>]]) {
    let mut scratch = vec![0.0; code.scratch()];
    for lane in 0..L {
        let of_lane = given.map(|all| all.iter().skip(lane).step_by(L).copied().collect::<Vec<f64>>());
        let mut found: Vec<Vec<f64>> = results.iter().map(|all| vec![0.0; all.len()]).collect();
        let mut places: Vec<&mut [f64]> = found.iter_mut().map(|all| &mut all[..]).collect();
        let given: [&[f64]; INPUTS] = std::array::from_fn(|k| &of_lane[k][..]);
        code.call(&given, &mut places, &mut scratch);
        for (to, from) in results.iter_mut().zip(found) {
            to.iter_mut().zip(from).for_each(|(to, from)| to.0[lane] = from);
        }
    }
}

/// Writes one lane of an array.
fn set<const L: usize>(to: &mut Vec<f64>, lane: usize, from: &[f64]) {
    to.resize(L * from.len(), 0.0);
    to.chunks_exact_mut(L).zip(from).for_each(|(to, from)| to[lane] = *from);
}

impl<const L: usize> System for CompiledLanes<L> {
    type Scalar = Packed<L>;
    type Coordinates = Vec<Packed<L>>;
    type Momenta = Vec<Packed<L>>;

    fn neutral(&self) -> Vec<Packed<L>> {
        self.neutral.clone()
    }

    fn zero_momenta(&self) -> Vec<Packed<L>> {
        vec![Packed::zero(); self.sizes[1]]
    }

    fn lie_joints(&self) -> &[LieJoint] {
        self.interpreter.lie_joints()
    }

    fn rates_at(
        &mut self,
        _t: Packed<L>,
        q: &Vec<Packed<L>>,
        p: &Vec<Packed<L>>,
        qd: &mut Vec<Packed<L>>,
        pd: &mut Vec<Packed<L>>,
    ) {
        let done = self.evaluate(Output::Rates, &[q, p], &mut [qd, pd]);
        debug_assert!(done.is_ok(), "the code was made with the lanes");
    }

    fn part_name(&self, part: Part) -> Option<&str> {
        self.interpreter.part_name(part)
    }

    fn coordinate_rates(&self, q: &Vec<Packed<L>>, v: &Vec<Packed<L>>, qd: &mut Vec<Packed<L>>) {
        let Ok(code) = self.shared.coordinate_rates_in_lanes(L) else { return };
        let mut scratch = vec![0.0; code.scratch()];
        let one = || self.shared.coordinate_rates().ok();
        call(code, one, (&[&q[..], &v[..]], &self.fields), &mut [&mut qd[..]], &mut scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{Arithmetic, Options, PlanOptions, RolledCode};
    use crate::plan::Plan;
    use crate::read::{model, ImportOptions};
    use crate::sample::State;
    use mbd_runtime::contact::Reducible;
    use mbd_runtime::system::Conjugate;

    /// All lanes have the bits of single states: of a tree, of a chain in rolled code, with parameters, with loops.
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
                let single = Compiled::from_plan(plan.clone(), options).expect("machine code");
                compare::<2>(file, single.clone(), &plan);
                if best_lanes() >= 4 {
                    compare::<4>(file, single.clone(), &plan);
                }
                if best_lanes() >= 8 {
                    compare::<8>(file, single, &plan);
                }
            }
        }
    }

    /// A robot whose feet stand, whose code for one state has early rows, takes angles beyond the main path of sines in lanes.
    #[test]
    fn lanes_of_a_robot_that_stands_take_large_angles() {
        let text = include_str!("../../../models/contacts/quadruped_hop.toml");
        let model = model("quadruped_hop.toml", text, &ImportOptions::default()).expect("a sound model").model;
        let full = Plan::new(&model, 1e-9).with_contacts();
        let robot = Compiled::<f64>::from_plan(full.clone(), Options::default().of_model(true)).expect("machine code");
        let feet = (1..=full.dims.rows).map(|n| (0..full.dims.rows).map(|r| r < n).collect::<Vec<bool>>());
        let early = |acts: Vec<bool>| Some(Reducible::acting(&robot, &acts)).filter(|on| on.shared.early.is_some());
        let mut standing = feet.rev().find_map(early).expect("some code for one state has early rows");
        let state = State::new(&full, 1);
        let mut q = state.q.clone();
        *q.last_mut().expect("coordinates") = 2e6;
        let (mut qd, mut pd) = (q.clone(), state.v.clone());
        standing.rates_at(0.0, &q, &state.v, &mut qd, &mut pd);
        let mut lanes = standing.lanes::<2>().expect("machine code for lanes");
        let pack = |x: &[f64]| x.iter().map(|x| Packed([*x; 2])).collect::<Vec<Packed<2>>>();
        let (mut found_qd, mut found_pd) = (pack(&qd), pack(&pd));
        lanes.rates_at(Packed::zero(), &pack(&q), &pack(&state.v), &mut found_qd, &mut found_pd);
        let size = pd.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
        for (found, wanted) in found_qd.iter().zip(&qd).chain(found_pd.iter().zip(&pd)) {
            // Another order of elimination has other rounding errors.
            assert!(found.0.iter().all(|x| (x - wanted).abs() < 1e-9 * size), "{found:?} {wanted}");
        }
    }

    /// In single precision, code has other bits than the interpreter: which computes does not depend on other clones.
    #[test]
    fn code_of_another_clone_is_not_taken_in_single_precision() {
        let text = include_str!("../../../models/ur5.urdf");
        let model = model("ur5.urdf", text, &ImportOptions::default()).expect("a sound model").model;
        let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
        let patient = Compiled::<f32>::new(&model, &options).expect("machine code").compiled_after(3);
        let (q, v) = (vec![0.3; 6], vec![0.7; 6]);
        let momenta = |of: &mut Compiled<f32>| {
            let mut p = of.zero_momenta();
            of.conjugate_momenta(&q, &v, &mut p);
            p
        };
        let wanted = momenta(&mut patient.clone().interpreted());
        let mut other = patient.clone();
        (0..5).for_each(|_| drop(momenta(&mut other)));
        assert_ne!(momenta(&mut other), wanted, "the code has other bits");
        assert_eq!(momenta(&mut patient.clone()), wanted);
    }

    fn compare<const L: usize>(file: &str, single: Compiled, plan: &Plan) {
        // Once within the main path of sines, and once with an angle beyond it.
        compare_states::<L>(file, single.clone(), plan, false);
        compare_states::<L>(file, single, plan, true);
    }

    fn compare_states<const L: usize>(file: &str, mut single: Compiled, plan: &Plan, large: bool) {
        let mut lanes = single.lanes::<L>().expect("machine code for lanes");
        let states: Vec<State> = (0..L as u64).map(|seed| State::new(plan, seed)).collect();
        let mut wanted = Vec::new();
        for (lane, state) in states.iter().enumerate() {
            state.set_inputs(plan, single.inputs(), true);
            lanes.take_inputs(lane, &single);
            let mut q = state.q.clone();
            if large && lane == 1 && single.lie_joints().is_empty() {
                q[0] = 1e9;
            }
            let (mut v, mut qd, mut pd) = (single.zero_momenta(), q.clone(), single.zero_momenta());
            single.rates(&q, &state.v, &mut v, &mut qd, &mut pd);
            let mut turned = q.clone();
            single.coordinate_rates(&q, &v, &mut turned);
            wanted.push((q, state.v.clone(), v, qd, pd, turned));
        }
        let pack = |of: fn(&Wanted) -> &Vec<f64>| -> Vec<Packed<L>> {
            (0..of(&wanted[0]).len()).map(|k| Packed(std::array::from_fn(|l| of(&wanted[l])[k]))).collect()
        };
        let (q, p) = (pack(|w| &w.0), pack(|w| &w.1));
        let (mut v, mut qd, mut pd) = (lanes.zero_momenta(), lanes.neutral(), lanes.zero_momenta());
        lanes.velocities(&q, &p, &mut v);
        lanes.rates_at(Packed::zero(), &q, &p, &mut qd, &mut pd);
        assert_eq!((&v, &qd, &pd), (&pack(|w| &w.2), &pack(|w| &w.3), &pack(|w| &w.4)), "{file}");
        let mut turned = q.clone();
        lanes.coordinate_rates(&q, &v, &mut turned);
        assert_eq!(turned, pack(|w| &w.5), "{file}");
        let mut tau = lanes.zero_momenta();
        match lanes.evaluate(Output::InverseDynamics, &[&q, &v, &p], &mut [&mut tau]) {
            Err(CompileError::TooLarge { .. }) => return,
            done => done.unwrap_or_else(|e| panic!("{file}: {e}")),
        }
        for (lane, w) in wanted.iter().enumerate() {
            let mut one = single.zero_momenta();
            states[lane].set_inputs(plan, single.inputs(), true);
            single.evaluate(Output::InverseDynamics, &[&w.0, &w.2, &w.1], &mut [&mut one]).expect("machine code");
            assert_eq!(tau.iter().map(|x| x.0[lane]).collect::<Vec<_>>(), one, "{file}");
        }
    }

    /// Coordinates, momenta, velocities, rates of both, coordinate rates of the velocities.
    type Wanted = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);
}

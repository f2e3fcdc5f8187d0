//! A mechanism whose functions are machine code made at run time.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use mbd_runtime::contact::{ColumnsOf, Contact, Reach, Reducible, Way};
use mbd_runtime::interp::ImplicitSprings;
use mbd_runtime::tree::row_order::RowProducts;
use mbd_runtime::Interpreter;

use super::columns::Several;
use super::given::Given;
use super::instructions::width;
use super::interpreted::interpret;
use super::lanes::AllLanes;
use super::memory::{MachineCode, Number, RESULTS};
use super::{vectors, CompileError};
use crate::code::{compile, Code};
use crate::model::{Gravity, Model};
use crate::modes::OF_EACH_SET;
use crate::options::{Arithmetic, Options, Precision};
use crate::output::{Output, OutputProgram, Sizes};
use crate::plan::Plan;
use crate::rolled::{rolled, together, Together};
use crate::search;
use crate::trace::{chosen_frames, coordinate_rates, sizes};

/// Largest number of operations of a program that is compiled; those of a loop's body count once. Compiling one takes
/// some 25 µs.
const MOST_OPERATIONS: usize = 30_000;

/// Length of the working memory of coordinate rates that is not allocated.
const FEW: usize = 96;

/// Mechanisms with more bodies than this are not unrolled: they would have more operations than that.
const MOST_BODIES: usize = MOST_OPERATIONS / 50;

/// A mechanism whose functions are machine code, compiled when they are first called.
///
/// It implements the traits of generated types, so that all integrators and constraint methods take it. Outputs whose
/// programs are too large to compile ([`CompileError::TooLarge`]) are computed by the interpreter. Clones share the
/// code; each has its own inputs and working memory.
///
/// The inputs beside the state (joint forces, prescribed motions, wrenches, gravity where it is an input) are those of
/// [`Compiled::inputs`].
#[derive(Clone, Debug)]
pub struct Compiled<S: Number = f64> {
    pub(super) shared: Arc<Shared<S>>,
    /// The code with the rows in the order of the plan, where [`Constrained::reorder_rows`] has found another one.
    ///
    /// [`Constrained::reorder_rows`]: mbd_runtime::Constrained::reorder_rows
    planned: Option<Arc<Shared<S>>>,
    /// Holds the inputs, too.
    pub(super) interpreter: Interpreter<S>,
    /// Whether its tree has the parameters of before: it is made again when it is to compute something.
    outdated: bool,
    /// Whether the interpreter computes everything.
    pub(super) interpreted: bool,
    /// Number of calls of an output that the interpreter computes before the output is compiled.
    patience: u32,
    /// Whether one of these two has to be asked, unless an output has been called that often.
    pub(super) asks: bool,
    /// Calls of each of [`Output::ALL`], counted up to that number.
    calls: Vec<u32>,
    /// Calls in which early rows did not act.
    late_calls: u32,
    pub(super) params: Vec<S>,
    /// 1 for each row that acts, 0 for one that does not, where that is an input.
    pub(super) acts: Vec<S>,
    pub(super) scratch: Vec<S>,
    /// Arguments and results that have to be copied.
    pub(super) copies: Vec<S>,
    /// Memory for several states at once.
    pub(super) several: Several<S>,
    /// Motion of the prescribed joints, where it is a function of time.
    pub(super) drives: Option<Arc<dyn super::Drives<S>>>,
}

/// Number of sets of rows above which those that nobody uses are forgotten, with their code.
const REDUCED: usize = 256;

/// What all clones have in common.
#[derive(Debug)]
pub(super) struct Shared<S> {
    plan: Plan,
    /// The same with [early rows](Plan::with_early_contacts), for one state and the outputs [`OF_EACH_SET`].
    pub(super) early: Option<Plan>,
    options: Options,
    sizes: Sizes,
    /// One for each of [`Output::ALL`].
    outputs: [OnceLock<Result<MachineCode<S>, CompileError>>; Output::ALL.len()],
    /// The same without early rows, for states in which these do not act.
    late: [OnceLock<Result<MachineCode<S>, CompileError>>; OF_EACH_SET.len()],
    coordinate_rates: OnceLock<Result<MachineCode<S>, CompileError>>,
    /// The same with only some rows of the constraints, by the rows that act.
    reduced: Mutex<BTreeMap<Vec<bool>, Arc<Shared<S>>>>,
    /// The same for steps that are implicit in springs and dampers.
    implicit: OnceLock<Arc<Shared<S>>>,
    /// Code for several states at once.
    pub(super) lanes: AllLanes,
}

impl<S: Number> Shared<S> {
    /// Nothing is compiled yet.
    fn new(plan: Plan, options: Options, sizes: Sizes) -> Self {
        let (outputs, late) =
            (std::array::from_fn(|_| OnceLock::new()), [const { OnceLock::new() }; OF_EACH_SET.len()]);
        let (coordinate_rates, reduced, lanes) = (OnceLock::new(), Mutex::default(), AllLanes::default());
        let (early, implicit) = (None, OnceLock::new());
        Shared { plan, early, options, sizes, outputs, late, coordinate_rates, reduced, implicit, lanes }
    }

    /// The same with early rows, where some pay.
    fn with_early_rows(self) -> Self {
        let early = self.plan.early_contacts(self.options.arithmetic);
        Shared { early: (!early.is_empty()).then(|| self.plan.with_early_contacts(&early)), ..self }
    }

    /// Whether code and interpreter give the same bits. In single precision, code has constants that were computed in double
    /// precision, and the interpreter rounds in every step.
    fn has_bits_of_interpreter(&self) -> bool {
        (self.options.arithmetic, S::PRECISION) == (Arithmetic::Exact, Precision::F64)
    }

    /// The code of an output for one state, without early rows: that of the program which several states have.
    pub(super) fn without_early_rows(&self, output: Output) -> Option<&MachineCode<S>> {
        match self.early.is_some() && OF_EACH_SET.contains(&output) {
            true => self.late(output),
            false => self.output(output).ok(),
        }
    }

    /// The code of an output that has early rows, without these.
    fn late(&self, output: Output) -> Option<&MachineCode<S>> {
        let k = OF_EACH_SET.iter().position(|other| *other == output)?;
        self.late[k].get_or_init(|| self.compiled_from(&self.plan, output, 1)).as_ref().ok()
    }

    pub(super) fn sizes(&self) -> &Sizes {
        &self.sizes
    }

    /// Compiles a program.
    fn machine_code(&self, program: &OutputProgram<Code>, lanes: usize) -> Result<MachineCode<S>, CompileError> {
        let results = program.spec.results.iter().map(|array| array.len(&self.sizes)).collect();
        MachineCode::new(program, results, self.options.arithmetic, lanes)
    }

    /// Compiles an output, if it is not too large.
    pub(super) fn compiled(&self, output: Output, lanes: usize) -> Result<MachineCode<S>, CompileError> {
        let early = self.early.as_ref().filter(|_| lanes == 1 && OF_EACH_SET.contains(&output));
        self.compiled_from(early.unwrap_or(&self.plan), output, lanes)
    }

    fn compiled_from(&self, plan: &Plan, output: Output, lanes: usize) -> Result<MachineCode<S>, CompileError> {
        let (options, most) = (&self.options, MOST_OPERATIONS);
        if plan.nodes.len() > MOST_BODIES && rolled(plan, output, options).is_none() {
            return Err(CompileError::TooLarge { output, operations: None, most });
        }
        let mut program = compile(plan, output, options)?;
        if let Code::Straight(straight) = &program.program {
            let width = |both: &Together| {
                vectors::one_state(S::PRECISION).map_or(width(S::PRECISION, 1), |width| width.branches(&both.program))
            };
            let pays = |both: &Together| both.pays_in(width(both), straight, options);
            if let Some(both) = together(plan, output, options).filter(|both| pays(&both.program)) {
                // Every state has the same bits, alone or in a lane.
                program = both.map(|both| match lanes {
                    1 => Code::Rolled(both.program),
                    _ => Code::Straight(both.apart),
                });
            }
        }
        let operations = program.program.operations().count();
        match operations > most {
            true => Err(CompileError::TooLarge { output, operations: Some(operations), most }),
            false => self.machine_code(&program, lanes),
        }
    }

    /// The code of an output, made when it is first asked for.
    pub(super) fn output(&self, output: Output) -> Result<&MachineCode<S>, &CompileError> {
        let make = || self.compiled(output, 1);
        // The list has the order of the enumeration.
        self.outputs[output as usize].get_or_init(make).as_ref()
    }

    /// The same, if it is made.
    #[inline(always)]
    pub(super) fn made(&self, output: Output) -> Option<&MachineCode<S>> {
        self.outputs[output as usize].get()?.as_ref().ok()
    }

    pub(super) fn coordinate_rates(&self) -> Result<&MachineCode<S>, &CompileError> {
        self.coordinate_rates.get_or_init(|| self.compiled_coordinate_rates(1)).as_ref()
    }

    pub(super) fn compiled_coordinate_rates(&self, lanes: usize) -> Result<MachineCode<S>, CompileError> {
        self.machine_code(&coordinate_rates(&self.plan, &self.options).map(Code::Straight), lanes)
    }
}

impl<S: Number> Compiled<S> {
    /// A mechanism with parameters at their defaults and other inputs zero. Of the options, those count that change the
    /// programs: arithmetic, frames, choice of the structure. All outputs that the model has are available.
    ///
    /// # Errors
    /// An unknown frame name in the options.
    pub fn new(model: &Model, options: &Options) -> Result<Self, CompileError> {
        let options = options.of_model(!model.constraints.is_empty());
        Compiled::from_plan(search::plan(model, options.plan), options)
    }

    /// The same with the eliminations of a plan; [`Options::plan`] only says where code is rolled.
    ///
    /// # Errors
    /// As of [`Compiled::new`].
    pub fn from_plan(plan: Plan, options: Options) -> Result<Self, CompileError> {
        // Joint forces that are zero cost next to nothing, and a user may want to set them.
        let options = Options { precision: S::PRECISION, efforts: true, ..options };
        let frames = chosen_frames(&plan, &options)?.len();
        let sizes = sizes(&plan, &options, frames);
        let params: Vec<S> = plan.default_params().into_iter().map(S::constant).collect();
        let interpreter = plan.interpreter(&params);
        let (acts, shared) = (vec![S::one(); sizes.acts], Arc::new(Shared::new(plan, options, sizes)));
        Ok(Compiled {
            shared,
            planned: None,
            interpreter,
            outdated: false,
            interpreted: false,
            patience: 0,
            asks: false,
            calls: Vec::new(),
            late_calls: 0,
            params,
            acts,
            scratch: Vec::new(),
            copies: Vec::new(),
            several: Several::default(),
            drives: None,
        })
    }

    /// The same mechanism, whose traits are computed by the interpreter alone, for comparison. In exact arithmetic and double
    /// precision it gives the same bits. [`Compiled::evaluate`] still runs machine code, [`Compiled::evaluate_or_interpret`] does not.
    #[must_use]
    pub fn interpreted(self) -> Self {
        Compiled { interpreted: true, asks: true, ..self }
    }

    /// Number of calls for which the interpreter takes about as long as making the code takes.
    pub const WORTHWHILE: u32 = 1000;

    /// The same mechanism, whose outputs are compiled after so many calls each. Until then the interpreter computes them:
    /// code that is hardly used is not worth the time of making it. In exact arithmetic and double precision both give the same
    /// bits.
    #[must_use]
    pub fn compiled_after(self, calls: u32) -> Self {
        let asks = self.interpreted || calls > 0;
        Compiled { patience: calls, asks, calls: vec![0; Output::ALL.len()], ..self }
    }

    /// The plan of which the code is made.
    pub fn plan(&self) -> &Plan {
        &self.shared.plan
    }

    /// Lengths of all arrays.
    pub fn sizes(&self) -> &Sizes {
        &self.shared.sizes
    }

    /// The inputs beside the state: `tau`, `drive_q`, `drive_v`, `drive_a`, `wrenches`, `gravity`. They must keep their
    /// lengths. Gravity must be left as it is unless the model says that it is an input: the code has it as a constant, the
    /// interpreter, which serves outputs that are too large, reads it here.
    pub fn inputs(&mut self) -> &mut Interpreter<S> {
        self.interpreting()
    }

    /// The parameters, in the order of the model.
    pub fn parameters(&self) -> &[S] {
        &self.params
    }

    /// Sets the parameters; the code stays as it is.
    ///
    /// # Panics
    /// If there is another number of them than the model has.
    pub fn set_parameters(&mut self, params: &[S]) {
        self.outdated |= self.params != params;
        self.params.copy_from_slice(params);
    }

    /// The interpreter with the parameters of now.
    pub(super) fn interpreting(&mut self) -> &mut Interpreter<S> {
        if self.outdated {
            self.interpreter = self.new_interpreter();
            self.outdated = false;
        }
        &mut self.interpreter
    }

    /// The same of a mechanism that does not change.
    fn current(&self) -> Cow<'_, Interpreter<S>> {
        match self.outdated {
            true => Cow::Owned(self.new_interpreter()),
            false => Cow::Borrowed(&self.interpreter),
        }
    }

    /// The interpreter of the plan with the parameters and the inputs of now.
    fn new_interpreter(&self) -> Interpreter<S> {
        let old = &self.interpreter;
        let mut new = self.shared.plan.interpreter(&self.params);
        new.tau.clone_from(&old.tau);
        new.drive_q.clone_from(&old.drive_q);
        new.drive_v.clone_from(&old.drive_v);
        new.drive_a.clone_from(&old.drive_a);
        new.wrenches.clone_from(&old.wrenches);
        if self.shared.plan.model.gravity == Gravity::Input {
            new.gravity = old.gravity;
        }
        new
    }

    /// Compiles an output now, in place of at its first call.
    ///
    /// # Errors
    /// [`CompileError`]; where it is `TooLarge`, the functions of the traits use the interpreter.
    pub fn prepare(&self, output: Output) -> Result<(), CompileError> {
        self.shared.output(output).map(|_| ()).map_err(CompileError::clone)
    }

    /// Length of the machine code of an output, bytes; it is compiled if it was not yet.
    ///
    /// # Errors
    /// [`CompileError`].
    pub fn code_size(&self, output: Output) -> Result<usize, CompileError> {
        self.shared.output(output).map(MachineCode::size).map_err(CompileError::clone)
    }

    /// Computes an output: its arguments and results are those of the generated function ([`Output::spec`]), as flat
    /// slices.
    ///
    /// # Errors
    /// [`CompileError`], where there is no code for the output or the arrays are not its own; nothing is written then.
    pub fn evaluate(
        &mut self,
        output: Output,
        arguments: &[&[S]],
        results: &mut [&mut [S]],
    ) -> Result<(), CompileError> {
        self.prepare(output)?;
        self.check_arrays(output, arguments, results)?;
        let given = |k: usize| arguments.get(k).copied().unwrap_or_default();
        if !self.call(output, [given(0), given(1), given(2)], results) {
            interpret(self, output, arguments, results);
        }
        Ok(())
    }

    /// Runs the code of an output whose arrays are right. Returns whether there is some: not where early rows do not act
    /// and the code without these has not been asked for often; the results are wrong then.
    fn call(&mut self, output: Output, arguments: [&[S]; 3], results: &mut [&mut [S]]) -> bool {
        let Ok(code) = self.shared.output(output) else { return false };
        let more = (&self.interpreter, &self.params[..], &self.acts[..]);
        let scratch = long_enough(&mut self.scratch, code);
        // Code for one state never gives up.
        if code.results() == results.len() {
            return code.call(&Given::new(code, arguments, more), results, scratch);
        }
        let (mut act, count) = ([S::zero()], results.len());
        let mut all: [&mut [S]; RESULTS] = Default::default();
        let own = results.iter_mut().map(|result| &mut **result).chain([&mut act[..]]);
        all.iter_mut().zip(own).for_each(|(to, result)| *to = result);
        code.call(&Given::new(code, arguments, more), &mut all[..=count], scratch);
        if act[0] != S::zero() {
            return true;
        }
        self.late_calls = (self.late_calls + 1).min(Self::WORTHWHILE);
        if self.late_calls < Self::WORTHWHILE {
            return false;
        }
        let Some(code) = self.shared.late(output) else { return false };
        let scratch = long_enough(&mut self.scratch, code);
        code.call(&Given::new(code, arguments, more), results, scratch)
    }

    /// Whether an output is, or may be, still interpreted although its code is made.
    #[inline(always)]
    pub(super) fn waits(&self, output: Output) -> bool {
        self.asks && (self.interpreted || self.calls.get(output as usize) != Some(&self.patience))
    }

    /// Computes an output that one of the traits asks for, whose arrays are right. Returns whether there is code for
    /// it.
    #[inline(always)]
    pub(super) fn run<const N: usize>(
        &mut self,
        output: Output,
        arguments: [&[S]; 3],
        mut results: [&mut [S]; N],
    ) -> bool {
        let done = self.shared.made(output).filter(|_| !self.waits(output)).is_some_and(|code| {
            let results = results.each_mut().map(|result| &mut **result);
            code.call_lean(arguments, (&self.interpreter.tau, &self.params), results, &mut self.scratch)
        });
        done || self.run_any(output, arguments, results)
    }

    /// [`Compiled::run`] in every case.
    #[inline(never)]
    pub(super) fn run_any<const N: usize>(
        &mut self,
        output: Output,
        arguments: [&[S]; 3],
        mut results: [&mut [S]; N],
    ) -> bool {
        if self.interprets(output) {
            return false;
        }
        self.call(output, arguments, &mut results)
    }

    /// Whether the interpreter computes an output now; the call is counted. Code that another clone has had made is taken at
    /// once, if it gives the same bits.
    pub(super) fn interprets(&mut self, output: Output) -> bool {
        if self.interpreted {
            return true;
        }
        self.patience > 0 && !self.patient(output) && {
            let made = || self.shared.outputs[output as usize].get().is_some();
            !(self.shared.has_bits_of_interpreter() && made())
        }
    }

    /// Counts a call of an output; whether it is to be compiled.
    fn patient(&mut self, output: Output) -> bool {
        let calls = &mut self.calls[output as usize];
        *calls = (*calls + 1).min(self.patience);
        *calls == self.patience
    }

    /// Chooses the order of the rows anew at coordinates `q`, if that changes it; then the code is made again when it is
    /// next called.
    pub(super) fn with_rows_ordered_at(&mut self, q: &Vec<S>) -> bool {
        if !self.interpreter.tree().rows_can_be_ordered() {
            return false;
        }
        let mut plan = self.shared.plan.clone();
        if !plan.reorder_rows(&RowProducts::new(self.interpreting(), q)) {
            return false;
        }
        let options = self.shared.options.clone();
        let shared = Arc::new(Shared::new(plan, options, self.shared.sizes));
        let old = std::mem::replace(&mut self.shared, shared);
        self.planned.get_or_insert(old);
        self.code_has_changed();
        true
    }

    /// Gives the rows of the constraints the order of the plan again, where [`Constrained::reorder_rows`] has changed it:
    /// what is computed then does not depend on the motions that were computed before.
    ///
    /// [`Constrained::reorder_rows`]: mbd_runtime::Constrained::reorder_rows
    pub fn restore_row_order(&mut self) {
        if let Some(planned) = self.planned.take() {
            self.shared = planned;
            self.code_has_changed();
        }
    }

    /// Takes the interpreter of the plan that the code has now.
    fn code_has_changed(&mut self) {
        self.interpreter = self.new_interpreter();
        self.outdated = false;
        self.calls.fill(0);
    }

    /// The mechanism in which only some rows of the constraints act, one entry of `acts` for each row: with the
    /// parameters and the gravity of this one, and other inputs that are zero.
    fn with_rows(&self, acts: &[bool]) -> Self {
        let Shared { plan, options, sizes, reduced, .. } = &*self.shared;
        let make = || Arc::new(Shared::new(plan.acting(acts), options.clone(), *sizes).with_early_rows());
        let mut reduced = reduced.lock().unwrap_or_else(PoisonError::into_inner);
        if reduced.len() >= REDUCED && !reduced.contains_key(acts) {
            reduced.retain(|_, shared| Arc::strong_count(shared) > 1);
        }
        let shared = reduced.entry(acts.to_vec()).or_insert_with(make).clone();
        let (interpreter, calls) = (self.current().acting(acts), vec![0; self.calls.len()]);
        Compiled { shared, planned: None, interpreter, outdated: false, calls, ..self.clone() }
    }

    /// `q̇ = N(q) v`.
    pub(super) fn coordinate_rates_into(&self, q: &[S], v: &[S], qd: &mut [S]) -> bool {
        if self.interpreted {
            return false;
        }
        let Ok(code) = self.shared.coordinate_rates() else { return false };
        // These programs have few angles, or none, so that nothing is allocated.
        let (mut few, mut many) = ([S::zero(); FEW], Vec::new());
        let scratch = if code.scratch() <= FEW { &mut few[..] } else { long_enough(&mut many, code) };
        let given = Given::new(code, [q, v, &[]], (&self.interpreter, &self.params, &self.acts));
        code.call(&given, &mut [qd], scratch);
        true
    }
}

impl<S: Number> Reducible for Compiled<S> {
    fn acting(&self, acts: &[bool]) -> Self {
        self.with_rows(acts)
    }

    fn swap_inputs(&mut self, other: &mut Self) {
        Reducible::swap_inputs(&mut self.interpreter, &mut other.interpreter);
    }

    fn way(&self) -> Way {
        let exact = self.shared.has_bits_of_interpreter();
        let patient = || self.calls.get(Output::Rates as usize).is_none_or(|n| *n >= self.patience);
        let compiled = !self.interpreted && (exact || patient());
        if compiled && self.shared.outputs[Output::Rates as usize].get().is_some_and(Result::is_ok) {
            Way::Compiled
        } else {
            Way::Interpreted
        }
    }

    fn reaches(&self, contacts: &[Contact<S>]) -> Vec<Reach<S>> {
        self.current().tree().reaches(contacts)
    }

    fn trees(&self) -> Vec<usize> {
        self.interpreter.tree().trees()
    }

    fn moves_at_rest(&self) -> bool {
        self.interpreter.moves_at_rest()
    }

    fn gaps(&mut self, q: &Vec<S>, v: &Vec<S>, gaps: &mut Vec<S>, velocities: &mut Vec<S>, entries: &mut Vec<S>) {
        if !self.run(Output::Gaps, [q, v, &[]], [gaps, velocities, entries]) {
            self.interpreting().gaps(q, v, gaps, velocities, entries);
        }
    }

    /// Machine code computes all of them.
    fn sees_parts(&self) -> bool {
        self.interpreted || !self.shared.outputs[Output::Gaps as usize].get().is_some_and(Result::is_ok)
    }

    fn gaps_of(
        &mut self,
        wanted: &[bool],
        (q, v): (&Vec<S>, &Vec<S>),
        gaps: &mut Vec<S>,
        velocities: &mut Vec<S>,
        entries: &mut Vec<S>,
    ) {
        if !self.run(Output::Gaps, [q, v, &[]], [gaps, velocities, entries]) {
            self.interpreting().gaps_of(wanted, (q, v), gaps, velocities, entries);
        }
    }

    fn with_implicit_springs(&self, step: S) -> Option<ImplicitSprings<Self, Vec<S>>> {
        let found = self.current().with_implicit_springs(step)?;
        let Shared { plan, options, sizes, implicit, .. } = &*self.shared;
        let params = [&self.params[..], &[step]].concat();
        let sizes = Sizes { params: params.len(), ..*sizes };
        let make = || Arc::new(Shared::new(plan.with_implicit_springs(), options.clone(), sizes));
        let (shared, calls) = (implicit.get_or_init(make).clone(), vec![0; self.calls.len()]);
        Some(found.map(|interpreter| Compiled {
            shared,
            planned: None,
            interpreter,
            outdated: false,
            params,
            calls,
            ..self.clone()
        }))
    }

    fn project_several(&mut self, t: S, q: &Vec<S>, columns: &mut ColumnsOf<S>) -> bool {
        self.drive_to(t);
        S::project_several(self, q, columns)
    }
}

impl Model {
    /// Machine code of the model: [`Compiled::new`] in double precision.
    ///
    /// # Errors
    /// As of [`Compiled::new`].
    pub fn compile(&self, options: &Options) -> Result<Compiled, CompileError> {
        Compiled::new(self, options)
    }
}

/// Working memory that is long enough for a function.
fn long_enough<'a, S: Number>(scratch: &'a mut Vec<S>, code: &MachineCode<S>) -> &'a mut [S] {
    if scratch.len() < code.scratch() {
        scratch.resize(code.scratch(), S::zero());
    }
    scratch
}

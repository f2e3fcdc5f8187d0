//! A mechanism in exact arithmetic: WebAssembly that is assembled for it in the page, the interpreter where there is none.
//! Both give the same bits.

use std::cell::{OnceCell, RefCell};
use std::rc::Rc;

use multibody::codegen::plan::Plan;
use multibody::codegen::Output;
use multibody::runtime::contact::{Contact, Reach, Reducible, Way};
use multibody::runtime::interp::ImplicitSprings;
use multibody::runtime::system::{LieJoint, Part, Row};
use multibody::runtime::{Conjugate, Constrained, Energetic, Interpreter, System};

use crate::engine::Function;
use crate::load::Load;

/// Calls of an output by the interpreter before it is assembled: making code takes about as long.
const PATIENCE: u32 = 300;

/// A mechanism with what acts on it.
#[derive(Clone, Debug)]
pub struct Evaluator {
    code: Rc<Code>,
    interpreter: Interpreter<f64>,
    params: Vec<f64>,
    /// Efforts and the spring by which a body is pulled.
    pub load: Rc<RefCell<Load>>,
    v: Vec<f64>,
}

/// The code of a mechanism, which all its clones share.
#[derive(Debug)]
struct Code {
    plan: Plan,
    /// One for each of [`Output::ALL`].
    functions: RefCell<Vec<Made>>,
    /// That for steps that are implicit in springs and dampers.
    implicit: OnceCell<Rc<Code>>,
}

#[derive(Clone, Debug)]
enum Made {
    /// Not yet: the number of calls.
    Calls(u32),
    Function(Rc<Function>),
    /// Too large, or there is no engine.
    Never,
}

impl Code {
    fn new(plan: Plan) -> Rc<Code> {
        let functions = RefCell::new(vec![Made::Calls(0); Output::ALL.len()]);
        Rc::new(Code { plan, functions, implicit: OnceCell::new() })
    }

    /// The function of an output, if it has been called often enough.
    fn function(&self, output: Output) -> Option<Rc<Function>> {
        let mut functions = self.functions.borrow_mut();
        let made = &mut functions[output as usize];
        match made {
            Made::Calls(calls) if *calls < PATIENCE => {
                *calls += 1;
                None
            }
            Made::Calls(_) => {
                let function = Function::new(&self.plan, output).map(Rc::new);
                *made = function.clone().map_or(Made::Never, Made::Function);
                function
            }
            Made::Function(function) => Some(function.clone()),
            Made::Never => None,
        }
    }
}

impl Evaluator {
    /// A mechanism with given parameters.
    pub fn new(plan: Plan, params: &[f64], load: Rc<RefCell<Load>>) -> Evaluator {
        let interpreter = plan.interpreter(params);
        let v = interpreter.zero_momenta();
        Evaluator { code: Code::new(plan), interpreter, params: params.to_vec(), load, v }
    }

    /// Inputs beside the state.
    pub fn inputs(&mut self) -> &mut Interpreter<f64> {
        &mut self.interpreter
    }

    /// Number of outputs that run as assembled code.
    pub fn assembled(&self) -> usize {
        self.code.functions.borrow().iter().filter(|made| matches!(made, Made::Function(_))).count()
    }

    /// Velocities from momenta.
    pub fn velocities(&mut self, q: &[f64], p: &[f64], v: &mut [f64]) {
        if !self.run(Output::Velocities, &[("q", q), ("p", p)], &mut [v]) {
            self.interpreter.velocities(q, p, v);
        }
    }

    fn run(&self, output: Output, arguments: &[(&str, &[f64])], results: &mut [&mut [f64]]) -> bool {
        let Some(function) = self.code.function(output) else { return false };
        function.run(arguments, (&self.interpreter, &self.params), results);
        true
    }

    /// Sets the joint forces for a state.
    fn push(&mut self, q: &[f64], p: &[f64]) {
        let load = self.load.clone();
        let mut load = load.borrow_mut();
        if load.feels() {
            let mut v = std::mem::take(&mut self.v);
            self.velocities(q, p, &mut v);
            self.v = v;
        }
        load.set(q, &self.v, &mut self.interpreter.tau);
    }
}

impl System for Evaluator {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Momenta = Vec<f64>;

    fn neutral(&self) -> Vec<f64> {
        self.interpreter.neutral()
    }
    fn zero_momenta(&self) -> Vec<f64> {
        self.interpreter.zero_momenta()
    }
    fn lie_joints(&self) -> &[LieJoint] {
        self.interpreter.lie_joints()
    }
    fn rates_at(&mut self, t: f64, q: &Vec<f64>, p: &Vec<f64>, qd: &mut Vec<f64>, pd: &mut Vec<f64>) {
        self.push(q, p);
        if !self.run(Output::Rates, &[("q", q), ("p", p)], &mut [qd, pd]) {
            self.interpreter.rates_at(t, q, p, qd, pd);
        }
    }
    fn part_name(&self, part: Part) -> Option<&str> {
        self.interpreter.part_name(part)
    }
    fn coordinate_rates(&self, q: &Vec<f64>, v: &Vec<f64>, qd: &mut Vec<f64>) {
        self.interpreter.coordinate_rates(q, v, qd);
    }
}

impl Energetic for Evaluator {
    fn energies(&mut self, q: &Vec<f64>, p: &Vec<f64>) -> (f64, f64) {
        let mut energy = [0.0; 2];
        match self.run(Output::Energy, &[("q", q), ("p", p)], &mut [&mut energy]) {
            true => (energy[0], energy[1]),
            false => self.interpreter.energy(q, p),
        }
    }
}

impl Conjugate for Evaluator {
    fn conjugate_momenta(&mut self, q: &Vec<f64>, v: &Vec<f64>, p: &mut Vec<f64>) {
        if !self.run(Output::Momenta, &[("q", q), ("v", v)], &mut [p]) {
            self.interpreter.conjugate_momenta(q, v, p);
        }
    }
}

impl Constrained for Evaluator {
    type Rows = Vec<f64>;
    type Entries = Vec<f64>;

    fn zero_rows(&self) -> Vec<f64> {
        self.interpreter.zero_rows()
    }
    fn zero_entries(&self) -> Vec<f64> {
        self.interpreter.zero_entries()
    }
    fn rows(&self) -> &[Row] {
        self.interpreter.rows()
    }
    fn entry_columns(&self) -> &[usize] {
        self.interpreter.entry_columns()
    }
    fn constraint_residuals(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, jacobian: &mut Vec<f64>) {
        if !self.run(Output::ConstraintResiduals, &[("q", q)], &mut [residual, jacobian]) {
            self.interpreter.constraint_residuals(q, residual, jacobian);
        }
    }
    fn project_momenta(&mut self, t: f64, q: &Vec<f64>, p: &mut Vec<f64>, v: &mut Vec<f64>, sigma: &mut Vec<f64>) {
        let augmented = p.clone();
        if !self.run(Output::ProjectMomenta, &[("q", q), ("p", &augmented)], &mut [v, p, sigma]) {
            self.interpreter.project_momenta(t, q, p, v, sigma);
        }
    }
    fn position_correction(&mut self, q: &Vec<f64>, residual: &mut Vec<f64>, dq: &mut Vec<f64>, pivots: &mut Vec<f64>) {
        if !self.run(Output::PositionCorrection, &[("q", q)], &mut [residual, dq, pivots]) {
            self.interpreter.position_correction(q, residual, dq, pivots);
        }
    }
    fn multipliers(&mut self, t: f64, q: &Vec<f64>, v: &Vec<f64>, lambda: &mut Vec<f64>) {
        self.load.borrow_mut().set(q, v, &mut self.interpreter.tau);
        if !self.run(Output::Multipliers, &[("q", q), ("v", v)], &mut [lambda]) {
            self.interpreter.multipliers(t, q, v, lambda);
        }
    }
}

impl Reducible for Evaluator {
    fn acting(&self, acts: &[bool]) -> Self {
        Evaluator {
            code: Code::new(self.code.plan.acting(acts)),
            interpreter: self.interpreter.acting(acts),
            ..self.clone()
        }
    }
    fn swap_inputs(&mut self, other: &mut Self) {
        Reducible::swap_inputs(&mut self.interpreter, &mut other.interpreter);
    }
    fn way(&self) -> Way {
        match self.code.functions.borrow()[Output::Rates as usize] {
            Made::Function(_) => Way::Compiled,
            _ => Way::Interpreted,
        }
    }
    fn reaches(&self, contacts: &[Contact<f64>]) -> Vec<Reach<f64>> {
        self.interpreter.tree().reaches(contacts)
    }
    fn trees(&self) -> Vec<usize> {
        self.interpreter.tree().trees()
    }
    fn moves_at_rest(&self) -> bool {
        self.interpreter.moves_at_rest()
    }
    fn with_implicit_springs(&self, step: f64) -> Option<ImplicitSprings<Self, Vec<f64>>> {
        let found = self.interpreter.with_implicit_springs(step)?;
        let code = self.code.implicit.get_or_init(|| Code::new(self.code.plan.with_implicit_springs())).clone();
        let params = [&self.params[..], &[step]].concat();
        Some(found.map(|interpreter| Evaluator { code, interpreter, params, ..self.clone() }))
    }
    fn gaps(
        &mut self,
        q: &Vec<f64>,
        v: &Vec<f64>,
        gaps: &mut Vec<f64>,
        velocities: &mut Vec<f64>,
        entries: &mut Vec<f64>,
    ) {
        if !self.run(Output::Gaps, &[("q", q), ("v", v)], &mut [gaps, velocities, entries]) {
            self.interpreter.gaps(q, v, gaps, velocities, entries);
        }
    }
    // All gaps are computed wherever some are asked for: which contacts are looked at must not depend on which functions are
    // assembled, since rounding errors of events do.
}

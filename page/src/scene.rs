//! A mechanism that was dropped on the page, and its motion.

mod look;
mod reading;

use std::cell::RefCell;
use std::rc::Rc;

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::model::{Gravity, Model, Value};
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::search;
use multibody::runtime::constrained::{close, complete, Closing};
use multibody::runtime::contact::{ModeTable, WithContacts};
use multibody::runtime::sweep::FrameState;
use multibody::runtime::tree::WrenchAxes;
use multibody::runtime::{Conjugate, Constrained, Interpreter, System as _};

use crate::evaluator::Evaluator;
use crate::load::{Load, Pull};
use crate::motion::{energies, Motion, Settings, System};
use crate::picture::touch::Touch;
use crate::start::{default_start, default_velocity};
pub use reading::{read, Files, Reading};

/// A mechanism and its motion.
pub struct Scene {
    /// The plan, whose parameters have the values of the sliders as their defaults.
    pub plan: Plan,
    /// Warnings and notices about the file.
    pub findings: Diagnostics,
    /// How the motion is computed.
    pub settings: Settings,
    load: Rc<RefCell<Load>>,
    system: System,
    motion: Result<Motion, String>,
    t: f64,
    q: Vec<f64>,
    p: Vec<f64>,
    v: Vec<f64>,
    /// Coordinates and velocities at the start.
    start: (Vec<f64>, Vec<f64>),
    /// Energy at the start and what hands have added since then, J.
    budget: f64,
    /// Without contacts, for what is shown.
    view: Interpreter<f64>,
    frames: Vec<FrameState<f64>>,
    touch: Option<Touch>,
    /// The coordinate and the value whose crossings upwards are kept, for sections of Poincaré, and whether it is an angle.
    section: Option<(usize, f64, bool)>,
    /// States at crossings since the last look.
    crossings: Vec<Vec<f64>>,
    /// What the page reads.
    pub out: Vec<f64>,
}

/// The value of a number of a model.
pub fn value(model: &Model, x: Value) -> f64 {
    match x {
        Value::Const(x) => x,
        Value::Param(k) => model.params[k].default,
    }
}

fn gravity(plan: &Plan, interpreter: &mut Interpreter<f64>) {
    if plan.model.gravity == Gravity::Input {
        interpreter.gravity = [0.0, 0.0, -9.81];
    }
}

/// A mechanism at given parameters.
fn system(plan: &Plan, load: &Rc<RefCell<Load>>) -> System {
    let full = if plan.model.contacts.is_empty() { plan.clone() } else { plan.with_contacts() };
    let contacts = if plan.model.contacts.is_empty() { Vec::new() } else { plan.contacts() };
    let mut evaluator = Evaluator::new(full, &plan.default_params(), load.clone());
    gravity(plan, evaluator.inputs());
    WithContacts::new(ModeTable::new(evaluator, contacts))
}

/// An interpreter of the mechanism without contacts. If there are some, a wrench in ground axes on the body behind each joint comes
/// after the wrenches of the model.
fn viewer(plan: &Plan) -> Interpreter<f64> {
    let mut plan = plan.clone();
    if !plan.model.contacts.is_empty() {
        // The frames of these bodies come first.
        plan.wrenches.extend((0..plan.joint_nodes.len()).map(|frame| (frame, WrenchAxes::Ground)));
        plan.dims.wrenches = plan.wrenches.len();
    }
    let mut interpreter = plan.default_interpreter();
    gravity(&plan, &mut interpreter);
    interpreter
}

/// Damping of every velocity, N m s/rad or N s/m.
fn damping(view: &Interpreter<f64>, nv: usize) -> Vec<f64> {
    let all = view.tree().dynamic_parameters();
    let end = all.len();
    all[end - 2 * nv..end - nv].to_vec()
}

impl Scene {
    /// Makes a scene of a model, at its start, with loops closed.
    ///
    /// # Errors
    /// Loops that do not close, and a mass matrix that is singular: a message.
    pub fn new(model: &Model, findings: Diagnostics) -> Result<Scene, String> {
        // No search: the code is assembled within a second, and its bits do not depend on how long a search may take.
        let plan = search::plan(model, PlanOptions::quick());
        let mut view = viewer(&plan);
        let nv = plan.dims.nv;
        let load = Load { efforts: vec![0.0; nv], damping: damping(&view, nv), pull: None };
        let load = Rc::new(RefCell::new(load));
        let (mut q, v) = (default_start(&plan), default_velocity(&plan));
        view.check_rank(&q).map_err(|e| format!("{e}: give the bodies behind this joint mass and inertia"))?;
        if !view.rows().is_empty() {
            close(&mut view, &mut q, &Closing::holding(&plan.held()))
                .map_err(|e| format!("the loops do not close: {e}"))?;
        }
        let v = consistent(&plan, &mut view, &q, v);
        let p = vec![0.0; nv];
        let frames = vec![FrameState::ground(); plan.frames.len()];
        let mut scene = Scene {
            findings,
            settings: Settings::default(),
            system: system(&plan, &load),
            motion: Err("it has not begun".into()),
            load,
            t: 0.0,
            p: p.clone(),
            v: v.clone(),
            start: (q.clone(), v),
            q,
            budget: 0.0,
            view,
            frames,
            touch: Touch::new(&plan),
            section: None,
            crossings: Vec::new(),
            plan,
            out: Vec::new(),
        };
        scene.restart();
        Ok(scene)
    }

    /// Back to the start.
    pub fn restart(&mut self) {
        self.load.borrow_mut().pull = None;
        let (q, v) = self.start.clone();
        self.go(0.0, q, v);
    }

    /// Makes a state the start.
    ///
    /// # Errors
    /// Loops that cannot be closed: a message, and nothing changes.
    pub fn set_start(&mut self, coordinate: usize, x: f64, velocity: bool) -> Result<(), String> {
        let (mut q, mut v) = self.start.clone();
        match (velocity, q.get_mut(coordinate), v.get_mut(coordinate)) {
            (true, _, Some(v)) => *v = x,
            (false, Some(q), _) => *q = x,
            _ => return Ok(()),
        }
        if !self.view.rows().is_empty() {
            let mut held = self.plan.held();
            if q.len() == v.len() && !velocity {
                held = vec![false; v.len()];
                held[coordinate] = true;
            }
            close(&mut self.view, &mut q, &Closing::holding(&held))
                .map_err(|e| format!("the loops do not close there: {e}"))?;
            v = consistent(&self.plan, &mut self.view, &q, v);
        }
        self.start = (q, v);
        self.restart();
        Ok(())
    }

    /// Goes on from a state that was shown before.
    pub fn set_state(&mut self, t: f64, q: &[f64], p: &[f64]) {
        let q = q.to_vec();
        let mut v = p.to_vec();
        self.system.system_mut().velocities(&q, p, &mut v);
        self.go(t, q, v);
    }

    /// Begins a motion.
    fn go(&mut self, t: f64, q: Vec<f64>, v: Vec<f64>) {
        self.system.system_mut().conjugate_momenta(&q, &v, &mut self.p);
        (self.t, self.q, self.v) = (t, q, v);
        self.begin();
    }

    /// Begins a motion from the state here.
    fn begin(&mut self) {
        self.motion = Motion::new(&mut self.system, &self.settings, self.t, (&self.q, &self.p));
        self.budget = energies(&mut self.system, &self.q, &self.p).iter().sum();
    }

    /// Changes how the motion is computed.
    pub fn set_settings(&mut self, settings: Settings) {
        if settings != self.settings {
            self.settings = settings;
            self.begin();
        }
    }

    /// Changes a parameter; coordinates and velocities stay.
    ///
    /// # Errors
    /// Loops that do not close with it: a message, and nothing changes.
    pub fn set_parameter(&mut self, k: usize, x: f64) -> Result<(), String> {
        let Some(param) = self.plan.model.params.get_mut(k) else { return Ok(()) };
        let before = std::mem::replace(&mut param.default, x);
        let mut view = viewer(&self.plan);
        let (mut q, mut start) = (self.q.clone(), self.start.0.clone());
        let mut closed = view.check_rank(&q).map_err(|e| e.to_string());
        if closed.is_ok() && !view.rows().is_empty() {
            for q in [&mut q, &mut start] {
                let done = close(&mut view, q, &Closing::default());
                closed = closed.and(done.map(drop).map_err(|e| format!("the loops do not close with it: {e}")));
            }
        }
        if let Err(message) = closed {
            self.plan.model.params[k].default = before;
            return Err(message);
        }
        let mut v = self.v.clone();
        if !view.rows().is_empty() {
            v = consistent(&self.plan, &mut view, &q, v);
            self.start.1 = consistent(&self.plan, &mut view, &start, self.start.1.clone());
        }
        self.start.0 = start;
        self.load.borrow_mut().damping = damping(&view, v.len());
        self.view = view;
        self.system = system(&self.plan, &self.load);
        self.touch = Touch::new(&self.plan);
        self.go(self.t, q, v);
        Ok(())
    }

    /// Sets a joint force, N m or N.
    pub fn set_effort(&mut self, k: usize, x: f64) {
        if let Some(effort) = self.load.borrow_mut().efforts.get_mut(k) {
            *effort = x;
        }
        self.resume();
    }

    fn resume(&mut self) {
        if let Ok(motion) = &mut self.motion {
            if let Err(message) = motion.resume(&mut self.system, self.t, &self.q, &self.p) {
                self.motion = Err(message);
            }
        }
    }

    /// Takes hold of a body at a point of its frame. `None` of a body lets go.
    pub fn pull(&mut self, at: Option<(usize, [f64; 3])>, stiffness: f64, damping: f64) {
        let model = &self.plan.model;
        let body = at.and_then(|(frame, at)| {
            let name = &self.plan.frames.get(frame)?.name;
            Some((model.bodies.iter().position(|body| body.name == *name)?, at))
        });
        let mut pull = body.and_then(|(body, at)| Pull::new(model, body, at, stiffness, damping));
        if let Some(pull) = &mut pull {
            pull.target = pull.point(&self.q, &self.v).0;
        }
        // What is still in the spring is lost when it is let go.
        let kept = self.load.borrow_mut().energy(&self.q);
        self.budget -= kept;
        self.load.borrow_mut().pull = pull;
        self.resume();
    }

    /// Moves the hand that holds the spring; the work that this takes is in the budget.
    pub fn pull_to(&mut self, target: [f64; 3]) {
        {
            let mut load = self.load.borrow_mut();
            let before = load.energy(&self.q);
            if let Some(pull) = &mut load.pull {
                pull.target = target;
            }
            self.budget += load.energy(&self.q) - before;
        }
        self.resume();
    }

    /// Takes steps. Returns how many of them succeeded.
    pub fn advance(&mut self, steps: usize) -> usize {
        for k in 0..steps {
            let Ok(motion) = &mut self.motion else { return k };
            let before = self.section.map(|_| [&self.q[..], &self.p].concat());
            match motion.step(&mut self.system, &mut self.q, &mut self.p) {
                Ok(t) => self.t = t,
                Err(message) => {
                    self.motion = Err(message);
                    return k;
                }
            }
            if let Some(before) = before {
                self.cross(&before);
            }
        }
        steps
    }

    /// Why the motion has ended, if it has.
    pub fn trouble(&self) -> &str {
        self.motion.as_ref().err().map_or("", String::as_str)
    }

    /// Time, coordinates and momenta.
    pub fn state(&self) -> (f64, &[f64], &[f64]) {
        (self.t, &self.q, &self.p)
    }

    /// Number of outputs that run as assembled code.
    pub fn assembled(&self) -> usize {
        self.system.system().assembled()
    }
}

/// Velocities that satisfy the constraints, those of held joints kept if they can be.
fn consistent(plan: &Plan, view: &mut Interpreter<f64>, q: &Vec<f64>, mut v: Vec<f64>) -> Vec<f64> {
    if view.rows().is_empty() {
        return v;
    }
    let held = plan.held();
    if held.contains(&true) && complete(view, 0.0, q, &mut v, &held, 1e-9).is_ok() {
        return v;
    }
    let (mut p, mut sigma) = (view.zero_momenta(), view.zero_rows());
    view.momenta(q, &v.clone(), &mut p);
    view.project_momenta(0.0, q, &mut p, &mut v, &mut sigma);
    v
}

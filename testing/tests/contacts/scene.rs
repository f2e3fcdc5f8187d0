//! Scenes with contacts, run by one method.

use mbd_codegen::model::Model;
use mbd_codegen::plan::Plan;
use mbd_codegen::read;
use mbd_runtime::constrained::{close, Closing, Effort, Projection, Stabilisation, WithPostStep};
use mbd_runtime::contact::{
    ContactEvent, ContactInterpreter, ContactObserver, Hybrid, HybridError, ImpactOrder, Touching, WithContacts,
};
use mbd_runtime::integrate::{Dop853, Step, Tolerances};
use mbd_runtime::{Conjugate, Constrained, Energetic};
pub use mbd_testing::largest_difference as apart;

pub type Mechanism = ContactInterpreter<f64>;
type Closed = Projection<WithContacts<Mechanism>>;
type Method = WithPostStep<WithContacts<Mechanism>, Dop853<WithContacts<Mechanism>>, Closed>;

/// A motion with contacts, and its events.
pub struct Scene {
    pub system: WithContacts<Mechanism>,
    pub motion: Option<Hybrid<Mechanism, Method>>,
    pub events: Events,
    pub q: Vec<f64>,
    pub p: Vec<f64>,
    pub tolerance: f64,
    /// Order of simultaneous impacts.
    pub order: ImpactOrder,
    /// Largest number of steps of a run.
    pub steps: u64,
}

#[derive(Default)]
pub struct Events(pub Vec<ContactEvent<f64>>);

impl ContactObserver<Mechanism> for Events {
    fn event(&mut self, _system: &mut WithContacts<Mechanism>, event: &ContactEvent<f64>) {
        self.0.push(*event);
    }
}

impl Scene {
    /// A scene at `q` with velocities `v`.
    pub fn new(model: Model, q: &[f64], v: &[f64]) -> Scene {
        let plan = Plan::new(&model, 1e-9);
        let mut mechanism: Mechanism = plan.default_contact_interpreter();
        let q = q.to_vec();
        let mut p = v.to_vec();
        mechanism.conjugate_momenta(&q, &v.to_vec(), &mut p);
        let system = WithContacts::new(mechanism);
        let (events, order) = (Events::default(), ImpactOrder::default());
        Scene { system, motion: None, events, q, p, tolerance: 1e-12, order, steps: u64::MAX }
    }

    /// Goes on to time `t`, s.
    pub fn run(&mut self, t: f64) {
        self.try_run(t).unwrap();
    }

    /// Starts the motion, if it has not begun.
    pub fn start(&mut self) {
        if self.motion.is_some() {
            return;
        }
        let projection =
            Projection::new(&self.system, Stabilisation::Mass, Effort { energy: f64::INFINITY, ..Effort::default() });
        let method = WithPostStep::new(&self.system, Dop853::new(&self.system), projection);
        let step = Step::Adaptive(Tolerances::new(self.tolerance));
        let mut motion = Hybrid::new(&mut self.system, method, step, 0.0, &self.q, &self.p).unwrap();
        motion.limits_mut().steps = self.steps;
        motion.rules.order = self.order;
        self.motion = Some(motion);
    }

    /// Goes on to time `t`, s, or to where the motion fails.
    pub fn try_run(&mut self, t: f64) -> Result<(), HybridError> {
        self.start();
        let Some(motion) = &mut self.motion else { return Ok(()) };
        let result = motion.run(&mut self.system, t, &mut self.events);
        motion.state(&self.system, &mut self.q, &mut self.p);
        result
    }

    /// Takes one step, not beyond time `t`, s, or goes to the first event of that step.
    pub fn advance(&mut self, t: f64) {
        self.start();
        let Some(motion) = &mut self.motion else { return };
        motion.advance(&mut self.system, t, &mut self.events).unwrap();
        motion.state(&self.system, &mut self.q, &mut self.p);
    }

    /// Velocities.
    pub fn v(&mut self) -> Vec<f64> {
        let (mut v, mut sigma, mut p) = (self.p.clone(), self.system.zero_rows(), self.p.clone());
        self.system.project_momenta(0.0, &self.q, &mut p, &mut v, &mut sigma);
        v
    }

    /// Residuals of all rows; those of normal rows are gaps, m.
    pub fn gaps(&mut self) -> Vec<f64> {
        let (q, v) = (self.q.clone(), self.v());
        self.rows_at(&q, &v)[0].clone()
    }

    /// The least gap of contacts with friction, m.
    pub fn feet(&mut self) -> f64 {
        let gaps = self.gaps();
        let feet = self.system.system().contacts().iter().filter(|contact| contact.tangents);
        feet.map(|contact| gaps[contact.row]).fold(f64::INFINITY, f64::min)
    }

    /// Residuals and velocities of all rows at a state.
    pub fn rows_at(&mut self, q: &[f64], v: &[f64]) -> [Vec<f64>; 2] {
        let system = self.system.system_mut();
        let (mut gaps, mut rates, mut entries) = (system.zero_rows(), system.zero_rows(), system.zero_entries());
        system.gaps(0.0, &q.to_vec(), &v.to_vec(), &mut gaps, &mut rates, &mut entries);
        [gaps, rates]
    }

    /// Kinetic and potential energy, J.
    pub fn energy(&mut self) -> f64 {
        let (kinetic, potential) = self.system.energies(&self.q, &self.p);
        kinetic + potential
    }
}

/// The start of a model, with its loops closed.
pub fn closed_start(plan: &Plan) -> Vec<f64> {
    let mut q = plan.start();
    close(&mut plan.default_interpreter::<f64>(), &mut q, &Closing::default()).unwrap();
    q
}

/// A model from its text.
pub fn model(text: &str) -> Model {
    read::model("scene.toml", text, &Default::default()).unwrap_or_else(|e| panic!("{e}")).model
}

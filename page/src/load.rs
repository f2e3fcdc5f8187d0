//! What acts on a mechanism in the page: joint forces of the sliders, and a spring by which a body is pulled.

use multibody::codegen::model::{Frame, Model, Placement, Rotation, Value};
use multibody::codegen::plan::Plan;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::Interpreter;

/// Joint forces and a spring.
#[derive(Clone, Debug, Default)]
pub struct Load {
    /// Joint forces, N m or N.
    pub efforts: Vec<f64>,
    /// Damping of every velocity in the model, N m s/rad or N s/m: it takes energy.
    pub damping: Vec<f64>,
    /// The spring, if a body is pulled.
    pub pull: Option<Pull>,
}

/// A spring with a damper between a point of a body and a point of the ground.
#[derive(Clone, Debug)]
pub struct Pull {
    /// Has the one frame at the point of the body.
    interpreter: Interpreter<f64>,
    frame: [FrameState<f64>; 1],
    jacobian: Vec<f64>,
    /// The point of the ground, m.
    pub target: [f64; 3],
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
}

/// Name of the frame at the point: a control character is in no name of a model.
const POINT: &str = "\u{1}";

impl Pull {
    /// A spring at a point of a body, in its frame, m. `stiffness` is in N/m, `damping` in N s/m.
    pub fn new(model: &Model, body: usize, at: [f64; 3], stiffness: f64, damping: f64) -> Option<Pull> {
        let mut model = model.clone();
        let placement = Placement { xyz: at.map(Value::Const), rotation: Rotation::NONE };
        model.frames = vec![Frame { name: POINT.into(), body: Some(body), placement }];
        // Contacts and loops change nothing about where the point is.
        model.contacts.clear();
        model.constraints.clear();
        let mut plan = Plan::new(&model, 1e-9);
        plan.frames.retain(|frame| frame.name == POINT);
        plan.wrenches.clear();
        plan.dims.wrenches = 0;
        let interpreter = plan.default_interpreter();
        let jacobian = vec![0.0; 6 * plan.dims.nv];
        let ground = [FrameState::ground()];
        let mut pull = Pull { interpreter, frame: ground, jacobian, target: [0.0; 3], stiffness, damping };
        if plan.frames.len() != 1 || pull.interpreter.tree().frames.len() != 1 {
            return None;
        }
        pull.target = [f64::NAN; 3];
        Some(pull)
    }

    /// Pose and velocity of the point; velocities do not matter for its place.
    pub fn point(&mut self, q: &[f64], v: &[f64]) -> ([f64; 3], [f64; 3]) {
        self.interpreter.frames(q, v, &mut self.frame);
        let [frame] = &self.frame;
        (frame.position, frame.velocity.lin)
    }

    /// Stretch of the spring, m, and velocity of the point, m/s, in ground axes.
    fn stretch(&mut self, q: &[f64], v: &[f64]) -> ([f64; 3], [f64; 3]) {
        let (position, own) = self.point(q, v);
        // Velocities of frames are in their own axes.
        let rotation = &self.frame[0].rotation;
        let velocity = rotation.map(|row| row[0] * own[0] + row[1] * own[1] + row[2] * own[2]);
        (std::array::from_fn(|k| self.target[k] - position[k]), velocity)
    }

    /// The force on the body, N, in ground axes.
    pub fn force(&mut self, q: &[f64], v: &[f64]) -> [f64; 3] {
        let (stretch, velocity) = self.stretch(q, v);
        std::array::from_fn(|k| self.stiffness * stretch[k] - self.damping * velocity[k])
    }

    /// Energy of the spring, J.
    pub fn energy(&mut self, q: &[f64]) -> f64 {
        let rest = vec![0.0; self.jacobian.len() / 6];
        let (stretch, _) = self.stretch(q, &rest);
        0.5 * self.stiffness * stretch.iter().map(|x| x * x).sum::<f64>()
    }

    /// Power of the damper, W: what it takes is negative.
    fn power(&mut self, q: &[f64], v: &[f64]) -> f64 {
        let (_, velocity) = self.stretch(q, v);
        -self.damping * velocity.iter().map(|x| x * x).sum::<f64>()
    }

    /// Adds the generalised force to joint forces.
    fn add(&mut self, q: &[f64], v: &[f64], tau: &mut [f64]) {
        let force = self.force(q, v);
        self.interpreter.jacobians(q, &mut self.jacobian);
        let rotation = &self.frame[0].rotation;
        let own: [f64; 3] = std::array::from_fn(|k| (0..3).map(|i| rotation[i][k] * force[i]).sum());
        let nv = tau.len();
        for (j, tau) in tau.iter_mut().enumerate() {
            *tau += (0..3).map(|k| self.jacobian[k * nv + j] * own[k]).sum::<f64>();
        }
    }
}

impl Load {
    /// Whether it depends on velocities.
    pub fn feels(&self) -> bool {
        self.pull.is_some()
    }

    /// Whether anything but gravity and springs of the model changes the energy.
    pub fn works(&self) -> bool {
        self.pull.is_some() || self.efforts.iter().chain(&self.damping).any(|x| *x != 0.0)
    }

    /// Sets joint forces.
    pub fn set(&mut self, q: &[f64], v: &[f64], tau: &mut [f64]) {
        tau.copy_from_slice(&self.efforts);
        if let Some(pull) = &mut self.pull {
            pull.add(q, v, tau);
        }
    }

    /// Power of what has no potential, W.
    pub fn power(&mut self, q: &[f64], v: &[f64]) -> f64 {
        let joints =
            self.efforts.iter().zip(&self.damping).zip(v).map(|((effort, damping), v)| effort * v - damping * v * v);
        joints.sum::<f64>() + self.pull.as_mut().map_or(0.0, |pull| pull.power(q, v))
    }

    /// Energy of the spring, J.
    pub fn energy(&mut self, q: &[f64]) -> f64 {
        self.pull.as_mut().map_or(0.0, |pull| pull.energy(q))
    }
}

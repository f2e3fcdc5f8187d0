//! Changes of the tree at run time (6.4 and 7.4 of the thesis): the state of a mechanism as the state of another model
//! of the same bodies, in which a joint was cut, locked or exchanged.
//!
//! Bodies are matched by name. Their poses are carried over: the new joints' coordinates are taken from them. So is
//! their momentum, as far as the new joints let it: the new conjugate momenta are `p' = Σ J'ᵀ h`, over all bodies, with
//! the momentum `h` of the body in the old motion and the velocity Jacobian `J'` of its frame in the new tree. That is
//! the plastic impact by which a joint locks, `v' = M'⁻¹ p'`: of all velocities of the new model those whose difference
//! from the old motion has the least kinetic energy. Where the old motion is one of the new model, as after a cut, the
//! velocities of the bodies do not change, although the momenta do (6.4). Impulses inside the mechanism cancel, so that
//! a tree that floats freely keeps its linear and angular momentum.

mod error;
mod extract;
pub(crate) mod moves;
mod rejoin;

use std::collections::HashMap;
use std::f64::consts::TAU;

use mbd_runtime::spatial::{Motion, RigidInertia};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::{Dims, Source, Tree, TreeFrame, TreeWrench, WrenchAxes};
use mbd_runtime::{Constrained, Interpreter, System};

pub use error::{RejoinError, TransferError};
pub use moves::NoCode;

use crate::model::{JointMotion, Unit};
use crate::plan::{Plan, Rigid, Slot};
use extract::{coordinates, Half};

/// What a joint or loop may be off its place when a state is carried over. The bodies it carries are moved by as much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Distance, m.
    pub length: f64,
    /// Angle, rad.
    pub angle: f64,
}

impl Default for Fit {
    /// 1e-8 m and 1e-8 rad.
    fn default() -> Self {
        Fit { length: 1e-8, angle: 1e-8 }
    }
}

/// A state that was carried over, and what has happened to it.
#[derive(Clone, Debug)]
pub struct Transferred {
    /// Coordinates of the new model.
    pub q: Vec<f64>,
    /// Its velocities.
    pub v: Vec<f64>,
    /// Its conjugate momenta, free of multipliers where it has loops or couplings.
    pub p: Vec<f64>,
    /// Kinetic and potential energy in the old model, J.
    pub before: [f64; 2],
    /// The same in the new model. Springs that are gone are missing in its potential energy.
    pub after: [f64; 2],
    /// The joint that is farthest from its place, as a part of what [`Fit`] allows; `None` without joints.
    pub misfit: Option<Misfit>,
    /// The body whose velocity has changed most; `None` without bodies.
    pub jump: Option<Jump>,
}

impl Transferred {
    /// Kinetic energy that the impact took, J. Without prescribed joints it is not negative, but for round-off.
    pub fn lost(&self) -> f64 {
        self.before[0] - self.after[0]
    }
}

/// A joint whose bodies do not stand exactly where it lets them.
#[derive(Clone, Debug, PartialEq)]
pub struct Misfit {
    /// Name of the joint in the new model.
    pub joint: String,
    /// Distance, m.
    pub length: f64,
    /// Angle, rad.
    pub angle: f64,
}

/// Change of the velocity of a body, in its own axes, at its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Jump {
    /// Name of the body.
    pub body: String,
    /// Change of its velocity, m/s.
    pub linear: f64,
    /// Change of its angular velocity, rad/s.
    pub angular: f64,
}

/// A body of both models.
#[derive(Clone, Debug)]
struct SharedBody {
    /// Its frame among those of the old and of the new model.
    frames: [usize; 2],
    /// Its frame in that of the new model's node.
    in_node: Rigid,
    /// At its frame.
    inertia: RigidInertia<f64>,
    /// Its wrench in [`Transfer::impulses`]; `None` where it is fixed to the ground.
    wrench: Option<usize>,
}

/// A joint of the new model.
#[derive(Clone, Debug)]
struct NewJoint {
    name: String,
    parent: Option<usize>,
    child: usize,
    /// First coordinate, and the elementary joints, where the joint has coordinates in the state.
    own: Option<(usize, Vec<Half>)>,
    /// Which of the coordinates are angles, modulo whole turns.
    angles: Vec<bool>,
    /// Its unit quaternion among the coordinates.
    quaternion: Option<usize>,
    /// First coordinate of the old model's joint of the same name and kind, and whether it is the same joint.
    before: Option<(usize, bool)>,
}

/// A rotor that goes on: the coordinate of a joint that both models have, with reflected inertia.
#[derive(Clone, Debug)]
struct Rotor {
    /// Velocity of the new model, and its momentum for a unit rate of the rotor, kg m² or kg.
    velocity: usize,
    momentum: f64,
    /// Node of the old model and its freedom.
    node: usize,
    freedom: usize,
}

/// Carries states of one model over to another one of the same bodies. Making it is the slow part; one transfer serves
/// any number of states.
///
/// ```
/// # use mbd_codegen::{plan::Plan, read::{self, ImportOptions}, transfer::Transfer};
/// let text = r#"
///     name = "pendulum"
///     gravity = [0, 0, -9.81]
///     [[body]]
///     name = "bob"
///     mass = 2.0
///     com = [0, 0, -0.5]
///     inertia = [0.01, 0.01, 0.01]
///     [[joint]]
///     name = "pin"
///     type = "revolute"
///     parent = "ground"
///     child = "bob"
///     axis = [0, 1, 0]
/// "#;
/// let model = read::model("pendulum.toml", text, &ImportOptions::default()).unwrap().model;
/// let [hanging, falling] = [&model, &model.cut("pin").unwrap()].map(|model| Plan::new(model, 0.0));
/// let (mut old, mut new) = (hanging.default_interpreter(), falling.default_interpreter());
/// let state = Transfer::new(&hanging, &falling)?.apply(&mut old, &[0.3], &[2.0], &mut new)?;
/// assert!((state.v[4] - 2.0).abs() < 1e-14 && state.lost().abs() < 1e-14);
/// # Ok::<(), mbd_codegen::transfer::TransferError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Transfer {
    /// What joints and loops of the new model may be off their places.
    pub fit: Fit,
    bodies: Vec<SharedBody>,
    names: Vec<String>,
    joints: Vec<NewJoint>,
    rotors: Vec<Rotor>,
    constraints: Vec<String>,
    /// The new tree at rest, without gravity and passive elements, with a wrench on every body: its joint forces are
    /// those that hold against the wrenches, `−Σ Jᵀ w`.
    impulses: Interpreter<f64>,
    /// Dimensions and numbers of frames of both models.
    sizes: [(Dims, usize); 2],
}

impl Transfer {
    /// A transfer from one model to another, with the parameters of both at their defaults.
    ///
    /// # Errors
    /// [`TransferError::Body`], [`TransferError::Inertia`].
    pub fn new(from: &Plan, to: &Plan) -> Result<Transfer, TransferError> {
        Transfer::with_params(from, &from.default_params(), to, &to.default_params())
    }

    /// The same with given parameters: one number for each parameter of the model.
    ///
    /// # Errors
    /// [`TransferError::Size`] for the parameters, and those of [`Transfer::new`].
    pub fn with_params(
        from: &Plan,
        from_params: &[f64],
        to: &Plan,
        to_params: &[f64],
    ) -> Result<Transfer, TransferError> {
        check("parameters of the old model", from.params().len(), from_params.len())?;
        check("parameters of the new model", to.params().len(), to_params.len())?;
        let tree = to.tree(to_params);
        let (bodies, wrenches) = shared_bodies((from, from_params), (to, to_params), &tree)?;
        let halves = halves(to, &tree);
        let same_params = from.params() == to.params() && from_params == to_params;
        let joints = joints(from, to, halves, same_params);
        let rotors = rotors(from, to, &tree);
        let sizes = [from, to].map(|plan| (plan.dims, plan.frames.len()));
        Ok(Transfer {
            fit: Fit::default(),
            bodies,
            names: to.model.bodies.iter().map(|b| b.name.clone()).collect(),
            joints,
            rotors,
            constraints: to.constraint_names(),
            impulses: at_rest(tree, wrenches),
            sizes,
        })
    }

    /// Carries the state `(q, v)` of the old model over. `from` and `to` are interpreters of the two models with the
    /// parameters of this transfer; prescribed positions and rates are taken from their inputs.
    ///
    /// Joints that both models have alike keep their coordinates to the bit; angles of joints of the same name and kind
    /// keep their turns. The momentum of a rotor goes on with its joint, by name; a rotor whose joint is new starts from
    /// rest.
    ///
    /// # Errors
    /// [`TransferError`], all but the first two.
    pub fn apply(
        &mut self,
        from: &mut Interpreter<f64>,
        q: &[f64],
        v: &[f64],
        to: &mut Interpreter<f64>,
    ) -> Result<Transferred, TransferError> {
        self.check_sizes(from, q, v, to)?;
        let mut p = vec![0.0; v.len()];
        from.momenta(q, v, &mut p);
        let (kinetic, potential) = from.energy(q, &p);
        let before = [kinetic, potential];
        let old = self.states(0, from, q, v);
        let new_q = self.coordinates(q, &old, to);
        let rest = vec![0.0; self.sizes[1].0.nv];
        let misfit = self.misfit(&old, &self.states(1, to, &new_q, &rest))?;
        self.check_loops(&new_q, to)?;
        to.check_rank(&new_q).map_err(TransferError::Singular)?;
        let mut new_p = self.momenta(&old, &new_q, from, v, to);
        let mut new_v = rest;
        if to.rows().is_empty() {
            to.velocities(&new_q, &new_p, &mut new_v);
        } else {
            let mut sigma = to.zero_rows();
            to.project_momenta(0.0, &new_q, &mut new_p, &mut new_v, &mut sigma);
        }
        if !new_q.iter().chain(&new_p).chain(&new_v).all(|x| x.is_finite()) {
            return Err(TransferError::NotFinite);
        }
        let (kinetic, potential) = to.energy(&new_q, &new_p);
        let jump = self.jump(&old, &self.states(1, to, &new_q, &new_v));
        Ok(Transferred { q: new_q, v: new_v, p: new_p, before, after: [kinetic, potential], misfit, jump })
    }

    fn check_sizes(
        &self,
        from: &Interpreter<f64>,
        q: &[f64],
        v: &[f64],
        to: &Interpreter<f64>,
    ) -> Result<(), TransferError> {
        let [(old, _), (new, _)] = self.sizes;
        check("coordinates of the state", old.nq, q.len())?;
        check("velocities of the state", old.nv, v.len())?;
        for (interpreter, (dims, frames)) in [from, to].into_iter().zip(self.sizes) {
            let tree = interpreter.tree();
            check("coordinates of an interpreter", dims.nq, tree.dims.nq)?;
            check("velocities of an interpreter", dims.nv, tree.dims.nv)?;
            check("frames of an interpreter", frames, tree.frames.len())?;
            check("prescribed positions", dims.drive_q, interpreter.drive_q.len())?;
            check("prescribed rates", dims.drive_v, interpreter.drive_v.len())?;
        }
        check("rows of the constraints", new.rows, to.rows().len())
    }

    /// Poses and velocities of all bodies in the old (0) or the new model (1).
    fn states(&self, side: usize, of: &mut Interpreter<f64>, q: &[f64], v: &[f64]) -> Vec<FrameState<f64>> {
        let mut frames = vec![FrameState::ground(); self.sizes[side].1];
        of.frames(q, v, &mut frames);
        self.bodies.iter().map(|b| frames[b.frames[side]]).collect()
    }

    /// Coordinates of the new model out of the poses of the bodies, each joint's out of those of its own two bodies.
    fn coordinates(&self, q: &[f64], bodies: &[FrameState<f64>], to: &Interpreter<f64>) -> Vec<f64> {
        let node = |b: usize| pose(&bodies[b]).then(&self.bodies[b].in_node.inverse());
        let mut new_q = to.neutral();
        for joint in &self.joints {
            let Some((at, halves)) = &joint.own else { continue };
            let out = &mut new_q[*at..*at + joint.angles.len()];
            let before = joint.before.map(|(old, same)| (&q[old..old + joint.angles.len()], same));
            if let Some((before, true)) = before {
                out.copy_from_slice(before);
                continue;
            }
            let parent = joint.parent.map_or(Rigid::IDENTITY, node);
            coordinates(halves, &parent.inverse().then(&node(joint.child)), out);
            let Some((before, false)) = before else { continue };
            for ((x, before), _) in out.iter_mut().zip(before).zip(&joint.angles).filter(|(_, angle)| **angle) {
                *x += TAU * ((before - *x) / TAU).round();
            }
            if let Some(first) = joint.quaternion {
                let along: f64 = (first..first + 4).map(|k| out[k] * before[k]).sum();
                if along < 0.0 {
                    out[first..first + 4].iter_mut().for_each(|x| *x = -*x);
                }
            }
        }
        new_q
    }

    /// The joint that fits worst, if all fit.
    fn misfit(&self, old: &[FrameState<f64>], new: &[FrameState<f64>]) -> Result<Option<Misfit>, TransferError> {
        let (mut worst, mut found) = (-1.0, None);
        for joint in &self.joints {
            let [wanted, given] = [old, new].map(|bodies| {
                let parent = joint.parent.map_or(Rigid::IDENTITY, |b| pose(&bodies[b]));
                parent.inverse().then(&pose(&bodies[joint.child]))
            });
            let length = distance(&wanted.pos, &given.pos);
            let turned = distance(wanted.rot.as_flattened(), given.rot.as_flattened());
            // |R − R'| = 2√2 sin(θ/2) for two rotations θ apart.
            let angle = 2.0 * libm::asin((turned / 8.0_f64.sqrt()).min(1.0));
            let size = (length / self.fit.length).max(angle / self.fit.angle);
            // What is not a number does not fit.
            if size.is_nan() || length.is_nan() || length > self.fit.length || angle > self.fit.angle {
                return Err(TransferError::Position { joint: joint.name.clone(), length, angle });
            }
            if size > worst {
                worst = size;
                found = Some(Misfit { joint: joint.name.clone(), length, angle });
            }
        }
        Ok(found)
    }

    fn check_loops(&self, q: &Vec<f64>, to: &mut Interpreter<f64>) -> Result<(), TransferError> {
        let (mut residual, mut entries) = (to.zero_rows(), to.zero_entries());
        to.constraint_residuals(q, &mut residual, &mut entries);
        let allowed = self.fit.length.min(self.fit.angle);
        // A residual that is not a number is open.
        let open = |x: f64| x.is_nan() || x.abs() > allowed;
        let mut rows = to.rows().iter().zip(&residual);
        let Some(worst) = rows.find_map(|(row, x)| open(*x).then_some(row.constraint)) else { return Ok(()) };
        let rows = to.rows().iter().zip(&residual).filter(|(row, _)| row.constraint == worst);
        let residual = rows.map(|(_, x)| x.abs()).fold(0.0, f64::max);
        Err(TransferError::Open { constraint: self.constraints.get(worst).cloned().unwrap_or_default(), residual })
    }

    /// `Σ Jᵀ h` of the new tree, with the rotors that go on.
    fn momenta(
        &mut self,
        old: &[FrameState<f64>],
        q: &[f64],
        from: &Interpreter<f64>,
        v: &[f64],
        to: &Interpreter<f64>,
    ) -> Vec<f64> {
        for (body, state) in self.bodies.iter().zip(old) {
            if let Some(k) = body.wrench {
                let momentum = body.inertia.momentum(&state.velocity);
                self.impulses.wrenches[k] = std::array::from_fn(|c| momentum.get(c));
            }
        }
        self.impulses.drive_q.copy_from_slice(&to.drive_q);
        let rest = vec![0.0; self.sizes[1].0.nv];
        let mut p = rest.clone();
        self.impulses.inverse_dynamics(q, &rest, &rest, &mut p);
        p.iter_mut().for_each(|p| *p = -*p);
        for rotor in &self.rotors {
            let node = &from.tree().nodes[rotor.node];
            let rate = match node.source {
                Source::State { v: at, .. } => node.ratio * v[at + rotor.freedom],
                Source::Drive { v: at, .. } => node.ratio * from.drive_v[at + rotor.freedom],
            };
            p[rotor.velocity] += rotor.momentum * rate;
        }
        p
    }

    fn jump(&self, old: &[FrameState<f64>], new: &[FrameState<f64>]) -> Option<Jump> {
        let changes = old.iter().zip(new).zip(&self.names).map(|((old, new), name)| {
            let (a, b): (Motion<f64>, Motion<f64>) = (old.velocity, new.velocity);
            let [a, b] = [a, b].map(|m| std::array::from_fn::<f64, 6, _>(|k| m.get(k)));
            Jump { body: name.clone(), linear: distance(&a[..3], &b[..3]), angular: distance(&a[3..], &b[3..]) }
        });
        changes.max_by(|a, b| (a.linear + a.angular).total_cmp(&(b.linear + b.angular)))
    }
}

fn check(what: &'static str, expected: usize, found: usize) -> Result<(), TransferError> {
    match expected == found {
        true => Ok(()),
        false => Err(TransferError::Size { what, expected, found }),
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn pose(frame: &FrameState<f64>) -> Rigid {
    Rigid { rot: frame.rotation, pos: frame.position }
}

/// The bodies in the order of the new model, and a wrench on each that can move.
fn shared_bodies(
    (from, from_params): (&Plan, &[f64]),
    (to, to_params): (&Plan, &[f64]),
    tree: &Tree<f64>,
) -> Result<(Vec<SharedBody>, Vec<TreeWrench<f64>>), TransferError> {
    let [in_old, in_new] = [from, to].map(|plan| {
        let frames = plan.frames.iter().enumerate().rev();
        frames.map(|(k, f)| (f.name.as_str(), k)).collect::<HashMap<&str, usize>>()
    });
    let old: HashMap<&str, usize> = from.model.bodies.iter().enumerate().map(|(k, b)| (b.name.as_str(), k)).collect();
    let new: HashMap<&str, usize> = to.model.bodies.iter().enumerate().map(|(k, b)| (b.name.as_str(), k)).collect();
    let missing = |body: &str, plan: &Plan| TransferError::Body { body: body.into(), model: plan.model.name.clone() };
    if let Some(body) = from.model.bodies.iter().find(|b| !new.contains_key(b.name.as_str())) {
        return Err(missing(&body.name, to));
    }
    let (mut bodies, mut wrenches) = (Vec::new(), Vec::new());
    for (b, body) in to.model.bodies.iter().enumerate() {
        let name = body.name.as_str();
        let (Some(&before), Some(&f), Some(&t)) = (old.get(name), in_old.get(name), in_new.get(name)) else {
            return Err(missing(name, from));
        };
        let inertia = to.inertia_of_body(b, &[], to_params);
        let other = from.inertia_of_body(before, &[], from_params);
        let (x, y) = (inertia.parameters(), other.parameters());
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
        // Moments and products of inertia are compared with the largest of them.
        let size = |x: &[f64; 10]| x[4..].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let largest = size(&x).max(size(&y));
        let alike = (0..4).all(|k| near(x[k], y[k])) && (4..10).all(|k| (x[k] - y[k]).abs() <= 1e-12 * largest);
        if !alike {
            return Err(TransferError::Inertia { body: name.into() });
        }
        let frame = &tree.frames[t];
        let mut in_node = Rigid::IDENTITY;
        frame.place.iter().for_each(|step| step.pose(&mut in_node.rot, &mut in_node.pos));
        let wrench = frame.node.map(|node| {
            let mut path: Vec<usize> = std::iter::successors(Some(node), |&i| tree.nodes[i].parent).collect();
            path.reverse();
            wrenches.push(TreeWrench { frame: frame.clone(), axes: WrenchAxes::Frame, path });
            wrenches.len() - 1
        });
        bodies.push(SharedBody { frames: [f, t], in_node, inertia, wrench });
    }
    Ok((bodies, wrenches))
}

/// The elementary joints of every joint of the model, with the poses of their nodes at zero coordinates, which the
/// interpreter computes.
fn halves(plan: &Plan, tree: &Tree<f64>) -> HashMap<usize, Vec<Half>> {
    let mut bare = tree.clone();
    bare.frames = (0..bare.nodes.len()).map(|i| TreeFrame { node: Some(i), place: Vec::new() }).collect();
    bare.joint_nodes.clear();
    bare.accelerations = None;
    let mut interpreter = Interpreter::new(bare, [0.0; 3]);
    let mut nodes = vec![FrameState::ground(); tree.nodes.len()];
    let (q, v) = (interpreter.neutral(), interpreter.zero_momenta());
    interpreter.frames(&q, &v, &mut nodes);
    let mut halves: HashMap<usize, Vec<Half>> = HashMap::new();
    for (i, node) in plan.nodes.iter().enumerate() {
        let parent = node.parent.map_or(Rigid::IDENTITY, |p| pose(&nodes[p]));
        let zero = parent.inverse().then(&pose(&nodes[i]));
        halves.entry(node.joint.0).or_default().push(Half { kind: tree.nodes[i].kind, zero });
    }
    halves
}

fn joints(from: &Plan, to: &Plan, mut halves: HashMap<usize, Vec<Half>>, same_params: bool) -> Vec<NewJoint> {
    let old: HashMap<&str, usize> = from.model.joints.iter().enumerate().map(|(k, j)| (j.name.as_str(), k)).collect();
    let name = |plan: &Plan, body: Option<usize>| body.map(|b| plan.model.bodies[b].name.clone());
    let joint = |(k, joint): (usize, &crate::model::Joint)| {
        let spec = joint.kind.spec();
        let own = match Slot::of_joint(&to.slots, k).and_then(|slot| slot.at) {
            Some(Source::State { q, .. }) if joint.motion == JointMotion::Free => {
                halves.remove(&k).map(|halves| (q, halves))
            }
            _ => None,
        };
        let before = old.get(joint.name.as_str()).and_then(|&b| {
            let before = &from.model.joints[b];
            let Some(Source::State { q, .. }) = Slot::of_joint(&from.slots, b)?.at else { return None };
            let same = same_params
                && before.kind == joint.kind
                && before.placement == joint.placement
                && name(from, before.parent) == name(to, joint.parent)
                && name(from, Some(before.child)) == name(to, Some(joint.child));
            (before.kind.spec() == spec).then_some((q, same))
        });
        NewJoint {
            name: joint.name.clone(),
            parent: joint.parent,
            child: joint.child,
            own,
            angles: spec.coordinates.iter().map(|c| c.unit == Unit::Radian && !spec.pitch).collect(),
            quaternion: spec.quaternion(),
            before,
        }
    };
    to.model.joints.iter().enumerate().map(joint).collect()
}

/// Rotors of joints that both models have, by name and kind.
fn rotors(from: &Plan, to: &Plan, tree: &Tree<f64>) -> Vec<Rotor> {
    let part = |plan: &Plan, joint: (usize, usize)| (plan.model.joints[joint.0].name.clone(), joint.1);
    let old: HashMap<(String, usize), usize> =
        from.nodes.iter().enumerate().map(|(i, n)| (part(from, n.joint), i)).collect();
    let mut rotors = Vec::new();
    for (plan_node, node) in to.nodes.iter().zip(&tree.nodes) {
        let (Source::State { v, .. }, Some(&before)) = (node.source, old.get(&part(to, plan_node.joint))) else {
            continue;
        };
        let kinds = [(from, from.nodes[before].joint.0), (to, plan_node.joint.0)];
        let [a, b] = kinds.map(|(plan, joint)| plan.model.joints[joint].kind.spec());
        if a != b {
            continue;
        }
        for (freedom, passive) in node.passive.iter().enumerate().filter(|(_, passive)| passive.armature != 0.0) {
            let momentum = node.ratio * passive.armature;
            rotors.push(Rotor { velocity: v + freedom, momentum, node: before, freedom });
        }
    }
    rotors
}

/// The tree with these wrenches, and with nothing else that acts.
fn at_rest(mut tree: Tree<f64>, wrenches: Vec<TreeWrench<f64>>) -> Interpreter<f64> {
    for passive in tree.nodes.iter_mut().flat_map(|node| &mut node.passive) {
        (passive.damping, passive.stiffness, passive.armature) = (0.0, 0.0, 0.0);
    }
    tree.dims.wrenches = wrenches.len();
    tree.wrenches = wrenches;
    tree.accelerations = None;
    Interpreter::new(tree, [0.0; 3])
}

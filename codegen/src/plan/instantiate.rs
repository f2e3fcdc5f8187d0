//! Converts a plan to a tree over any scalar: numbers, symbols, dual numbers.

use mbd_runtime::spatial::{add3, ElementaryTransform, Mat3, RigidInertia, Vec3, SYM};
use mbd_runtime::system::Row;
use mbd_runtime::tree::{Bond, Constraint, Cut, Node, Passive, Tree, TreeFrame, TreeWrench};
use mbd_runtime::{Interpreter, Scalar};

use super::placement::rotation;
use super::structure::{Plan, PlanBond, PlanConstraint, PlanNode, PoseStep, RowsThatAct};
use crate::model::{Gravity, Param, Value};

/// A number of the model as a scalar.
fn value<S: Scalar>(v: Value, params: &[S]) -> S {
    match v {
        Value::Const(x) => S::constant(x),
        Value::Param(k) => params[k],
    }
}

fn steps<S: Scalar>(pose: &[PoseStep], params: &[S]) -> Vec<ElementaryTransform<S>> {
    pose.iter()
        .map(|step| match *step {
            PoseStep::Turn { axis, c, s } => ElementaryTransform::Turn { axis, c: S::constant(c), s: S::constant(s) },
            PoseStep::TurnBy { axis, angle } => {
                let (s, c) = value(angle, params).sin_cos();
                ElementaryTransform::Turn { axis, c, s }
            }
            PoseStep::Shift { axis, r } => ElementaryTransform::Shift { axis, r: value(r, params) },
            PoseStep::Rotate(m) => ElementaryTransform::Rotate(m.map(|row| row.map(S::constant))),
        })
        .collect()
}

/// Inertia of a body at a frame in which it stands at `(rot, pos)`: mass, centre of mass, inertia about it
/// `[xx, yy, zz, xy, xz, yz]` in axes rotated by `axes` from those of the body.
pub(super) fn body_inertia<S: Scalar>(
    mass: S,
    com: Vec3<S>,
    inertia: [S; 6],
    axes: &Mat3<S>,
    rot: &Mat3<S>,
    pos: Vec3<S>,
) -> RigidInertia<S> {
    let [xx, yy, zz, xy, xz, yz] = inertia;
    let about_com = [xx, xy, xz, yy, yz, zz];
    let turned = |m: [S; 6], r: &Mat3<S>| {
        let body = RigidInertia { mass: S::zero(), moment: [S::zero(); 3], inertia: m };
        ElementaryTransform::Rotate(*r).inertia(&body.articulated()).j
    };
    let j = turned(turned(about_com, axes), rot);
    let c = add3(ElementaryTransform::Rotate(*rot).vector_back(com), pos);
    let square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    let mut at_frame = j;
    for a in 0..3 {
        for b in a..3 {
            let shift = if a == b { square - c[a] * c[b] } else { -(c[a] * c[b]) };
            at_frame[SYM[a][b]] = j[SYM[a][b]] + mass * shift;
        }
    }
    RigidInertia { mass, moment: c.map(|x| mass * x), inertia: at_frame }
}

impl Plan {
    /// An interpreter with given parameters and the model's gravity (zero where it is an input: set it before a call).
    pub fn interpreter<S: Scalar>(&self, params: &[S]) -> Interpreter<S> {
        match &self.acts {
            RowsThatAct::Some(of) => of.0.interpreter(params).acting(&of.1),
            RowsThatAct::All | RowsThatAct::Input => Interpreter::new(self.tree(params), self.gravity(params))
                .with_names(self.velocity_names(), self.constraint_names()),
        }
    }

    /// The interpreter with the parameters at their defaults.
    pub fn default_interpreter<S: Scalar>(&self) -> Interpreter<S> {
        self.interpreter(&self.default_params().into_iter().map(S::constant).collect::<Vec<S>>())
    }

    /// The plan whose inertia includes what a step by the implicit midpoint rule adds for springs and dampers of the joints:
    /// [`Passive::implicit_inertia`]. The length of the step, s, is one more parameter, the last one.
    pub fn with_implicit_springs(&self) -> Plan {
        let mut plan = self.clone();
        plan.step = Some(plan.model.params.len());
        plan.model.params.push(Param { name: String::from("step"), default: 0.0 });
        if let RowsThatAct::Some(of) = &mut plan.acts {
            of.0 = of.0.with_implicit_springs();
        }
        plan.accelerations = plan.accelerations.map(|other| Box::new(other.with_implicit_springs()));
        plan
    }

    /// Gravity of the model at given parameters; zero where it is an input, to be set with every call.
    pub fn gravity<S: Scalar>(&self, params: &[S]) -> [S; 3] {
        self.gravity_or(params, || [S::zero(); 3])
    }

    /// Gravity of the model at given parameters; what is given where it is an input.
    pub(crate) fn gravity_or<S: Scalar>(&self, params: &[S], given: impl FnOnce() -> [S; 3]) -> [S; 3] {
        match self.model.gravity {
            Gravity::Constant(g) => g.map(|v| value(v, params)),
            Gravity::Input => given(),
        }
    }

    /// The plan itself, or the one some rows of which act in it.
    pub(crate) fn with_all_rows(&self) -> &Plan {
        if let RowsThatAct::Some(of) = &self.acts {
            &of.0
        } else {
            self
        }
    }

    /// Rows of the constraints, those that do not act among them.
    pub fn rows(&self) -> Vec<Row> {
        self.with_all_rows().tree(&self.default_params()).rows()
    }

    /// Velocity index of every entry of `Φ`, row by row.
    pub fn entry_columns(&self) -> Vec<usize> {
        self.with_all_rows().tree(&self.default_params()).entry_columns()
    }

    /// The tree with given parameters, not regrouped. `params` has one entry for each run-time parameter.
    pub fn tree<S: Scalar>(&self, params: &[S]) -> Tree<S> {
        let frames: Vec<TreeFrame<S>> =
            self.frames.iter().map(|f| TreeFrame { node: f.node, place: steps(&f.pose, params) }).collect();
        let wrenches = self.wrenches.iter().map(|&(frame, axes)| {
            let mut path: Vec<usize> = std::iter::successors(frames[frame].node, |&i| self.nodes[i].parent).collect();
            path.reverse();
            TreeWrench { frame: frames[frame].clone(), axes, path }
        });
        Tree {
            nodes: self.nodes.iter().map(|n| self.node(n, params)).collect(),
            dims: self.dims,
            unknowns: self.unknowns.clone(),
            solve_at_ground: self.solve_at_ground.clone(),
            ground_moment: [S::zero(); 3],
            wrenches: wrenches.collect(),
            constraints: self.constraints.iter().map(|c| c.instantiate(params)).collect(),
            tolerance: S::rank_tolerance(),
            early_tolerance: self.early_tolerance,
            row_factors: None,
            joint_nodes: self.joint_nodes.clone(),
            matrix_depth: self.matrix_depth,
            accelerations: self.accelerations.as_ref().map(|other| Box::new(other.tree(params))),
            frames,
        }
    }

    fn node<S: Scalar>(&self, node: &PlanNode, params: &[S]) -> Node<S> {
        let kind = node.kind.map(|v| value(v, params));
        let (mut ratio, mut offset) = (S::one(), S::zero());
        for &(r, o) in &node.follow {
            let r = value(r, params);
            ratio = r * ratio;
            offset = r * offset + value(o, params);
        }
        let joint = &self.model.joints[node.joint.0];
        let at = |list: &[Value], k: usize| value(list.get(node.joint.1 + k).copied().unwrap_or(Value::ZERO), params);
        let passive = (0..kind.nv()).map(|k| {
            let passive = Passive {
                damping: at(&joint.damping, k),
                stiffness: at(&joint.stiffness, k),
                rest: at(&joint.rest, k),
                armature: at(&joint.armature, k),
            };
            self.step.map_or(passive, |step| passive.with_implicit_inertia(params[step]))
        });
        Node {
            parent: node.parent,
            place: steps(&node.place, params),
            passive: passive.collect(),
            kind,
            source: node.source,
            ratio,
            offset,
            phase: S::constant(node.phase),
            quarter: node.quarter,
            slide: S::constant(node.slide),
            slides: node.slide != 0.0,
            inertia: self.inertia(node, params),
            elimination: node.elimination.clone(),
        }
    }

    fn inertia<S: Scalar>(&self, node: &PlanNode, params: &[S]) -> RigidInertia<S> {
        let x = node.inertia.map(S::constant);
        let fixed =
            RigidInertia { mass: x[0], moment: [x[1], x[2], x[3]], inertia: [x[4], x[5], x[6], x[7], x[8], x[9]] };
        node.variable.iter().fold(fixed, |sum, (b, pose)| sum.plus(&self.inertia_of_body(*b, pose, params)))
    }

    /// Inertia of body `b` of the model at the frame in which it stands at `pose`, with given parameters.
    pub(crate) fn inertia_of_body<S: Scalar>(&self, b: usize, pose: &[PoseStep], params: &[S]) -> RigidInertia<S> {
        let (o, one) = (S::zero(), S::one());
        let identity = [[one, o, o], [o, one, o], [o, o, one]];
        let body = &self.model.bodies[b];
        let of = |v: Value| value(v, params);
        let (mut rot, mut pos, mut axes, mut nowhere) = (identity, [o; 3], identity, [o; 3]);
        for step in steps(pose, params) {
            step.pose(&mut rot, &mut pos);
        }
        for step in steps(&rotation(&body.inertia_axes, self.snap, &mut |_| {}), params) {
            step.pose(&mut axes, &mut nowhere);
        }
        body_inertia(of(body.mass), body.com.map(of), body.inertia.map(of), &axes, &rot, pos)
    }
}

impl PlanConstraint {
    /// The constraint over any scalar.
    fn instantiate<S: Scalar>(&self, params: &[S]) -> Constraint<S> {
        let bond = match &self.bond {
            PlanBond::Cut { kind, frames, paths: [path_a, path_b] } => {
                let [a, b] = frames.each_ref().map(|f| TreeFrame { node: f.node, place: steps(&f.pose, params) });
                let closure = kind.closure().map(|v| value(v, params));
                Bond::Cut(Cut {
                    closure,
                    grounded: a.node.is_some() != b.node.is_some(),
                    a,
                    b,
                    path_a: path_a.clone(),
                    path_b: path_b.clone(),
                })
            }
            PlanBond::Coupling { terms, offset } => Bond::Coupling {
                terms: terms.iter().map(|(i, ratio)| (*i, value(*ratio, params))).collect(),
                offset: value(*offset, params),
            },
        };
        let decay = (self.decay != Value::ZERO).then(|| value(self.decay, params));
        let (slots, passes, velocities) = (self.slots.clone(), self.passes.clone(), self.velocities.clone());
        let (first, entry) = (self.first, self.entry);
        Constraint { bond, slots, passes, first, entry, velocities, decay, compliance: None, own_axes: false }
    }
}

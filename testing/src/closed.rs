//! Random trees with constraints that are satisfied exactly in a given state.

use mbd_codegen::model::{
    Constraint, ConstraintKind, JointKind, JointMotion, LoopKind, Model, Mount, Param, Placement, Rotation, Value,
};
use mbd_codegen::options::DEFAULT_SNAP;
use mbd_codegen::plan::Plan;
use mbd_runtime::spatial::{add3, dot3, scale3, Mat3, Vec3};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::Source;

use crate::kkt::{across, mounted, rank, unit, Pose, Rows};
use crate::random::{random_model, rotation_matrix, Distribution, Rng};
use crate::state::{random_state, State};
use crate::touching;
use crate::value;

/// Distribution of the constraints of a random mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopKnobs {
    /// Distribution of the tree.
    pub tree: Distribution,
    /// Whether all joints are revolute and prismatic joints of one plane. A loop that is closed by a joint then has
    /// redundant rows.
    pub planar: bool,
    /// Whether all loops bind bodies of other branches from the ground to one body of the first branch, like legs to a
    /// platform.
    pub platform: bool,
    /// Smallest and largest number of constraints.
    pub count: (usize, usize),
    /// Probability that one end of a loop is on the ground.
    pub ground: f64,
    /// Probability that a constraint is present twice.
    pub twice: f64,
    /// Probability that a constraint couples joints.
    pub coupling: f64,
    /// Weights of the kinds of loops, in the order of [`LoopKind`].
    pub kinds: [f64; 20],
    /// Probability that a constraint has a `decay`.
    pub decay: f64,
    /// Probability that a loop may leave its joints no motion.
    pub locked: f64,
}

impl LoopKnobs {
    /// Spatial trees of revolute joints with loops of every kind.
    pub fn plain() -> LoopKnobs {
        LoopKnobs {
            tree: Distribution { bodies: (3, 8), ..Distribution::default() },
            planar: false,
            platform: false,
            count: (1, 3),
            ground: 0.6,
            twice: 0.0,
            coupling: 0.1,
            kinds: [1.0; 20],
            decay: 0.0,
            locked: 0.0,
        }
    }

    /// Platforms on legs of all kinds of joints, with loops of every kind.
    pub fn platforms(seed: u64) -> LoopKnobs {
        let everything = LoopKnobs::everything(seed, 10);
        // One branch after the other, each of two or three bodies; coordinates that branches share couple these.
        let tree = Distribution { bodies: (8, 12), roots: 0.4, branching: 0.1, mimic: 0.05, ..everything.tree };
        LoopKnobs { tree, platform: true, count: (3, 6), coupling: 0.05, ..everything }
    }

    /// All kinds of joints and constraints on up to `bodies` bodies; the probabilities themselves are random.
    pub fn everything(seed: u64, bodies: usize) -> LoopKnobs {
        let mut rng = Rng::new(seed, 5);
        let planar = rng.chance(0.25);
        let mut tree = Distribution::everything(seed, bodies);
        tree.bodies.0 = 2.min(bodies);
        if planar {
            tree =
                Distribution { kinds: [4.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5], mimic: tree.mimic / 2.0, ..tree };
            // With parallel axes, a body without mass may have motions without inertia.
            tree.massless = 0.0;
        }
        let few = rng.chance(0.4);
        let kinds: [f64; 20] = std::array::from_fn(|_| if few && rng.chance(0.7) { 0.0 } else { 1.0 });
        let kinds = if kinds.iter().all(|w| *w == 0.0) { [1.0; 20] } else { kinds };
        LoopKnobs {
            tree,
            planar,
            platform: false,
            count: (1, 4),
            ground: rng.pick(&[0.0, 0.4, 0.8]),
            twice: if rng.chance(0.2) { 0.4 } else { 0.0 },
            coupling: if rng.chance(0.3) { 0.4 } else { 0.0 },
            kinds,
            decay: if rng.chance(0.3) { 0.5 } else { 0.0 },
            locked: if rng.chance(0.2) { 0.3 } else { 0.0 },
        }
    }
}

/// A mechanism with constraints, and a state that satisfies them. Both are the same for the same seed and distribution.
#[derive(Clone, Debug)]
pub struct LoopSystem {
    /// Seed from which it was made.
    pub seed: u64,
    /// The mechanism.
    pub model: Model,
    /// Plan of the mechanism without its constraints.
    pub open: Plan,
    /// Coordinates that satisfy the constraints, velocities that need not satisfy them, inputs.
    pub state: State,
}

/// A random mechanism that can move: `Φ` has fewer independent rows than there are velocities. Where prescribed motions
/// and loops contradict each other, the prescribed joints are at rest.
///
/// # Panics
/// If none of a thousand mechanisms drawn from the distribution can move.
pub fn random_loops(seed: u64, distribution: &LoopKnobs) -> LoopSystem {
    movable_loops(seed, distribution)
        .unwrap_or_else(|| panic!("seed {seed}: no mechanism drawn from this distribution can move: {distribution:?}"))
}

/// The same, or none where no mechanism of a thousand can move.
pub fn movable_loops(seed: u64, distribution: &LoopKnobs) -> Option<LoopSystem> {
    (0..1000).find_map(|attempt| attempted(seed, attempt, distribution))
}

fn attempted(seed: u64, attempt: u64, distribution: &LoopKnobs) -> Option<LoopSystem> {
    let own = seed.wrapping_add(attempt << 32);
    let mut tree = random_model(own, &distribution.tree);
    tree.name = format!("loops{seed}");
    let mut rng = Rng::new(own, 6);
    if distribution.planar {
        flatten(&mut tree, &mut rng);
    }
    let open = Plan::new(&tree, DEFAULT_SNAP);
    let mut state = random_state(&open, own);
    let mut frames = vec![FrameState::ground(); open.frames.len()];
    state.interpreter(&open).frames(&state.q, &state.v, &mut frames);
    let mut closer = Closer { rng, distribution, model: tree, open: &open, state: &mut state, frames };
    let count = distribution.count.0 + closer.rng.below(distribution.count.1 - distribution.count.0 + 1);
    for _ in 0..count {
        closer.add();
    }
    let model = closer.model;
    let (phi, b) = Rows { plan: &open, model: &model, state: &state }.jacobian();
    let independent = rank(&phi, RANK);
    if independent == 0 || independent >= open.dims.nv {
        return None;
    }
    let augmented = |(row, b): (&Vec<f64>, &f64)| [row.clone(), vec![*b]].concat();
    let with_drives: Vec<Vec<f64>> = phi.iter().zip(&b).map(augmented).collect();
    if rank(&with_drives, RANK) > independent {
        state.drive[1].fill(0.0);
        state.drive[2].fill(0.0);
    }
    Some(LoopSystem { seed, model, open, state })
}

/// A row of unit length depends on other rows if less than this remains of it after their elimination.
const RANK: f64 = 1e-7;

/// Makes a model planar: all axes along z, all rotations about z.
fn flatten(model: &mut Model, rng: &mut Rng) {
    let z = [0.0, 0.0, 1.0];
    for joint in &mut model.joints {
        match &mut joint.kind {
            JointKind::Revolute { axis } => *axis = scale3(rng.pick(&[1.0, -1.0, 2.0]), z),
            JointKind::Planar { normal } => *normal = z,
            JointKind::Prismatic { axis } => *axis = flat_direction(rng),
            _ => {}
        }
        let angle = if rng.chance(0.3) { 0.0 } else { rng.around(3.0) };
        joint.placement.rotation = Rotation::Rpy([Value::ZERO, Value::ZERO, Value::Const(angle)]);
    }
}

fn flat_direction(rng: &mut Rng) -> [f64; 3] {
    let (s, c) = rng.around(3.0).sin_cos();
    [c, s, 0.0]
}

fn about(axis: Vec3<f64>, angle: f64) -> Mat3<f64> {
    rotation_matrix(&Rotation::AxisAngle { axis, angle: Value::Const(angle) }, &[])
}

fn times(a: &Mat3<f64>, b: &Mat3<f64>) -> Mat3<f64> {
    std::array::from_fn(|i| std::array::from_fn(|k| (0..3).map(|j| a[i][j] * b[j][k]).sum()))
}

fn transposed(a: &Mat3<f64>) -> Mat3<f64> {
    std::array::from_fn(|i| std::array::from_fn(|k| a[k][i]))
}

/// A rotation matrix as roll, pitch and yaw of the model description, exact to rounding.
fn described(r: &Mat3<f64>) -> Rotation {
    let pitch = (-r[2][0]).atan2((r[2][1] * r[2][1] + r[2][2] * r[2][2]).sqrt());
    let (roll, yaw) = if pitch.cos() > 1e-3 {
        (r[2][1].atan2(r[2][2]), r[1][0].atan2(r[0][0]))
    } else {
        // Near the poles roll and yaw are rotations about the same axis; roll is set to zero.
        (0.0, (-r[0][1]).atan2(r[1][1]))
    };
    Rotation::Rpy([roll, pitch, yaw].map(Value::Const))
}

/// Adds constraints to a model so that they hold in a state.
struct Closer<'a> {
    rng: Rng,
    distribution: &'a LoopKnobs,
    model: Model,
    open: &'a Plan,
    state: &'a mut State,
    frames: Vec<FrameState<f64>>,
}

impl Closer<'_> {
    /// A constant, or a parameter with this value in the state.
    fn value(&mut self, x: f64) -> Value {
        if !self.rng.chance(self.distribution.tree.params) {
            return Value::Const(x);
        }
        let k = self.model.params.len();
        self.model.params.push(Param { name: format!("c{k}"), default: x });
        self.state.params.push(x);
        Value::Param(k)
    }

    fn add(&mut self) {
        let kind = if self.rng.chance(self.distribution.coupling) { self.coupling() } else { self.closed_loop() };
        let Some(kind) = kind else { return };
        let decay = if self.rng.chance(self.distribution.decay) { self.rng.range(0.5, 20.0) } else { 0.0 };
        let decay = if decay == 0.0 { Value::ZERO } else { self.value(decay) };
        let name = |n: usize| format!("loop{n}");
        let n = self.model.constraints.len();
        self.model.constraints.push(Constraint::new(name(n), kind.clone(), decay));
        if self.rng.chance(self.distribution.twice) {
            self.model.constraints.push(Constraint::new(name(n + 1), kind, decay));
        }
    }

    fn coupling(&mut self) -> Option<ConstraintKind> {
        let single = |j: &usize| {
            let joint = &self.model.joints[*j];
            joint.kind.nv() == 1 && joint.motion == JointMotion::Free
        };
        let mut can: Vec<usize> = (0..self.model.joints.len()).filter(single).collect();
        let n = (2 + self.rng.below(2)).min(can.len());
        if n < 2 {
            return None;
        }
        let mut terms = Vec::new();
        let mut sum = 0.0;
        for _ in 0..n {
            let joint = can.swap_remove(self.rng.below(can.len()));
            let ratio = self.rng.range(0.3, 2.0) * self.rng.pick(&[1.0, -1.0]);
            let at = self.open.slots.iter().find(|s| s.joint == joint).and_then(|s| s.at);
            let Some(Source::State { q, .. }) = at else { return None };
            sum += ratio * self.state.q[q];
            terms.push((joint, self.value(ratio)));
        }
        Some(ConstraintKind::Coupling { terms, offset: self.value(sum) })
    }

    /// Number of velocities of the free joints between two bodies; a mimic joint counts as a joint of its own.
    fn between(&self, a: Option<usize>, b: Option<usize>) -> usize {
        let path = |mut body: Option<usize>| {
            let mut joints = Vec::new();
            while let Some(at) = body {
                let Some(j) = self.model.joints.iter().position(|j| j.child == at) else { break };
                joints.push(j);
                body = self.model.joints[j].parent;
            }
            joints
        };
        let (a, b) = (path(a), path(b));
        let only = |x: &[usize], y: &[usize]| x.iter().copied().filter(|j| !y.contains(j)).collect::<Vec<_>>();
        let moves = |j: &usize| match self.model.joints[*j].motion {
            JointMotion::Prescribed => 0,
            _ => self.model.joints[*j].kind.nv(),
        };
        only(&a, &b).iter().chain(&only(&b, &a)).map(moves).sum()
    }

    /// The body on the ground that a body is carried by.
    fn root(&self, body: usize) -> usize {
        let parent =
            |&at: &usize| self.model.joints.iter().find(|joint| joint.child == at).and_then(|joint| joint.parent);
        std::iter::successors(Some(body), parent).last().unwrap_or(body)
    }

    fn closed_loop(&mut self) -> Option<ConstraintKind> {
        let n = self.model.bodies.len();
        let kind = self.kind();
        for _ in 0..20 {
            let ground = !self.distribution.platform && self.rng.chance(self.distribution.ground);
            let mut ends = [Some(self.rng.below(n)), if ground { None } else { Some(self.rng.below(n)) }];
            if self.distribution.platform {
                let platform = (0..n).take_while(|&body| self.root(body) == self.root(0)).last();
                if ends[0].is_some_and(|body| self.root(body) == self.root(0)) {
                    continue;
                }
                ends[1] = platform;
            }
            if self.rng.chance(0.5) {
                ends.swap(0, 1);
            }
            let free = self.between(ends[0], ends[1]);
            // In a plane at most three rows are independent.
            let rows = kind.spec().rows.len();
            let needed = if self.distribution.planar { rows.min(3) } else { rows };
            if free == 0 || (free <= needed && !self.rng.chance(self.distribution.locked)) {
                continue;
            }
            let first = Mount { body: ends[0], placement: self.placement() };
            let a = mounted(self.open, &self.state.params, &self.frames, &first);
            let (turn, offset) = self.allowed(&kind);
            let second = self.second(ends[1], &a, &turn, offset);
            return Some(ConstraintKind::Loop { kind, first, second });
        }
        None
    }

    fn placement(&mut self) -> Placement {
        let xyz: [f64; 3] = std::array::from_fn(|_| self.rng.around(0.4));
        let xyz = xyz.map(|x| self.value(x));
        let angle = self.rng.around(3.0);
        if self.distribution.planar {
            return Placement { xyz, rotation: Rotation::Rpy([Value::ZERO, Value::ZERO, Value::Const(angle)]) };
        }
        if self.rng.chance(0.4) {
            return Placement {
                xyz,
                rotation: Rotation::AxisAngle { axis: self.direction(), angle: self.value(angle) },
            };
        }
        let rotation = if self.rng.chance(0.2) {
            Rotation::NONE
        } else {
            Rotation::Rpy(std::array::from_fn(|_| Value::Const(self.rng.around(3.0))))
        };
        Placement { xyz, rotation }
    }

    /// Mount of the second frame on its body: rotated by `turn` and displaced by `offset` from the first frame.
    fn second(&mut self, body: Option<usize>, a: &Pose<f64>, turn: &Mat3<f64>, offset: Vec3<f64>) -> Mount {
        let at = Mount { body, placement: Placement::IDENTITY };
        let carrier = mounted(self.open, &self.state.params, &self.frames, &at);
        let origin = add3(a.origin, a.turn(offset));
        let back = transposed(&carrier.axes);
        let arm = [0, 1, 2].map(|k| origin[k] - carrier.origin[k]);
        let xyz = back.map(|row| dot3(row, arm));
        let rotation = described(&times(&back, &times(&a.axes, turn)));
        Mount { body, placement: Placement { xyz: xyz.map(|x| self.value(x)), rotation } }
    }

    /// A random direction; in a planar model the normal of the plane.
    fn direction(&mut self) -> Vec3<f64> {
        if self.distribution.planar {
            return [0.0, 0.0, self.rng.pick(&[1.0, -1.0, 2.0])];
        }
        if self.rng.chance(0.4) {
            let mut v = [0.0; 3];
            v[self.rng.below(3)] = self.rng.pick(&[1.0, -1.0, 2.0]);
            return v;
        }
        loop {
            let v: Vec3<f64> = std::array::from_fn(|_| self.rng.around(1.0));
            if dot3(v, v) > 0.04 {
                return v;
            }
        }
    }

    /// A random direction; in a planar model one in the plane.
    fn sideways(&mut self) -> Vec3<f64> {
        if self.distribution.planar {
            flat_direction(&mut self.rng)
        } else {
            self.direction()
        }
    }

    fn kind(&mut self) -> LoopKind {
        let length = self.rng.range(0.2, 0.8);
        match self.rng.weighted(&self.distribution.kinds) {
            0 => LoopKind::Revolute { axis: self.direction() },
            1 => LoopKind::Prismatic { axis: self.sideways() },
            2 => LoopKind::Cylindrical { axis: self.direction() },
            3 => {
                let pitch = self.rng.range(0.05, 0.3) * self.rng.pick(&[1.0, -1.0]);
                LoopKind::Helical { axis: self.direction(), pitch: self.value(pitch) }
            }
            4 => {
                let axis = self.direction();
                LoopKind::Universal { axes: [axis, scale3(self.rng.range(0.5, 2.0), across(axis)[0])] }
            }
            5 => LoopKind::Planar { normal: self.direction() },
            6 => LoopKind::Spherical,
            7 => LoopKind::Fixed,
            8 => LoopKind::Distance { length: self.value(length) },
            9 => LoopKind::PointOnLine { axis: self.sideways() },
            10 => LoopKind::PointOnPlane { normal: self.sideways() },
            11 => LoopKind::PointOnCylinder { axis: self.direction(), radius: self.value(length) },
            12 => LoopKind::RollingDisc { normal: self.sideways(), axis: self.direction(), radius: self.value(length) },
            13 => {
                let (normal, radius) = (self.sideways(), self.value(length));
                // Some of them are ellipsoids, by a number that is drawn anyway.
                match length > 0.5 {
                    true => {
                        let [y, z] = [0.6, 0.9].map(|part| Value::Const(part * length));
                        LoopKind::RollingEllipsoid { normal, semi_axes: [radius, y, z] }
                    }
                    false => LoopKind::RollingBall { normal, radius },
                }
            }
            14 => LoopKind::RollingBalls { radii: [0.4, 0.6].map(|part| self.value(part * length)) },
            15 => {
                let axes = [self.sideways(), self.sideways()];
                let parts = self.rng.pick(&[[0.5, 0.7], [0.8, 0.0]]);
                let lengths = parts.map(|part| self.value(part * length));
                LoopKind::RollingCapsules { axes, lengths, radii: [0.4, 0.6].map(|part| self.value(part * length)) }
            }
            16 => {
                let size = [0.5, 0.7, 0.9].map(|part| self.value(part * length));
                LoopKind::RollingBallOnBox { size, rounding: 0.0, radius: self.value(0.5 * length) }
            }
            17 => {
                let (axis, radii) = (self.direction(), [0.4, 0.6].map(|part| self.value(part * length)));
                LoopKind::RollingBallOnCylinder { axis, length: self.value(length), radii }
            }
            18 => LoopKind::KnifeEdge { axis: self.sideways() },
            _ => {
                let row: [f64; 6] = std::array::from_fn(|_| self.rng.around(1.0));
                LoopKind::Pfaffian { row: row.map(|x| self.value(x)) }
            }
        }
    }

    fn any_turn(&mut self) -> Mat3<f64> {
        let axis = self.direction();
        about(axis, self.rng.around(3.0))
    }

    /// A random rotation and offset of the second frame, in axes of the first, that a kind of loop allows.
    fn allowed(&mut self, kind: &LoopKind) -> (Mat3<f64>, Vec3<f64>) {
        let none = about([1.0, 0.0, 0.0], 0.0);
        let (angle, slide) = (self.rng.around(2.5), self.rng.around(0.6));
        let params = self.state.params.clone();
        let num = |x: Value| value(x, &params);
        let along = |a: Vec3<f64>, x: f64| scale3(x, unit(a));
        let level = |s: &mut Self, n: Vec3<f64>| {
            let [x, y] = across(n);
            add3(scale3(s.rng.around(0.6), x), scale3(s.rng.around(0.6), y))
        };
        match *kind {
            LoopKind::Revolute { axis } => (about(axis, angle), [0.0; 3]),
            LoopKind::Prismatic { axis } => (none, along(axis, slide)),
            LoopKind::Cylindrical { axis } => (about(axis, angle), along(axis, slide)),
            LoopKind::Helical { axis, pitch } => (about(axis, angle), along(axis, num(pitch) * angle)),
            LoopKind::Universal { axes: [a, b] } => {
                (times(&about(a, angle), &about(b, self.rng.around(2.5))), [0.0; 3])
            }
            LoopKind::Planar { normal } => (about(normal, angle), level(self, normal)),
            LoopKind::Spherical => (self.any_turn(), [0.0; 3]),
            LoopKind::Fixed => (none, [0.0; 3]),
            LoopKind::Distance { length } => (self.any_turn(), along(self.sideways(), num(length))),
            LoopKind::PointOnLine { axis } => (self.any_turn(), along(axis, slide)),
            LoopKind::PointOnPlane { normal } => (self.any_turn(), level(self, normal)),
            LoopKind::PointOnCylinder { axis, radius } => {
                let [x, y] = across(axis);
                let off = add3(scale3(num(radius) * angle.cos(), x), scale3(num(radius) * angle.sin(), y));
                (self.any_turn(), add3(off, along(axis, slide)))
            }
            LoopKind::RollingDisc { normal, axis, radius } => loop {
                let turn = self.any_turn();
                let axis = unit(axis);
                let tilt = dot3(unit(normal), turn.map(|row| dot3(row, axis)));
                if tilt.abs() < 0.9 {
                    let height = num(radius) * (1.0 - tilt * tilt).sqrt();
                    break (turn, add3(along(normal, height), level(self, normal)));
                }
            },
            LoopKind::RollingBall { normal, radius } => {
                (self.any_turn(), add3(along(normal, num(radius)), level(self, normal)))
            }
            LoopKind::RollingEllipsoid { normal, semi_axes } => {
                let turn = self.any_turn();
                // The extent along the normal, from the normal's components in the second frame.
                let n = unit(normal);
                let height = (0..3).map(|k| num(semi_axes[k]) * (0..3).map(|i| turn[i][k] * n[i]).sum::<f64>());
                let height = height.map(|x| x * x).sum::<f64>().sqrt();
                (turn, add3(along(normal, height), level(self, normal)))
            }
            LoopKind::RollingBalls { radii: [a, b] } => (self.any_turn(), along(self.sideways(), num(a) + num(b))),
            LoopKind::RollingCapsules { axes: [a, b], lengths, radii } => loop {
                let (turn, normal) = (self.any_turn(), self.sideways());
                let axes = [unit(a), turn.map(|row| dot3(row, unit(b)))];
                let half = lengths.map(|x| 0.5 * num(x));
                let flat = self.distribution.planar;
                if let Some(d) = touching::capsules(&mut self.rng, axes, half, radii.map(num), normal, flat) {
                    break (turn, d);
                }
            },
            LoopKind::RollingBallOnBox { size, radius, .. } => {
                let turn = self.any_turn();
                (turn, touching::on_box(&mut self.rng, size.map(num), num(radius), self.distribution.planar))
            }
            LoopKind::RollingBallOnCylinder { axis, length, radii } => {
                let turn = self.any_turn();
                let (length, flat) = (num(length), self.distribution.planar);
                (turn, touching::on_cylinder(&mut self.rng, axis, length, radii.map(num), flat))
            }
            LoopKind::RollingBallOnField { .. }
            | LoopKind::RollingBallOnHull { .. }
            | LoopKind::RollingCapsuleOnCylinder { .. } => {
                unreachable!("loops are of the kinds that models can have")
            }
            LoopKind::KnifeEdge { .. } | LoopKind::Pfaffian { .. } => {
                let anywhere = self.direction();
                (self.any_turn(), along(anywhere, slide))
            }
        }
    }
}

//! Random mechanisms: bodies, joints and inputs together.

use mbd_codegen::model::{Frame, Gravity, Joint, JointBounds, JointMotion, Model, Origin, Value, Wrench, WrenchAxes};

use super::bodies::{weights, Weight};
use super::builder::{Builder, Skeleton};
use super::distribution::Distribution;
use super::rng::Rng;

/// Names that could collide with names in generated code. Some bodies and joints get them.
const ODD_NAMES: [&str; 12] =
    ["type", "self", "q", "kept", "tau", "Upper arm", "link-7", "Größe 2", "new", "rates", "kinetic", "7th"];

impl Builder<'_> {
    fn names(&mut self, plain: &str, n: usize) -> Vec<String> {
        let shift = self.rng.below(ODD_NAMES.len());
        let mut names: Vec<String> = (0..n).map(|k| format!("{plain}{k}")).collect();
        for (k, name) in names.iter_mut().enumerate().take(ODD_NAMES.len()) {
            if self.rng.chance(0.15) {
                *name = ODD_NAMES[(k + shift) % ODD_NAMES.len()].to_string();
            }
        }
        names
    }

    fn skeleton(&mut self) -> Skeleton {
        let (low, high) = self.distribution.bodies;
        let n = low + self.rng.below(high - low + 1);
        let mut s = Skeleton { parent: Vec::new(), depth: Vec::new() };
        for i in 0..n {
            let parent = if i == 0 || self.rng.chance(self.distribution.roots) {
                None
            } else if self.rng.chance(self.distribution.branching) {
                Some(self.rng.below(i))
            } else {
                Some(i - 1)
            };
            s.depth.push(parent.map_or(0, |p| s.depth[p] + 1));
            s.parent.push(parent);
        }
        s
    }

    fn joint(&mut self, name: String, child: usize, parent: Option<usize>, length: f64) -> Joint {
        let kind = self.kind();
        let n = kind.nv();
        let k = self.distribution;
        let sprung = if kind.spec().has_springs() { k.springs } else { 0.0 };
        let stiffness = self.per_freedom(n, sprung, 1.0, 30.0);
        let has_spring = stiffness.iter().any(|s| *s != Value::ZERO);
        Joint {
            name,
            kind,
            parent,
            child,
            placement: self.placement(length),
            unbounded: false,
            motion: if n > 0 && self.rng.chance(k.prescribed) { JointMotion::Prescribed } else { JointMotion::Free },
            damping: self.per_freedom(n, k.damping, 0.1, 2.0),
            rest: self.per_freedom(n, if has_spring { 0.7 } else { 0.0 }, -0.5, 0.5),
            stiffness,
            armature: self.per_freedom(n, k.armature, 0.01, 0.2),
            bounds: JointBounds::default(),
            origin: Origin::default(),
        }
    }

    fn mimics(&mut self, joints: &mut [Joint]) {
        let can: Vec<usize> = (0..joints.len()).filter(|&j| joints[j].kind.nv() == 1).collect();
        let rank: Vec<u64> = joints.iter().map(|_| self.rng.bits()).collect();
        for &j in &can {
            // Leaders have a lower rank, so that there are chains of mimic joints but no cycles.
            let leaders: Vec<usize> = can.iter().copied().filter(|&l| rank[l] < rank[j]).collect();
            if leaders.is_empty() || joints[j].motion != JointMotion::Free || !self.rng.chance(self.distribution.mimic)
            {
                continue;
            }
            let ratio = match self.rng.below(4) {
                0 => 1.0,
                1 => -1.0,
                _ => self.rng.range(0.3, 2.0) * self.rng.pick(&[1.0, -1.0]),
            };
            let offset = if self.rng.chance(0.4) { 0.0 } else { self.rng.around(1.0) };
            let (leader, ratio) = (self.rng.pick(&leaders), self.value(ratio));
            joints[j].motion = JointMotion::Mimic { leader, ratio, offset: self.value_or_zero(offset) };
        }
    }

    fn gravity(&mut self) -> Gravity {
        match self.rng.weighted(&self.distribution.gravity) {
            0 if self.rng.chance(0.5) => Gravity::Constant([Value::ZERO, Value::ZERO, self.value(-9.81)]),
            0 => Gravity::Constant(self.vector(9.0).map(|x| self.value_or_zero(x))),
            1 => Gravity::Constant([Value::ZERO; 3]),
            _ => Gravity::Input,
        }
    }

    fn wrenches(&mut self, bodies: usize) -> Vec<Wrench> {
        let on: Vec<usize> = (0..bodies).filter(|_| self.rng.chance(self.distribution.wrenches)).collect();
        let both = on.iter().flat_map(|&b| vec![b; 1 + usize::from(self.rng.chance(0.2))]).collect::<Vec<_>>();
        let wrench = |(k, body): (usize, usize)| {
            let axes = self.rng.pick(&[WrenchAxes::Body, WrenchAxes::World]);
            Wrench { name: format!("w{k}"), body, axes }
        };
        both.into_iter().enumerate().map(wrench).collect()
    }

    fn frames(&mut self, bodies: usize) -> Vec<Frame> {
        let at = (0..=bodies).map(|b| b.checked_sub(1)).collect::<Vec<_>>();
        let mut frames = Vec::new();
        for body in at {
            if self.rng.chance(self.distribution.frames) {
                frames.push(Frame { name: format!("frame{}", frames.len()), body, placement: self.placement(0.5) });
            }
        }
        frames
    }
}

/// Joint indices depth first from the ground, children in the given order.
fn depth_first(parent: &[Option<usize>]) -> Vec<usize> {
    let children = |p: Option<usize>| (0..parent.len()).rev().filter(move |&c| parent[c] == p);
    let mut stack: Vec<usize> = children(None).collect();
    let mut order = Vec::new();
    while let Some(j) = stack.pop() {
        order.push(j);
        stack.extend(children(Some(j)));
    }
    order
}

/// A random mechanism that passes the checks of the generator. Its mass matrix is positive definite in every
/// configuration and near the defaults of the parameters. The same seed and distribution give the same mechanism.
pub fn random_model(seed: u64, distribution: &Distribution) -> Model {
    let mut b = Builder { rng: Rng::new(seed, 2), distribution, params: Vec::new() };
    let s = b.skeleton();
    let n = s.parent.len();
    let (body_names, joint_names) = (b.names("b", n), b.names("j", n));
    let length: Vec<f64> = s.depth.iter().map(|&d| 0.5 * distribution.taper.powi(d)).collect();
    let mut joints: Vec<Joint> = (0..n).map(|i| b.joint(joint_names[i].clone(), i, s.parent[i], length[i])).collect();
    let defaults: Vec<f64> = b.params.iter().map(|p| p.default).collect();
    let (weight, rotor) = weights(&mut b, &s, &joints, &defaults);
    for (joint, _) in joints.iter_mut().zip(&rotor).filter(|(_, rotor)| **rotor) {
        joint.armature = b.per_freedom(joint.kind.nv(), 1.0, 0.01, 0.2);
        for x in joint.armature.iter_mut().filter(|x| **x == Value::ZERO) {
            *x = Value::Const(0.05);
        }
    }
    let body = |i: usize| {
        let full = if weight[i] == Weight::Full { 2.0 } else { 1.0 };
        b.body(body_names[i].clone(), weight[i], full * distribution.taper.powi(s.depth[i]), length[i])
    };
    let mut bodies: Vec<_> = (0..n).map(body).collect();
    let mut joints: Vec<Joint> = depth_first(&s.parent).into_iter().map(|j| joints[j].clone()).collect();
    b.mimics(&mut joints);
    // Nothing may depend on the order of bodies, so the order is random.
    let mut place: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        place.swap(i, b.rng.below(i + 1));
    }
    let old = bodies.clone();
    for (i, body) in old.into_iter().enumerate() {
        bodies[place[i]] = body;
    }
    for joint in &mut joints {
        joint.child = place[joint.child];
        joint.parent = joint.parent.map(|p| place[p]);
    }
    let gravity = b.gravity();
    let (frames, wrenches) = (b.frames(n), b.wrenches(n));
    Model {
        name: format!("tree{seed}"),
        params: b.params,
        gravity,
        bodies,
        joints,
        frames,
        wrenches,
        constraints: Vec::new(),
        shapes: Vec::new(),
        contacts: Vec::new(),
        starts: Vec::new(),
    }
}

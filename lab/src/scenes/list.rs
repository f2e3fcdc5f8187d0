//! The list of scenes.

use super::text::{chain, tapered, tree, FRICTION};
use super::{Entry, Expect, Refused, Source};
use multibody::codegen::model::Model;
use multibody::codegen::read::Base;

/// A file of `models/` and its text.
macro_rules! file {
    ($name:literal) => {
        Source::File($name, include_str!(concat!("../../../models/", $name)))
    };
    ($name:literal, undamped, $base:expr) => {
        Source::Undamped($name, include_str!(concat!("../../../models/", $name)), $base)
    };
}

/// All scenes, in the order of reports.
pub(super) static SCENES: [Entry; 22] = [
    Entry {
        name: "double_pendulum",
        title: "double pendulum, regular",
        model: file!("double_pendulum.toml"),
        start: |_| (vec![0.5, -0.3], vec![0.0, 0.0]),
        t_end: 10.0,
        rk4_step: 0.01,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "double_pendulum_chaotic",
        title: "double pendulum, chaotic",
        model: file!("double_pendulum.toml"),
        start: |_| (vec![3.0, 0.3], vec![0.0, 0.0]),
        t_end: 5.0,
        rk4_step: 0.01,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "ur5",
        title: "UR5 swinging freely",
        model: file!("ur5.urdf", undamped, Base::Fixed),
        start: |m| swing(m, 0.5),
        t_end: 5.0,
        rk4_step: 0.005,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "panda_arm",
        title: "Panda arm swinging freely",
        model: file!("panda_arm.urdf", undamped, Base::Fixed),
        start: |m| swing(m, 0.5),
        t_end: 1.0,
        rk4_step: 0.002,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "arm7",
        title: "seven-joint arm in space",
        model: file!("arm7.toml"),
        start: |_| (vec![0.3, 0.3, 0.3, -0.3, 0.3, -0.3, 0.3], vec![0.5; 7]),
        t_end: 2.0,
        rk4_step: 0.004,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "chain10",
        title: "planar chain of 10, no friction, dropped",
        model: Source::Made(|name| chain(name, 10, 0.0)),
        start: rest,
        t_end: 1.0,
        rk4_step: 0.002,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "chain10_swing",
        title: "planar chain of 10, no friction, swinging",
        model: Source::Made(|_| chain("chain10", 10, 0.0)),
        start: |m| {
            let (mut q, v) = rest(m);
            q[0] = 0.5 - std::f64::consts::FRAC_PI_2;
            (q, v)
        },
        t_end: 2.0,
        rk4_step: 0.002,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "chain10_friction",
        title: "planar chain of 10, friction",
        model: Source::Made(|name| chain(name, 10, FRICTION)),
        start: rest,
        t_end: 2.0,
        rk4_step: 0.001,
        conservative: false,
        expect: Expect::Runs,
    },
    Entry {
        name: "chain50_friction",
        title: "planar chain of 50, friction",
        model: Source::Made(|name| chain(name, 50, FRICTION)),
        start: rest,
        t_end: 2.0,
        rk4_step: 0.001,
        conservative: false,
        expect: Expect::Runs,
    },
    Entry {
        name: "chain100_friction",
        title: "planar chain of 100, friction",
        model: Source::Made(|name| chain(name, 100, FRICTION)),
        start: rest,
        t_end: 2.0,
        rk4_step: 0.001,
        conservative: false,
        expect: Expect::Runs,
    },
    Entry {
        name: "tree150_friction",
        title: "planar tree of 150, friction",
        model: Source::Made(|name| tree(name, 4, FRICTION)),
        start: forked,
        t_end: 2.0,
        rk4_step: 0.001,
        conservative: false,
        expect: Expect::Runs,
    },
    Entry {
        name: "quadruped",
        title: "Solo-12 in free flight",
        model: file!("solo12.urdf", undamped, Base::Floating),
        start: flight,
        t_end: 2.0,
        rk4_step: 0.005,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "rotor",
        title: "free asymmetric rotor",
        model: file!("rotor.toml"),
        start: |_| (vec![0.0, 0.0, 0.0, 1.0], vec![0.01, 10.0, 0.02]),
        t_end: 10.0,
        rk4_step: 0.01,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "mass_ratio",
        title: "mass ratio 1e6, light tip",
        model: Source::Made(|name| tapered(name, 1e3, FIFTH_ROOT)),
        start: |m| swing(m, 0.5),
        t_end: 2.0,
        rk4_step: 0.001,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "mass_ratio_heavy_tip",
        title: "mass ratio 1e6, heavy tip",
        model: Source::Made(|name| tapered(name, 1e-3, 1.0 / FIFTH_ROOT)),
        start: |_| (vec![0.3, 0.2, 0.01, -0.01, 0.01, -0.01], vec![0.0; 6]),
        t_end: 2.0,
        rk4_step: 5e-4,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "point_tip",
        title: "tip without inertia",
        model: file!("scenes/point_tip.toml"),
        start: |m| swing(m, 0.5),
        t_end: 5.0,
        rk4_step: 0.005,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "vanishing_tip",
        title: "tip without mass, by a parameter",
        model: file!("scenes/vanishing_tip.toml"),
        start: |m| swing(m, 0.5),
        t_end: 5.0,
        rk4_step: 0.005,
        conservative: true,
        expect: Expect::Stops,
    },
    Entry {
        name: "stiff_spring",
        title: "spring of 1e8 N/m",
        model: file!("scenes/stiff_spring.toml"),
        start: |_| (vec![0.0, 0.5], vec![0.0, 0.0]),
        t_end: 2.0,
        rk4_step: 2e-5,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "near_parallel",
        title: "universal joint, axes 1e-4 rad from parallel",
        model: file!("scenes/near_parallel.toml"),
        start: |_| (vec![0.3, 0.1], vec![0.0, 0.0]),
        t_end: 2.0,
        rk4_step: 0.01,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "pole",
        title: "universal joint close to its singular position",
        model: file!("scenes/pole.toml"),
        start: |_| (vec![0.0, std::f64::consts::FRAC_PI_2 - 0.5], vec![0.01, 0.0]),
        t_end: 2.0,
        rk4_step: 1e-4,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "mujoco2896",
        title: "two joints of MuJoCo issue 2896",
        model: file!("mujoco2896.toml"),
        start: |_| (vec![0.0, 0.0, 0.0, 0.0, 1.0], vec![0.0; 4]),
        t_end: 5.0,
        rk4_step: 0.002,
        conservative: true,
        expect: Expect::Runs,
    },
    Entry {
        name: "chain1000",
        title: "planar chain of 1,000, no friction",
        model: Source::Made(|name| chain(name, 1000, 0.0)),
        start: rest,
        t_end: 0.1,
        rk4_step: 0.001,
        conservative: true,
        expect: Expect::Runs,
    },
];

/// The number `1e-6^(1/5)`, whose fifth power is a millionth.
const FIFTH_ROOT: f64 = 0.063_095_734_448_019_33;

pub(super) static REFUSED: [Refused; 2] = [
    Refused {
        name: "massless_tip",
        title: "tip with neither mass nor inertia",
        file: "scenes/massless_tip.toml",
        text: include_str!("../../../models/scenes/massless_tip.toml"),
        finding: "`tip` has neither mass nor inertia, so the mass matrix is singular",
    },
    Refused {
        name: "point_on_axis",
        title: "point mass on its own revolute joint",
        file: "scenes/point_on_axis.toml",
        text: include_str!("../../../models/scenes/point_on_axis.toml"),
        finding: "`tip` has no inertia against turning about the axis, so the mass matrix is singular",
    },
];

fn sizes(model: &Model) -> (usize, usize) {
    model.joints.iter().fold((0, 0), |(q, v), j| (q + j.kind.nq(), v + j.kind.nv()))
}

/// Zero coordinates at rest, for models without quaternions.
fn rest(model: &Model) -> (Vec<f64>, Vec<f64>) {
    let (nq, nv) = sizes(model);
    (vec![0.0; nq], vec![0.0; nv])
}

/// Coordinates 0.3 and -0.3 in turn and equal velocities (rad, rad/s), for models without quaternions.
fn swing(model: &Model, speed: f64) -> (Vec<f64>, Vec<f64>) {
    let (nq, nv) = sizes(model);
    ((0..nq).map(|k| if k % 2 == 0 { 0.3 } else { -0.3 }).collect(), vec![speed; nv])
}

/// A tree at rest, straight except for ±0.3 rad at its forks.
fn forked(model: &Model) -> (Vec<f64>, Vec<f64>) {
    let (mut q, v) = rest(model);
    for (q, joint) in q.iter_mut().zip(&model.joints) {
        let name = joint.name.as_str();
        *q = if name.ends_with("left") {
            0.3
        } else if name.ends_with("right") {
            -0.3
        } else {
            0.0
        };
    }
    (q, v)
}

/// The quadruped in the air: thrown and tumbling, knees bent, every leg joint moving.
fn flight(model: &Model) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut v) = (vec![0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0], vec![0.3, -0.2, 1.5, 1.0, 2.0, -1.5]);
    for joint in model.joints.iter().filter(|j| j.kind.nv() == 1) {
        let forward = if joint.name.starts_with('F') { 1.0 } else { -1.0 };
        let (angle, rate) = match joint.name.rsplit('_').next() {
            Some("HFE") => (0.8 * forward, 2.0),
            Some("KFE") => (-1.6 * forward, -3.0),
            _ => (0.1, 1.0),
        };
        q.push(angle);
        v.push(rate);
    }
    (q, v)
}

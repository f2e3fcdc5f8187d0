//! Identities of mechanics on random trees with all kinds of elements: exact relations, no finite differences.
//!
//! Time derivatives are taken by dual numbers: the sweep for momenta, run with `q + ε q̇` and `v + ε v̇`, gives
//! `p + ε ṗ` independently of the sweep for `ṗ`.

use mbd_codegen::model::JointKind;
use mbd_runtime::spatial::cross;
use mbd_runtime::sweep::{Inputs, Sweeps};
use mbd_runtime::tree::{Kind, Source};
use mbd_runtime::workspace::Workspace;
use mbd_testing::eliminations::random_plan;
use mbd_testing::newton;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::random_state;
use mbd_testing::value;

use crate::cases::*;

#[test]
fn mass_matrix_is_that_of_the_bodies_and_positive() {
    all("M against Jacobians", |c| {
        let nv = c.plan.dims.nv;
        let mut m = vec![0.0; nv * nv];
        c.i.mass_matrix(&c.s.q, &mut m);
        let none = vec![0.0; c.plan.dims.drive_v];
        let unit = |k: usize| (0..nv).map(|j| f64::from(u8::from(j == k))).collect::<Vec<_>>();
        let columns: Vec<_> = (0..nv).map(|k| c.bodies_at(&unit(k), &none)).collect();
        let rotors: Vec<_> = (0..nv).map(|k| newton::joint_rates(&c.plan, &c.s.params, &unit(k), &none)).collect();
        let model = &c.plan.model;
        let mut dense = vec![0.0; nv * nv];
        for a in 0..nv {
            for b in 0..nv {
                assert_eq!(m[a * nv + b], m[b * nv + a], "seed {}: M is symmetric", c.seed);
                let bodies = (0..model.bodies.len())
                    .map(|k| newton::twice_kinetic(model, &c.s.params, k, &columns[a][k], &columns[b][k]));
                let joints = model.joints.iter().enumerate().map(|(j, joint)| {
                    let pairs = rotors[a][j].iter().zip(&rotors[b][j]).zip(&joint.armature);
                    pairs.map(|((x, y), i)| x * y * value(*i, &c.s.params)).sum::<f64>()
                });
                dense[a * nv + b] = bodies.sum::<f64>() + joints.sum::<f64>();
            }
        }
        let matrix = nalgebra::DMatrix::from_row_slice(nv, nv, &m);
        assert!(nv == 0 || matrix.cholesky().is_some(), "seed {}: M is positive definite", c.seed);
        c.near_within("M", &m, &dense, 0.0, 3e-14)
    });
}

#[test]
fn momenta_and_velocities() {
    all("p = M v, v(p(v)) = v", |c| {
        let nv = c.plan.dims.nv;
        let mut m = vec![0.0; nv * nv];
        c.i.mass_matrix(&c.s.q, &mut m);
        // Momenta of the prescribed motion alone.
        let mut driven = vec![0.0; nv];
        c.i.momenta(&c.s.q, &vec![0.0; nv], &mut driven);
        let p: Vec<f64> = (0..nv).map(|a| driven[a] + (0..nv).map(|b| m[a * nv + b] * c.s.v[b]).sum::<f64>()).collect();
        c.near_within("M v", &p, &c.p, 0.0, 1e-13);
        let mut v = vec![0.0; nv];
        c.i.velocities(&c.s.q, &c.p, &mut v);
        c.near("v(p(v))", &v, &c.s.v, 0.0)
    });
}

#[test]
fn momentum_rates_are_the_derivative_of_the_momenta() {
    all("d/dt p(q, v) = pd", |c| {
        let (mut i, q) = c.dual();
        let mut p = vec![D::default(); c.plan.dims.nv];
        i.momenta(&q, &c.dual_v(), &mut p);
        let rates: Vec<f64> = p.iter().map(|p| p.du).collect();
        c.near("pd", &rates, &c.pd, largest(&c.s.tau))
    });
}

#[test]
fn accelerations_are_the_derivative_of_the_velocities() {
    all("d/dt v(q, p) = a", |c| {
        let (mut i, q) = c.dual();
        let mut v = vec![D::default(); c.plan.dims.nv];
        i.velocities(&q, &c.dual_p(), &mut v);
        let rates: Vec<f64> = v.iter().map(|v| v.du).collect();
        c.near("a", &rates, &c.a, 1.0)
    });
}

#[test]
fn energies_are_those_of_the_bodies() {
    all("T and V against sums over bodies", |c| {
        let (kinetic, potential) = c.i.energy(&c.s.q, &c.p);
        let (v, drive) = (c.s.v.clone(), c.s.drive[1].clone());
        let bodies = c.bodies_at(&v, &drive);
        let (model, params) = (&c.plan.model, &c.s.params);
        let rates = newton::joint_rates(&c.plan, params, &v, &drive);
        let positions = newton::joint_coordinates(&c.plan, params, &c.s.q, &c.s.drive[0]);
        let (mut twice, mut sum, mut size) = (0.0, 0.0, 1.0_f64);
        for (k, at) in bodies.iter().enumerate() {
            twice += newton::twice_kinetic(model, params, k, at, at);
            let (m, centre) = newton::mass_centre(model, params, k, at);
            // Bodies that are fixed to the ground add only a constant, which the sweep omits.
            if c.plan.frames[newton::body_frames(&c.plan)[k]].node.is_none() {
                continue;
            }
            for (g, x) in c.s.gravity.iter().zip(centre) {
                sum -= m * g * x;
                size = size.max((m * g * x).abs());
            }
        }
        for (j, joint) in model.joints.iter().enumerate() {
            for (rate, i) in rates[j].iter().zip(&joint.armature) {
                twice += value(*i, params) * rate * rate;
            }
            for (k, stiffness) in joint.stiffness.iter().enumerate().filter(|_| springs(&joint.kind)) {
                let stretch = positions[j][k] - value(joint.rest[k], params);
                sum += 0.5 * value(*stiffness, params) * stretch * stretch;
            }
        }
        c.near_within("V", &[potential], &[sum], size, 1e-13);
        c.near("T", &[kinetic], &[0.5 * twice], 0.0)
    });
}

fn springs(kind: &JointKind) -> bool {
    !matches!(kind, JointKind::Spherical | JointKind::Floating)
}

#[test]
fn energy_changes_by_the_power_put_in() {
    all("dH/dt = power", |c| {
        let (mut i, q) = c.dual();
        let (kinetic, potential) = i.energy(&q, &c.dual_p());
        let mut reactions = vec![[0.0; 6]; c.plan.joint_nodes.len()];
        let mut a = vec![0.0; c.s.v.len()];
        c.i.reactions(&c.s.q, &c.s.v, &mut a, &mut reactions);
        let (model, params) = (&c.plan.model, &c.s.params);
        let rates = newton::joint_rates(&c.plan, params, &c.s.v, &c.s.drive[1]);
        let accelerations = newton::joint_rates(&c.plan, params, &a, &c.s.drive[2]);
        let positions = newton::joint_coordinates(&c.plan, params, &c.s.q, &c.s.drive[0]);
        let mut terms: Vec<f64> = c.s.tau.iter().zip(&c.s.v).map(|(f, v)| f * v).collect();
        for (slot, wrench) in c.plan.slots.iter().zip(&reactions) {
            let joint = &model.joints[slot.joint];
            let rate = &rates[slot.joint];
            if !matches!(newton::source(&c.plan, slot.joint), Some(Source::Drive { .. })) {
                let damping = joint.damping.iter().zip(rate);
                terms.extend(damping.map(|(d, v)| -(value(*d, params) * v * v)));
                continue;
            }
            // Power of the drive in addition to that of the spring and damper of its joint; the spring's energy is part
            // of H.
            let position = &positions[slot.joint];
            for (k, e) in newton::freedoms(&joint.kind, params, position).iter().enumerate() {
                let along: f64 = e.iter().zip(wrench).map(|(e, f)| e * f).sum();
                terms.push((along + value(joint.armature[k], params) * accelerations[slot.joint][k]) * rate[k]);
            }
            let mut coordinate_rates = rate.clone();
            if let JointKind::Planar { .. } = joint.kind {
                let (s, c) = position[2].sin_cos();
                (coordinate_rates[0], coordinate_rates[1]) = (c * rate[0] - s * rate[1], s * rate[0] + c * rate[1]);
            }
            for k in (0..joint.kind.nv()).filter(|_| springs(&joint.kind)) {
                let pull = value(joint.stiffness[k], params) * (position[k] - value(joint.rest[k], params));
                terms.push(pull * coordinate_rates[k]);
            }
        }
        let bodies = c.bodies();
        for (wrench, given) in model.wrenches.iter().zip(&c.s.wrenches) {
            let at = &bodies[wrench.body];
            let velocity = re(&at.velocity);
            let velocity = match wrench.axes {
                mbd_codegen::model::WrenchAxes::Body => [velocity.lin, velocity.ang].concat(),
                mbd_codegen::model::WrenchAxes::World => [turn(at, velocity.lin), turn(at, velocity.ang)].concat(),
            };
            terms.extend(velocity.iter().zip(given).map(|(v, f)| v * f));
        }
        let size = largest(&terms).max(kinetic.du.abs()).max(potential.du.abs());
        c.near("power", &[kinetic.du + potential.du], &[terms.iter().sum()], size)
    });
}

#[test]
fn reactions_are_what_newton_and_euler_ask_for() {
    all("reactions against momentum rates of the bodies", |c| {
        let mut reactions = vec![[0.0; 6]; c.plan.joint_nodes.len()];
        let mut a = vec![0.0; c.s.v.len()];
        c.i.reactions(&c.s.q, &c.s.v, &mut a, &mut reactions);
        c.near("a of the tree as described", &a, &c.a, 1.0);
        let model = &c.plan.model;
        let bodies = c.bodies();
        let needed = needed(c, &bodies);
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for (slot, wrench) in c.plan.slots.iter().zip(&reactions) {
            let carried = newton::subtree(model, slot.joint);
            let sum = |part: usize, i: usize| carried.iter().map(|&b| needed[b][part][i]).sum::<f64>();
            let f: [f64; 3] = std::array::from_fn(|i| sum(0, i));
            let at = &bodies[model.joints[slot.joint].child];
            let arm = cross(at.position.map(|x| x.re), f);
            let n: [f64; 3] = std::array::from_fn(|i| sum(1, i) - arm[i]);
            theirs.extend([turn_back(at, f), turn_back(at, n)].concat());
            ours.extend(wrench);
        }
        c.near("reactions", &ours, &theirs, 1.0)
    });
}

#[test]
fn momentum_of_free_trees_is_constant() {
    let mut worst = 0.0_f64;
    for seed in 0..TREES {
        let distribution =
            Distribution { roots: 0.0, prescribed: 0.0, wrenches: 0.0, ..Distribution::everything(seed, 8) };
        let mut model = random_model(seed, &Distribution { gravity: [0.0, 1.0, 0.0], ..distribution });
        // One base, free in space.
        let base = &mut model.joints[0];
        base.kind = JointKind::Floating;
        base.motion = mbd_codegen::model::JointMotion::Free;
        for list in [&mut base.damping, &mut base.stiffness, &mut base.rest, &mut base.armature] {
            *list = vec![mbd_codegen::model::Value::ZERO; 6];
        }
        let body = &mut model.bodies[base.child];
        if body.inertia[0] == mbd_codegen::model::Value::ZERO {
            body.mass = mbd_codegen::model::Value::ONE;
            body.inertia[..3].fill(mbd_codegen::model::Value::Const(0.02));
        }
        for joint in &mut model.joints {
            if matches!(joint.motion, mbd_codegen::model::JointMotion::Mimic { leader: 0, .. }) {
                joint.motion = mbd_codegen::model::JointMotion::Free;
            }
        }
        let plan = random_plan(&model, seed);
        let mut s = random_state(&plan, seed);
        s.tau[..6].fill(0.0);
        let c = Case::of(seed, plan, s);
        let mut total = [0.0; 6];
        let mut size = 1.0_f64;
        for (k, at) in c.bodies().iter().enumerate() {
            for (i, x) in newton::momentum(&model, &c.s.params, k, at).concat().iter().enumerate() {
                total[i] += x.du;
                size = size.max(x.du.abs());
            }
        }
        worst = worst.max(c.near("momentum", &total, &[0.0; 6], size));
    }
    println!("momentum of free trees: largest rate {worst:.1e} of that of a body");
}

/// `M'E = 0` (without a rotor): once a freedom is eliminated, no inertia is left along it.
#[test]
fn reduced_inertia_has_nothing_along_its_freedoms() {
    for seed in 0..TREES {
        let distribution = Distribution { armature: 0.0, massless: 0.0, ..Distribution::everything(seed, 8) };
        let plan = random_plan(&random_model(seed, &distribution), seed);
        let s = random_state(&plan, seed);
        let tree = plan.tree(&s.params).regrouped();
        let mut w = Workspace::new(&tree);
        let sweeps = Sweeps { tree: &tree, trace: &() };
        let [drive_q, drive_v, drive_a] = s.drive.each_ref().map(|drive| &drive[..]);
        let inputs = Inputs { tau: &[], drive_q, drive_v, drive_a, wrenches: &[], gravity: [0.0; 3] };
        sweeps.factor(&s.q, &inputs, &mut w);
        for (i, node) in tree.nodes.iter().enumerate() {
            if node.elimination.unknown.is_some() || matches!(node.source, Source::Drive { .. }) {
                continue;
            }
            let m = &w.factor.m[i];
            let size = (0..6).fold(0.0_f64, |s, k| s.max(m.get(k, k).abs())).max(1e-3);
            for k in 0..node.kind.nv() {
                let along = m.times(&node.kind.axis(k).motion(1.0));
                for j in 0..6 {
                    assert!(along.get(j).abs() <= 1e-12 * size, "seed {seed}, node {i}, {:?}: {along:?}", node.kind);
                }
                // For joints with one freedom the sweep sets these rows to exact zeros.
                if let Kind::Revolute | Kind::Prismatic = node.kind {
                    assert_eq!(along.dot(&node.kind.axis(0).motion(1.0)), 0.0, "seed {seed}, node {i}");
                }
            }
        }
    }
}

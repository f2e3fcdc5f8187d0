//! Quantities for controllers, on random trees with all kinds of elements: inverse dynamics, bias forces, Jacobians and
//! bias accelerations of frames.

use mbd_codegen::identifiable::identifiable;
use mbd_codegen::model::JointKind;
use mbd_runtime::spatial::{add3, cross, RigidInertia};
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::Source;
use mbd_runtime::Interpreter;
use mbd_testing::random::Rng;
use mbd_testing::{newton, value};

use crate::cases::*;

/// Random accelerations, unrelated to the joint forces of the case.
fn any_accelerations(c: &Case) -> Vec<f64> {
    let mut rng = Rng::new(c.seed, 9);
    c.a.iter().map(|_| rng.around(4.0)).collect()
}

#[test]
fn inverse_dynamics_undoes_accelerations() {
    all("tau(a(tau)) = tau", |c| {
        let (mut tau, mut h) = (c.a.clone(), c.a.clone());
        c.i.inverse_dynamics(&c.s.q, &c.s.v, &c.a, &mut tau);
        c.i.bias(&c.s.q, &c.s.v, &mut h);
        c.near("tau", &tau, &c.s.tau, largest(&h).max(largest(&c.a)))
    });
}

/// Neither side solves equations, so the tolerance is the rounding of a few sweeps.
#[test]
fn inverse_dynamics_is_mass_and_bias() {
    all("M a + h = tau(a)", |c| {
        let nv = c.plan.dims.nv;
        let a = any_accelerations(c);
        let (mut m, mut h, mut tau) = (vec![0.0; nv * nv], vec![0.0; nv], vec![0.0; nv]);
        c.i.mass_matrix(&c.s.q, &mut m);
        c.i.bias(&c.s.q, &c.s.v, &mut h);
        c.i.inverse_dynamics(&c.s.q, &c.s.v, &a, &mut tau);
        let sum: Vec<f64> = (0..nv).map(|i| h[i] + (0..nv).map(|k| m[i * nv + k] * a[k]).sum::<f64>()).collect();
        c.near_within("tau", &tau, &sum, largest(&h), 1e-12)
    });
}

/// For any `v̇`, inverse dynamics gives `τ = d/dt p(q, v) − ṗ(q, p, τ = 0)`. The test computes the right-hand side by
/// other sweeps, which use another principle.
#[test]
fn inverse_dynamics_is_the_change_of_momentum() {
    all("tau(a) = d/dt p - pd(0)", |c| {
        c.a = any_accelerations(c);
        let (nq, nv) = (c.plan.dims.nq, c.plan.dims.nv);
        let mut tau = vec![0.0; nv];
        c.i.inverse_dynamics(&c.s.q, &c.s.v, &c.a, &mut tau);
        let (mut i, q) = c.dual();
        let mut p = vec![D::default(); nv];
        i.momenta(&q, &c.dual_v(), &mut p);
        let (mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        c.i.tau.fill(0.0);
        c.i.rates(&c.s.q, &c.p, &mut v, &mut qd, &mut pd);
        let other: Vec<f64> = p.iter().zip(&pd).map(|(p, pd)| p.du - pd).collect();
        c.near("tau", &tau, &other, largest(&pd))
    });
}

/// Inverse dynamics is the virtual power of the forces that the bodies need, and of rotors, dampers and springs,
/// computed body by body from the motion of frames.
#[test]
fn inverse_dynamics_is_what_newton_and_euler_ask_for() {
    all("tau(a) against virtual power of the bodies", |c| {
        c.a = any_accelerations(c);
        let nv = c.plan.dims.nv;
        let mut tau = vec![0.0; nv];
        c.i.inverse_dynamics(&c.s.q, &c.s.v, &c.a, &mut tau);
        let needed = needed(c, &c.bodies());
        let none = vec![0.0; c.plan.dims.drive_v];
        let mut size = 1.0_f64;
        let mut other = vec![0.0; nv];
        for (k, sum) in other.iter_mut().enumerate() {
            let unit: Vec<f64> = (0..nv).map(|j| f64::from(u8::from(j == k))).collect();
            for (at, [f, n]) in c.bodies_at(&unit, &none).iter().zip(&needed) {
                let turn = |x: [f64; 3]| at.rotation.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
                let (v, w, r) = (turn(at.velocity.lin), turn(at.velocity.ang), at.position);
                for i in 0..3 {
                    let (a, b) = ((i + 1) % 3, (i + 2) % 3);
                    // The point of the body at the origin of the ground moves with v + r × w.
                    let terms = [f[i] * v[i], f[i] * (r[a] * w[b] - r[b] * w[a]), n[i] * w[i]];
                    size = terms.iter().fold(size, |m, x| m.max(x.abs()));
                    *sum += terms.iter().sum::<f64>();
                }
            }
            *sum += joints(c, &unit);
        }
        c.near("tau", &tau, &other, size)
    });
}

/// Power of rotors, dampers and springs at the velocities `unit` of the state, with the drives at rest.
fn joints(c: &Case, unit: &[f64]) -> f64 {
    let (model, params, s) = (&c.plan.model, &c.s.params, &c.s);
    let none = vec![0.0; c.plan.dims.drive_v];
    let virtual_rates = newton::joint_rates(&c.plan, params, unit, &none);
    let rates = newton::joint_rates(&c.plan, params, &s.v, &s.drive[1]);
    let accelerations = newton::joint_rates(&c.plan, params, &c.a, &s.drive[2]);
    let positions = newton::joint_coordinates(&c.plan, params, &s.q, &s.drive[0]);
    let mut power = 0.0;
    for (j, joint) in model.joints.iter().enumerate() {
        let mut along = virtual_rates[j].clone();
        for k in 0..along.len() {
            let rotor = value(joint.armature[k], params) * accelerations[j][k];
            power += along[k] * (rotor + value(joint.damping[k], params) * rates[j][k]);
        }
        match joint.kind {
            JointKind::Spherical | JointKind::Floating => continue,
            JointKind::Planar { .. } => {
                let (s, c) = positions[j][2].sin_cos();
                (along[0], along[1]) = (c * along[0] - s * along[1], s * along[0] + c * along[1]);
            }
            _ => {}
        }
        for k in 0..along.len() {
            let stretch = positions[j][k] - value(joint.rest[k], params);
            power += along[k] * value(joint.stiffness[k], params) * stretch;
        }
    }
    power
}

#[test]
fn jacobians_take_velocities_to_those_of_frames() {
    all("J v = velocity of the frame", |c| {
        let (nv, n) = (c.plan.dims.nv, c.plan.frames.len());
        let mut jacobians = vec![0.0; 6 * nv * n];
        c.i.jacobians(&c.s.q, &mut jacobians);
        c.i.drive_v.fill(0.0);
        let mut frames = vec![FrameState::ground(); n];
        c.i.frames(&c.s.q, &c.s.v, &mut frames);
        let ours: Vec<f64> = match nv {
            0 => vec![0.0; 6 * n],
            nv => jacobians.chunks(nv).map(|row| row.iter().zip(&c.s.v).map(|(j, v)| j * v).sum()).collect(),
        };
        let theirs: Vec<f64> = frames.iter().flat_map(|f| [f.velocity.lin, f.velocity.ang].concat()).collect();
        c.near_within("J v", &ours, &theirs, 1.0, 1e-13)
    });
}

/// `R (J v̇ + bias)` is the derivative of the frame's velocity in ground axes, prescribed motions included.
#[test]
fn bias_accelerations_complete_the_accelerations_of_frames() {
    all("R (J a + bias) = d/dt (R velocity)", |c| {
        c.a = any_accelerations(c);
        let (nv, n) = (c.plan.dims.nv, c.plan.frames.len());
        let (mut jacobians, mut biases) = (vec![0.0; 6 * nv * n], vec![[0.0; 6]; n]);
        c.i.jacobians(&c.s.q, &mut jacobians);
        c.i.bias_accelerations(&c.s.q, &c.s.v, &mut biases);
        let (mut i, q) = c.dual();
        let mut frames = vec![FrameState::ground(); n];
        i.frames(&q, &c.dual_v(), &mut frames);
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for (k, frame) in frames.iter().enumerate() {
            let row = |r: usize| &jacobians[(6 * k + r) * nv..(6 * k + r + 1) * nv];
            let along = |r: usize| row(r).iter().zip(&c.a).map(|(j, a)| j * a).sum::<f64>() + biases[k][r];
            ours.extend(turn(frame, std::array::from_fn(along)));
            ours.extend(turn(frame, std::array::from_fn(|r| along(r + 3))));
            for part in [frame.velocity.lin, frame.velocity.ang] {
                theirs.extend(
                    frame.rotation.map(|row| (0..3).map(|k| row[k] * part[k]).fold(D::default(), |s, x| s + x).du),
                );
            }
        }
        c.near_within("acceleration", &ours, &theirs, 1.0, 1e-12)
    });
}

/// Centre of mass, momentum of the state's velocities about it and rate of all momentum, body by body from the motion
/// of frames.
#[test]
fn centroidal_momentum_is_that_of_the_bodies() {
    all("A v and A a + bias against the bodies' momenta", |c| {
        let nv = c.plan.dims.nv;
        let (mut center, mut matrix, mut bias) = ([0.0; 3], vec![0.0; 6 * nv], [0.0; 6]);
        c.i.centroidal(&c.s.q, &c.s.v, &mut center, &mut matrix, &mut bias);
        let none = vec![0.0; c.plan.dims.drive_v];
        let v = c.s.v.clone();
        let (slow, moving) = (c.bodies_at(&v, &none), c.bodies());
        let (model, params) = (&c.plan.model, &c.s.params);
        let (mut mass, mut moment) = (0.0, [0.0; 3]);
        let (mut momentum, mut rate) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
        for (k, frame) in newton::body_frames(&c.plan).into_iter().enumerate() {
            if c.plan.frames[frame].node.is_none() {
                continue;
            }
            let (m, at) = newton::mass_centre(model, params, k, &slow[k]);
            mass += m;
            moment = add3(moment, at.map(|x| m * x));
            let now = newton::momentum(model, params, k, &slow[k]);
            let change = newton::momentum(model, params, k, &moving[k]).map(|x| x.map(|x| x.du));
            momentum = [0, 1].map(|half| add3(momentum[half], now[half]));
            rate = [0, 1].map(|half| add3(rate[half], change[half]));
        }
        // Rotors alone may resist: without mass the centre is put at the origin.
        let other = moment.map(|x| if mass > 0.0 { x / mass } else { 0.0 });
        let about = |[lin, ang]: [[f64; 3]; 2]| {
            let arm = cross(other, lin);
            [lin, std::array::from_fn(|k| ang[k] - arm[k])].concat()
        };
        let times = |x: &[f64]| {
            let row = |k: usize| (0..nv).map(|j| matrix[k * nv + j] * x[j]).sum::<f64>();
            (0..6).map(row).collect::<Vec<f64>>()
        };
        let ours: Vec<f64> = times(&c.a).iter().zip(bias).map(|(a, b)| a + b).collect();
        let size = rate.concat().iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let errors = [
            c.near("center", &center, &other, 1.0),
            c.near("momentum", &times(&v), &about(momentum), largest(&momentum.concat())),
            c.near("rate", &ours, &about(rate), size.max(largest(&bias))),
        ];
        largest(&errors)
    });
}

/// `τ = Y π` of the model's own parameters, beside springs and rotors; a unit more of any inertial parameter changes
/// `τ` by its column.
#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    all("Y pi + springs + rotors = tau", |c| {
        let (nv, a) = (c.plan.dims.nv, any_accelerations(c));
        let tree = c.plan.tree(&c.s.params);
        c.i.wrenches.fill([0.0; 6]);
        let tau = |i: &mut Interpreter<f64>, v: &[f64], a: &[f64]| {
            let mut tau = vec![0.0; nv];
            i.inverse_dynamics(&c.s.q, v, a, &mut tau);
            tau
        };
        let n = tree.regressor_columns();
        if n == 0 {
            return 0.0;
        }
        let mut y = vec![0.0; nv * n];
        c.i.regressor(&c.s.q, &c.s.v, &a, &mut y);
        let asked = tau(&mut c.i, &c.s.v, &a);
        // At rest, without gravity, only springs pull.
        let (mut rest, zero) = (c.i.clone(), vec![0.0; nv]);
        rest.gravity = [0.0; 3];
        rest.drive_v.fill(0.0);
        rest.drive_a.fill(0.0);
        let mut sum = tau(&mut rest, &zero, &zero);
        let mut size = largest(&sum).max(largest(&asked));
        for node in &tree.nodes {
            let Source::State { v, .. } = node.source else { continue };
            for (k, passive) in node.passive.iter().enumerate() {
                sum[v + k] += node.ratio * node.ratio * passive.armature * a[v + k];
            }
        }
        let parameters = tree.dynamic_parameters();
        assert_eq!(parameters.len(), c.plan.parameter_names().len());
        for (sum, row) in sum.iter_mut().zip(y.chunks(n.max(1))) {
            let terms = row.iter().zip(&parameters).map(|(y, x)| y * x);
            size = terms.clone().fold(size, |m, x| m.max(x.abs()));
            *sum += terms.sum::<f64>();
        }
        let mut worst = c.near_within("tau", &asked, &sum, size, 1e-12);
        let mut rng = Rng::new(c.seed, 10);
        let (joint, k) = (rng.below(tree.joint_nodes.len()), rng.below(10));
        let mut unit = [0.0; 10];
        unit[k] = 1.0;
        let m = RigidInertia::from_parameters(&unit).articulated();
        let m = tree.frames[joint].place.iter().rev().fold(m, |m, step| step.inertia(&m));
        let mut other = tree.clone();
        let node = &mut other.nodes[tree.joint_nodes[joint]];
        node.inertia = node.inertia.plus(&RigidInertia::from_articulated(&m));
        let mut more = Interpreter::new(other, c.i.gravity);
        (more.drive_q, more.drive_v, more.drive_a) = (c.i.drive_q.clone(), c.i.drive_v.clone(), c.i.drive_a.clone());
        let change: Vec<f64> = tau(&mut more, &c.s.v, &a).iter().zip(&asked).map(|(more, tau)| more - tau).collect();
        let column: Vec<f64> = y.chunks(n.max(1)).map(|row| row[10 * joint + k]).collect();
        worst = worst.max(c.near_within("a unit more", &change, &column, size, 1e-12));
        for (k, row) in y.chunks(n.max(1)).enumerate() {
            let [damping, friction] = [0, 1].map(|kind| &row[n - (2 - kind) * nv..n - (1 - kind) * nv]);
            let v = c.s.v[k];
            assert_eq!((damping[k], damping.iter().filter(|x| **x != 0.0).count()), (v, 1));
            assert!((friction[k] - v.signum()).abs() < 1e-15 && friction.iter().filter(|x| **x != 0.0).count() == 1);
        }
        worst
    });
}

/// The base parameters explain every joint force: putting each group together onto its first parameter changes nothing,
/// and there are as many groups as the regressor has independent columns.
#[test]
fn base_parameters_replace_all_parameters() {
    let mut counted = [0; 2];
    for seed in 0..60 {
        let mut c = Case::new(seed);
        // Lengths are in the combinations: those of the default parameters.
        c.s.params = c.plan.default_params();
        let c = Case::of(seed, c.plan, c.s);
        let tree = c.plan.tree(&c.s.params);
        let found = identifiable(&c.plan);
        let (n, nv) = (tree.regressor_columns(), c.plan.dims.nv);
        let mut rng = Rng::new(seed, 11);
        // Parameters of no body at all serve as well: the joint forces are linear in them.
        let parameters: Vec<f64> = (0..n).map(|_| rng.around(1.0)).collect();
        let mut grouped = vec![0.0; n];
        for base in &found.base {
            grouped[base.parameter] =
                base.others.iter().fold(parameters[base.parameter], |sum, (k, factor)| sum + factor * parameters[*k]);
        }
        let mut y = vec![0.0; nv * n];
        let mut i = c.i.clone();
        i.regressor(&c.s.q, &c.s.v, &any_accelerations(&c), &mut y);
        let times =
            |x: &[f64]| y.chunks(n.max(1)).map(|row| row.iter().zip(x).map(|(y, x)| y * x).sum()).collect::<Vec<f64>>();
        let size = y.iter().fold(1.0_f64, |m, x| m.max(x.abs())) * largest(&grouped);
        c.near_within("base parameters", &times(&grouped), &times(&parameters), size, 1e-9);
        let others: usize = found.base.iter().map(|base| base.others.len()).sum();
        assert!(found.base.len() + found.without_effect.len() <= n, "seed {seed}");
        counted = [counted[0] + found.base.len(), counted[1] + others];
    }
    println!("{counted:?} base parameters, others in them");
    assert!(counted.iter().all(|n| *n > 1000), "{counted:?}");
}

//! Section 5.3.3 of the thesis with its errata, written down literally: minimal coordinates of a serial chain with one
//! loop to the ground, by a recursion with constraint matrices. The velocities of any choice of whole joints are the
//! dependent ones.

use mbd_codegen::model::{ConstraintKind, JointKind, LoopKind};
use mbd_runtime::spatial::cross;
use mbd_runtime::sweep::FrameState;
use mbd_runtime::tree::Source;
use mbd_runtime::System;
use mbd_testing::closed::{random_loops, LoopKnobs, LoopSystem};
use mbd_testing::kkt::{across, mounted, unit, Pose};
use mbd_testing::newton::{body_frames, freedoms, joint_coordinates};
use mbd_testing::random::{rotation_matrix, Distribution};
use mbd_testing::value;

use super::minimal::least;
use super::{Matrix, Vector};

/// The chain in a configuration, in body axes.
pub struct Chain {
    /// Model joint of every link.
    joints: Vec<usize>,
    /// First velocity of every link.
    first: Vec<usize>,
    /// Pose of every body in the ground.
    poses: Vec<Pose<f64>>,
    /// `X` from the previous link to each link.
    x: Vec<Matrix>,
    e: Vec<Matrix>,
    mass: Vec<Matrix>,
    /// `X` from the last body to the cut: to the axes of the loop's frame on the ground, at the origin of its frame on
    /// the body.
    cut: Matrix,
    /// `E_c`, constant in these axes.
    cut_rows: Matrix,
}

fn skew(a: [f64; 3]) -> Matrix {
    Matrix::from_row_slice(3, 3, &[0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0])
}

fn square(r: &[[f64; 3]; 3]) -> Matrix {
    Matrix::from_row_slice(3, 3, &r.concat())
}

/// The transform `X` of velocities at frame `a` to velocities at frame `b`.
fn transform(a: &Pose<f64>, b: &Pose<f64>) -> Matrix {
    let (ra, rb) = (square(&a.axes), square(&b.axes));
    let turn = rb.transpose() * &ra;
    let apart = Vector::from_fn(3, |k, _| b.origin[k] - a.origin[k]);
    let arm = ra.transpose() * apart;
    let mut x = Matrix::zeros(6, 6);
    x.view_mut((0, 0), (3, 3)).copy_from(&turn);
    x.view_mut((3, 3), (3, 3)).copy_from(&turn);
    x.view_mut((0, 3), (3, 3)).copy_from(&(-&turn * skew([arm[0], arm[1], arm[2]])));
    x
}

/// `Ω × P` (3.36).
fn crossed(o: &Vector, p: &Vector) -> Vector {
    let three = |v: &Vector, k: usize| [v[k], v[k + 1], v[k + 2]];
    let (v, w, f, n) = (three(o, 0), three(o, 3), three(p, 0), three(p, 3));
    let (a, b, c) = (cross(w, f), cross(v, f), cross(w, n));
    Vector::from_vec(vec![a[0], a[1], a[2], b[0] + c[0], b[1] + c[1], b[2] + c[2]])
}

/// `E_c` of the kinds of loops for which it is constant in the axes of the frame at rest.
pub fn cut_rows(kind: &LoopKind) -> Option<Matrix> {
    let lin = |n: [f64; 3]| vec![n[0], n[1], n[2], 0.0, 0.0, 0.0];
    let ang = |n: [f64; 3]| vec![0.0, 0.0, 0.0, n[0], n[1], n[2]];
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let all = |f: &dyn Fn([f64; 3]) -> Vec<f64>, list: &[[f64; 3]]| list.iter().map(|n| f(*n)).collect::<Vec<_>>();
    let columns: Vec<Vec<f64>> = match *kind {
        LoopKind::Revolute { axis } => [all(&lin, &axes), all(&ang, &across(axis))].concat(),
        LoopKind::Prismatic { axis } => [all(&lin, &across(axis)), all(&ang, &axes)].concat(),
        LoopKind::Cylindrical { axis } => [all(&lin, &across(axis)), all(&ang, &across(axis))].concat(),
        LoopKind::Planar { normal } => [vec![lin(unit(normal))], all(&ang, &across(normal))].concat(),
        LoopKind::Spherical => all(&lin, &axes),
        LoopKind::Fixed => [all(&lin, &axes), all(&ang, &axes)].concat(),
        LoopKind::PointOnLine { axis } => all(&lin, &across(axis)),
        LoopKind::PointOnPlane { normal } => vec![lin(unit(normal))],
        _ => return None,
    };
    Some(Matrix::from_fn(6, columns.len(), |i, k| columns[k][i]))
}

impl Chain {
    /// The chain of a system whose only constraint connects the ground and its last body, at coordinates `q`.
    pub fn new(system: &LoopSystem, q: &[f64]) -> Chain {
        let (plan, params) = (&system.open, &system.state.params);
        let mut frames = vec![FrameState::ground(); plan.frames.len()];
        system.state.interpreter(plan).frames(q, &vec![0.0; plan.dims.nv], &mut frames);
        let ConstraintKind::Loop { kind, first, second } = &system.model.constraints[0].kind else { panic!("a loop") };
        let at = joint_coordinates(plan, params, q, &[]);
        let at_body = body_frames(plan);
        let (mut chain_joints, mut starts) = (Vec::new(), Vec::new());
        let (mut poses, mut x, mut e, mut mass) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut before = Pose::ground();
        for (j, joint) in system.model.joints.iter().enumerate() {
            let Some(Source::State { v, .. }) = plan.slots.iter().find(|s| s.joint == j).and_then(|s| s.at) else {
                panic!("every joint of the chain moves")
            };
            chain_joints.push(j);
            starts.push(v);
            let pose = Pose::of(&frames[at_body[joint.child]]);
            x.push(transform(&before, &pose));
            let columns = freedoms(&joint.kind, params, &at[j]);
            e.push(Matrix::from_fn(6, columns.len(), |i, k| columns[k][i]));
            let b = &system.model.bodies[joint.child];
            let (m, com) = (value(b.mass, params), b.com.map(|c| value(c, params)));
            let [xx, yy, zz, xy, xz, yz] = b.inertia.map(|i| value(i, params));
            let r = square(&rotation_matrix(&b.inertia_axes, params));
            let own = &r * square(&[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) * r.transpose();
            let s = skew(com);
            let mut inertia = Matrix::zeros(6, 6);
            inertia.view_mut((0, 0), (3, 3)).fill_diagonal(m);
            inertia.view_mut((0, 3), (3, 3)).copy_from(&(-m * &s));
            inertia.view_mut((3, 0), (3, 3)).copy_from(&(m * &s));
            inertia.view_mut((3, 3), (3, 3)).copy_from(&(own - m * &s * &s));
            mass.push(inertia);
            poses.push(pose);
            before = pose;
        }
        let place = |mount| mounted(plan, params, &frames, mount);
        let (rest, moved) = (place(first), place(second));
        let cut = transform(&before, &Pose { axes: rest.axes, ..moved });
        Chain {
            joints: chain_joints,
            first: starts,
            poses,
            x,
            e,
            mass,
            cut,
            cut_rows: cut_rows(kind).expect("a kind with constant rows"),
        }
    }

    pub fn links(&self) -> usize {
        self.joints.len()
    }

    /// Velocity indices of some links' joints.
    pub fn velocities(&self, links: &[usize]) -> Vec<usize> {
        links.iter().flat_map(|&k| self.first[k]..self.first[k] + self.e[k].ncols()).collect()
    }

    /// `X` from link `k` to link `d`, in either direction along the chain.
    fn between(&self, d: usize, k: usize) -> Matrix {
        transform(&self.poses[k], &self.poses[d])
    }

    /// `C̄_q` of the dependent links, 6 × freedoms each (5.172 to 5.176).
    fn constraint_matrices(&self, dependents: &[usize]) -> Vec<Matrix> {
        let n = self.links();
        let mut c = &self.cut_rows * self.cut_rows.transpose();
        let mut x = &self.cut;
        let mut own = vec![None; n];
        for k in (0..n).rev() {
            let s = x.transpose() * &c * x;
            c = s.clone();
            if dependents.contains(&k) {
                let e = &self.e[k];
                let inverse = (e.transpose() * &s * e).try_inverse().expect("a valid choice");
                let cq = -inverse * e.transpose() * &s;
                c = &s * (Matrix::identity(6, 6) + e * &cq);
                own[k] = Some(cq);
            }
            x = &self.x[k];
        }
        let mut total: Vec<Matrix> = Vec::new();
        for (at, &d) in dependents.iter().enumerate() {
            let mut z = Matrix::identity(6, 6);
            for (i, bar) in dependents[..at].iter().zip(&total) {
                z += self.between(d, *i) * &self.e[*i] * bar.transpose() * self.between(*i, d);
            }
            let cq = own[d].as_ref().expect("it is dependent");
            total.push((cq * z).transpose());
        }
        total
    }
}

/// A serial chain with one loop to the ground, as section 5.3.3 requires: its joints have joint forces, but no springs,
/// dampers or rotors.
pub fn chain(seed: u64) -> LoopSystem {
    let mixed = [2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0];
    let kinds = if seed.is_multiple_of(2) { [1.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] } else { mixed };
    let tree = Distribution { bodies: (3, 6), kinds, ..Distribution::default() };
    let mut cuts = [0.0; 20];
    for k in [0, 1, 2, 5, 6, 7, 9, 10] {
        cuts[k] = 1.0;
    }
    let distribution = LoopKnobs { tree, count: (1, 1), ground: 1.0, coupling: 0.0, kinds: cuts, ..LoopKnobs::plain() };
    (0..)
        .map(|k| random_loops(seed + 1000 * k, &distribution))
        .find(serial)
        .expect("some loop goes from the ground to the tip")
}

fn serial(s: &LoopSystem) -> bool {
    let tip = s.model.joints.last().map(|j| j.child);
    match &s.model.constraints[0].kind {
        ConstraintKind::Loop { first, second, .. } => first.body.is_none() && second.body == tip,
        ConstraintKind::Coupling { .. } => false,
    }
}

/// A node of the backward recursion.
struct Node {
    u: Matrix,
    inverse: Matrix,
    /// `D` and, one column for each dependent momentum, `D^p`.
    d: Matrix,
    m_after: Matrix,
    d_after: Matrix,
    /// The known momentum in the first column, zeros in the others.
    p: Matrix,
}

/// Velocities and `ṗ_ind` from independent momenta. All arrays have entries for all velocities.
pub fn motion(system: &LoopSystem, p: &Vector, dependents: &[usize]) -> (Vector, Vector) {
    let chain = Chain::new(system, &system.state.q);
    let bars = chain.constraint_matrices(dependents);
    let v = velocities(&chain, &bars, p, dependents);
    let rates = momentum_rates(system, &chain, &bars, &v, dependents);
    (v, rates)
}

/// One step of the backward recursion. The momentum of a dependent joint counts as zero because its `p^d` terms cancel.
fn node(e: &Matrix, p: Matrix, m: Matrix, d: Matrix) -> Node {
    let u = &m * e;
    let inverse = (e.transpose() * &u).try_inverse().expect("the freedoms move inertia");
    let m_after = &m - &u * &inverse * u.transpose();
    let d_after = &d + &u * &inverse * (&p - e.transpose() * &d);
    Node { u, inverse, d, m_after, d_after, p }
}

/// Velocities by (5.180) to (5.187).
fn velocities(chain: &Chain, bars: &[Matrix], p: &Vector, dependents: &[usize]) -> Vector {
    let n = chain.links();
    let unknown: usize = bars.iter().map(Matrix::ncols).sum();
    let innermost = dependents[0];
    let given = |k: usize| {
        let freedoms = chain.e[k].ncols();
        let mut known = Matrix::zeros(freedoms, 1 + unknown);
        if !dependents.contains(&k) {
            known.column_mut(0).copy_from(&p.rows(chain.first[k], freedoms));
        }
        known
    };
    let mut nodes: Vec<Option<Node>> = (0..n).map(|_| None).collect();
    let mut d = Matrix::zeros(6, 1 + unknown);
    let mut column = 1;
    for (bar, &i) in bars.iter().zip(dependents) {
        let seed = chain.between(i, n - 1).transpose() * bar;
        d.columns_mut(column, bar.ncols()).copy_from(&seed);
        column += bar.ncols();
    }
    let mut m = chain.mass[n - 1].clone();
    for k in (innermost..n).rev() {
        let done = node(&chain.e[k], given(k), m, d);
        let x = &chain.x[k];
        (m, d) = (x.transpose() * &done.m_after * x, x.transpose() * &done.d_after);
        if k > innermost {
            m += &chain.mass[k - 1];
        }
        nodes[k] = Some(done);
    }
    // The velocity of the last body as an affine function: a constant, then the columns of the dependent momenta, then
    // those of the velocity of the link before the innermost dependent one.
    let mut affine = Matrix::zeros(6, 1 + unknown + 6);
    affine.columns_mut(1 + unknown, 6).fill_with_identity();
    for k in innermost..n {
        let done = nodes[k].as_ref().expect("it was met");
        let hat = &chain.x[k] * affine;
        let mut known = &done.p - chain.e[k].transpose() * &done.d;
        known = known.resize_horizontally(1 + unknown + 6, 0.0);
        affine = &hat + &chain.e[k] * (&done.inverse * (known - done.u.transpose() * &hat));
    }
    // This replaces the normal equations of (5.186), which square the condition.
    let rows = chain.cut_rows.transpose() * &chain.cut;
    let solver = -least(&(&rows * affine.columns(1, unknown)), &rows);
    let constant = &solver * affine.column(0);
    let by_velocity = &solver * affine.columns(1 + unknown, 6);
    // From here to the base the recursion is that of an open chain: the dependent momenta are affine in the velocity of
    // the link before the innermost dependent one.
    let (by_p, rest) = (d.columns(1, unknown).clone_owned(), d.column(0).clone_owned());
    m += &by_p * &by_velocity;
    let mut d = Matrix::from_columns(&[rest + by_p * &constant]);
    for k in (0..innermost).rev() {
        m += &chain.mass[k];
        let done = node(&chain.e[k], given(k).columns(0, 1).clone_owned(), m, d);
        let x = &chain.x[k];
        (m, d) = (x.transpose() * &done.m_after * x, x.transpose() * &done.d_after);
        nodes[k] = Some(done);
    }
    let mut v = Vector::zeros(p.len());
    let mut omega = Vector::zeros(6);
    let mut momenta = Vector::zeros(unknown);
    for k in 0..n {
        if k == innermost {
            momenta = &constant + &by_velocity * &omega;
        }
        let done = nodes[k].as_ref().expect("it was met");
        let hat = &chain.x[k] * omega;
        let mut known = done.p.column(0) - chain.e[k].transpose() * done.d.column(0);
        if k >= innermost {
            known -= chain.e[k].transpose() * done.d.columns(1, unknown) * &momenta;
        }
        let rate = &done.inverse * (known - done.u.transpose() * &hat);
        v.rows_mut(chain.first[k], rate.len()).copy_from(&rate);
        omega = hat + &chain.e[k] * rate;
    }
    v
}

/// Momentum rates by (5.177) to (5.179).
fn momentum_rates(system: &LoopSystem, chain: &Chain, bars: &[Matrix], v: &Vector, dependents: &[usize]) -> Vector {
    let n = chain.links();
    let rate = |k: usize| v.rows(chain.first[k], chain.e[k].ncols()).clone_owned();
    let force = |k: usize| Vector::from_fn(chain.e[k].ncols(), |i, _| system.state.tau[chain.first[k] + i]);
    let mut omega: Vec<Vector> = Vec::new();
    for k in 0..n {
        let hat = if k == 0 { Vector::zeros(6) } else { &chain.x[k] * &omega[k - 1] };
        omega.push(hat + &chain.e[k] * rate(k));
    }
    let p: Vec<Vector> = (0..n).map(|k| &chain.mass[k] * &omega[k]).collect();
    let t: Vec<Vector> = (0..n).map(|k| weight(system, chain, k)).collect();
    let gathered = |own: &[Vector], last: Vector| {
        let mut sums = own.to_vec();
        sums[n - 1] = last;
        for k in (0..n - 1).rev() {
            sums[k] = &own[k] + chain.x[k + 1].transpose() * &sums[k + 1];
        }
        sums
    };
    let (ps, ts) = (gathered(&p, p[n - 1].clone()), gathered(&t, t[n - 1].clone()));
    let bar_rates = bar_rates(system, v, dependents);
    let (mut pc, mut tc) = (p[n - 1].clone(), t[n - 1].clone());
    for ((bar, bar_rate), &i) in bars.iter().zip(&bar_rates).zip(dependents) {
        let z = bar * chain.e[i].transpose();
        let z_rate = bar_rate * chain.e[i].transpose() + bar * joint_rate(system, chain, i, v).transpose();
        let x = chain.between(i, n - 1).transpose();
        let turned = crossed(&omega[i], &(&z * &ps[i])) - &z * crossed(&omega[i], &ps[i]);
        tc += &x * (&z * &ts[i] + bar * force(i) + z_rate * &ps[i] + turned);
        pc += &x * &z * &ps[i];
    }
    let (pc, tc) = (gathered(&p, pc), gathered(&t, tc));
    let mut out = Vec::new();
    for k in (0..n).filter(|k| !dependents.contains(k)) {
        let along = chain.e[k].transpose() * (&tc[k] - crossed(&omega[k], &pc[k]));
        let all = along + joint_rate(system, chain, k, v).transpose() * &pc[k] + force(k);
        out.extend(all.iter().copied());
    }
    out.into()
}

/// Force of gravity on a body, and its moment about the origin of the body frame.
fn weight(system: &LoopSystem, chain: &Chain, k: usize) -> Vector {
    let body = &system.model.bodies[system.model.joints[chain.joints[k]].child];
    let m = value(body.mass, &system.state.params);
    let pose = &chain.poses[k];
    let g = square(&pose.axes).transpose() * Vector::from_column_slice(&system.state.gravity);
    let f = [m * g[0], m * g[1], m * g[2]];
    let n = cross(body.com.map(|x| value(x, &system.state.params)), f);
    Vector::from_vec([f, n].concat())
}

/// `Ė` of a link's joint. It is zero except for a universal joint, whose first axis rotates in body axes against the
/// second angle.
fn joint_rate(system: &LoopSystem, chain: &Chain, k: usize, v: &Vector) -> Matrix {
    let e = &chain.e[k];
    let mut rate = Matrix::zeros(6, e.ncols());
    if let JointKind::Universal { .. } = system.model.joints[chain.joints[k]].kind {
        let column = |c: usize| [e[(3, c)], e[(4, c)], e[(5, c)]];
        let turning = cross(column(0), column(1));
        for (i, x) in turning.iter().enumerate() {
            rate[(3 + i, 0)] = x * v[chain.first[k] + 1];
        }
    }
    rate
}

/// `d/dt C̄_q` in body axes, by central differences of fourth order.
fn bar_rates(system: &LoopSystem, v: &Vector, dependents: &[usize]) -> Vec<Matrix> {
    let q = &system.state.q;
    let mut qd = vec![0.0; q.len()];
    system.state.interpreter(&system.open).coordinate_rates(q, &v.as_slice().to_vec(), &mut qd);
    let h = 1e-3 / v.amax().max(1.0);
    let at = |steps: f64| {
        let q: Vec<f64> = q.iter().zip(&qd).map(|(q, qd)| q + steps * h * qd).collect();
        Chain::new(system, &q).constraint_matrices(dependents)
    };
    let [a, b, c, d] = [at(1.0), at(-1.0), at(2.0), at(-2.0)];
    let slope = |k: usize| ((&a[k] - &b[k]) * 8.0 - (&c[k] - &d[k])) / (12.0 * h);
    (0..dependents.len()).map(slope).collect()
}

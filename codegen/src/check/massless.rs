//! Freedoms that nothing resists: they make the mass matrix singular.

use crate::import::raw::RawModel;
use crate::import::source::Findings;
use crate::import::words::quote;
use crate::inertia::{apply, at_default, cross, dot, moved, own, sum, trace, transpose, unit, Inertia, Mat3};
use crate::model::{Body, Freedom, JointKind, JointMotion, Model, Param, Unit, Value};

/// Below this fraction of the body's largest moment (or of its mass) an inertia is taken for rounding: 1.5708 for pi/2
/// leaves 1e-11.
const NOTHING: f64 = 1e-10;

/// Reports free joints that carry nothing heavy, and leaves that do not resist one of their freedoms. `order` gives the
/// file index of each joint.
pub(super) fn leaves(raw: &RawModel, order: &[usize], model: &Model, findings: &mut Findings) {
    let n = model.joints.len();
    let mut carrier = vec![0; model.bodies.len()];
    for (k, joint) in model.joints.iter().enumerate() {
        carrier[joint.child] = k;
    }
    let mut leads = vec![false; n];
    for joint in &model.joints {
        if let JointMotion::Mimic { leader, .. } = joint.motion {
            leads[leader] = true;
        }
    }
    // What rides on each joint, from the leaves inwards: is anything heavy, is anything moving, and (while nothing
    // moves) its inertia.
    let mut heavy: Vec<bool> = model.joints.iter().map(|j| is_heavy(&model.bodies[j.child])).collect();
    let mut moving = vec![false; n];
    let mut reported = vec![false; n];
    let mut inertia: Vec<Option<Inertia>> =
        model.joints.iter().map(|j| constant(&model.bodies[j.child], &model.params)).collect();
    for k in (0..n).rev() {
        let joint = &model.joints[k];
        let nv = joint.kind.nv();
        let judged = nv > 0 && joint.motion == JointMotion::Free && !leads[k];
        if judged && !reported[k] {
            if let Some(problem) = weak_freedom(model, k, heavy[k], moving[k], inertia[k]) {
                let source = &raw.joints[order[k]];
                let body = quote(&model.bodies[joint.child].name);
                let message = format!("joint {}: {problem}, so the mass matrix is singular", quote(&joint.name));
                let help = format!("give {body} mass and inertia, give the joint an `armature`, or make it `fixed`");
                findings.error(source.name.span, message, help);
                reported[k] = true;
            }
        }
        let Some(parent) = joint.parent.map(|b| carrier[b]) else { continue };
        heavy[parent] |= heavy[k];
        moving[parent] |= moving[k] || nv > 0;
        // One report per massless branch is enough.
        reported[parent] |= reported[k] && !heavy[k];
        inertia[parent] = match (inertia[parent], inertia[k]) {
            (Some(a), Some(b)) => Some(sum(a, moved(b, &joint.placement, &model.params))),
            _ => None,
        };
    }
}

/// Says which freedom of joint `k` nothing resists, if there is one.
fn weak_freedom(model: &Model, k: usize, heavy: bool, moving: bool, inertia: Option<Inertia>) -> Option<String> {
    let joint = &model.joints[k];
    let body = quote(&model.bodies[joint.child].name);
    let loose: Vec<bool> = joint.armature.iter().map(|a| a.constant() == Some(0.0)).collect();
    if !heavy {
        let all = if moving { " and all it carries" } else { "" };
        let verb = if moving { "have" } else { "has" };
        return loose.contains(&true).then(|| format!("{body}{all} {verb} neither mass nor inertia"));
    }
    let inertia = inertia.filter(|_| !moving)?;
    if matches!(joint.kind.axes(), [a, b] if super::joints::parallel(*a, *b)) {
        return None; // reported as that
    }
    let columns = freedoms(&joint.kind, &model.params);
    let armature: Vec<f64> = joint.armature.iter().map(|a| at_default(*a, &model.params)).collect();
    let resists = resistance(&inertia, &columns, &armature);
    let scale = |unit: Unit| if unit == Unit::Radian { trace(&inertia.about_origin) } else { inertia.mass };
    let freedoms = joint.kind.spec().freedoms;
    let weak = (0..columns.len()).find(|&i| loose[i] && resists[i] <= NOTHING * scale(freedoms[i].unit))?;
    let Freedom { unit, direction, .. } = freedoms[weak];
    let way = if unit == Unit::Radian { "turning" } else { "sliding" };
    Some(format!("{body} has no inertia against {way} {direction}"))
}

/// A body counts as heavy if any part of its inertia is a parameter or not zero.
fn is_heavy(body: &Body) -> bool {
    body.mass != Value::ZERO || body.inertia.iter().any(|x| *x != Value::ZERO)
}

/// Inertia of a body in its own frame; `None` if a parameter other than one of its axes has a say in it.
fn constant(body: &Body, params: &[Param]) -> Option<Inertia> {
    let mut numbers = body.com.iter().chain(&body.inertia).chain([&body.mass]);
    numbers.all(|x| x.constant().is_some()).then(|| own(body, params))
}

/// Velocity and angular velocity of the child frame per unit of each freedom, at zero coordinates. Of the directions
/// across an axis any two will do: the mass is the same along all.
fn freedoms(kind: &JointKind, params: &[Param]) -> Vec<([f64; 3], [f64; 3])> {
    const AXES: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut columns = Vec::new();
    for (element, axis) in kind.elements() {
        let axes = axis.map_or(AXES, |axis| {
            let n = unit(axis);
            let k = (0..3).min_by(|i, j| n[*i].abs().total_cmp(&n[*j].abs())).unwrap_or(0);
            let a = unit(cross(n, AXES[k]));
            [a, cross(n, a), n]
        });
        let element = element.map(&mut |value| at_default(value, params));
        let outer = |v: [f64; 3]| apply(&transpose(&axes), v);
        columns.extend((0..element.nv()).map(|k| element.axis(k).motion(1.0)).map(|e| (outer(e.lin), outer(e.ang))));
    }
    columns
}

/// What resists each freedom when the ones before it may follow freely: the pivots of the joint's own block of the mass
/// matrix.
fn resistance(i: &Inertia, columns: &[([f64; 3], [f64; 3])], armature: &[f64]) -> Vec<f64> {
    let momentum = |(v, w): ([f64; 3], [f64; 3])| {
        let a = cross(w, i.first);
        let p = [0, 1, 2].map(|k| i.mass * v[k] + a[k]);
        let (b, c) = (cross(i.first, v), apply(&i.about_origin, w));
        (p, [0, 1, 2].map(|k| b[k] + c[k]))
    };
    let n = columns.len();
    let mut m = vec![vec![0.0; n]; n];
    for a in 0..n {
        let (p, l) = momentum(columns[a]);
        for b in 0..n {
            m[a][b] = dot(columns[b].0, p) + dot(columns[b].1, l);
        }
        m[a][a] += armature[a];
    }
    let mut pivots = vec![0.0; n];
    for k in 0..n {
        pivots[k] = m[k][k];
        if pivots[k] <= 0.0 {
            continue;
        }
        for r in k + 1..n {
            let f = m[r][k] / pivots[k];
            for c in k..n {
                m[r][c] -= f * m[k][c];
            }
        }
    }
    pivots
}

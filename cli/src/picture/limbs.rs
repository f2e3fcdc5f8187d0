//! Colours and names of bodies: one colour for each body of a small mechanism, one for each limb of a large one.

use multibody::codegen::model::{Model, Value};

use crate::ink::COLOURS;

/// Largest number of names; more hide the mechanism.
const NAMES: usize = 12;

/// The body that holds each body.
fn parents(model: &Model) -> Vec<Option<usize>> {
    let mut parents = vec![None; model.bodies.len()];
    model.joints.iter().for_each(|joint| parents[joint.child] = joint.parent);
    parents
}

/// Whether a joint lets each body move against the one that holds it.
fn moves(model: &Model) -> Vec<bool> {
    let mut moves = vec![false; model.bodies.len()];
    model.joints.iter().for_each(|joint| moves[joint.child] = joint.kind.spec().nv() > 0);
    moves
}

/// Whether each body is welded to the ground.
pub fn grounded(model: &Model) -> Vec<bool> {
    let moves = moves(model);
    let mut grounded = vec![false; model.bodies.len()];
    // Joints are depth first, so that parents come before children.
    for joint in &model.joints {
        grounded[joint.child] = !moves[joint.child] && joint.parent.is_none_or(|p| grounded[p]);
    }
    grounded
}

/// Limb of each body: what follows a body without branching. Welded bodies belong to the limb of the body that holds them.
fn limbs(model: &Model) -> Vec<usize> {
    let (parents, moves) = (parents(model), moves(model));
    let mut branches = vec![0; model.bodies.len()];
    for (b, parent) in parents.iter().enumerate() {
        if let (Some(p), true) = (parent, moves[b]) {
            branches[*p] += 1;
        }
    }
    let (mut limbs, mut count) = (vec![0; model.bodies.len()], 0);
    // Joints are depth first, so that parents come before children.
    for joint in &model.joints {
        let b = joint.child;
        limbs[b] = match joint.parent {
            Some(p) if !moves[b] || branches[p] < 2 => limbs[p],
            _ => {
                count += 1;
                count - 1
            }
        };
    }
    limbs
}

/// Bodies with mass that a joint moves.
fn bodies(model: &Model, number: &dyn Fn(Value) -> f64) -> Vec<usize> {
    let moves = moves(model);
    (0..model.bodies.len()).filter(|b| moves[*b] && number(model.bodies[*b].mass) > 0.0).collect()
}

/// Whether bodies of one limb have one colour.
fn by_limb(model: &Model, number: &dyn Fn(Value) -> f64) -> bool {
    let limbs = limbs(model);
    bodies(model, number).len() > COLOURS && limbs.iter().any(|limb| *limb != limbs[0])
}

/// Index of the colour of each body.
pub fn colours(model: &Model, number: &dyn Fn(Value) -> f64) -> Vec<usize> {
    match by_limb(model, number) {
        true => limbs(model),
        false => {
            let (bodies, parents) = (bodies(model, number), parents(model));
            let mut colours: Vec<usize> = vec![0; model.bodies.len()];
            for joint in &model.joints {
                let b = joint.child;
                colours[b] = match bodies.iter().position(|x| *x == b) {
                    Some(k) => k,
                    None => parents[b].map_or(0, |p| colours[p]),
                };
            }
            colours
        }
    }
}

/// Bodies that a picture names: all of a small mechanism, the last ones of the limbs of a large one.
pub fn named(model: &Model, number: &dyn Fn(Value) -> f64) -> Vec<usize> {
    let mut bodies = bodies(model, number);
    if by_limb(model, number) {
        let parents = parents(model);
        let holds = |b: usize| bodies.iter().any(|x| parents[*x] == Some(b));
        bodies = bodies.iter().copied().filter(|b| !holds(*b)).collect();
    }
    if bodies.len() > NAMES {
        bodies.clear();
    }
    bodies
}

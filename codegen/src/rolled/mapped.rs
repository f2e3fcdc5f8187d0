//! Constraints and nodes with other constants: symbols, numbers, or columns of a table.

use mbd_runtime::spatial::{ElementaryTransform, RigidInertia};
use mbd_runtime::tree::{Bond, Constraint, Cut, Node, Passive, TreeFrame};

fn map_steps<A: Copy, B>(steps: &[ElementaryTransform<A>], f: &mut impl FnMut(A) -> B) -> Vec<ElementaryTransform<B>> {
    let steps = steps.iter().map(|step| match *step {
        ElementaryTransform::Turn { axis, c, s } => ElementaryTransform::Turn { axis, c: f(c), s: f(s) },
        ElementaryTransform::Shift { axis, r } => ElementaryTransform::Shift { axis, r: f(r) },
        ElementaryTransform::Rotate(m) => ElementaryTransform::Rotate(m.map(|row| row.map(&mut *f))),
    });
    steps.collect()
}

/// A constraint with every constant replaced, always in the same order.
pub fn map_constraint<A: Copy, B>(constraint: &Constraint<A>, f: &mut impl FnMut(A) -> B) -> Constraint<B> {
    let bond = match &constraint.bond {
        Bond::Cut(cut) => {
            let closure = cut.closure.map(&mut *f);
            let [a, b] =
                [&cut.a, &cut.b].map(|frame| TreeFrame { node: frame.node, place: map_steps(&frame.place, f) });
            let (path_a, path_b) = (cut.path_a.clone(), cut.path_b.clone());
            Bond::Cut(Cut { closure, a, b, path_a, path_b, grounded: cut.grounded })
        }
        Bond::Coupling { terms, offset } => {
            Bond::Coupling { terms: terms.iter().map(|(node, ratio)| (*node, f(*ratio))).collect(), offset: f(*offset) }
        }
    };
    Constraint {
        bond,
        slots: constraint.slots.clone(),
        passes: constraint.passes.clone(),
        first: constraint.first,
        entry: constraint.entry,
        velocities: constraint.velocities.clone(),
        decay: constraint.decay.map(&mut *f),
        compliance: constraint.compliance.map(&mut *f),
        own_axes: constraint.own_axes,
    }
}

/// A node with every constant replaced, always in the same order.
pub fn map_node<A: Copy, B>(node: &Node<A>, f: &mut impl FnMut(A) -> B) -> Node<B> {
    let place = map_steps(&node.place, f);
    let passive = node.passive.iter().map(|p| Passive {
        damping: f(p.damping),
        stiffness: f(p.stiffness),
        rest: f(p.rest),
        armature: f(p.armature),
    });
    let passive = passive.collect();
    Node {
        parent: node.parent,
        place,
        kind: node.kind.map(&mut *f),
        source: node.source,
        ratio: f(node.ratio),
        offset: f(node.offset),
        phase: f(node.phase),
        quarter: node.quarter,
        slide: f(node.slide),
        slides: node.slides,
        inertia: RigidInertia {
            mass: f(node.inertia.mass),
            moment: node.inertia.moment.map(&mut *f),
            inertia: node.inertia.inertia.map(&mut *f),
        },
        passive,
        elimination: node.elimination.clone(),
    }
}

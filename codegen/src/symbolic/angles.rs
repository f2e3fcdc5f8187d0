//! Sines and cosines of a straight-line body.

use std::collections::{BTreeMap, BTreeSet};

use super::{Op, Operand, Program, ProgramResult};

/// Angles with the nodes of their sines and cosines.
pub type Pairs = BTreeMap<u32, [Option<u32>; 2]>;

/// Angles of a program with the nodes of their sines and cosines.
pub fn pairs(program: &Program) -> Pairs {
    let mut pairs = Pairs::new();
    for (id, op, _) in &program.steps {
        match op {
            Op::Sin(a) => pairs.entry(*a).or_default()[0] = Some(*id),
            Op::Cos(a) => pairs.entry(*a).or_default()[1] = Some(*id),
            _ => {}
        }
    }
    pairs
}

/// Nodes among the operands.
pub fn nodes(op: &Op) -> impl Iterator<Item = u32> {
    op.operands().filter_map(|o| if let Operand::Node(k) = o { Some(k) } else { None })
}

/// Some nodes of a program, and all that they are computed from.
pub fn with_operands(program: &Program, mut wanted: BTreeSet<u32>) -> BTreeSet<u32> {
    for (id, op, _) in program.steps.iter().rev() {
        if wanted.contains(id) {
            wanted.extend(nodes(op));
        }
    }
    wanted
}

/// Division of a program into the part before its sines and cosines and the part after them.
#[derive(Default)]
pub struct Angles {
    /// Angles that depend on inputs by sums and products only.
    pub early: Pairs,
    /// The other angles.
    pub late: Pairs,
    /// Nodes that early angles need.
    pub before: BTreeSet<u32>,
    /// Nodes that the rest needs.
    pub after: BTreeSet<u32>,
}

impl Angles {
    /// Divides a program.
    pub fn new(program: &Program) -> Angles {
        // Nodes that do not depend on inputs by sums and products only.
        let mut involved = BTreeSet::new();
        for (id, op, _) in &program.steps {
            let functions = matches!(op, Op::Sin(_) | Op::Cos(_) | Op::Sqrt(_) | Op::Div(..) | Op::ReciprocalAbove(_));
            if functions || op.looks_up() || nodes(op).any(|k| involved.contains(&k)) {
                involved.insert(*id);
            }
        }
        let mut angles = Angles::default();
        (angles.late, angles.early) = pairs(program).into_iter().partition(|(a, _)| involved.contains(a));
        angles.before = with_operands(program, angles.early.keys().copied().collect());
        for result in &program.outputs {
            if let ProgramResult::Node(id, _) = result {
                angles.after.insert(*id);
            }
        }
        for (id, op, _) in program.steps.iter().rev() {
            let early = matches!(op, Op::Sin(a) | Op::Cos(a) if angles.early.contains_key(a));
            if angles.after.contains(id) && !early {
                angles.after.extend(nodes(op));
            }
        }
        angles
    }
}

//! Names of values: body, quantity and component.

use std::collections::{BTreeMap, BTreeSet};

use mbd_runtime::sweep::Quantity;

pub use crate::names::identifier;

#[cfg(feature = "factored")]
use crate::factored::{Piece, Source};
use crate::output::{locate, InputArray};
use crate::plan::Plan;
use crate::rolled::{Block, Place, RolledProgram};
use crate::symbolic::{Entry, Label, Name, Op, Program};

/// A name as an identifier in upper case, for constants.
pub fn constant(name: &str) -> String {
    identifier(name).to_ascii_uppercase()
}

/// Description of a quantity for comments.
pub fn quantity(q: Quantity) -> &'static str {
    match q {
        Quantity::Pose => "sine and cosine, rotation",
        Quantity::Inertia => "inertia carried to the parent, M* (4.48)",
        Quantity::Pivot => "U, Mj, k and the reduced inertia M' (4.44)",
        Quantity::BiasMomentum => "bias momentum D, D' (4.45, 4.49)",
        Quantity::Velocity => "velocity and joint rate (4.40)",
        Quantity::Rate => "coordinate rates",
        Quantity::Acceleration => "acceleration",
        Quantity::Momentum => "momentum",
        Quantity::MomentumRate => "momentum rate (4.36)",
        Quantity::Load => "gravity and wrenches",
        Quantity::Energy => "energy",
        Quantity::MassMatrix => "mass matrix by composite inertias",
        Quantity::Placement => "placement",
        Quantity::Reaction => "reaction wrench (4.66)",
        Quantity::Effort => "joint force",
        Quantity::Jacobian => "Jacobian",
        Quantity::Derivative => "derivatives of the rates",
        Quantity::Constraint => "loops and couplings",
    }
}

/// The comment above values of one body and quantity.
pub fn heading(plan: &Plan, (node, what): Label) -> String {
    format!("{}: {}", node.map_or("ground", |i| plan.nodes[i].name.as_str()), quantity(what))
}

/// The part of a name after the body: `m_xx`, `v`.
fn component(Name { minus, letter, entry, .. }: &Name) -> String {
    let minus = if *minus { "minus_" } else { "" };
    match entry {
        Entry::Axes("") => format!("{minus}{letter}"),
        Entry::Axes(axes) => format!("{minus}{letter}_{axes}"),
        Entry::Number(k) => format!("{minus}{letter}_{k}"),
        Entry::Pair(i, k) => format!("{minus}{letter}_{i}_{k}"),
    }
}

/// Names of the values of one function.
#[derive(Default)]
pub struct Names {
    taken: BTreeSet<String>,
    /// Number that comes next after a name.
    next: BTreeMap<String, usize>,
}

impl Names {
    /// Names that differ from some others.
    pub fn besides(others: impl IntoIterator<Item = String>) -> Names {
        Names { taken: others.into_iter().collect(), ..Names::default() }
    }

    /// Names of straight-line code.
    pub fn straight(self, plan: &Plan, program: &Program, inputs: &[InputArray]) -> BTreeMap<u32, String> {
        let bodies: Vec<String> = plan.nodes.iter().map(|n| identifier(&n.name)).collect();
        let body = |node: Option<usize>| node.map_or("ground", |i| bodies[i].as_str()).to_string();
        self.of(program, body, |k| input(inputs, k))
    }

    /// Names of a piece of factored code.
    #[cfg(feature = "factored")]
    pub fn piece(self, plan: &Plan, piece: &Piece, inputs: &[InputArray]) -> BTreeMap<u32, String> {
        let body = |node: Option<usize>| node.map_or("ground".to_string(), |i| identifier(&plan.nodes[i].name));
        let source = |k: usize| match piece.inputs[k] {
            Source::Given(k) => input(inputs, k),
            Source::Kept(k) => format!("kept_{k}"),
            Source::Own(k) => format!("own_{k}"),
            Source::Part { place, entry } => format!("part{place}_{entry}"),
        };
        self.of(&piece.program, body, source)
    }

    /// Names of a block of rolled code; in loops they contain the place of the link in its iteration.
    pub fn block(
        self,
        plan: &Plan,
        program: &RolledProgram,
        block: &Block,
        inputs: &[InputArray],
    ) -> BTreeMap<u32, String> {
        let body = |node: Option<usize>| match (node, &block.repeat) {
            (None, _) => "ground".to_string(),
            (Some(i), None) => identifier(&plan.nodes[i].name),
            (Some(0), Some(_)) => "inner".to_string(),
            // Branches are named after the first of them.
            (Some(i), Some(r)) if !program.loops[r.run].branches.is_empty() => {
                identifier(&plan.nodes[program.loops[r.run].nodes.start + i - 1].name)
            }
            (Some(_), Some(r)) if program.loops[r.run].period == 1 => "link".to_string(),
            (Some(i), Some(_)) => format!("link{i}"),
        };
        let source = |k: usize| match block.inputs[k] {
            Place::Given(k) | Place::GivenOfTurn { first: k, .. } => input(inputs, k),
            Place::Kept(slot) => format!("kept_{slot}"),
            Place::Column(column) => format!("table_{column}"),
            Place::Row(row) => format!("row_{row}"),
            Place::Carried(k) => format!("carried_{k}"),
            Place::RowOfBranch { turn, row, .. } => format!("branch{turn}_row_{row}"),
        };
        self.of(&block.program, body, source)
    }

    /// Names of a program's values, all different. A value that the sweeps have named is named after its body, its
    /// letter and its component, `link5_m_xx`, further ones of that name `link5_m_xx_2`; sums and products on the way
    /// to such values are numbered, `link5_t0`. `body` is the name of a body, `input` that of an input.
    fn of(
        mut self,
        program: &Program,
        body: impl Fn(Option<usize>) -> String,
        mut input: impl FnMut(usize) -> String,
    ) -> BTreeMap<u32, String> {
        let mut names = BTreeMap::new();
        for (id, op, (node, _)) in &program.steps {
            let name = match (*op, program.name(*id)) {
                (Op::Input(k), _) => self.unique(input(k as usize)),
                (Op::Sin(_), _) => self.unique(format!("{}_sin", body(*node))),
                (Op::Cos(_), _) => self.unique(format!("{}_cos", body(*node))),
                (_, Some(name)) => self.unique(match name.entry {
                    Entry::Axes(_) => format!("{}_{}", body(name.node), component(&name)),
                    // Results do not belong to one body.
                    Entry::Number(_) | Entry::Pair(..) => component(&name),
                }),
                (_, None) => self.numbered(format!("{}_t", body(*node)), 0),
            };
            names.insert(*id, name);
        }
        names
    }

    /// The name, with a number from 2 on where it is taken.
    fn unique(&mut self, name: String) -> String {
        match self.taken.insert(name.clone()) {
            true => name,
            false => self.numbered(name + "_", 2),
        }
    }

    /// The name with the first number from `first` on that is free.
    fn numbered(&mut self, name: String, first: usize) -> String {
        let number = self.next.entry(name.clone()).or_insert(first);
        loop {
            let next = format!("{name}{number}");
            *number += 1;
            if self.taken.insert(next.clone()) {
                return next;
            }
        }
    }
}

/// Name of an input: its array and its index there.
fn input(inputs: &[InputArray], k: usize) -> String {
    let (array, k) = locate(inputs, k);
    format!("{}_{k}", array.name)
}

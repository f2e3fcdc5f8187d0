//! Values of what depends on the constants of a turn alone, with the operations that the code would have used.

use std::collections::{BTreeMap, BTreeSet};

use mbd_runtime::Scalar;

use super::link::{Link, LinkInput};
use super::partition::nodes;
use crate::symbolic::{Graph, Op, Operand};

/// The value of a node that depends on constants alone, in the turn with a given row of the table.
pub fn constant(graph: &Graph, link: &Link<'_, '_>, row: &[f64], id: u32) -> Option<f64> {
    let mut needed = BTreeSet::from([id]);
    let mut open = vec![id];
    while let Some(id) = open.pop() {
        let op = graph.get(id).0;
        match op {
            Op::Input(k) if !matches!(link.inputs[k as usize], LinkInput::Column(_)) => return None,
            _ => open.extend(nodes(&op).filter(|id| needed.insert(*id)).collect::<Vec<_>>()),
        }
    }
    let mut values = BTreeMap::new();
    for id in &needed {
        values.insert(*id, value(graph.get(*id).0, link, row, &values));
    }
    values.get(&id).copied()
}

/// The value of one operation.
pub fn value(op: Op, link: &Link<'_, '_>, row: &[f64], values: &BTreeMap<u32, f64>) -> f64 {
    let of = |o: Operand| match o {
        Operand::Const(bits) => f64::from_bits(bits),
        Operand::Node(id) => values[&id],
    };
    let node = |id: u32| values[&id];
    let signed = |x: f64, minus: bool| if minus { -x } else { x };
    match op {
        Op::Input(k) => match link.inputs[k as usize] {
            LinkInput::Column(c) => row[c],
            _ => unreachable!("depends on more than constants"),
        },
        Op::Add(a, b) => of(a) + of(b),
        Op::Sub(a, b) => of(a) - of(b),
        Op::Mul(a, b) => of(a) * of(b),
        Op::Div(a, b) => of(a) / of(b),
        Op::Fma(_) => unreachable!("the sweeps make none"),
        Op::ReciprocalAbove(p) => {
            Scalar::reciprocal_above(signed(of(p.value), p.minus_value), signed(of(p.floor), p.minus_floor))
        }
        #[cfg(feature = "height_fields")]
        Op::LookUp(look) => signed(node(look.at), look.minus).look_up(look.table.0, look.offset as usize),
        Op::Sqrt(a) => Scalar::sqrt(node(a)),
        Op::Sin(a) => Scalar::sin_cos(node(a)).0,
        Op::Cos(a) => Scalar::sin_cos(node(a)).1,
    }
}

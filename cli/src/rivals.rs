//! Published operation counts of the forward dynamics of serial chains of revolute joints.
//!
//! J. Naudet, *Forward Dynamics of Multibody Systems: A Recursive Hamiltonian Approach* (2005), table 4.1: additions
//! and multiplications for a chain of `n ≥ 3` bodies with revolute joints, given there as upper bounds.

use multibody::codegen::model::{JointKind, JointMotion};
use multibody::codegen::plan::Plan;

/// One formula, `a n − b`.
pub struct Rival {
    /// Source, in the thesis' words.
    pub name: &'static str,
    a: usize,
    b: usize,
}

/// The table, smallest counts first.
pub const RIVALS: [Rival; 5] = [
    Rival { name: "Naudet et al., 2003 (Hamiltonian)", a: 363, b: 475 },
    Rival { name: "Rein, 1993", a: 411, b: 669 },
    Rival { name: "Stejskal & Valasek, 1996", a: 432, b: 688 },
    Rival { name: "Vukobratovic et al., 1994", a: 480, b: 566 },
    Rival { name: "Featherstone, 1987", a: 611, b: 238 },
];

impl Rival {
    /// The formula as text.
    pub fn formula(&self) -> String {
        format!("{}n - {}", self.a, self.b)
    }

    /// Its value, `n ≥ 3`.
    pub fn operations(&self, n: usize) -> usize {
        self.a * n - self.b
    }
}

/// Number of bodies if the formulas apply: a serial chain of at least three free revolute joints on the ground.
pub fn chain_of_pins(plan: &Plan) -> Option<usize> {
    let serial = plan.nodes.iter().enumerate().all(|(k, node)| node.parent == k.checked_sub(1));
    let revolute = plan.model.joints.iter().all(|j| {
        let revolute = matches!(j.kind, JointKind::Revolute { .. }) && j.motion == JointMotion::Free;
        revolute || j.kind == JointKind::Fixed
    });
    (serial && revolute && plan.nodes.len() >= 3).then_some(plan.nodes.len())
}

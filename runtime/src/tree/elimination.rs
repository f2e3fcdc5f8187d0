//! How the freedoms of a node are eliminated, and which columns pass through it.

use alloc::vec::Vec;

/// How the freedoms of a node are eliminated. The default is the articulated-body algorithm: each node solves its own
/// freedoms, one joint at a time, in its own frame, and gets its momentum rates from quadratic forms. Numbers of
/// unknowns are indices into [`Tree::unknowns`](super::Tree::unknowns).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Elimination {
    /// Unknown of the node's coordinate where several nodes share it, or where it is solved at another node.
    pub unknown: Option<usize>,
    /// The coordinate is this node's alone, only solved further inboard (with others, as a block).
    pub deferred: bool,
    /// The freedom is eliminated in the frame ahead of the joint's own motion, where the axis is the same: what is
    /// divided by does not wait for the turn. Joints about or along z only.
    pub before_joint: bool,
    /// The node frame does not rotate with the joint: a revolute joint whose children are all revolute joints about
    /// parallel axes, placed by shifts alone. The body turns in the frame, by the sum of the angles since the last
    /// frame that rotated.
    pub non_rotating: bool,
    /// The momentum rate comes from the accumulated momentum `P*` instead of a quadratic form of the velocity.
    pub accumulates_momentum: bool,
    /// Unknowns whose columns are not carried further inward, because the screws of all freedoms inboard that they meet
    /// are carried outward to this node.
    pub ends: Vec<usize>,
    /// Those screws, by the unknowns they belong to (each of a deferred freedom).
    pub screws: Vec<usize>,
    /// Unknowns with members in the subtree of this node that are not solved below it.
    pub open: Vec<usize>,
    /// Unknowns solved at this node before its own freedoms: its subtrees hold all members, or all but the node and its
    /// ancestors, with a branch from the ground that is eliminated before (early rows, see [`super::row_order`]).
    pub solve_before: Vec<usize>,
    /// Unknowns solved at this node after its own freedom, which is a member; of early rows, its ancestors are members too.
    pub solve_after: Vec<usize>,
}

impl Elimination {
    /// The default, as a constant.
    pub(crate) const PLAIN: Elimination = Elimination {
        unknown: None,
        deferred: false,
        before_joint: false,
        non_rotating: false,
        accumulates_momentum: false,
        ends: Vec::new(),
        screws: Vec::new(),
        open: Vec::new(),
        solve_before: Vec::new(),
        solve_after: Vec::new(),
    };

    /// Whether no unknown is open at the node after its own freedoms: most nodes, which are spared all that is about
    /// them.
    #[inline]
    pub(crate) fn is_closed(&self) -> bool {
        self.solve_after.is_empty() && self.open.is_empty() && self.ends.is_empty()
    }

    /// Unknowns still open after position `k` of `solve_before`.
    #[inline]
    pub(crate) fn open_before(&self, k: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        self.solve_before[k..].iter().chain(&self.solve_after).chain(&self.open).chain(&self.ends).copied()
    }

    /// Unknowns still open after position `k` of `solve_after`.
    #[inline]
    pub(crate) fn open_after(&self, k: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        self.solve_after[k..].iter().chain(&self.open).chain(&self.ends).copied()
    }

    /// Calls a function with the unknowns of [`Elimination::open_before`]`(0)`, by loops that the compiler merges with it.
    #[inline(always)]
    pub(crate) fn each_open_before(&self, mut call: impl FnMut(usize)) {
        for open in [&self.solve_before, &self.solve_after, &self.open, &self.ends] {
            for &g in open {
                call(g);
            }
        }
    }

    /// The same with those of [`Elimination::open_after`]`(0)`.
    #[inline(always)]
    pub(crate) fn each_open_after(&self, mut call: impl FnMut(usize)) {
        for open in [&self.solve_after, &self.open, &self.ends] {
            for &g in open {
                call(g);
            }
        }
    }

    /// Keeps only the columns of some unknowns. The node's own unknown stays.
    pub fn retain_columns(&mut self, keep: impl Fn(usize) -> bool) {
        for list in [&mut self.ends, &mut self.screws, &mut self.open, &mut self.solve_before, &mut self.solve_after] {
            list.retain(|&g| keep(g));
        }
    }

    /// All numbers of unknowns.
    #[cfg(feature = "hulls")]
    pub(crate) fn unknowns_mut(&mut self) -> impl Iterator<Item = &mut usize> {
        let Elimination { unknown, ends, screws, open, solve_before, solve_after, .. } = self;
        unknown.iter_mut().chain([ends, screws, open, solve_before, solve_after].into_iter().flatten())
    }
}

//! Which velocities are coupled, and through which others.
//!
//! `M = LᵀDL` eliminates from the last velocity to the first. Every velocity hangs on the one it is eliminated into, so
//! velocities form a tree of their own (that of the joints, but for shared coordinates). What lies on different
//! branches is coupled only through the common path: rows of `M⁻¹` and `M⁻¹B` follow from those few by a short product.

use alloc::vec;
use alloc::vec::Vec;

use super::velocity;
use crate::tree::Tree;
use crate::Scalar;

/// How two velocities are coupled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meeting {
    /// One velocity is on the path of the other.
    Path,
    /// They are coupled through the common path of both, by this entry of [`Order::across`].
    Branch(u32),
    /// They are not coupled.
    Apart,
}

/// Coefficients of velocity `of` on the path of velocity `end`: `x_of = Σ h_j x_j` where `L x = 0` in between.
#[derive(Clone, Debug)]
pub(super) struct Across {
    pub of: usize,
    pub end: usize,
    /// Place of the first coefficient.
    pub at: usize,
    /// Where the same velocity has coefficients on a longer path: those on this path.
    pub longer: Option<usize>,
    /// Places of factors (of the longer path, else in the row of `L`) and of the coefficients they multiply.
    pub steps: Vec<(usize, usize)>,
}

/// The couplings of a tree.
#[derive(Clone, Debug)]
pub(super) struct Order {
    nv: usize,
    /// Where `L` is not zero, lower triangle.
    coupled: Vec<bool>,
    parent: Vec<Option<usize>>,
    meetings: Vec<Meeting>,
    pub across: Vec<Across>,
    /// First of them for every velocity.
    first: Vec<usize>,
    /// Number of coefficients.
    pub coefficients: usize,
}

impl Order {
    pub fn new<S: Scalar>(tree: &Tree<S>) -> Order {
        let nv = tree.dims.nv;
        let coupled = coupled(tree);
        let parent: Vec<Option<usize>> = (0..nv).map(|k| (0..k).rev().find(|i| coupled[k * nv + i])).collect();
        // Where the paths of two velocities meet.
        let mut ends = vec![None; nv * nv];
        for a in 0..nv {
            ends[a * nv + a] = Some(a);
            for b in 0..a {
                let end = parent[a].and_then(|p| ends[p * nv + b]);
                (ends[a * nv + b], ends[b * nv + a]) = (end, end);
            }
        }
        let meetings = vec![Meeting::Path; nv * nv];
        let mut order = Order { nv, coupled, parent, meetings, across: Vec::new(), first: Vec::new(), coefficients: 0 };
        for a in 0..nv {
            order.first.push(order.across.len());
            let mut by_end = vec![None; nv];
            for b in (0..nv).filter(|&b| b != a) {
                match ends[a * nv + b] {
                    Some(end) if end != a && end != b => by_end[end] = Some(0),
                    Some(_) => {}
                    None => order.meetings[a * nv + b] = Meeting::Apart,
                }
            }
            // Longest path first.
            let mut longer = None;
            for end in (0..a).rev() {
                if by_end[end].is_none() {
                    continue;
                }
                let index = order.push(a, end, longer);
                by_end[end] = Some(index as u32);
                longer = Some(index);
            }
            for b in (0..nv).filter(|&b| b != a) {
                match ends[a * nv + b] {
                    Some(end) if end != a && end != b => {
                        order.meetings[a * nv + b] = by_end[end].map_or(Meeting::Apart, Meeting::Branch);
                    }
                    _ => {}
                }
            }
        }
        order
    }

    /// Adds the coefficients of `of` on the path of `end`.
    fn push(&mut self, of: usize, end: usize, longer: Option<usize>) -> usize {
        let own = |k: usize| {
            let all = &self.across[self.first[k]..self.first[k + 1]];
            all.iter().find(|x| x.end == end).map(|x| x.at)
        };
        let (from, first) = match longer {
            Some(l) => (self.across[l].end, self.across[l].at),
            None => (of, of * self.nv),
        };
        let between: Vec<usize> = self.path(from).take_while(|&k| k != end).collect();
        let factors = between.iter().enumerate().filter(|&(_, &k)| k != of);
        let factors = factors.map(|(place, &k)| (first + if longer.is_some() { place } else { k }, own(k)));
        let steps = factors.filter_map(|(factor, own)| own.map(|own| (factor, own))).collect();
        let at = self.coefficients;
        let longer = longer.map(|_| first + between.len());
        self.coefficients += self.path(end).count();
        self.across.push(Across { of, end, at, longer, steps });
        self.across.len() - 1
    }

    /// Velocities from `k` inward, itself first.
    pub fn path(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        core::iter::successors(Some(k), |&k| self.parent[k])
    }

    /// Those inward of `k` that `L` couples it with.
    pub fn row(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.path(k).skip(1).filter(move |i| self.coupled[k * self.nv + i])
    }

    /// Coefficients of `a` on the shortest path that still holds `b`, which is on the path of `a`.
    pub fn shorter(&self, a: usize, b: usize) -> Option<&Across> {
        let end = self.first.get(a + 1).copied().unwrap_or(self.across.len());
        self.across[self.first[a]..end].iter().rev().find(|x| x.end >= b)
    }

    pub fn meeting(&self, a: usize, b: usize) -> Meeting {
        self.meetings[a * self.nv + b]
    }
}

/// Velocities that are coupled in `M`, and with them those that the elimination from the last to the first couples.
fn coupled<S: Scalar>(tree: &Tree<S>) -> Vec<bool> {
    let nv = tree.dims.nv;
    let mut coupled = vec![false; nv * nv];
    for (i, node) in tree.nodes.iter().enumerate() {
        let Some(a) = velocity(node) else { continue };
        let path = core::iter::successors(Some(i), |&j| tree.nodes[j].parent);
        for other in path.map(|j| &tree.nodes[j]) {
            let Some(b) = velocity(other) else { continue };
            for (x, y) in (0..node.kind.nv()).flat_map(|x| (0..other.kind.nv()).map(move |y| (a + x, b + y))) {
                coupled[x.max(y) * nv + x.min(y)] = true;
            }
        }
    }
    for k in (0..nv).rev() {
        for i in (0..k).filter(|i| coupled[k * nv + i]).collect::<Vec<_>>() {
            for j in (0..=i).filter(|j| coupled[k * nv + j]).collect::<Vec<_>>() {
                coupled[i * nv + j] = true;
            }
        }
    }
    coupled
}

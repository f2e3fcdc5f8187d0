//! Chains whose links have branches of their own, like the legs of a centipede: a turn of the loop is a link with all that
//! hangs on it.

use super::runs::{alike, compatible, tabulate, Run};
use mbd_runtime::tree::Node;

/// The most nodes in a turn that are looked for.
const LONGEST_TURN: usize = 64;

/// Runs of at least `least` nodes, inner ones first. Their nodes follow one another, as in a description that lists what hangs
/// on a link before the next link.
pub fn find(links: &[Option<Node<f64>>], parents: &[Option<usize>], least: usize) -> Vec<Run> {
    let [strict, loose] = [alike, compatible].map(|same| Turns { links, parents, least, same }.cover());
    let covered = |runs: &[Run]| runs.iter().map(|run| run.nodes.len()).sum::<usize>();
    // Steps that are let in cost less than a turn that is written once more.
    match covered(&loose) > covered(&strict) {
        true => loose,
        false => strict,
    }
}

/// The search for turns.
struct Turns<'a> {
    /// Nodes that may be in a loop.
    links: &'a [Option<Node<f64>>],
    /// What all nodes of the tree hang on.
    parents: &'a [Option<usize>],
    least: usize,
    /// Whether two links may be the same node of two turns.
    same: fn(&Node<f64>, &Node<f64>) -> bool,
}

impl Turns<'_> {
    /// The longest runs from each start, of the shortest turns.
    fn cover(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        let mut at = 0;
        while at < self.links.len() {
            let mut best: Option<Run> = None;
            for period in 2..=LONGEST_TURN {
                let least = best.as_ref().map_or(self.least, |run| run.nodes.len() + run.nodes.len() / 8 + 1);
                best = self.run(at, period, least).or(best);
            }
            at = best.as_ref().map_or(at + 1, |run| run.nodes.end);
            runs.extend(best);
        }
        runs
    }

    fn link(&self, i: usize) -> Option<&Node<f64>> {
        self.links.get(i)?.as_ref()
    }

    /// What a node hangs on that may be in a loop.
    fn parent(&self, i: usize) -> Option<usize> {
        self.link(i)?.parent
    }

    /// The run of at least `least` nodes with turns of a length that starts at a node.
    fn run(&self, start: usize, period: usize, least: usize) -> Option<Run> {
        // What the innermost link hands inward needs a place, so it hangs on a node.
        self.parent(start)?;
        let exit = self.parent(start + period)?.checked_sub(start).filter(|exit| *exit < period)?;
        let of_turn = |k: usize| self.parent(start + k).is_some_and(|parent| parent >= start);
        // Chains without branches are found elsewhere, in less time.
        let chained = exit + 1 == period && (1..period).all(|k| self.parent(start + k) == Some(start + k - 1));
        if chained || !(1..period).all(of_turn) {
            return None;
        }
        let repeats = |i: usize| {
            let hangs_alike = match (i - start) % period {
                0 => self.parent(i) == Some(i - period + exit),
                _ => self.parent(i) == self.parent(i - period).map(|parent| parent + period),
            };
            let first = start + (i - start) % period;
            let like = |k: usize| self.link(k).zip(self.link(i)).is_some_and(|(a, b)| (self.same)(a, b));
            hangs_alike && like(i - period) && like(first)
        };
        let end = (start + period..).find(|i| !repeats(*i))?;
        let mut turns = (end - start) / period;
        if turns < 2 {
            return None;
        }
        while !self.ends_after(start, (period, exit), turns) {
            turns -= 1;
        }
        let nodes = start..start + turns * period;
        if turns < 2 || nodes.len() < least {
            return None;
        }
        let all: Vec<Node<f64>> = nodes.clone().map(|i| self.link(i).cloned()).collect::<Option<_>>()?;
        tabulate(&all, nodes, (period, exit))
    }

    /// Whether nothing but one node at the end of the last of some turns hangs on nodes of theirs. True where there are none.
    fn ends_after(&self, start: usize, (period, exit): (usize, usize), turns: usize) -> bool {
        let end = start + turns * period;
        let hanging = self.parents.iter().skip(end).copied().flatten();
        let all: Vec<usize> = hanging.filter(|parent| (start..end).contains(parent)).collect();
        all.is_empty() || all == [end - period + exit]
    }
}

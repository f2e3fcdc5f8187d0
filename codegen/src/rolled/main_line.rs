//! The tree without the turns of its runs, taken through the passes: what is left is straight-line code between loops.

use super::link::Link;
use super::runs::Run;
use super::stage::{PassState, SweepDirection};
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

/// A pass over a run, as the rest of the tree sees it.
pub struct Event<'m> {
    /// Length of the graph before it.
    pub at: usize,
    /// Run.
    pub run: usize,
    /// Pass.
    pub pass: usize,
    /// What is carried into the first turn.
    pub start: Vec<Expr<'m>>,
    /// What the last turn carries out: symbols or constants.
    pub end: Vec<Expr<'m>>,
}

/// Walks the tree and takes the links of the runs along.
pub struct MainLine<'m, 'a> {
    /// Graph of everything outside runs.
    pub graph: &'m Graph,
    /// Its tree.
    pub stage: PassState<'m>,
    /// Its inputs.
    pub given: SymbolicInputs<'m>,
    /// Runs, inner first.
    pub runs: &'a [Run],
    /// Passes over runs, in order.
    pub events: Vec<Event<'m>>,
    /// Number of the next symbol.
    pub next_input: usize,
}

impl<'m> MainLine<'m, '_> {
    /// One pass over the whole tree.
    pub fn pass(&mut self, pass: usize, way: SweepDirection, links: &mut [Link<'_>]) {
        self.stage.begin(pass, &self.given);
        let n = self.stage.tree.nodes.len();
        match way {
            SweepDirection::TipToBase => {
                for run in self.runs {
                    // The first turn adds the body itself.
                    self.stage.carried(pass, run.last()).into_iter().for_each(|e| *e = Expr::Const(0.0));
                }
                let mut runs = self.runs.iter().enumerate().rev().peekable();
                let mut i = n;
                while i > 0 {
                    match runs.next_if(|(_, run)| run.nodes.end == i) {
                        Some((k, run)) => {
                            self.run(k, pass, way, links);
                            i = run.nodes.start;
                        }
                        None => {
                            i -= 1;
                            self.stage.node(pass, i, &self.given);
                        }
                    }
                }
            }
            SweepDirection::BaseToTip => {
                let mut runs = self.runs.iter().enumerate().peekable();
                let mut i = 0;
                while i < n {
                    match runs.next_if(|(_, run)| run.nodes.start == i) {
                        Some((k, run)) => {
                            self.run(k, pass, way, links);
                            i = run.nodes.end;
                        }
                        None => {
                            self.stage.node(pass, i, &self.given);
                            i += 1;
                        }
                    }
                }
            }
        }
        self.stage.end(pass, &self.given);
    }

    fn run(&mut self, k: usize, pass: usize, way: SweepDirection, links: &mut [Link<'_>]) {
        let run = &self.runs[k];
        let Some(parent) = self.stage.tree.nodes[run.nodes.start].parent else { return };
        let (from, to) = match way {
            SweepDirection::TipToBase => (run.last(), parent),
            SweepDirection::BaseToTip => (parent, run.last()),
        };
        let mut start: Vec<Expr<'m>> = self.stage.carried(pass, from).into_iter().map(|e| *e).collect();
        let local = start.len();
        start.extend(self.stage.running(pass).into_iter().map(|e| *e));
        let at = self.graph.len();
        links[k].pass(way, &start);
        let negative = &links[k].passes[pass].negative;
        start.iter_mut().zip(negative).filter(|(_, negative)| **negative).for_each(|(e, _)| *e = -*e);
        let next = &mut self.next_input;
        let graph = self.graph;
        let end: Vec<Expr<'m>> = links[k].passes[pass]
            .outgoing
            .iter()
            .map(|out| match *out {
                Expr::Const(x) => Expr::Const(x),
                Expr::Node { .. } => {
                    *next += 1;
                    graph.input(*next - 1)
                }
            })
            .collect();
        let signed = |(out, negative): (&Expr<'m>, &bool)| if *negative { -*out } else { *out };
        let out: Vec<Expr<'m>> = end.iter().zip(negative).map(signed).collect();
        for (place, out) in self.stage.carried(pass, to).into_iter().zip(&out[..local]) {
            *place = match way {
                SweepDirection::TipToBase => *place + *out,
                SweepDirection::BaseToTip => *out,
            };
        }
        for (place, out) in self.stage.running(pass).into_iter().zip(&out[local..]) {
            *place = *out;
        }
        self.events.push(Event { at, run: k, pass, start, end });
    }
}

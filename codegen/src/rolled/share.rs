//! What like branches take in from their parent and what they hand to it.

use std::collections::BTreeMap;

use super::build::{mark, Build, Live};
use super::main_line::Event;
use super::Place;
use crate::symbolic::Expr;

impl Build<'_, '_, '_> {
    /// Marks what branches need of their parent, and the parent of them. Returns whether something was not marked yet.
    pub(super) fn live_in_branches(&self, event: &Event<'_>, live: &mut Live) -> bool {
        let Some(_) = &self.line.runs[event.run].branches else { return false };
        let pass = &self.links[event.run].passes[event.pass];
        let read = |e: Expr, live: &[bool]| matches!(e, Expr::Node { id, .. } if live[id as usize]);
        let mut more = false;
        for k in 0..live.carried[event.run][event.pass].len() {
            let outward = pass.incoming.get(k).is_some_and(|e| read(*e, &live.links[event.run]));
            let inward = event.handed.iter().any(|share| share.get(k).is_some_and(|e| read(*e, &live.main)));
            if (outward || inward) && !std::mem::replace(&mut live.carried[event.run][event.pass][k], true) {
                more = true;
                if inward {
                    mark(&self.graphs[event.run], &mut live.links[event.run], pass.outgoing[k]);
                } else {
                    mark(self.line.graph, &mut live.main, event.start[k]);
                }
            }
        }
        more
    }

    /// Where the straight-line code finds what branches hand to their parents.
    pub(super) fn handed(&self, rows: &[BTreeMap<u32, usize>]) -> BTreeMap<u32, Place> {
        let mut places = BTreeMap::new();
        for event in &self.line.events {
            let outgoing = &self.links[event.run].passes[event.pass].outgoing;
            for (turn, share) in event.handed.iter().enumerate() {
                for (outer, inner) in share.iter().zip(outgoing) {
                    let (Expr::Node { id, .. }, Expr::Node { id: inner, .. }) = (*outer, *inner) else { continue };
                    if let Some(&row) = rows[event.run].get(&inner) {
                        places.insert(id, Place::RowOfBranch { run: event.run, turn, row });
                    }
                }
            }
        }
        places
    }
}

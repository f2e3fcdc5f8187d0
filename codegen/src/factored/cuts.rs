//! The cuts: symbolic runs of the sweeps, node by node, in which what passes between limbs and trunk is replaced.

use std::rc::Rc;

use super::symbols::{Crossing, Symbol};
use super::tracing::{Handed, Kind, Traced, Tracing};
use crate::output::Output;
use crate::rolled::{output, read, OutputSweeps, PassState, SweepDirection};
use crate::symbolic::{Expr, ProgramResult};
use crate::trace::{symbolic_tree, SymbolicInputs};

impl<'g> Tracing<'g, '_> {
    /// Runs the sweeps in a set of modes, with or without cuts.
    pub fn trace(&mut self, set: &[usize], cuts: bool) -> Option<Traced<'g>> {
        let plan = self.plan(set);
        let tree = symbolic_tree(&plan, self.output, &self.given, self.options).regrouped();
        let tree = match self.output {
            Output::Multipliers => tree.for_accelerations().clone(),
            _ => tree,
        };
        let passes = OutputSweeps::of(self.output)?.all_passes(&tree);
        let mut state = PassState::new(self.output, self.graph, tree, &passes)?;
        let given = Rc::clone(&self.given);
        let mut traced = Traced::default();
        for (k, pass) in passes.iter().enumerate() {
            let before: Vec<ProgramResult> = state.unknowns().map(|(_, _, e)| output(*e)).collect();
            state.begin(k, &given);
            let n = state.tree.nodes.len();
            let solved = !traced.trunk.is_empty() || !traced.multipliers.is_empty();
            match pass.direction {
                SweepDirection::TipToBase => {
                    let inward = cuts && !solved;
                    for i in (0..n).rev() {
                        if inward && self.root == Some(i) {
                            state.carried(k, i, &given, |e| self.cut(set, Kind::Other, e));
                            self.cut_running(set, k, &mut state, &given);
                        }
                        let parent = state.tree.nodes[i].parent.filter(|p| self.trunk[*p] && !self.trunk[i]);
                        let Some(parent) = parent.filter(|_| cuts) else {
                            state.node(k, i, &given);
                            continue;
                        };
                        let before = read(|visit| state.carried(k, parent, &given, visit));
                        state.carried(k, parent, &given, |e| *e = Expr::Const(0.0));
                        state.node(k, i, &given);
                        let mut before = before.into_iter();
                        state.carried_by_sweeps(k, parent, &given, |value, e| {
                            let crossing = Crossing::Carried { node: i, value };
                            self.cut_limb(set, crossing, solved, e, &mut traced);
                            *e = before.next().unwrap_or(Expr::Const(0.0)) + *e;
                        });
                    }
                    if inward && self.root.is_none() {
                        self.cut_running(set, k, &mut state, &given);
                    }
                }
                SweepDirection::BaseToTip => {
                    if cuts && self.root.is_none() {
                        self.cut_outward(set, k, &before, &mut state, &given, &mut traced);
                    }
                    for i in 0..n {
                        state.node(k, i, &given);
                        if cuts && self.root == Some(i) {
                            self.cut_outward(set, k, &before, &mut state, &given, &mut traced);
                        }
                    }
                }
            }
            state.end(k, &given);
        }
        traced.results = state.finish(&given);
        traced.early_rows_act = plan.early_tolerance.map(|_| state.early_rows_act());
        Some(traced)
    }

    /// Replaces what a pass updates at every node: of all rows first their whole diagonals.
    fn cut_running(&mut self, set: &[usize], pass: usize, state: &mut PassState<'g, '_>, given: &SymbolicInputs<'g>) {
        let slots: Vec<usize> = (0..state.tree.unknowns.len()).filter(|g| state.tree.is_slot(*g)).collect();
        // Rows that limbs have eliminated do not cross: they would only shift the numbers of those that do.
        let crosses: Vec<bool> = slots.iter().map(|unknown| self.crosses(set, *unknown)).collect();
        let n = slots.len();
        let mut number = 0;
        state.running(pass, given, |e| {
            let (crossing, kind) = match number {
                k if k < n => (crosses[k], Kind::Whole),
                k if k < n + n * n => (crosses[(k - n) / n] && crosses[(k - n) % n], Kind::Other),
                k => (crosses[(k - n) % n], Kind::Other),
            };
            if crossing {
                self.cut(set, kind, e);
            }
            number += 1;
        });
    }

    /// Whether an unknown is solved in the trunk, as far as it belongs to a contact.
    fn crosses(&self, set: &[usize], unknown: usize) -> bool {
        let Some(contact) = self.contact_of(unknown) else { return true };
        let early = || self.limb_of(unknown).is_some_and(|g| self.limbs[g].late[set[g]].is_some());
        self.reaching[contact] && !early()
    }

    /// Notes whether a value that crosses in flight is another one here. Whether it crosses as a symbol in all modes.
    fn crosses_always(&mut self, set: &[usize], crossing: Crossing, e: &Expr<'g>) -> bool {
        let value = output(*e);
        if set.iter().all(|m| *m == 0) {
            self.in_flight.insert(crossing, value);
        }
        if self.in_flight.get(&crossing).is_some_and(|other| *other != value) {
            self.found.insert(crossing);
        }
        self.always.contains(&crossing)
    }

    /// Replaces what a limb hands to the trunk where that depends on the modes of the limb.
    fn cut_limb(&mut self, set: &[usize], crossing: Crossing, solved: bool, e: &mut Expr<'g>, traced: &mut Traced<'g>) {
        let always = self.crosses_always(set, crossing, e);
        // Sweeps that flight does not need hand on nothing there.
        if solved && matches!(*e, Expr::Node { .. }) && !self.in_flight.contains_key(&crossing) {
            self.found.insert(crossing);
        }
        if always {
            traced.from_limbs[usize::from(solved)].insert(crossing, *e);
            *e = self.symbol_for(if solved { Symbol::BackFromLimb(crossing) } else { Symbol::FromLimb(crossing) });
        } else if !solved {
            self.cut(set, Kind::Other, e);
        }
    }

    /// After the trunk: its motion, and the multipliers that differ from what they were `before` the pass.
    fn cut_outward(
        &mut self,
        set: &[usize],
        pass: usize,
        before: &[ProgramResult],
        state: &mut PassState<'g, '_>,
        given: &SymbolicInputs<'g>,
        traced: &mut Traced<'g>,
    ) {
        for node in (0..self.trunk.len()).filter(|i| self.trunk[*i]).collect::<Vec<_>>() {
            state.carried_by_sweeps(pass, node, given, |value, e| {
                self.cut_trunk(set, Crossing::Carried { node, value }, e, traced);
            });
        }
        let all: Vec<(usize, usize, Expr<'g>)> = state.unknowns().map(|(level, g, e)| (level, g, *e)).collect();
        let mut new = Vec::new();
        for ((level, unknown, mut e), before) in all.into_iter().zip(before) {
            if output(e) != *before {
                match self.limb_of(unknown) {
                    None => self.cut_trunk(set, Crossing::Unknown { level, unknown }, &mut e, traced),
                    Some(_) => {
                        traced.multipliers.push((level, unknown, e));
                        e = self.symbol_for(Symbol::Multiplier { level, unknown });
                    }
                }
            }
            new.push(e);
        }
        state.unknowns().zip(new).for_each(|((_, _, e), new)| *e = new);
    }

    /// Replaces what the trunk hands on where that depends on what touches.
    fn cut_trunk(&mut self, set: &[usize], crossing: Crossing, e: &mut Expr<'g>, traced: &mut Traced<'g>) {
        let always = self.crosses_always(set, crossing, e);
        // Sweeps that flight does not need hand on what is the same in all modes, before the trunk is solved.
        let depends = matches!(*e, Expr::Node { id, .. } if !self.class(id).is_early());
        if depends && !self.in_flight.contains_key(&crossing) {
            self.found.insert(crossing);
        }
        if always {
            traced.trunk.insert(crossing, *e);
            *e = self.symbol_for(Symbol::Trunk(crossing));
        }
    }

    /// Replaces a value that depends on the modes of one limb.
    fn cut(&mut self, set: &[usize], kind: Kind, e: &mut Expr<'g>) {
        let Expr::Node { id, neg, .. } = *e else { return };
        if self.of_limbs(id) {
            if let Some(symbol) = self.hand_over(set, Handed { id, neg, kind }) {
                *e = symbol;
            }
        }
    }
}

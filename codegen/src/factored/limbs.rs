//! Trunk and limbs of a mechanism with contacts.

use std::collections::BTreeSet;

use mbd_runtime::contact::Mode;

use crate::modes::modes_of;
use crate::plan::{Plan, PlanBond};

/// Largest number of modes of all limbs together.
pub const MOST_LIMB_MODES: usize = 512;

/// The contacts that act together on one limb, and their modes; the first mode is that in which all are open.
#[derive(Clone, Debug)]
pub struct Limb {
    pub contacts: Vec<usize>,
    pub modes: Vec<Vec<Mode>>,
    /// For modes in which rows are eliminated in the limb as far as it can follow them: the mode of the same contacts in which
    /// all come to the trunk.
    pub late: Vec<Option<usize>>,
}

impl Limb {
    /// Gives modes in which `early` says so rows that are eliminated in the limb, and adds the modes in which these come to
    /// the trunk.
    pub fn take_early(&mut self, early: impl Fn(&[Mode]) -> bool) {
        for m in 0..self.modes.len() {
            if early(&self.modes[m]) {
                self.late[m] = Some(self.modes.len());
                self.modes.push(self.modes[m].clone());
                self.late.push(None);
            }
        }
    }
}

/// The nodes that constraint `index` of a plan binds.
fn members(plan: &Plan, index: usize) -> Vec<usize> {
    match &plan.constraints[index].bond {
        PlanBond::Cut { frames, .. } => frames.iter().filter_map(|frame| frame.node).collect(),
        PlanBond::Coupling { terms, .. } => terms.iter().map(|(node, _)| *node).collect(),
    }
}

/// Whether rows of a constraint are eliminated in the trunk or at the ground.
pub fn reaches(plan: &Plan, index: usize, trunk: &[bool]) -> bool {
    reaches_of(plan, &plan.constraints[index].slots, trunk)
}

/// Whether some of these rows are.
pub fn reaches_of(plan: &Plan, slots: &[usize], trunk: &[bool]) -> bool {
    let inboard = plan.nodes.iter().zip(trunk).filter(|(_, trunk)| **trunk);
    let solved =
        inboard.flat_map(|(node, _)| node.elimination.solve_before.iter().chain(&node.elimination.solve_after));
    solved.chain(&plan.solve_at_ground).any(|unknown| slots.contains(unknown))
}

/// Numbers of the constraints that are contacts, in the order of the contacts.
pub fn of_contacts(plan: &Plan) -> std::ops::Range<usize> {
    plan.constraints.len() - plan.model.contacts.len()..plan.constraints.len()
}

/// The nodes inboard of everything that contacts bind, and the outermost of them.
pub fn trunk(plan: &Plan) -> (Vec<bool>, Option<usize>) {
    let mut common: Option<Vec<usize>> = None;
    for node in of_contacts(plan).flat_map(|index| members(plan, index)) {
        let way = plan.ancestors(node);
        common = Some(match common {
            None => way,
            Some(common) => common.into_iter().filter(|i| way.contains(i)).collect(),
        });
    }
    let common = common.unwrap_or_default();
    // Where there is one contact only, its own body is the outermost node of the trunk.
    let trunk = (0..plan.nodes.len()).map(|i| common.contains(&i)).collect();
    (trunk, common.first().copied())
}

/// Contacts by the branches of the trunk that they bind.
pub fn limbs(full: &Plan, plan: &Plan, trunk: &[bool]) -> Option<(Vec<Limb>, Vec<BTreeSet<usize>>)> {
    let mut groups: Vec<(Vec<usize>, BTreeSet<usize>)> = Vec::new();
    for (contact, index) in of_contacts(plan).enumerate() {
        let branch = |node: usize| plan.ancestors(node).into_iter().take_while(|i| !trunk[*i]).last();
        let mut branches: BTreeSet<usize> = members(plan, index).into_iter().filter_map(branch).collect();
        let mut contacts = vec![contact];
        groups.retain(|(others, of_others)| {
            let apart = of_others.is_disjoint(&branches);
            if !apart {
                contacts.extend(others);
                branches.extend(of_others);
            }
            apart
        });
        groups.push((contacts, branches));
    }
    for (contacts, _) in &mut groups {
        contacts.sort_unstable();
    }
    groups.sort();
    let limb = |(contacts, branches): (Vec<usize>, BTreeSet<usize>)| {
        let mut modes = vec![Vec::new()];
        for &contact in &contacts {
            let contact = &full.model.contacts[contact];
            let each = modes_of(&contact.kind, contact.friction);
            modes = modes.iter().flat_map(|set: &Vec<Mode>| each.iter().map(|m| [&set[..], &[*m]].concat())).collect();
            if modes.len() > MOST_LIMB_MODES {
                return None;
            }
        }
        Some((Limb { contacts, late: vec![None; modes.len()], modes }, branches))
    };
    let limbs = groups.into_iter().map(limb).collect::<Option<Vec<_>>>()?;
    Some(limbs.into_iter().unzip())
}

//! Plans with eliminations drawn at random. They cover what the search finds and layouts that it never picks, and take
//! no time to find.

use mbd_codegen::model::Model;
use mbd_codegen::options::{EliminationStrategy, LikeBranches, PlanOptions, RolledCode, RowElimination, DEFAULT_SNAP};
use mbd_codegen::plan::{chains, has_rows, parallel_runs, ChainElimination, Plan};
use mbd_codegen::search;

use crate::random::Rng;

/// A plan whose freedoms are eliminated one by one or together, at random; every fourth with its rows in passes.
pub fn random_plan(model: &Model, seed: u64) -> Plan {
    random_plan_snapped(model, DEFAULT_SNAP, seed)
}

/// A random plan with the given [`PlanOptions::snap`], rad.
pub fn random_plan_snapped(model: &Model, snap: f64, seed: u64) -> Plan {
    let single = PlanOptions {
        snap,
        elimination: EliminationStrategy::Single,
        rolled: RolledCode::Never,
        branches: LikeBranches::default(),
        rows: if seed % 4 == 3 { RowElimination::Passes } else { RowElimination::Once },
        accelerations: false,
        mass_matrix: false,
    };
    let single = search::plan(model, single);
    let mut rng = Rng::new(seed, 20);
    let mut plan = eliminated(&single, &mut rng);
    if rng.chance(0.5) {
        plan.accelerations = Some(Box::new(eliminated(&single, &mut rng)));
    }
    plan
}

/// The plan with random eliminations of its chains and closed loops, random non-rotating frames, and a random number of
/// nodes in the mass matrix.
fn eliminated(single: &Plan, rng: &mut Rng) -> Plan {
    let mut plan = single.clone();
    plan.matrix_depth = rng.below(plan.nodes.len() + 1);
    for run in parallel_runs(single) {
        let non_rotating = rng.chance(0.5);
        run.iter().for_each(|&i| plan.nodes[i].elimination.non_rotating = non_rotating);
    }
    for chain in chains(single) {
        let parent = plan.nodes[chain[0]].parent;
        let passes = parent.is_some_and(|p| !has_rows(single, p)) && rng.chance(0.2);
        let elimination = match passes {
            true => ChainElimination {
                before_joint: before_joint(chain.len(), rng),
                ..ChainElimination::passing(chain.len(), false)
            },
            false => random_chain(chain.len(), parent.is_none(), rng),
        };
        elimination.apply(&mut plan, &chain);
    }
    let accumulates = rng.chance(0.5);
    for i in single.constraints.iter().flat_map(|c| c.cycle()) {
        if plan.nodes[i].kind.nv() == 1 {
            plan.nodes[i].elimination.accumulates_momentum = accumulates;
        }
    }
    plan
}

/// An elimination for a chain of `len` joints; `from_ground` tells whether it starts there.
fn random_chain(len: usize, from_ground: bool, rng: &mut Rng) -> ChainElimination {
    let base = if rng.chance(0.3) { len - 1 } else { rng.below(len) };
    let split = match from_ground {
        true if rng.chance(0.3) => base,
        true if rng.chance(0.4) => rng.below(base + 1),
        _ => 0,
    };
    let accumulating = split + rng.below(len - split + 1);
    let before_joint = before_joint(len, rng);
    ChainElimination { split, base, before_joint, accumulating, ..ChainElimination::single(len) }
}

/// Whether each of `len` joints is eliminated before its own motion.
fn before_joint(len: usize, rng: &mut Rng) -> Vec<bool> {
    (0..len).map(|_| rng.chance(0.5)).collect()
}

//! The sweeps of a group as passes over the nodes, one node at a time: the same steps for the whole tree and for one link
//! alone.

use mbd_runtime::spatial::{ArticulatedInertia, Force, Motion};
use mbd_runtime::sweep::{Accelerations, Inputs, Load, Quantity, Sweeps};
use mbd_runtime::tree::Tree;
use mbd_runtime::workspace::Workspace;
use mbd_runtime::Scalar;

use crate::output::Output;
use crate::symbolic::{Expr, Graph};
use crate::trace::SymbolicInputs;

/// SweepDirection of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepDirection {
    /// Leaves to base.
    TipToBase,
    /// Base to leaves.
    BaseToTip,
}

/// Passes of a group; `None` for groups that have no loop form. With constraints, `constrained`, the way to their frames
/// comes first.
pub fn passes(group: Output, constrained: bool) -> Option<&'static [SweepDirection]> {
    match group {
        Output::PositionCorrection if constrained => {
            Some(&[SweepDirection::BaseToTip, SweepDirection::TipToBase, SweepDirection::BaseToTip])
        }
        Output::ProjectMomenta => {
            Some(&[SweepDirection::TipToBase, SweepDirection::BaseToTip, SweepDirection::TipToBase])
        }
        Output::Accelerations if constrained => None,
        Output::Rates | Output::Velocities | Output::Energy => {
            Some(&[SweepDirection::TipToBase, SweepDirection::BaseToTip])
        }
        Output::Momenta | Output::InverseDynamics | Output::Bias => {
            Some(&[SweepDirection::BaseToTip, SweepDirection::TipToBase])
        }
        Output::Accelerations => {
            Some(&[SweepDirection::BaseToTip, SweepDirection::TipToBase, SweepDirection::BaseToTip])
        }
        _ => None,
    }
}

/// A tree on its way through the passes.
#[derive(Clone)]
pub struct PassState<'g> {
    group: Output,
    graph: &'g Graph,
    /// Whether there are constraints that matter.
    bound: bool,
    /// Whether the first pass goes to their frames.
    reaches: bool,
    /// Whether it is a link alone, whose constraints stand for columns that are carried.
    alone: bool,
    /// Whether momentum rates wait for accumulated momenta.
    gathers: bool,
    /// The mechanism, regrouped.
    pub tree: Tree<Expr<'g>>,
    work: Workspace<Expr<'g>>,
    v: Vec<Expr<'g>>,
    qd: Vec<Expr<'g>>,
    pd: Vec<Expr<'g>>,
    p: Vec<Expr<'g>>,
    /// Twice the kinetic energy, and the potential.
    energy: [Expr<'g>; 2],
}

impl<'g> PassState<'g> {
    /// Nothing done yet.
    pub fn new(group: Output, graph: &'g Graph, tree: Tree<Expr<'g>>, alone: bool) -> Self {
        let zeros = |n: usize| vec![Expr::zero(); n];
        let (nq, nv) = (tree.dims.nq, tree.dims.nv);
        let work = Workspace::new(&tree);
        let energy = [Expr::zero(); 2];
        let bound = solves(group) && !tree.constraints.is_empty();
        let reaches = bound && group == Output::PositionCorrection;
        let gathers = tree.nodes.iter().any(|n| n.elimination.accumulates_momentum);
        let (v, qd, pd, p) = (zeros(nv), zeros(nq), zeros(nv), zeros(nv));
        PassState { group, graph, bound, reaches, alone, gathers, work, v, qd, pd, p, energy, tree }
    }

    /// The pass among those of a mechanism without constraints; `None`: that to the frames of the constraints.
    fn own(&self, pass: usize) -> Option<usize> {
        pass.checked_sub(usize::from(self.reaches))
    }

    /// Before the first node of a pass.
    pub fn begin(&mut self, pass: usize, given: &SymbolicInputs<'g>) {
        let own = self.own(pass);
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        let (u, w) = (given.inputs(), &mut self.work);
        if pass == 0 && self.group != Output::Momenta {
            // Screws that are carried outward need the joints of the whole tree.
            for i in 0..self.tree.nodes.len() {
                sweeps.articulate_node(i, &given.q, &given.drive[0], &mut w.poses);
            }
        }
        let Some(pass) = own else { return sweeps.reach_begin(w) };
        if self.bound && pass == 0 && !self.alone {
            sweeps.set_rows(w, self.reaches);
            if self.group == Output::PositionCorrection {
                sweeps.aim_at_closed(w);
            }
        }
        let load = load(self.group, given, &u, [&w.generalized, &w.drive, &w.constraints.rhs]);
        match (self.group, pass) {
            (Output::Momenta, 1) => sweeps.momentum_begin(w),
            (Output::Momenta | Output::InverseDynamics | Output::Bias, _) | (Output::Accelerations, 0) => {}
            (Output::Accelerations, 1) => {
                for (f, tau) in w.generalized.iter_mut().zip(u.tau) {
                    *f = *f + *tau;
                }
                sweeps.factor_begin(&w.poses, &mut w.factor);
                let load = Load::accelerations(&w.generalized, &w.drive, &w.force, &[]);
                sweeps.bias_momentum_begin(&load, &mut w.acceleration);
            }
            (Output::Accelerations, _) => {
                let load = Load::accelerations(&w.generalized, &w.drive, &w.force, &[]);
                sweeps.motion_ground(&w.factor, &load, &mut w.acceleration);
            }
            (_, 0) => {
                sweeps.factor_begin(&w.poses, &mut w.factor);
                if !self.alone {
                    sweeps.seed_columns(&w.constraints.rows, &mut w.factor);
                }
                sweeps.bias_momentum_begin(&load, &mut w.velocity);
                sweeps.moment_begin(w);
            }
            (Output::ProjectMomenta, 2) => {
                self.p = given.second.clone();
                if !self.alone {
                    sweeps.hold_begin(w);
                }
            }
            (group, _) => {
                sweeps.motion_ground(&w.factor, &load, &mut w.velocity);
                if group == Output::Energy {
                    self.energy[1] = sweeps.weight_potential(&u, w);
                }
            }
        }
    }

    /// One node of a pass.
    pub fn node(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>) {
        let Some(pass) = self.own(pass) else {
            return Sweeps { tree: &self.tree, trace: self.graph }.reach_node(i, &mut self.work);
        };
        match self.group {
            Output::Momenta => self.momentum_node(pass, i, given),
            Output::Accelerations => self.acceleration_node(pass, i, given),
            Output::InverseDynamics | Output::Bias => self.newton_node(pass, i, given),
            _ => self.velocity_node(pass, i, given),
        }
    }

    fn momentum_node(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>) {
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        let w = &mut self.work;
        if pass == 1 {
            return sweeps.momentum_node(i, w, &mut self.p);
        }
        sweeps.articulate_node(i, &given.q, &given.drive[0], &mut w.poses);
        sweeps.velocity_node(i, &given.second, &given.drive[1], w);
    }

    fn newton_node(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>) {
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        let w = &mut self.work;
        if pass == 1 {
            return sweeps.wrench_back_node(i, w);
        }
        sweeps.newton_node(i, &given.second, imposed(self.group, given), &given.inputs(), w);
        sweeps.newton_wrench_node(i, w);
    }

    fn acceleration_node(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>) {
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        let w = &mut self.work;
        if pass == 0 {
            sweeps.newton_node(i, &given.second, Accelerations::Chosen, &given.inputs(), w);
            sweeps.newton_wrench_node(i, w);
            return sweeps.joint_load_node(i, w);
        }
        let load = Load::accelerations(&w.generalized, &w.drive, &w.force, &[]);
        if pass == 1 {
            sweeps.factor_node(i, &w.poses, &w.first, &mut w.factor);
            sweeps.bias_momentum_node(i, &w.poses, &w.first, &w.factor, &load, &mut w.acceleration);
        } else {
            sweeps.motion_node(i, &w.poses, &w.first, &w.factor, &load, &mut w.acceleration);
        }
    }

    /// Of all groups that solve for velocities.
    fn velocity_node(&mut self, pass: usize, i: usize, given: &SymbolicInputs<'g>) {
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        let (u, w) = (given.inputs(), &mut self.work);
        if (self.group, pass) == (Output::ProjectMomenta, 2) {
            return sweeps.hold_node(i, w, &mut self.p);
        }
        let load = load(self.group, given, &u, [&w.generalized, &w.drive, &w.constraints.rhs]);
        if pass == 0 {
            sweeps.factor_node(i, &w.poses, &w.first, &mut w.factor);
            sweeps.bias_momentum_node(i, &w.poses, &w.first, &w.factor, &load, &mut w.velocity);
            if weighs(self.group) {
                sweeps.moment_node(i, w);
            }
            return;
        }
        sweeps.motion_node(i, &w.poses, &w.first, &w.factor, &load, &mut w.velocity);
        match self.group {
            Output::Rates => {
                sweeps.gravity_node(i, &u, w);
                if !self.gathers {
                    sweeps.momentum_rate_node(i, w, &mut self.pd);
                }
            }
            Output::Energy => {
                self.energy[0] = sweeps.kinetic_node(i, &given.second, w, self.energy[0]);
                self.energy[1] = sweeps.spring_node(i, w, self.energy[1]);
            }
            _ => {}
        }
    }

    /// After the last node of a pass.
    pub fn end(&mut self, pass: usize, given: &SymbolicInputs<'g>) {
        let Some(pass) = self.own(pass) else { return };
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        let (u, w) = (given.inputs(), &mut self.work);
        match (self.group, pass) {
            (Output::Momenta | Output::InverseDynamics | Output::Bias, _) => {}
            (Output::Accelerations, 1) => {
                sweeps.factor_ground(&mut w.factor);
                let load = Load::accelerations(&w.generalized, &w.drive, &w.force, &[]);
                sweeps.bias_momentum_ground(&w.factor, &load, &mut w.acceleration);
            }
            (Output::Accelerations, _) => {}
            (_, 0) => {
                sweeps.factor_ground(&mut w.factor);
                let load = load(self.group, given, &u, [&w.generalized, &w.drive, &w.constraints.rhs]);
                sweeps.bias_momentum_ground(&w.factor, &load, &mut w.velocity);
            }
            _ => {}
        }
    }

    /// Results in the order of the generated function, after the last pass. For a link alone, its own part of them.
    pub fn finish(&mut self, given: &SymbolicInputs<'g>) -> Vec<Expr<'g>> {
        let sweeps = Sweeps { tree: &self.tree, trace: self.graph };
        match self.group {
            Output::Rates => {
                sweeps.collect_rates(&self.work.velocity, &self.work.first, &mut self.v);
                sweeps.coordinate_rates(&given.q, &self.v, &mut self.qd);
                if self.gathers {
                    sweeps.accumulate_momenta(&given.second, &mut self.work);
                    (0..self.tree.nodes.len()).for_each(|i| sweeps.momentum_rate_node(i, &self.work, &mut self.pd));
                }
                for (pd, tau) in self.pd.iter_mut().zip(&given.tau) {
                    *pd = *pd + *tau;
                }
                [self.qd.as_slice(), &self.pd].concat()
            }
            Output::Velocities => {
                sweeps.collect_rates(&self.work.velocity, &self.work.first, &mut self.v);
                self.v.clone()
            }
            Output::ProjectMomenta => {
                sweeps.collect_rates(&self.work.velocity, &self.work.first, &mut self.v);
                let mut sigma = vec![Expr::zero(); self.tree.dims.rows];
                sweeps.settled_multipliers(&self.work, &mut sigma);
                [self.v.as_slice(), &self.p, &sigma].concat()
            }
            Output::PositionCorrection => {
                sweeps.collect_rates(&self.work.velocity, &self.work.first, &mut self.v);
                let rows = vec![Expr::zero(); if self.alone { 0 } else { self.tree.dims.rows }];
                let (mut residuals, mut pivots) = (rows.clone(), rows);
                sweeps.residuals(&self.work, &mut residuals);
                if !self.alone {
                    sweeps.row_pivots(&self.work, &mut pivots);
                }
                [residuals, self.v.clone(), pivots].concat()
            }
            Output::Momenta => self.p.clone(),
            Output::Accelerations => {
                sweeps.collect_rates(&self.work.acceleration, &self.work.first, &mut self.v);
                (0..self.tree.nodes.len()).for_each(|i| sweeps.add_reference_node(i, &self.work, &mut self.v));
                self.v.clone()
            }
            Output::InverseDynamics | Output::Bias => {
                let a = imposed(self.group, given);
                (0..self.tree.nodes.len()).for_each(|i| sweeps.joint_force_node(i, a, &self.work, &mut self.p));
                self.p.clone()
            }
            Output::Energy => {
                vec![sweeps.kinetic_end(&given.second, &self.work, self.energy[0]), self.energy[1]]
            }
            _ => Vec::new(),
        }
    }

    /// What a pass carries through node `i`: on the way back what its children hand to it, on the way forth what it hands
    /// to its children.
    pub fn carried(&mut self, pass: usize, i: usize) -> Vec<&mut Expr<'g>> {
        let Some(pass) = self.own(pass) else { return Vec::new() };
        let (n, slots) = (self.tree.nodes.len(), slots(&self.tree));
        let w = &mut self.work;
        match (self.group, pass) {
            (Output::Momenta, 0) => motion(&mut w.velocity.omega[i]),
            (Output::InverseDynamics | Output::Bias | Output::Accelerations, 0) => {
                let newton = &mut w.newton;
                newton.spin[i].iter_mut().chain(&mut newton.alpha[i]).chain(&mut newton.accel[i]).collect()
            }
            (Output::Momenta | Output::InverseDynamics | Output::Bias, _) => force(&mut w.force[i]),
            (Output::Accelerations, 1) => {
                let mut all = inertia(&mut w.factor.m[i]);
                all.extend(force(&mut w.acceleration.d[i]));
                all
            }
            (Output::Accelerations, _) => motion(&mut w.acceleration.omega[i]),
            (group, 0) => {
                let mut all = inertia(&mut w.factor.m[i]);
                all.extend(force(&mut w.velocity.d[i]));
                if weighs(group) {
                    all.extend(w.loads.moment[i].iter_mut().chain(Some(&mut w.loads.mass[i])));
                }
                let columns = w.factor.columns.iter_mut().enumerate();
                columns.filter(|(k, _)| k % n == i && slots.contains(&(k / n))).for_each(|(_, c)| all.extend(force(c)));
                all
            }
            (Output::ProjectMomenta, 2) => Vec::new(),
            (group, _) => {
                let mut all = motion(&mut w.velocity.omega[i]);
                match group {
                    Output::Rates => all.extend(w.loads.gravity[i].iter_mut()),
                    Output::Energy => all.extend(self.energy.iter_mut()),
                    _ => {}
                }
                all
            }
        }
    }

    /// What a pass carries whatever node it is at: sums over all nodes so far, and multipliers.
    pub fn running(&mut self, pass: usize) -> Vec<&mut Expr<'g>> {
        if !self.bound {
            return Vec::new();
        }
        let (own, ng, slots) = (self.own(pass), self.tree.unknowns.len(), slots(&self.tree));
        let w = &mut self.work;
        let Some(pass) = own else {
            let ends = w.constraints.reach.iter_mut().flatten();
            return ends.flat_map(|(rot, pos)| rot.iter_mut().flatten().chain(pos)).collect();
        };
        if pass == 2 {
            return w.constraints.hold.iter_mut().flatten().flat_map(force).collect();
        }
        let row = |g: &usize| slots.contains(g);
        let rates = w.velocity.unknown_rate.iter_mut().enumerate().filter(|(g, _)| row(g)).map(|(_, x)| x);
        if pass == 1 {
            return rates.collect();
        }
        let gram = w.factor.gram.iter_mut().enumerate().filter(|(k, _)| row(&(k / ng)) && row(&(k % ng)));
        let whole = w.factor.whole.iter_mut().enumerate().filter(|(g, _)| row(g)).map(|(_, x)| x);
        rates.chain(whole).chain(gram.map(|(_, x)| x)).collect()
    }
}

/// Whether a group solves for velocities.
pub fn solves(group: Output) -> bool {
    matches!(
        group,
        Output::Rates | Output::Velocities | Output::Energy | Output::ProjectMomenta | Output::PositionCorrection
    )
}

/// Whether it needs masses and first moments.
fn weighs(group: Output) -> bool {
    matches!(group, Output::Rates | Output::Energy)
}

/// What velocities are solved from; `own` are the workspace's right-hand sides: of freedoms, drives, rows.
fn load<'a, 'g>(
    group: Output,
    given: &'a SymbolicInputs<'g>,
    u: &Inputs<'a, Expr<'g>>,
    own: [&'a [Expr<'g>]; 3],
) -> Load<'a, Expr<'g>> {
    let [p, drive, rows] = own;
    match group {
        Output::PositionCorrection => Load { p, drive, seeds: None, rows, what: Quantity::Constraint },
        _ => Load::velocities(&given.second, u, rows),
    }
}

/// Places of the constraints' rows among the shared coordinates.
fn slots(tree: &Tree<Expr>) -> Vec<usize> {
    tree.constraints.iter().flat_map(|c| c.slots.iter().copied()).collect()
}

/// Accelerations that the inverse dynamics of a group start from.
fn imposed<'a, 'g>(group: Output, given: &'a SymbolicInputs<'g>) -> Accelerations<'a, Expr<'g>> {
    match group {
        Output::InverseDynamics => Accelerations::Given(&given.third),
        _ => Accelerations::Zero,
    }
}

fn inertia<'a, 'g>(m: &'a mut ArticulatedInertia<Expr<'g>>) -> Vec<&'a mut Expr<'g>> {
    m.a.iter_mut().chain(m.h.iter_mut().flatten()).chain(m.j.iter_mut()).collect()
}

fn motion<'a, 'g>(m: &'a mut Motion<Expr<'g>>) -> Vec<&'a mut Expr<'g>> {
    m.lin.iter_mut().chain(m.ang.iter_mut()).collect()
}

fn force<'a, 'g>(f: &'a mut Force<Expr<'g>>) -> Vec<&'a mut Expr<'g>> {
    f.lin.iter_mut().chain(f.ang.iter_mut()).collect()
}

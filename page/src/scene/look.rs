//! What the page shows of an instant, and what it keeps of a step: crossings of a section.

use multibody::runtime::sweep::FrameState;
use multibody::runtime::Constrained;

use super::Scene;
use crate::motion::{energies, Motion};

/// Largest number of crossings of a section between two looks.
const MOST_CROSSINGS: usize = 200;

impl Scene {
    /// Keeps crossings of a coordinate upwards through a value; those of an angle are the same after whole turns. `None` of
    /// a coordinate keeps none.
    pub fn set_section(&mut self, section: Option<(usize, f64)>) {
        self.section = section.filter(|(k, _)| *k < self.plan.dims.nq);
        self.crossings.clear();
    }

    /// Keeps the state where the section was crossed in the last step, which began at a state, as if it were straight.
    pub(super) fn cross(&mut self, before: &[f64]) {
        let Some((k, level)) = self.section else { return };
        let turn = std::f64::consts::TAU;
        let a = (before[k] - level + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
        let b = a + self.q[k] - before[k];
        if a < 0.0 && b >= 0.0 && self.crossings.len() < MOST_CROSSINGS {
            let part = -a / (b - a);
            let after = self.q.iter().chain(&self.p);
            self.crossings.push(before.iter().zip(after).map(|(x, y)| x + part * (y - x)).collect());
        }
    }

    /// The largest residual of loops and couplings, m or rad.
    fn residual(&mut self) -> f64 {
        if self.view.rows().is_empty() {
            return 0.0;
        }
        let (mut rows, mut entries) = (self.view.zero_rows(), self.view.zero_entries());
        self.view.constraint_residuals(&self.q, &mut rows, &mut entries);
        // Those that bind velocities have none.
        let rows = rows.iter().zip(self.view.rows()).filter(|(_, row)| row.holonomic);
        rows.fold(0.0, |most: f64, (x, _)| most.max(x.abs()))
    }

    /// Writes what the page shows of this instant to [`Scene::out`].
    pub fn look(&mut self, forces: bool) {
        let mut v = std::mem::take(&mut self.v);
        self.system.system_mut().velocities(&self.q, &self.p, &mut v);
        self.v = v;
        self.view.frames(&self.q, &self.v, &mut self.frames);
        let [kinetic, potential, spring] = energies(&mut self.system, &self.q, &self.p);
        let work = self.motion.as_ref().map_or(0.0, |motion| motion.work);
        let error = kinetic + potential + spring - self.budget - work;
        let residual = self.residual();
        let arrows = if forces { self.arrows() } else { Vec::new() };
        let reactions = if forces { self.reactions() } else { Vec::new() };
        let modes = self.motion.as_ref().map_or(Vec::new(), |motion| motion.modes(&self.system));
        let steps = self.motion.as_ref().is_ok_and(Motion::by_time_steps);
        let held = self.load.borrow_mut().pull.as_mut().map(|pull| {
            let (point, _) = pull.point(&self.q, &self.v);
            [point, pull.target, pull.force(&self.q, &self.v)].concat()
        });
        let out = &mut self.out;
        out.clear();
        out.extend([self.t, kinetic, potential, spring, error, work, residual, f64::from(u8::from(steps))]);
        let counts = [arrows.len(), reactions.len(), modes.len(), usize::from(held.is_some()), self.crossings.len()];
        out.extend(counts.map(|n| n as f64));
        out.extend(self.q.iter().chain(&self.p).chain(&self.v));
        for frame in &self.frames {
            out.extend(frame.rotation.as_flattened().iter().chain(&frame.position));
        }
        out.extend(arrows.iter().chain(&reactions).flatten());
        out.extend(modes);
        out.extend(held.into_iter().flatten());
        out.extend(self.crossings.drain(..).flatten());
    }

    /// Forces of contacts: where they act and their components, in ground axes.
    fn arrows(&mut self) -> Vec<[f64; 6]> {
        let (Some(touch), Ok(_)) = (&mut self.touch, &self.motion) else { return Vec::new() };
        // In a copy: nothing of the motion depends on whether it is looked at.
        let forces = self.system.clone().forces(self.t, &self.q, &self.p).to_vec();
        let poses = touch.poses(&self.q, &self.v);
        let arrows = touch.arrows(&poses, &forces).into_iter();
        arrows.map(|([a, b, c], [d, e, f])| [a, b, c, d, e, f]).collect()
    }

    /// Forces that joints transmit to their outer bodies, in ground axes, with those of loops; none where contacts have a share.
    fn reactions(&mut self) -> Vec<[f64; 6]> {
        if !self.plan.model.contacts.is_empty() {
            return Vec::new();
        }
        self.load.borrow_mut().set(&self.q, &self.v, &mut self.view.tau);
        let count = self.plan.joint_nodes.len();
        let (mut a, mut wrenches) = (self.v.clone(), vec![[0.0; 6]; count]);
        self.view.reactions(&self.q, &self.v, &mut a, &mut wrenches);
        let at = |(frame, wrench): (&FrameState<f64>, &[f64; 6])| {
            let force = frame.rotation.map(|row| (0..3).map(|k| row[k] * wrench[k]).sum::<f64>());
            [frame.position[0], frame.position[1], frame.position[2], force[0], force[1], force[2]]
        };
        self.frames.iter().zip(&wrenches).map(at).collect()
    }
}

//! What the page shows of an instant, and what it keeps of a step: crossings of a section.

use multibody::codegen::model::{ConstraintKind, Unit};
use multibody::runtime::spatial::cross;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::tree::Source;
use multibody::runtime::Constrained;

use super::{value, Scene};
use crate::motion::{energies, Motion};

/// Largest number of crossings of a section between two looks.
const MOST_CROSSINGS: usize = 200;

impl Scene {
    /// Keeps crossings of a coordinate upwards through a value; those of an angle are the same after whole turns. `None` of
    /// a coordinate keeps none.
    pub fn set_section(&mut self, section: Option<(usize, f64)>) {
        let section = section.filter(|(k, _)| *k < self.plan.dims.nq);
        self.section = section.map(|(k, level)| (k, level, self.is_angle(k)));
        self.crossings.clear();
    }

    fn is_angle(&self, k: usize) -> bool {
        self.plan.slots.iter().any(|slot| {
            let Some(Source::State { q, .. }) = slot.at else { return false };
            let coordinates = self.plan.model.joints[slot.joint].kind.spec().coordinates;
            k >= q && coordinates.get(k - q).is_some_and(|coordinate| coordinate.unit == Unit::Radian)
        })
    }

    /// Keeps the state where the section was crossed in the last step, which began at a state, as if it were straight.
    pub(super) fn cross(&mut self, before: &[f64]) {
        let Some((k, level, is_angle)) = self.section else { return };
        let mut a = before[k] - level;
        if is_angle {
            let turn = std::f64::consts::TAU;
            a = (a + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
        }
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

    /// Writes what the page shows of this instant to [`Scene::out`], the forces of contacts and joints only where they are
    /// asked for.
    pub fn look(&mut self, forces: bool) {
        let mut v = std::mem::take(&mut self.v);
        self.system.system_mut().velocities(&self.q, &self.p, &mut v);
        self.v = v;
        self.view.frames(&self.q, &self.v, &mut self.frames);
        let [kinetic, potential, spring] = energies(&mut self.system, &self.q, &self.p);
        let work = self.motion.as_ref().map_or(0.0, |motion| motion.work);
        let error = kinetic + potential + spring - self.budget - work;
        let residual = self.residual();
        let touching = if forces { self.contact_forces() } else { Vec::new() };
        let touch = self.touch.as_mut().filter(|_| forces);
        let poses = touch.map_or(Vec::new(), |touch| touch.poses(&self.q, &self.v));
        let arrows = self.touch.as_ref().map_or(Vec::new(), |touch| touch.arrows(&poses, &touching));
        let arrows: Vec<[f64; 6]> = arrows.iter().map(|([a, b, c], [d, e, f])| [*a, *b, *c, *d, *e, *f]).collect();
        let reactions = if forces { self.reactions(&poses, &touching) } else { Vec::new() };
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

    /// Forces of contacts: their components along the rows of each; none where there is no motion.
    fn contact_forces(&self) -> Vec<[f64; 3]> {
        // In a copy: nothing of the motion depends on whether it is looked at.
        self.motion.as_ref().map_or(Vec::new(), |_| self.system.clone().forces(self.t, &self.q, &self.p).to_vec())
    }

    /// Forces that joints transmit to their outer bodies, in ground axes, with those of loops and contacts.
    fn reactions(&mut self, poses: &[FrameState<f64>], touching: &[[f64; 3]]) -> Vec<[f64; 6]> {
        self.load.borrow_mut().set(&self.q, &self.v, &mut self.view.tau);
        self.touched(poses, touching);
        let count = self.plan.joint_nodes.len();
        let (mut a, mut wrenches) = (self.v.clone(), vec![[0.0; 6]; count]);
        self.view.reactions(&self.q, &self.v, &mut a, &mut wrenches);
        let at = |(frame, wrench): (&FrameState<f64>, &[f64; 6])| {
            let force = frame.rotation.map(|row| (0..3).map(|k| row[k] * wrench[k]).sum::<f64>());
            [frame.position[0], frame.position[1], frame.position[2], force[0], force[1], force[2]]
        };
        self.frames.iter().zip(&wrenches).map(at).collect()
    }

    /// Gives what is shown the forces of contacts: those of bodies as wrenches, those of stops as joint forces.
    fn touched(&mut self, poses: &[FrameState<f64>], touching: &[[f64; 3]]) {
        let (plan, view) = (&self.plan, &mut self.view);
        let Some((_, wrenches)) = view.wrenches.split_at_mut_checked(plan.wrenches.len()) else { return };
        wrenches.fill([0.0; 6]);
        for (k, (contact, force)) in plan.model.contacts.iter().zip(touching).enumerate() {
            if let ConstraintKind::Coupling { terms, .. } = &contact.kind {
                for (joint, ratio) in terms {
                    if let Some(axis) = plan.axes().find(|axis| axis.joint == *joint) {
                        view.tau[axis.v] += value(&plan.model, *ratio) * force[0];
                    }
                }
            }
            let arrow = self.touch.as_ref().and_then(|touch| touch.arrow(poses, k, force));
            let (Some((point, force)), Some(Some(ends))) = (arrow, plan.contact_frames.get(k)) else { continue };
            for (end, sign) in ends.iter().zip([-1.0, 1.0]) {
                let joint = plan.joint_nodes.iter().position(|node| Some(*node) == end.node);
                let Some(joint) = joint else { continue };
                let from = self.frames[joint].position;
                let (arm, force) = (std::array::from_fn(|i| point[i] - from[i]), force.map(|f| sign * f));
                let wrench = force.into_iter().chain(cross(arm, force));
                wrenches[joint].iter_mut().zip(wrench).for_each(|(sum, x)| *sum += x);
            }
        }
    }
}

//! The layout of the states in the file: the order and representation of another program ("there").

use multibody::codegen::model::JointMotion;
use multibody::codegen::options::{EliminationStrategy, PlanOptions};
use multibody::codegen::plan::state_layout;
use multibody::codegen::plan::Plan;
use multibody::codegen::search;
use multibody::runtime::layout::{Form, Layout, Part};
use multibody::runtime::tree::Source;

use crate::args::LayoutArg;

/// The layout of the file, with names.
pub struct Outer {
    layout: Layout,
    /// Names of the coordinates there.
    pub q_names: Vec<String>,
    /// Names of the velocities there.
    pub v_names: Vec<String>,
}

/// Numbers in the file that must have unit length together.
pub struct Unit {
    /// Index of the first number.
    pub at: usize,
    /// How many numbers.
    pub len: usize,
    /// Description for messages.
    pub what: String,
}

impl Outer {
    /// The layout of a plan.
    pub fn new(plan: &Plan, layout: LayoutArg) -> Outer {
        let layout = match layout {
            LayoutArg::Mbd => own(plan),
            LayoutArg::Pinocchio => state_layout::pinocchio(plan),
            LayoutArg::Mujoco => state_layout::mujoco(plan),
        };
        let mut outer = Outer { q_names: Vec::new(), v_names: Vec::new(), layout };
        let (nq, nv) = outer.layout.sizes();
        outer.q_names = vec![String::new(); nq];
        outer.v_names = vec![String::new(); nv];
        let (own_q, own_v) = (plan.coordinate_names(), plan.velocity_names());
        for part in &outer.layout.parts {
            let (nq_here, nq_there, nv) = part.form.sizes();
            let here = &own_q[part.q.0..part.q.0 + nq_here];
            for (to, from) in outer.v_names[part.v.1..].iter_mut().zip(&own_v[part.v.0..part.v.0 + nv]) {
                to.clone_from(from);
            }
            for (to, from) in outer.q_names[part.q.1..part.q.1 + nq_there].iter_mut().zip(names(part.form, here)) {
                *to = from;
            }
        }
        outer
    }

    /// The prescribed joints, which are always given in this program's own layout.
    pub fn drives(plan: &Plan) -> Outer {
        // The same plan with the prescribed joints as its state.
        let mut model = plan.model.clone();
        for joint in &mut model.joints {
            joint.motion = match joint.motion {
                JointMotion::Free => JointMotion::Prescribed,
                JointMotion::Prescribed => JointMotion::Free,
                mimic => mimic,
            };
        }
        // Only its names are used: no search for blocks.
        let options = PlanOptions { elimination: EliminationStrategy::Single, ..PlanOptions::default() };
        Outer::new(&search::plan(&model, options), LayoutArg::Mbd)
    }

    /// Coordinates from there to here.
    pub fn q_from(&self, there: &[f64], nq: usize) -> Vec<f64> {
        let mut here = vec![0.0; nq];
        self.layout.q_from(there, &mut here);
        here
    }

    /// Velocities or joint forces from there to here, at coordinates `q` here.
    pub fn v_from(&self, q: &[f64], there: &[f64]) -> Vec<f64> {
        let mut here = vec![0.0; there.len()];
        self.layout.v_from(q, there, &mut here);
        here
    }

    /// Coordinate rates from here to there.
    pub fn coordinate_rates(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let mut there = vec![0.0; self.q_names.len()];
        self.layout.qd_to(q, qd, &mut there);
        there
    }

    /// Velocities or momenta from here to there.
    pub fn velocities(&self, q: &[f64], here: &[f64]) -> Vec<f64> {
        let mut there = vec![0.0; self.v_names.len()];
        self.layout.v_to(q, here, &mut there);
        there
    }

    /// Time derivative of velocities or momenta `x`, from here to there. If the other program takes the linear part of
    /// a floating joint in the parent's axes, `d/dt (R x) = R (ẋ + ω × x)`.
    pub fn derivative(&self, q: &[f64], v: &[f64], x: &[f64], xd: &[f64]) -> Vec<f64> {
        let mut turned = xd.to_vec();
        for part in self.layout.parts.iter().filter(|p| p.form == Form::FloatingWorld) {
            let at = part.v.0;
            let (w, x) = (&v[at + 3..at + 6], &x[at..at + 3]);
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                turned[at + k] += w[i] * x[j] - w[j] * x[i];
            }
        }
        self.velocities(q, &turned)
    }

    /// Time derivative of velocities or momenta from there to here: the inverse of [`Outer::derivative`].
    pub fn derivative_from(&self, q: &[f64], v: &[f64], x: &[f64], there: &[f64]) -> Vec<f64> {
        let mut here = self.v_from(q, there);
        for part in self.layout.parts.iter().filter(|p| p.form == Form::FloatingWorld) {
            let at = part.v.0;
            let (w, x) = (&v[at + 3..at + 6], &x[at..at + 3]);
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                here[at + k] -= w[i] * x[j] - w[j] * x[i];
            }
        }
        here
    }

    /// Mass matrix from here (row by row) to there: `T M Tᵀ`, with `T` the map of velocities, which is orthogonal.
    pub fn matrix(&self, q: &[f64], m: &[f64]) -> Vec<Vec<f64>> {
        let n = self.v_names.len();
        let rows: Vec<Vec<f64>> = m.chunks(n.max(1)).map(|row| self.velocities(q, row)).collect();
        let columns = (0..n).map(|k| rows.iter().map(|row| row[k]).collect::<Vec<_>>());
        // The columns of a symmetric matrix are its rows.
        columns.map(|column| self.velocities(q, &column)).collect()
    }

    /// The numbers that must have unit length in the file.
    pub fn units(&self) -> Vec<Unit> {
        let unit = |part: &Part| {
            let at = part.q.1;
            let (at, len) = match part.form {
                Form::Same { .. } => return None,
                Form::CosSin => (at, 2),
                Form::PlanarCosSin => (at + 2, 2),
                Form::Quaternion | Form::QuaternionWxyz => (at, 4),
                Form::Floating | Form::FloatingWorld => (at + 3, 4),
            };
            Some(Unit { at, len, what: self.q_names[at..at + len].join(", ") })
        };
        self.layout.parts.iter().filter_map(unit).collect()
    }
}

/// This program's own layout.
fn own(plan: &Plan) -> Layout {
    let parts = plan.slots.iter().filter_map(|slot| {
        let Some(Source::State { q, v }) = slot.at else { return None };
        let form = plan.model.joints[slot.joint].kind.spec().form();
        Some(Part { form, q: (q, q), v: (v, v) })
    });
    Layout { parts: parts.collect() }
}

/// Names of the coordinates of one joint in the other layout, from those in this one.
fn names(form: Form, here: &[String]) -> Vec<String> {
    let turned = |angle: &String| {
        let stem = angle.trim_end_matches(".angle");
        vec![format!("{stem}.cos"), format!("{stem}.sin")]
    };
    match form {
        Form::Same { .. } | Form::Quaternion | Form::Floating => here.to_vec(),
        Form::CosSin => turned(&here[0]),
        Form::PlanarCosSin => [here[..2].to_vec(), turned(&here[2])].concat(),
        Form::QuaternionWxyz => [&here[3..], &here[..3]].concat(),
        Form::FloatingWorld => [&here[..3], &here[6..], &here[3..6]].concat(),
    }
}

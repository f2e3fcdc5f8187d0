//! Traits of the runtime, implemented for the generated type.

use std::fmt::Write as _;

use mbd_runtime::tree::Source;

use super::layout::neutral;
use crate::model::JointKind;
use crate::options::Options;
use crate::plan::Plan;

/// `impl System`.
pub fn system(out: &mut String, plan: &Plan, options: &Options) {
    let (t, name, rt) = (options.precision.name(), &options.type_name, &options.runtime);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let groups: Vec<String> = plan
        .slots
        .iter()
        .filter_map(|s| {
            let Some(Source::State { q, v }) = s.at else { return None };
            let kind = match plan.model.joints[s.joint].kind {
                JointKind::Spherical => "Rotation",
                JointKind::Floating => "Pose",
                JointKind::Planar { .. } => "Plane",
                _ => return None,
            };
            Some(format!("{rt}::system::LieJoint::new({rt}::system::LieGroup::{kind}, {q}, {v})"))
        })
        .collect();
    let neutral = neutral(plan, false);
    let constraints = match plan.constraint_names() {
        none if none.is_empty() => "{ let _ = k; None }".to_string(),
        names => format!("const {{ &{names:?} }}.get(k).copied()"),
    };
    let groups = groups.join(", ");
    let _ = write!(
        out,
        "
#[rustfmt::skip]
impl {rt}::System for {name} {{
    type Scalar = {t};
    type Coordinates = [{t}; {nq}];
    type Momenta = [{t}; {nv}];

    fn neutral(&self) -> [{t}; {nq}] {{
        {neutral}
    }}

    fn zero_momenta(&self) -> [{t}; {nv}] {{
        [0.0; {nv}]
    }}

    #[inline]
    fn lie_joints(&self) -> &[{rt}::system::LieJoint] {{
        const {{ &[{groups}] }}
    }}

    #[inline]
    fn rates_at(&mut self, _t: {t}, q: &[{t}; {nq}], p: &[{t}; {nv}], qd: &mut [{t}; {nq}], pd: &mut [{t}; {nv}]) {{
        Self::rates(self, q, p, qd, pd);
    }}

    fn part_name(&self, part: {rt}::system::Part) -> Option<&str> {{
        match part {{
            {rt}::system::Part::Velocity(k) => Self::VELOCITIES.get(k).copied(),
            {rt}::system::Part::Constraint(k) => {constraints},
        }}
    }}

    #[inline]
    fn coordinate_rates(&self, q: &[{t}; {nq}], v: &[{t}; {nv}], qd: &mut [{t}; {nq}]) {{
        Self::coordinate_rates(self, q, v, qd);
    }}
}}
"
    );
}

/// `impl Energetic`.
pub fn energetic(out: &mut String, plan: &Plan, options: &Options) {
    let (t, name, rt) = (options.precision.name(), &options.type_name, &options.runtime);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let _ = write!(
        out,
        "
#[rustfmt::skip]
impl {rt}::Energetic for {name} {{
    #[inline]
    fn energies(&mut self, q: &[{t}; {nq}], p: &[{t}; {nv}]) -> ({t}, {t}) {{
        let [kinetic, potential] = Self::energy(self, q, p);
        (kinetic, potential)
    }}
}}
"
    );
}

/// `impl Conjugate`.
pub fn conjugate(out: &mut String, plan: &Plan, options: &Options) {
    let (t, name, rt) = (options.precision.name(), &options.type_name, &options.runtime);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let _ = write!(
        out,
        "
#[rustfmt::skip]
impl {rt}::Conjugate for {name} {{
    #[inline]
    fn conjugate_momenta(&mut self, q: &[{t}; {nq}], v: &[{t}; {nv}], p: &mut [{t}; {nv}]) {{
        Self::momenta(self, q, v, p);
    }}
}}
"
    );
}

/// `impl Accelerated`.
pub fn accelerated(out: &mut String, plan: &Plan, options: &Options) {
    let (t, name, rt) = (options.precision.name(), &options.type_name, &options.runtime);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let _ = write!(
        out,
        "
#[rustfmt::skip]
impl {rt}::Accelerated for {name} {{
    #[inline]
    fn generalized_accelerations(&mut self, q: &[{t}; {nq}], v: &[{t}; {nv}], a: &mut [{t}; {nv}]) {{
        Self::accelerations(self, q, v, a);
    }}
}}
"
    );
}

/// `impl Differentiable`.
pub fn differentiable(out: &mut String, plan: &Plan, options: &Options) {
    let (t, name, rt, nv) = (options.precision.name(), &options.type_name, &options.runtime, plan.dims.nv);
    let nq = plan.dims.nq;
    let _ = write!(
        out,
        "
#[rustfmt::skip]
impl {rt}::Differentiable for {name} {{
    type Square = [[{t}; {nv}]; {nv}];

    fn square(&self) -> [[{t}; {nv}]; {nv}] {{
        [[0.0; {nv}]; {nv}]
    }}

    fn rate_derivatives(&mut self, _t: {t}, q: &[{t}; {nq}], p: &[{t}; {nv}], out: &mut {rt}::StateDerivatives<[{t}; {nv}], [[{t}; {nv}]; {nv}]>) {{
        Self::derivatives(self, q, p, &mut out.v, &mut out.pd, &mut out.dv_dq, &mut out.dv_dp, &mut out.dpd_dq, &mut out.dpd_dp);
    }}
}}
"
    );
}

/// `impl Constrained`.
pub fn constrained(out: &mut String, plan: &Plan, options: &Options) {
    let (t, name, rt) = (options.precision.name(), &options.type_name, &options.runtime);
    let (nq, nv) = (plan.dims.nq, plan.dims.nv);
    let (rows, entries) = (plan.dims.rows, plan.entry_columns().len());
    let _ = write!(
        out,
        "
#[rustfmt::skip]
impl {rt}::Constrained for {name} {{
    type Rows = [{t}; {rows}];
    type Entries = [{t}; {entries}];

    fn zero_rows(&self) -> [{t}; {rows}] {{
        [0.0; {rows}]
    }}

    fn zero_entries(&self) -> [{t}; {entries}] {{
        [0.0; {entries}]
    }}

    fn rows(&self) -> &[{rt}::system::Row] {{
        const {{ &Self::CONSTRAINT_ROWS }}
    }}

    fn entry_columns(&self) -> &[usize] {{
        const {{ &Self::ENTRY_COLUMNS }}
    }}

    #[inline]
    fn constraint_residuals(&mut self, q: &[{t}; {nq}], residual: &mut [{t}; {rows}], jacobian: &mut [{t}; {entries}]) {{
        Self::constraint_residuals(self, q, residual, jacobian);
    }}

    #[inline]
    fn project_momenta(&mut self, _t: {t}, q: &[{t}; {nq}], p: &mut [{t}; {nv}], v: &mut [{t}; {nv}], sigma: &mut [{t}; {rows}]) {{
        let augmented = *p;
        Self::project_momenta(self, q, &augmented, v, p, sigma);
    }}

    #[inline]
    fn position_correction(&mut self, q: &[{t}; {nq}], residual: &mut [{t}; {rows}], dq: &mut [{t}; {nv}], pivots: &mut [{t}; {rows}]) {{
        Self::position_correction(self, q, residual, dq, pivots);
    }}

    #[inline]
    fn multipliers(&mut self, _t: {t}, q: &[{t}; {nq}], v: &[{t}; {nv}], lambda: &mut [{t}; {rows}]) {{
        Self::multipliers(self, q, v, lambda);
    }}
}}
"
    );
}

//! Traits of the runtime, implemented for the generated type.

use std::fmt::Write as _;

use mbd_runtime::tree::Source;

use super::fields::neutral;
use super::lanes::{self, Kernel};
use crate::options::Options;
use crate::output::Output;
use crate::plan::Plan;

/// Writer of implementations, and the types of their arguments.
struct Writer<'a> {
    out: &'a mut String,
    options: &'a Options,
    /// The number.
    t: &'static str,
    /// Coordinates.
    q: String,
    /// Velocities and momenta.
    v: String,
}

/// An associated type of an implementation.
pub fn alias(name: &str, ty: &str) -> String {
    format!("    type {name} = {ty};\n")
}

/// A function of an implementation.
pub fn method(signature: &str, body: &str) -> String {
    format!("\n    #[inline]\n    fn {signature} {{\n        {body}\n    }}\n")
}

impl Writer<'_> {
    fn implement(&mut self, name: &str, items: &[String]) {
        let (rt, ty) = (&self.options.runtime, &self.options.type_name);
        let _ = writeln!(self.out, "\n#[rustfmt::skip]\nimpl {rt}::{name} for {ty} {{\n{}}}", items.concat());
    }
}

/// All implementations for which the type has the functions; none without the rates.
pub fn traits(out: &mut String, plan: &Plan, options: &Options, kernels: &[Kernel]) {
    let modes = options.modes.is_some();
    let t = options.precision.name();
    let [q, v] = [plan.dims.nq, plan.dims.nv].map(|n| format!("[{t}; {n}]"));
    let mut writer = Writer { out, options, t, q, v };
    let has = |output| options.outputs.contains(&output);
    let of_constraints =
        [Output::ConstraintResiduals, Output::ProjectMomenta, Output::PositionCorrection, Output::Multipliers];
    if !has(Output::Rates) {
        return;
    }
    // Several states would have to be in the same modes.
    let rates = kernels.iter().find(|k| !modes && k.signature.name == Output::Rates.name());
    writer.system(plan, rates);
    if has(Output::Momenta) {
        writer.conjugate();
    }
    if has(Output::Energy) {
        writer.energetic();
    }
    if has(Output::Accelerations) {
        writer.accelerated();
    }
    if has(Output::Derivatives) {
        writer.differentiable(plan.dims.nv);
    }
    if of_constraints.into_iter().all(has) {
        writer.constrained(plan.dims.rows, plan.entry_columns().len());
    }
}

impl Writer<'_> {
    fn system(&mut self, plan: &Plan, rates: Option<&Kernel>) {
        let (rt, Writer { t, q, v, .. }) = (&self.options.runtime, &*self);
        let joints = plan.slots.iter().filter_map(|s| {
            let Some(Source::State { q, v }) = s.at else { return None };
            let group = plan.model.joints[s.joint].kind.spec().group?;
            Some(format!("{rt}::system::LieJoint::new({rt}::system::LieGroup::{group:?}, {q}, {v})"))
        });
        let joints = joints.collect::<Vec<_>>().join(", ");
        let constraints = match plan.constraint_names() {
            none if none.is_empty() => "{ let _ = k; None }".to_string(),
            names => format!("const {{ &{names:?} }}.get(k).copied()"),
        };
        let part = format!("{rt}::system::Part");
        let items = [
            alias("Scalar", t),
            alias("Coordinates", q),
            alias("Momenta", v),
            method(&format!("neutral(&self) -> {q}"), &format!("{:?}", neutral(plan, false))),
            method(&format!("zero_momenta(&self) -> {v}"), &format!("[0.0; {}]", plan.dims.nv)),
            method(&format!("lie_joints(&self) -> &[{rt}::system::LieJoint]"), &format!("const {{ &[{joints}] }}")),
            method(
                &format!("rates_at(&mut self, _t: {t}, q: &{q}, p: &{v}, qd: &mut {q}, pd: &mut {v})"),
                "Self::rates(self, q, p, qd, pd);",
            ),
            match joints.is_empty() && q == v {
                true => method(
                    &format!(
                        "rates_by_velocities(&mut self, _t: {t}, q: &{q}, p: &{v}, v: &mut {v}, pd: &mut {v}) -> bool"
                    ),
                    "Self::rates(self, q, p, v, pd);\n        true",
                ),
                false => String::new(),
            },
            rates.map_or_else(String::new, |rates| self.rates_in_lanes(plan, rates)),
            method(
                &format!("part_name(&self, part: {part}) -> ::core::option::Option<&str>"),
                &format!(
                    "match part {{\n            {part}::Velocity(k) => Self::VELOCITIES.get(k).copied(),\n            \
                     {part}::Constraint(k) => {constraints},\n        }}"
                ),
            ),
            method(
                &format!("coordinate_rates(&self, q: &{q}, v: &{v}, qd: &mut {q})"),
                "Self::coordinate_rates(self, q, v, qd);",
            ),
        ];
        self.implement("System", &items);
    }

    /// The rates of several states. Rows are arrays in the kernel, so that it checks no index.
    fn rates_in_lanes(&self, plan: &Plan, rates: &Kernel) -> String {
        let t = self.t;
        let row = format!("[[{t}; LANES]]");
        let (nq, nv) = (plan.dims.nq, plan.dims.nv);
        let array = |(name, reference, n): (&str, &str, usize)| {
            // Rates need not depend on all of the state.
            if rates.ports.iter().all(|port| port.name != name) {
                return format!("let _ = {name};\n        ");
            }
            let ty = format!("{reference}[[{t}; LANES]; {n}]");
            format!(
                "let Ok({name}) = <{ty} as ::core::convert::TryFrom<_>>::try_from({name}) else {{ return false }};
        "
            )
        };
        let arrays = [("q", "&", nq), ("p", "&", nv), ("qd", "&mut ", nq), ("pd", "&mut ", nv)].map(array).concat();
        let call = lanes::call(self.options, rates, "LANES", &["q", "p", "qd", "pd"]);
        method(
            &format!(
                "rates_in_lanes<const LANES: usize>(&mut self, _t: &[{t}; LANES], q: &{row}, p: &{row}, qd: &mut {row}, \
                 pd: &mut {row}) -> bool"
            ),
            &format!("{arrays}{call}\n        true"),
        )
    }

    fn energetic(&mut self) {
        let Writer { t, q, v, .. } = &*self;
        let signature = format!("energies(&mut self, q: &{q}, p: &{v}) -> ({t}, {t})");
        let body = "let [kinetic, potential] = Self::energy(self, q, p);\n        (kinetic, potential)";
        let items = [method(&signature, body)];
        self.implement("Energetic", &items);
    }

    fn conjugate(&mut self) {
        let Writer { q, v, .. } = &*self;
        let signature = format!("conjugate_momenta(&mut self, q: &{q}, v: &{v}, p: &mut {v})");
        let items = [method(&signature, "Self::momenta(self, q, v, p);")];
        self.implement("Conjugate", &items);
    }

    fn accelerated(&mut self) {
        let Writer { q, v, .. } = &*self;
        let signature = format!("generalized_accelerations(&mut self, q: &{q}, v: &{v}, a: &mut {v})");
        let items = [method(&signature, "Self::accelerations(self, q, v, a);")];
        self.implement("Accelerated", &items);
    }

    fn differentiable(&mut self, nv: usize) {
        let (rt, Writer { t, q, v, .. }) = (&self.options.runtime, &*self);
        let square = format!("[{v}; {nv}]");
        let arguments = format!("_t: {t}, q: &{q}, p: &{v}, out: &mut {rt}::StateDerivatives<{v}, {square}>");
        let items = [
            alias("Square", &square),
            method(&format!("square(&self) -> {square}"), &format!("[[0.0; {nv}]; {nv}]")),
            method(&format!("rate_derivatives(&mut self, {arguments})"), "Self::derivatives(self, q, p, out);"),
        ];
        self.implement("Differentiable", &items);
    }

    fn constrained(&mut self, rows: usize, entries: usize) {
        let (rt, Writer { t, q, v, .. }) = (&self.options.runtime, &*self);
        let [row, entry] = [rows, entries].map(|n| format!("[{t}; {n}]"));
        let items = [
            alias("Rows", &row),
            alias("Entries", &entry),
            method(&format!("zero_rows(&self) -> {row}"), &format!("[0.0; {rows}]")),
            method(&format!("zero_entries(&self) -> {entry}"), &format!("[0.0; {entries}]")),
            method(&format!("rows(&self) -> &[{rt}::system::Row]"), "const { &Self::CONSTRAINT_ROWS }"),
            method("entry_columns(&self) -> &[usize]", "const { &Self::ENTRY_COLUMNS }"),
            method(
                &format!("constraint_residuals(&mut self, q: &{q}, residual: &mut {row}, jacobian: &mut {entry})"),
                "Self::constraint_residuals(self, q, residual, jacobian);",
            ),
            method(
                &format!("project_momenta(&mut self, _t: {t}, q: &{q}, p: &mut {v}, v: &mut {v}, sigma: &mut {row})"),
                "let augmented = *p;\n        Self::project_momenta(self, q, &augmented, v, p, sigma);",
            ),
            method(
                &format!(
                    "position_correction(&mut self, q: &{q}, residual: &mut {row}, dq: &mut {v}, pivots: &mut {row})"
                ),
                "Self::position_correction(self, q, residual, dq, pivots);",
            ),
            method(
                &format!("multipliers(&mut self, _t: {t}, q: &{q}, v: &{v}, lambda: &mut {row})"),
                "Self::multipliers(self, q, v, lambda);",
            ),
        ];
        self.implement("Constrained", &items);
    }
}

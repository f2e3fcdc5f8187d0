//! The table of outputs, which options, tracing, rolled code, emission, the macro, the command and the documentation
//! read.

mod program;
mod spec;
mod text;

pub(crate) use program::locate;
pub use program::{flat_entry, InputArray, OutputProgram};
pub use spec::{Array, Availability, Dim, Field, Search, Sizes, Spec};
pub use text::{help, table};

use Availability::{WithConstraints, WithContacts, WithoutConstraints};
use Dim::{
    Acts, Const, DriveQ, DriveV, Efforts, Entries, Frames, Gravity, Joints, Nq, Nv, Parameters, Params, Rows, Wrenches,
};

const Q: Array = Array::new("q", &[Nq]);
const V: Array = Array::new("v", &[Nv]);
const A: Array = Array::new("a", &[Nv]);
const P: Array = Array::new("p", &[Nv]);
const QD: Array = Array::new("qd", &[Nq]);
const PD: Array = Array::new("pd", &[Nv]);
const FREED: Array = Array::new("freed", &[Nv]);
const SIGMA: Array = Array::new("sigma", &[Rows]);
const LAMBDA: Array = Array::new("lambda", &[Rows]);

const fn square(name: &'static str) -> Array {
    Array::new(name, &[Nv, Nv])
}

/// Name of the argument whose fields are the results of a function.
pub const STRUCTURE: &str = "out";

/// Fields of a generated type, in the order in which programs number them.
pub const FIELDS: [Field; 8] = [
    Field::new("tau", &[Efforts], "Joint forces, N m or N, one for each velocity."),
    Field::new("drive_q", &[DriveQ], "Prescribed positions."),
    Field::new("drive_v", &[DriveV], "Prescribed rates."),
    Field::new("drive_a", &[DriveV], "Prescribed accelerations; they enter accelerations and reactions only."),
    Field::new("wrenches", &[Wrenches, Const(6)], "External wrenches `[force; moment]`, N and N m."),
    Field::new("params", &[Params], "Run-time parameters."),
    Field::new("acts", &[Acts], "1 for each row of the constraints that acts, 0 for one that does not."),
    Field::new("gravity", &[Gravity], "Gravity in ground axes, m/s²."),
];

/// The function that comes with the rates: coordinate rates of given velocities.
pub const COORDINATE_RATES: &Spec = &Spec {
    doc: "Coordinate rates of given velocities: `q̇ = N(q) v`.",
    ..Spec::new("coordinate_rates", &[Q, V], &[QD])
};

/// The enum and its table from one list; the documentation of a variant is that of its function.
macro_rules! outputs {
    ($($(#[doc = $doc:literal])+ $output:ident = $spec:expr;)+) => {
        /// What generated code can compute.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Output {
            $($(#[doc = $doc])+ $output,)+
        }

        impl Output {
            /// All of them.
            pub const ALL: &'static [Output] = &[$(Output::$output),+];

            /// Its row of the table.
            pub const fn spec(self) -> &'static Spec {
                match self {
                    $(Output::$output => {
                        const SPEC: Spec = Spec { doc: concat!($($doc, "\n"),+), ..$spec };
                        &SPEC
                    })+
                }
            }
        }
    };
}

outputs! {
    /// Rates of the state: coordinate rates `q̇` and momentum rates `ṗ`.
    Rates = Spec::new("rates", &[Q, P], &[QD, PD]);
    /// Velocities from momenta.
    Velocities = Spec::new("velocities", &[Q, P], &[V]);
    /// Momenta from velocities: `p = M(q) v`.
    Momenta = Spec::new("momenta", &[Q, V], &[P]);
    /// Kinetic and potential energy, J.
    Energy = Spec::new("energy", &[Q, P], &[Array::new("energy", &[Const(2)])]).returned();
    /// Accelerations: time derivatives `v̇` of the velocities.
    Accelerations = Spec::new("accelerations", &[Q, V], &[A]).searched(Search::Accelerations);
    /// Wrench `[force; moment]` that each joint transmits to its child, in the child's body frame, N and N m.
    Reactions = Spec::new("reactions", &[Q, V], &[Array::new("reactions", &[Joints, Const(6)])])
        .searched(Search::Accelerations);
    /// Mass matrix, by rows.
    MassMatrix = Spec::new("mass_matrix", &[Q], &[square("m")]).searched(Search::MassMatrix);
    /// Rotation, position and velocity of frames. The rotation takes components in the frame's axes to ground axes; the
    /// position is that of the origin in the ground, m; the velocity is `[linear; angular]`, m/s and rad/s, in the
    /// frame's axes.
    Frames = Spec::new("frames", &[Q, V], &[
        Array::new("rotation", &[Frames, Const(3), Const(3)]),
        Array::new("position", &[Frames, Const(3)]),
        Array::new("velocity", &[Frames, Const(6)]),
    ]);
    /// Joint forces of given accelerations: `τ = M v̇ + h`.
    /// The field `tau` is not read.
    InverseDynamics = Spec::new("inverse_dynamics", &[Q, V, A], &[Array::new("tau", &[Nv])]);
    /// Bias forces `h`, with `M v̇ + h = τ`.
    /// They are velocity products and gravity, less springs, dampers and external wrenches.
    Bias = Spec::new("bias", &[Q, V], &[Array::new("h", &[Nv])]);
    /// Regressor `Y` of the joint forces: `τ = Y π`, by rows.
    /// The columns are ten inertial parameters of every moving body, then a damping and a dry friction for every
    /// velocity (`REGRESSOR`). Springs, rotor inertias and external wrenches are not in it.
    Regressor = Spec::new("regressor", &[Q, V, A], &[Array::new("y", &[Nv, Parameters])]);
    /// Jacobians `J` of frames.
    /// `J v` is the frame's velocity `[linear; angular]` in its own axes, at its origin.
    Jacobians = Spec::new("jacobians", &[Q], &[Array::new("jacobian", &[Frames, Const(6), Nv])]);
    /// Bias accelerations `[linear; angular]` of frames, those at `v̇ = 0`, in the frame's axes.
    /// The linear part is the acceleration of the origin as seen from the ground. `J v̇ + bias` is the acceleration of
    /// the frame.
    BiasAccelerations = Spec::new("bias_accelerations", &[Q, V], &[Array::new("bias", &[Frames, Const(6)])]);
    /// Centre of mass in the ground, m, centroidal momentum matrix `A`, and its bias.
    /// `A v` is the momentum `[linear; angular]` of all bodies about the centre of mass, in ground axes, kg m/s and
    /// kg m²/s; it changes at the rate `A v̇ + bias`. Bodies fixed to the ground and rotor inertias do not count.
    Centroidal = Spec::new("centroidal", &[Q, V], &[
        Array::new("center", &[Const(3)]),
        Array::new("matrix", &[Const(6), Nv]),
        Array::new("bias", &[Const(6)]),
    ]);
    /// Velocities, momentum rates, and their derivatives with respect to `q` and `p`, by rows.
    /// Column `k` with respect to `q` is the derivative along `q̇ = N(q) e_k`: for angles and displacements the partial
    /// derivative. Joint forces add to `ṗ`: `∂ṗ/∂tau = 1`.
    Derivatives = Spec::new("derivatives", &[Q, P], &[
        V, PD, square("dv_dq"), square("dv_dp"), square("dpd_dq"), square("dpd_dp"),
    ]).fields_of("StateDerivatives");
    /// Momenta, their rates at `v̇ = 0`, and derivatives of both with respect to `q` and `v`, by rows.
    /// Columns with respect to `q` are as in `derivatives`. `∂p/∂v` is the mass matrix.
    MomentumDerivatives = Spec::new("momentum_derivatives", &[Q, V], &[
        P, PD, square("dp_dq"), square("dp_dv"), square("dpd_dq"), square("dpd_dv"),
    ]).fields_of("MomentumDerivatives").only(WithoutConstraints);
    /// Derivatives of velocities and momentum rates with respect to the parameters, by rows.
    ParameterDerivatives = Spec::new("parameter_derivatives", &[Q, P], &[
        Array::new("dv_dparams", &[Nv, Params]),
        Array::new("dpd_dparams", &[Nv, Params]),
    ]);
    /// Residuals `φ(q)` of the constraints, rad or m, and the entries of their Jacobian `Φ(q)`.
    /// The entries of row `r` stand from `CONSTRAINT_ROWS[r].first` on, in the columns `ENTRY_COLUMNS`.
    ConstraintResiduals = Spec::new("constraint_residuals", &[Q], &[
        Array::new("residual", &[Rows]),
        Array::new("jacobian", &[Entries]),
    ]).only(WithConstraints);
    /// Velocities, momenta freed of the constraints' multipliers `σ`, and these: `p − Φᵀσ = M v`.
    ProjectMomenta = Spec::new("project_momenta", &[Q, P], &[
        V,
        FREED,
        SIGMA,
    ]).only(WithConstraints);
    /// Residuals `φ(q)` of the constraints, Newton's step onto the closed positions, and its pivots. The step is `δq =
    /// −M⁻¹Φᵀ(Φ M⁻¹Φᵀ)⁻¹φ`; the pivots are those of `Φ M⁻¹Φᵀ`, zero where a row was left out as redundant.
    PositionCorrection = Spec::new("position_correction", &[Q], &[
        Array::new("residual", &[Rows]),
        Array::new("dq", &[Nv]),
        Array::new("pivots", &[Rows]),
    ]).only(WithConstraints);
    /// Multipliers `λ` of the constraints, N and N m.
    /// The constraints act on the joints with `−Φᵀλ`.
    Multipliers = Spec::new("multipliers", &[Q, V], &[LAMBDA]).only(WithConstraints);
    /// Gaps of the contacts: residuals of all rows, their velocities `Φ v`, and the entries of `Φ`, whatever acts.
    /// Of a contact's normal row the residual is the gap, m or rad, negative where bodies overlap; velocities are in m/s
    /// or rad/s, those of prescribed motions included.
    Gaps = Spec::new("gaps", &[Q, V], &[
        Array::new("gaps", &[Rows]),
        Array::new("velocities", &[Rows]),
        Array::new("jacobian", &[Entries]),
    ]).only(WithContacts);
}

/// Whether all early rows act, as the last result of a function for modes of contacts.
const EARLY_ROWS_ACT: Array = Array::new("early_rows_act", &[Const(1)]);

impl Output {
    /// Its row of the table for a plan whose early rows may be unable to act: whether they do is one more result, which is
    /// returned.
    pub(crate) const fn with_early_rows(self) -> &'static Spec {
        /// The row of an output with one more result.
        macro_rules! with {
            ($output:ident, $results:expr) => {{
                const SPEC: Spec = Spec { results: $results, ..*Output::$output.spec() };
                const RETURNED: Spec = SPEC.returned();
                &RETURNED
            }};
        }
        match self {
            Output::Rates => with!(Rates, &[QD, PD, EARLY_ROWS_ACT]),
            Output::ProjectMomenta => with!(ProjectMomenta, &[V, FREED, SIGMA, EARLY_ROWS_ACT]),
            Output::Multipliers => with!(Multipliers, &[LAMBDA, EARLY_ROWS_ACT]),
            // No other output has functions for sets of modes.
            _ => self.spec(),
        }
    }

    /// What is computed unless something else is asked for. Models with constraints then also get the outputs that only
    /// they have.
    pub const DEFAULT: &'static [Output] = &[Output::Rates, Output::Momenta, Output::Energy];

    /// Those of models with (or without) constraints.
    pub fn available(constrained: bool) -> impl Iterator<Item = Output> + Clone {
        Output::ALL.iter().copied().filter(move |output| output.spec().available(constrained))
    }

    /// Name of the generated function, and of the output in options.
    pub const fn name(self) -> &'static str {
        self.spec().name
    }

    /// Whether it consists of derivatives of the rates or of the momenta.
    pub(crate) const fn differentiates(self) -> bool {
        matches!(self, Output::Derivatives | Output::MomentumDerivatives | Output::ParameterDerivatives)
    }

    /// The output of a name.
    pub fn from_name(name: &str) -> Option<Output> {
        Output::ALL.iter().copied().find(|output| output.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_has_one_sentence_for_every_output() {
        let text = help();
        let sentences: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("      ")).collect();
        let outputs = Output::ALL.iter().filter(|output| output.spec().availability != WithContacts);
        assert_eq!(sentences.len(), outputs.count());
        for sentence in sentences {
            assert!(sentence.ends_with('.') && !sentence.contains(". "), "{sentence}");
        }
    }

    #[test]
    fn arguments_of_a_function_have_different_names() {
        for output in Output::ALL {
            let spec = output.spec();
            let mut names: Vec<&str> = spec.inputs.iter().chain(spec.results).map(|array| array.name).collect();
            assert!(!names.contains(&STRUCTURE), "{output:?}");
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), spec.inputs.len() + spec.results.len(), "{output:?}");
            assert_eq!(spec.inputs[0], Q, "{output:?}");
            assert!(!spec.returned || spec.results.len() == 1, "{output:?}");
            assert!(!spec.returned || spec.structure.is_none(), "{output:?}");
        }
    }

    #[test]
    fn names_lead_back() {
        for output in Output::ALL {
            assert_eq!(Output::from_name(output.name()), Some(*output));
        }
        assert_eq!(Output::from_name("rate"), None);
    }
}

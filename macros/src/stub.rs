//! What stands in for a type that could not be made, so that its uses add no errors of their own.

use mbd_codegen::{Options, Precision};

/// So large that no index of a real state is out of bounds.
const LENGTH: usize = 1000;

/// A type with the functions of a generated one that take whatever they are given.
pub fn source(options: &Options) -> String {
    let (name, rt) = (&options.type_name, &options.runtime);
    let t = match options.precision {
        Precision::F64 => "f64",
        Precision::F32 => "f32",
    };
    let array = format!("[{t}; {LENGTH}]");
    let fields =
        ["tau", "drive_q", "drive_v", "drive_a", "params"].map(|f| (f, array.clone(), format!("[0.0; {LENGTH}]")));
    let fields: Vec<(&str, String, String)> = fields
        .into_iter()
        .chain([
            ("wrenches", format!("[[{t}; 6]; {LENGTH}]"), format!("[[0.0; 6]; {LENGTH}]")),
            ("gravity", format!("[{t}; 3]"), "[0.0; 3]".to_string()),
        ])
        .collect();
    let declared: String = fields.iter().map(|(f, ty, _)| format!("#[doc = \"\"] pub {f}: {ty},")).collect();
    let values: String = fields.iter().map(|(f, _, value)| format!("{f}: {value},")).collect();
    let lane_fields: String = fields
        .iter()
        .map(|(f, ty, _)| {
            format!("#[doc = \"\"] pub {f}: {},", ty.replacen(&format!("{t};"), &format!("[{t}; LANES];"), 1))
        })
        .collect();
    let lane_values: String =
        fields.iter().map(|(f, _, value)| format!("{f}: {},", value.replacen("0.0;", "[0.0; LANES];", 1))).collect();
    let functions: String = [
        ("rates", "q p qd pd"),
        ("coordinate_rates", "q v qd"),
        ("velocities", "q p v"),
        ("momenta", "q v p"),
        ("accelerations", "q v a"),
        ("reactions", "q v reactions"),
        ("mass_matrix", "q m"),
        ("frames", "q v rotation position velocity"),
        ("inverse_dynamics", "q v a tau"),
        ("bias", "q v h"),
        ("jacobians", "q jacobian"),
        ("bias_accelerations", "q v drift"),
        ("derivatives", "q p v pd dv_dq dv_dp dpd_dq dpd_dp"),
        ("momentum_derivatives", "q v p pd dp_dq dp_dv dpd_dq dpd_dv"),
        ("parameter_derivatives", "q p dv_dparams dpd_dparams"),
        ("constraint_residuals", "q residual jacobian"),
        ("project_momenta", "q p v freed sigma"),
        ("position_correction", "q residual dq pivots"),
        ("multipliers", "q v lambda"),
    ]
    .into_iter()
    .map(|(f, arguments)| {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let types: Vec<String> = (0..arguments.len()).map(|k| format!("A{k}")).collect();
        let taken: Vec<String> = arguments.iter().zip(&types).map(|(a, ty)| format!("_{a}: {ty}")).collect();
        format!("#[doc = \"\"] pub fn {f}<{}>(&self, {}) {{}}", types.join(", "), taken.join(", "))
    })
    .collect();
    format!(
        "/// Stands in for a model with errors.
        #[derive(Clone, Debug, PartialEq)]
        pub struct {name} {{ {declared} }}
        #[allow(clippy::all, clippy::pedantic, dead_code)]
        impl {name} {{
            #[doc = \"\"] pub const NQ: usize = {LENGTH};
            #[doc = \"\"] pub const NV: usize = {LENGTH};
            #[doc = \"\"] pub const ROWS: usize = {LENGTH};
            #[doc = \"\"] pub const ENTRIES: usize = {LENGTH};
            #[doc = \"\"] pub const CONSTRAINT_ROWS: [{rt}::system::Row; 0] = [];
            #[doc = \"\"] pub const ENTRY_COLUMNS: [usize; 0] = [];
            #[doc = \"\"] pub const COORDINATES: [&'static str; {LENGTH}] = [\"\"; {LENGTH}];
            #[doc = \"\"] pub const VELOCITIES: [&'static str; {LENGTH}] = [\"\"; {LENGTH}];
            #[doc = \"\"] pub const fn new() -> Self {{ {name} {{ {values} }} }}
            {functions}
            #[doc = \"\"] pub fn energy<A0, A1>(&self, _q: A0, _p: A1) -> [{t}; 2] {{ [0.0; 2] }}
            #[doc = \"\"] pub fn rates_batch<A0, A1, A2, A3, A4>(&self, _q: A0, _p: A1, _tau: A2, _qd: A3, _pd: A4) -> ::core::result::Result<(), {rt}::batch::BatchError> {{
                ::core::result::Result::Ok(())
            }}
            #[doc = \"\"] pub fn lanes<const LANES: usize>(&self) -> {name}Lanes<LANES> {{ {name}Lanes {{ {lane_values} }} }}
        }}
        /// Stands in for several states of a model with errors.
        #[derive(Clone, Debug, PartialEq)]
        pub struct {name}Lanes<const LANES: usize> {{ {lane_fields} }}
        #[allow(clippy::all, clippy::pedantic, dead_code)]
        impl<const LANES: usize> {name}Lanes<LANES> {{
            #[doc = \"\"] pub fn new() -> Self {{ {name}Lanes {{ {lane_values} }} }}
            {functions}
            #[doc = \"\"] pub fn energy<A0, A1>(&self, _q: A0, _p: A1) -> [[{t}; LANES]; 2] {{ [[0.0; LANES]; 2] }}
        }}
        impl ::core::default::Default for {name} {{ fn default() -> Self {{ Self::new() }} }}
        impl {rt}::System for {name} {{
            type Scalar = {t};
            type Coordinates = {array};
            type Momenta = {array};
            fn neutral(&self) -> {array} {{ [0.0; {LENGTH}] }}
            fn zero_momenta(&self) -> {array} {{ [0.0; {LENGTH}] }}
            fn lie_joints(&self) -> &[{rt}::system::LieJoint] {{ &[] }}
            fn rates_at(&mut self, _t: {t}, _q: &{array}, _p: &{array}, _qd: &mut {array}, _pd: &mut {array}) {{}}
            fn coordinate_rates(&self, _q: &{array}, _v: &{array}, _qd: &mut {array}) {{}}
        }}
        impl {rt}::Energetic for {name} {{
            fn energies(&mut self, _q: &{array}, _p: &{array}) -> ({t}, {t}) {{ (0.0, 0.0) }}
        }}
        impl {rt}::Conjugate for {name} {{
            fn conjugate_momenta(&mut self, _q: &{array}, _v: &{array}, _p: &mut {array}) {{}}
        }}
        impl {rt}::Accelerated for {name} {{
            fn generalized_accelerations(&mut self, _q: &{array}, _v: &{array}, _a: &mut {array}) {{}}
        }}
        impl {rt}::Differentiable for {name} {{
            type Square = [{array}; {LENGTH}];
            fn square(&self) -> [{array}; {LENGTH}] {{ [[0.0; {LENGTH}]; {LENGTH}] }}
            fn rate_derivatives(&mut self, _t: {t}, _q: &{array}, _p: &{array}, _out: &mut {rt}::StateDerivatives<{array}, [{array}; {LENGTH}]>) {{}}
        }}
        impl {rt}::Constrained for {name} {{
            type Rows = {array};
            type Entries = {array};
            fn zero_rows(&self) -> {array} {{ [0.0; {LENGTH}] }}
            fn zero_entries(&self) -> {array} {{ [0.0; {LENGTH}] }}
            fn rows(&self) -> &[{rt}::system::Row] {{ &[] }}
            fn entry_columns(&self) -> &[usize] {{ &[] }}
            fn constraint_residuals(&mut self, _q: &{array}, _residual: &mut {array}, _jacobian: &mut {array}) {{}}
            fn project_momenta(&mut self, _t: {t}, _q: &{array}, _p: &mut {array}, _v: &mut {array}, _sigma: &mut {array}) {{}}
            fn position_correction(&mut self, _q: &{array}, _residual: &mut {array}, _dq: &mut {array}, _pivots: &mut {array}) {{}}
            fn multipliers(&mut self, _t: {t}, _q: &{array}, _v: &{array}, _lambda: &mut {array}) {{}}
        }}"
    )
}

//! A substitute for a type that could not be generated, so that its uses cause no further errors.

use mbd_codegen::output::{Dim, Field, Output, Sizes, Spec, COORDINATE_RATES, FIELDS, STRUCTURE};
use mbd_codegen::Options;

/// So large that no index of a real state is out of bounds.
const LENGTH: usize = 1000;

/// A function that takes whatever it is given and returns zeros. An argument whose fields are the results has its type,
/// which `zero()` would lack otherwise.
fn function(spec: &Spec, rt: &str, nested: &dyn Fn(&[Dim], &str) -> String, number: &str, zero: &str) -> String {
    let written = if spec.returned || spec.structure.is_some() { &[] } else { spec.results };
    let arguments = || spec.inputs.iter().chain(written).enumerate();
    let types: String = arguments().map(|(k, _)| format!("A{k}, ")).collect();
    let mut taken: String = arguments().map(|(k, array)| format!("_{}: A{k}, ", array.name)).collect();
    if let Some(structure) = spec.structure {
        let shapes: Vec<String> = spec.shapes().into_iter().map(|dims| nested(dims, number)).collect();
        taken += &format!("_{STRUCTURE}: &mut {rt}::{structure}<{}>", shapes.join(", "));
    }
    let (returned, body) = match spec.results {
        [array] if spec.returned => (format!("-> {}", nested(array.dims, number)), nested(array.dims, zero)),
        _ => Default::default(),
    };
    format!("#[doc = \"\"] pub fn {}<{types}>(&self, {taken}) {returned} {{ {body} }}", spec.name)
}

/// A type with the functions of a generated one that take whatever they are given.
pub fn source(options: &Options) -> String {
    let (name, rt) = (&options.type_name, &options.runtime);
    let t = options.precision.name();
    let array = format!("[{t}; {LENGTH}]");
    let sizes = Sizes { gravity: 3, ..Sizes::uniform(LENGTH) };
    let nested = |dims: &[Dim], entry: &str| {
        dims.iter().rev().fold(entry.to_string(), |inner, dim| format!("[{inner}; {}]", sizes.of(*dim)))
    };
    let declared = |number: &str| -> String {
        let field = |f: &Field| format!("#[doc = \"\"] pub {}: {},", f.array.name, nested(f.array.dims, number));
        FIELDS.iter().map(field).collect()
    };
    let values = |zero: &str| -> String {
        FIELDS.iter().map(|f| format!("{}: {},", f.array.name, nested(f.array.dims, zero))).collect()
    };
    let functions = |number: &str, zero: &str| -> String {
        let specs = Output::ALL.iter().map(|output| output.spec()).chain([COORDINATE_RATES]);
        specs.map(|spec| function(spec, rt, &nested, number, zero)).collect()
    };
    let (lane, lane_zero) = (format!("[{t}; LANES]"), "[0.0; LANES]");
    let (lane_fields, lane_values, lane_functions) = (declared(&lane), values(lane_zero), functions(&lane, lane_zero));
    let (declared, values, functions) = (declared(t), values("0.0"), functions(t, "0.0"));
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
            {lane_functions}
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

//! A unit for model exchange by version 2.0 of the Functional Mock-up Interface: its description, and its sources.

use std::fmt::Write;

use super::files;
use super::names::{literal, Prefix};
use crate::code::Programs;
use crate::emit::fields::{fields, Field};
use crate::emit::Input;
use crate::error::GenerateError;
use crate::model::Model;
use crate::options::{Options, Precision};
use crate::output::Output;
use crate::plan::Plan;
use crate::search;
use crate::symbolic::hash::fingerprint;

/// The text files of a unit. Zipped, with a shared library under `binaries` if there is one, they are the `.fmu`.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fmu {
    /// Its identifier, which is the name of its shared library.
    pub identifier: String,
    /// Paths inside the unit with contents. Those in `sources` that end in `.c` make the shared library.
    pub files: Vec<(String, String)>,
    /// Notices about changes, such as angles that became right angles.
    pub notices: Vec<String>,
}

/// One scalar variable.
struct Variable {
    name: String,
    description: &'static str,
    /// Attributes of the variable, and of its type.
    role: String,
    real: String,
}

/// A unit for model exchange: states `q` and `p`, inputs and parameters those of generated functions, outputs velocities
/// and energies. Of the options, [`Options::outputs`], [`Options::precision`] and [`Options::frames`] have no part in it.
///
/// # Errors
/// Those of [`crate::generate()`].
pub fn fmu(model: &Model, options: &Options) -> Result<Fmu, GenerateError> {
    let outputs = vec![Output::Rates, Output::Velocities, Output::Energy];
    let options = Options { outputs, precision: Precision::F64, frames: Vec::new(), ..options.clone() };
    let plan = &search::plan(model, options.searches());
    if options.modes.is_some() {
        return Err(GenerateError::ModesNeedRust);
    }
    let programs = Programs::new(plan, &options)?;
    let input = Input { plan, options: &options, programs: &programs };
    let prefix = Prefix::new(&options.type_name);
    let identifier = prefix.lower.clone();
    let (header, source) = files(&input, &identifier);
    let fields = fields(plan, &programs.sizes);
    let variables = variables(plan, &fields);
    let texts = [&header, &source, &described(&identifier, "", &variables, plan)];
    let guid = format!("{:016x}", fingerprint(texts.into_iter().flat_map(|text| text.bytes())));
    let files = vec![
        ("modelDescription.xml".to_string(), described(&identifier, &guid, &variables, plan)),
        (format!("sources/{identifier}.c"), source),
        (format!("sources/{identifier}.h"), header),
        (format!("sources/{}", wrapper_file(&identifier)), wrapper(&prefix, &guid, plan, &fields)),
    ];
    Ok(Fmu { identifier, files, notices: plan.notices.clone() })
}

/// Coordinates and momenta at the start: those of the model, with no momentum.
fn start(plan: &Plan) -> Vec<f64> {
    plan.start().into_iter().chain(vec![0.0; plan.dims.nv]).collect()
}

/// Values of the inputs at the start, in the order of the struct.
fn given(fields: &[Field]) -> Vec<f64> {
    fields.iter().flat_map(Field::values).collect()
}

/// The variables in the order of their value references.
fn variables(plan: &Plan, fields: &[Field]) -> Vec<Variable> {
    let named =
        |letter: &str, names: &[String]| names.iter().map(|name| format!("{letter}.{name}")).collect::<Vec<_>>();
    let (q, v) = (plan.coordinate_names(), plan.velocity_names());
    let states = [named("q", &q), named("p", &v)].concat();
    let mut all = Vec::new();
    for (k, (name, x)) in states.iter().zip(start(plan)).enumerate() {
        let description = if k < q.len() { "Coordinate, rad or m" } else { "Momentum, SI units" };
        let role = "causality=\"local\" variability=\"continuous\" initial=\"exact\"".to_string();
        all.push(Variable { name: name.clone(), description, role, real: format!(" start=\"{x:?}\"") });
    }
    let calculated =
        |causality: &str| format!("causality=\"{causality}\" variability=\"continuous\" initial=\"calculated\"");
    for (k, name) in states.iter().enumerate() {
        let (name, real) = (format!("der({name})"), format!(" derivative=\"{}\"", k + 1));
        all.push(Variable { name, description: "Rate of a state", role: calculated("local"), real });
    }
    for field in fields {
        for (k, x) in field.values().into_iter().enumerate() {
            let name = match field.name {
                "tau" => format!("tau.{}", v[k]),
                "params" => format!("params.{}", plan.model.params[k].name),
                "wrenches" => format!("wrenches.{}[{}]", plan.model.wrenches[k / 6].name, k % 6),
                name => format!("{name}[{k}]"),
            };
            let role = match field.name {
                "params" => "causality=\"parameter\" variability=\"fixed\" initial=\"exact\"",
                _ => "causality=\"input\" variability=\"continuous\"",
            };
            let (role, real) = (role.to_string(), format!(" start=\"{x:?}\""));
            all.push(Variable { name, description: field.doc, role, real });
        }
    }
    let outputs = named("v", &v).into_iter().map(|name| (name, "Velocity, rad/s or m/s"));
    let energies = [("energy.kinetic", "Kinetic energy, J"), ("energy.potential", "Potential energy, J")];
    let energies = energies.into_iter().map(|(name, description)| (name.to_string(), description));
    all.extend(outputs.chain(energies).map(|(name, description)| Variable {
        name,
        description,
        role: calculated("output"),
        real: String::new(),
    }));
    all
}

/// `modelDescription.xml`.
fn described(identifier: &str, guid: &str, variables: &[Variable], plan: &Plan) -> String {
    let (states, version) = (plan.dims.nq + plan.dims.nv, env!("CARGO_PKG_VERSION"));
    let outputs = variables.len() - plan.dims.nv - 2..variables.len();
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>
<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{}\" guid=\"{guid}\" generationTool=\"mbd {version}\" \
         variableNamingConvention=\"flat\" numberOfEventIndicators=\"0\">
  <ModelExchange modelIdentifier=\"{identifier}\">
    <SourceFiles>
      <File name=\"{identifier}.c\"/>
      <File name=\"{}\"/>
    </SourceFiles>
  </ModelExchange>
  <ModelVariables>
",
        escaped(&plan.model.name),
        wrapper_file(identifier)
    );
    for (k, Variable { name, description, role, real }) in variables.iter().enumerate() {
        let (name, description) = (escaped(name), escaped(description));
        let _ = writeln!(
            out,
            "    <ScalarVariable name=\"{name}\" valueReference=\"{k}\" description=\"{description}\" {role}><Real{real}/></ScalarVariable>"
        );
    }
    out += "  </ModelVariables>\n  <ModelStructure>\n";
    let mut list = |name: &str, indices: &[usize]| {
        let _ = writeln!(out, "    <{name}>");
        for k in indices {
            let _ = writeln!(out, "      <Unknown index=\"{}\"/>", k + 1);
        }
        let _ = writeln!(out, "    </{name}>");
    };
    let (outputs, rates): (Vec<usize>, Vec<usize>) = (outputs.collect(), (states..2 * states).collect());
    list("Outputs", &outputs);
    if !rates.is_empty() {
        list("Derivatives", &rates);
    }
    list("InitialUnknowns", &[rates, outputs].concat());
    out + "  </ModelStructure>\n</fmiModelDescription>\n"
}

fn escaped(text: &str) -> String {
    let character = |c: char| match c {
        '&' => "&amp;".to_string(),
        '<' => "&lt;".to_string(),
        '>' => "&gt;".to_string(),
        '"' => "&quot;".to_string(),
        // XML 1.0 has no control characters.
        c if c.is_control() => "?".to_string(),
        c => c.to_string(),
    };
    text.chars().map(character).collect()
}

/// The file of the functions of the standard, beside that of the model.
fn wrapper_file(identifier: &str) -> &'static str {
    match identifier {
        "fmi2" => "fmi2_functions.c",
        _ => "fmi2.c",
    }
}

/// The functions of the standard.
fn wrapper(prefix: &Prefix, guid: &str, plan: &Plan, fields: &[Field]) -> String {
    let list = |values: Vec<f64>| {
        // C has no empty initialisers.
        let values = values.into_iter().chain([0.0]).map(|x| literal(x, Precision::F64));
        values.collect::<Vec<_>>().join(", ")
    };
    let given = given(fields);
    [
        ("PREFIX", prefix.lower.clone()),
        ("GUID", guid.to_string()),
        ("NQ", plan.dims.nq.to_string()),
        ("NV", plan.dims.nv.to_string()),
        ("INPUTS", given.len().to_string()),
        ("STATE", list(start(plan))),
        ("GIVEN", list(given)),
    ]
    .iter()
    .fold(include_str!("fmi2.c").to_string(), |text, (word, by)| text.replace(&format!("@{word}@"), by))
}

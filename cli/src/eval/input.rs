//! Reads the states. All findings of a file are reported at once, each with the index of its state and its key.

use multibody::codegen::model::Gravity;
use multibody::codegen::plan::Plan;
use multibody::codegen::words;
use multibody::runtime::Interpreter;
use serde_json::{Map, Value};

use super::outer::{Outer, Unit};
use crate::json::Unique;
use crate::verdict::UNIT;

/// The contents of the file.
pub struct Inputs {
    /// Run-time parameters of the model.
    pub params: Vec<f64>,
    /// What was changed in the states, with its place.
    pub warnings: Vec<Finding>,
    /// The states.
    pub states: Vec<State>,
}

/// One state, in this program's layout.
pub struct State {
    /// Coordinates.
    pub q: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Accelerations for inverse dynamics, in the layout of the file.
    pub a: Vec<f64>,
    tau: Vec<f64>,
    drive_q: Option<Vec<f64>>,
    drive_v: Vec<f64>,
    drive_a: Vec<f64>,
    wrenches: Vec<f64>,
    gravity: Option<[f64; 3]>,
}

impl State {
    /// Sets the inputs of the interpreter.
    pub fn apply(&self, interpreter: &mut Interpreter<f64>) {
        let inputs = interpreter;
        inputs.tau.copy_from_slice(&self.tau);
        if let Some(q) = &self.drive_q {
            inputs.drive_q.copy_from_slice(q);
        }
        inputs.drive_v.copy_from_slice(&self.drive_v);
        inputs.drive_a.copy_from_slice(&self.drive_a);
        for (to, from) in inputs.wrenches.iter_mut().zip(self.wrenches.chunks(6)) {
            to.copy_from_slice(from);
        }
        if let Some(gravity) = self.gravity {
            inputs.gravity = gravity;
        }
    }
}

/// A finding: place in the file, what is wrong, what to do.
pub type Finding = (String, String, String);

/// Allowed difference of the length of a quaternion or a cosine-sine pair from one, for numbers with few decimals: they
/// are scaled to unit length. Above [`UNIT`], that is reported.
const UNIT_TOLERANCE: f64 = 1e-6;
/// Differences of the length from one that are roundings: such numbers are taken as they stand.
const UNIT_ROUNDING: f64 = 4.0 * f64::EPSILON;

const SHAPE: &str = "write {\"states\": [{\"q\": [..], \"v\": [..], \"tau\": [..]}, ..]}";

/// Parses the text.
pub fn read(text: &str, plan: &Plan, outer: &Outer) -> Result<Inputs, Vec<Finding>> {
    let Unique(value) = serde_json::from_str(text).map_err(|e| {
        let what = e.to_string();
        let what = what.split(" at line ").next().unwrap_or(&what).to_string();
        vec![(format!(":{}:{}", e.line(), e.column()), what, "correct the JSON".to_string())]
    })?;
    let mut reader = Reader { plan, outer, drives: Outer::drives(plan), findings: Vec::new(), warnings: Vec::new() };
    let inputs = reader.file(&value);
    match (inputs, reader.findings.is_empty()) {
        (Some(inputs), true) => Ok(Inputs { warnings: reader.warnings, ..inputs }),
        _ => Err(reader.findings),
    }
}

struct Reader<'a> {
    plan: &'a Plan,
    outer: &'a Outer,
    drives: Outer,
    findings: Vec<Finding>,
    warnings: Vec<Finding>,
}

/// What a list of numbers stands for.
struct Wanted<'a> {
    key: &'static str,
    names: &'a [String],
    required: bool,
}

impl Reader<'_> {
    fn error(&mut self, place: &str, what: String, help: impl Into<String>) {
        self.findings.push((format!(": {place}"), what, help.into()));
    }

    fn keys(&mut self, place: &str, object: &Map<String, Value>, known: &[&str]) {
        for key in object.keys().filter(|k| !known.contains(&k.as_str())) {
            let help = words::did_you_mean(key, known.iter().copied(), || {
                format!("known here are {}", words::list(known.iter().copied()))
            });
            self.error(place, format!("unknown key {}", words::quote(key)), help);
        }
    }

    fn file(&mut self, value: &Value) -> Option<Inputs> {
        let Value::Object(object) = value else {
            self.error("the file", "not an object".into(), SHAPE);
            return None;
        };
        self.keys("the file", object, &["states", "params"]);
        let params = self.params(object.get("params"));
        let Some(Value::Array(list)) = object.get("states") else {
            self.error("states", "no list of states".into(), SHAPE);
            return None;
        };
        let states: Vec<Option<State>> = list.iter().enumerate().map(|(k, s)| self.state(k, s)).collect();
        Some(Inputs { params, warnings: Vec::new(), states: states.into_iter().collect::<Option<_>>()? })
    }

    fn params(&mut self, value: Option<&Value>) -> Vec<f64> {
        let mut params = self.plan.default_params();
        let object = match value {
            None => return params,
            Some(Value::Object(object)) => object,
            Some(_) => {
                self.error("params", "not an object".into(), "write {\"name\": number, ..}");
                return params;
            }
        };
        let names: Vec<&str> = self.plan.params().iter().map(|p| p.name.as_str()).collect();
        self.keys("params", object, &names);
        for (param, name) in params.iter_mut().zip(&names) {
            match object.get(*name).map(Value::as_f64) {
                Some(Some(x)) => *param = x,
                Some(None) => self.error(&format!("params.{name}"), "not a number".into(), "write a number"),
                None => {}
            }
        }
        params
    }

    fn state(&mut self, k: usize, value: &Value) -> Option<State> {
        let place = format!("states[{k}]");
        let Value::Object(object) = value else {
            self.error(&place, "not an object".into(), SHAPE);
            return None;
        };
        let known = ["q", "v", "a", "tau", "wrenches", "drive_q", "drive_v", "drive_a", "gravity"];
        self.keys(&place, object, &known);
        let before = self.findings.len();
        let (plan, outer) = (self.plan, self.outer);
        let (drive_q_names, drive_v_names) = (self.drives.q_names.clone(), self.drives.v_names.clone());
        let mut list = |key, names: &[String], required| {
            let wanted = Wanted { key, names, required };
            self.numbers(&place, object, &wanted)
        };
        let mut q = list("q", &outer.q_names, true);
        let v = list("v", &outer.v_names, true);
        let a = list("a", &outer.v_names, false);
        let tau = list("tau", &outer.v_names, false);
        let mut drive_q = list("drive_q", &drive_q_names, false);
        let drive_v = list("drive_v", &drive_v_names, false);
        let drive_a = list("drive_a", &drive_v_names, false);
        let gravity = self.gravity(&place, object);
        let wrenches = self.wrenches(&place, object);
        if let Some(q) = &mut q {
            self.units(&format!("{place}.q"), q, outer.units());
        }
        if let Some(q) = &mut drive_q {
            self.units(&format!("{place}.drive_q"), q, self.drives.units());
        }
        if self.findings.len() > before {
            return None;
        }
        let q = outer.q_from(&q?, plan.dims.nq);
        let zeros = |n: usize| vec![0.0; n];
        Some(State {
            v: outer.v_from(&q, &v?),
            a: a.unwrap_or_else(|| zeros(plan.dims.nv)),
            tau: outer.v_from(&q, &tau.unwrap_or_else(|| zeros(plan.dims.nv))),
            drive_q,
            drive_v: drive_v.unwrap_or_else(|| zeros(plan.dims.drive_v)),
            drive_a: drive_a.unwrap_or_else(|| zeros(plan.dims.drive_v)),
            wrenches,
            gravity,
            q,
        })
    }

    fn numbers(&mut self, place: &str, object: &Map<String, Value>, wanted: &Wanted) -> Option<Vec<f64>> {
        let place = format!("{place}.{}", wanted.key);
        let n = wanted.names.len();
        let help = match n {
            0 => format!("the model has none: leave `{}` empty or out", wanted.key),
            _ => format!("in order: {}", wanted.names.join(", ")),
        };
        let Some(value) = object.get(wanted.key) else {
            if wanted.required {
                self.error(&place, format!("missing: expected {n} numbers"), help);
            }
            return None;
        };
        let numbers = match value {
            Value::Array(list) => list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>(),
            _ => None,
        };
        let Some(numbers) = numbers else {
            self.error(&place, format!("not a list of numbers: expected {n}"), help);
            return None;
        };
        if numbers.len() != n {
            self.error(&place, format!("{} numbers, expected {n}", numbers.len()), help);
            return None;
        }
        Some(numbers)
    }

    fn gravity(&mut self, place: &str, object: &Map<String, Value>) -> Option<[f64; 3]> {
        let input = self.plan.model.gravity == Gravity::Input;
        if !input && object.contains_key("gravity") {
            let help = "leave it out, use --gravity, or write gravity = \"input\" in the model";
            self.error(&format!("{place}.gravity"), "gravity is no input of this model".into(), help);
            return None;
        }
        let names = ["x", "y", "z"].map(String::from);
        let given = self.numbers(place, object, &Wanted { key: "gravity", names: &names, required: false });
        let given = given.and_then(|g| g.try_into().ok());
        // The default values of these fields in generated code.
        input.then(|| given.unwrap_or([0.0, 0.0, -9.81]))
    }

    fn wrenches(&mut self, place: &str, object: &Map<String, Value>) -> Vec<f64> {
        let names: Vec<&str> = self.plan.model.wrenches.iter().map(|w| w.name.as_str()).collect();
        let zeros = vec![0.0; 6 * names.len()];
        let Some(value) = object.get("wrenches") else { return zeros };
        let six = |v: &Value| -> Option<Vec<f64>> {
            let list = v.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>()?;
            (list.len() == 6).then_some(list)
        };
        let flat = value.as_array().and_then(|list| list.iter().map(six).collect::<Option<Vec<_>>>());
        match flat {
            Some(list) if list.len() == names.len() => list.concat(),
            _ => {
                let n = names.len();
                let help = match n {
                    0 => "the model has no external wrenches: leave `wrenches` out".to_string(),
                    _ => format!("one list [force x, y, z, moment x, y, z] for each of {}", words::list(names)),
                };
                self.error(&format!("{place}.wrenches"), format!("expected {n} lists of 6 numbers"), help);
                zeros
            }
        }
    }

    /// Scales quaternions and cosine-sine pairs to unit length. Those that are far from it are findings: their results
    /// would be meaningless.
    fn units(&mut self, place: &str, q: &mut [f64], units: Vec<Unit>) {
        for unit in units {
            let numbers = &mut q[unit.at..unit.at + unit.len];
            let norm = numbers.iter().fold(0.0_f64, |n, x| n.hypot(*x));
            let off = (norm - 1.0).abs();
            if off > UNIT_TOLERANCE {
                let help = format!("scale {} to unit length", unit.what);
                self.error(place, format!("{} has length {norm}, expected 1", unit.what), help);
            } else if off > UNIT_ROUNDING {
                numbers.iter_mut().for_each(|x| *x /= norm);
                if off > UNIT {
                    let what = format!("{} has length {norm}; it is scaled to unit length", unit.what);
                    self.warnings.push((format!(": {place}"), what, "give more digits".to_string()));
                }
            }
        }
    }
}

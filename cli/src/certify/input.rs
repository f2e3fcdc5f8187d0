//! Reads a box of states: numbers, or pairs of a lower and an upper bound.

use std::path::Path;

use multibody::codegen::plan::Plan;
use multibody::codegen::words;
use multibody::runtime::interval::Interval;
use serde_json::Value;

use crate::json::Unique;
use crate::output::note;
use crate::{source, Failure, Outcome};

const SHAPE: &str =
    "write {\"q\": [0.1, [-1, 1], ..], \"v\": [..], \"tau\": [..], \"a\": [..]}: numbers, or [low, high]";

/// A state with its inputs over any scalar.
pub struct Values<S> {
    /// Coordinates.
    pub q: Vec<S>,
    /// Velocities.
    pub v: Vec<S>,
    /// Joint forces.
    pub tau: Vec<S>,
    /// Accelerations, for inverse dynamics.
    pub a: Vec<S>,
}

/// A box of states.
pub type Region = Values<Interval>;

impl<S: Copy> Values<S> {
    /// The four lists.
    pub fn lists(&self) -> [&Vec<S>; 4] {
        [&self.q, &self.v, &self.tau, &self.a]
    }

    /// The four lists, to be changed.
    pub fn lists_mut(&mut self) -> [&mut Vec<S>; 4] {
        [&mut self.q, &mut self.v, &mut self.tau, &mut self.a]
    }

    /// Every number taken to another scalar.
    pub fn values<R>(&self, mut of: impl FnMut(S) -> R) -> Values<R> {
        let mut list = |x: &Vec<S>| x.iter().map(|x| of(*x)).collect();
        Values { q: list(&self.q), v: list(&self.v), tau: list(&self.tau), a: list(&self.a) }
    }
}

impl Region {
    /// Whether it is a single state.
    pub fn is_point(&self) -> bool {
        self.lists().into_iter().flatten().all(|x| x.low() == x.high())
    }
}

/// Reads and checks a box. All findings of the file are reported at once.
pub fn read(path: &Path, plan: &Plan) -> Outcome<Region> {
    let (name, text) = source::json(path)?;
    let Unique(value) = serde_json::from_str(&text)
        .map_err(|e| Failure::new(format!("{name}:{}:{}: not JSON: {e}", e.line(), e.column()), SHAPE))?;
    let Value::Object(object) = &value else {
        return Err(Failure::new(format!("{name}: not an object"), SHAPE));
    };
    let mut findings: Vec<(String, String, String)> = Vec::new();
    let known = ["q", "v", "tau", "a"];
    for key in object.keys().filter(|key| !known.contains(&key.as_str())) {
        let help = words::did_you_mean(key, known, || SHAPE.to_string());
        findings.push((name.clone(), format!("unknown key {}", words::quote(key)), help));
    }
    let (coordinates, velocities) = (plan.coordinate_names(), plan.velocity_names());
    let mut list = |key: &str, names: &[String]| -> Vec<Interval> {
        let in_order = || format!("in order: {}", names.join(", "));
        match object.get(key) {
            None if key == "q" => {
                findings.push((name.clone(), "`q` is missing".to_string(), in_order()));
                Vec::new()
            }
            None => vec![Interval::point(0.0); names.len()],
            Some(Value::Array(list)) if list.len() == names.len() => {
                let sides = list.iter().zip(names).map(|(x, of)| {
                    side(x).unwrap_or_else(|| {
                        let what = format!("{key}: `{of}` is {x}, neither a number nor [low, high]");
                        findings.push((name.clone(), what, "give the lower bound first, both finite".to_string()));
                        Interval::point(0.0)
                    })
                });
                sides.collect()
            }
            Some(other) => {
                let what = match other.as_array() {
                    Some(list) => format!("{key}: {} entries, expected {}", list.len(), names.len()),
                    None => format!("{key}: not a list"),
                };
                findings.push((name.clone(), what, in_order()));
                Vec::new()
            }
        }
    };
    let region = Region {
        q: list("q", &coordinates),
        v: list("v", &velocities),
        tau: list("tau", &velocities),
        a: list("a", &velocities),
    };
    for (place, what, help) in &findings {
        note(format_args!("{place}: error: {what}\n  help: {help}"));
    }
    if findings.is_empty() {
        Ok(region)
    } else {
        Err(Failure::Shown)
    }
}

fn side(value: &Value) -> Option<Interval> {
    match value {
        Value::Array(pair) => match &pair[..] {
            [low, high] => Interval::new(low.as_f64()?, high.as_f64()?),
            _ => None,
        },
        value => value.as_f64().and_then(|x| Interval::new(x, x)),
    }
}

//! Numbers with parameters resolved, and suspicions about their units.

use crate::import::raw::{RawModel, RawNumber, RawParam, RawPlacement, RawRotation, RawValue, RawVec3};
use crate::import::source::{Findings, Spanned};
use crate::import::words::{did_you_mean, quote};
use crate::model::{Param, Placement, Rotation, Unit, Value};
use crate::rounded_once::norm;
use std::collections::HashMap;

/// Beyond this, products of a few numbers leave the range of a double, or the number itself that of an `f32`.
const LARGEST: f64 = 1e30;

/// What a number measures, for suspicions about its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Radians.
    Angle,
    /// Metres.
    Length,
    /// Kilograms.
    Mass,
    /// Metres per radian.
    Pitch,
    /// Nothing to suspect.
    Plain,
}

impl From<Unit> for Quantity {
    fn from(unit: Unit) -> Quantity {
        match unit {
            Unit::Metre => Quantity::Length,
            Unit::Radian => Quantity::Angle,
            Unit::One => Quantity::Plain,
        }
    }
}

impl Quantity {
    /// Why nothing can be computed with the constant `x`.
    fn is_beyond(self, x: f64) -> Option<String> {
        let x = x.abs();
        if x > LARGEST {
            Some(format!("{x:e} is beyond what can be computed with"))
        } else if self == Quantity::Mass && x > 0.0 && x < 1.0 / LARGEST {
            Some(format!("{x:e} kg is beyond what can be computed with"))
        } else {
            None
        }
    }

    /// Why the constant `x` looks like one in another unit, and what to write.
    fn suspicion(self, x: f64) -> Option<(String, String)> {
        let x = x.abs();
        // A little over a turn is a turn written with few digits.
        if self == Quantity::Angle && x > 1.00001 * std::f64::consts::TAU {
            let help = format!("angles are in radians; in a TOML model {x} degrees are written `{{ deg = {x} }}`");
            Some((format!("{x} is more than a full turn"), help))
        } else if self == Quantity::Length && x > 100.0 {
            Some((format!("{x} m is very long"), format!("lengths are in metres: {x} mm is {} m", x / 1000.0)))
        } else if self == Quantity::Mass && x > 1e5 {
            Some((format!("{x} kg is very heavy"), format!("masses are in kilograms: {x} g is {} kg", x / 1000.0)))
        } else if self == Quantity::Pitch && x > 1.0 {
            let help = "the pitch is in metres per radian: a lead of 5 mm per turn is 0.005 / (2 pi) = 0.000796";
            Some((format!("{x} m per radian is very steep"), help.into()))
        } else {
            None
        }
    }
}

/// The parameters of a model and which of them were used.
pub(super) struct Numbers<'r, 'f, 't> {
    params: &'r [RawParam],
    index: HashMap<&'r str, usize>,
    used: Vec<bool>,
    pub(super) findings: &'f mut Findings<'t>,
}

impl<'r, 'f, 't> Numbers<'r, 'f, 't> {
    pub(super) fn new(raw: &'r RawModel, findings: &'f mut Findings<'t>) -> Self {
        let mut index = HashMap::new();
        for (k, p) in raw.params.iter().enumerate() {
            index.entry(p.name.value.as_str()).or_insert(k);
        }
        Numbers { params: &raw.params, index, used: vec![false; raw.params.len()], findings }
    }

    /// A number resolved; NaN stands for what was reported, which compares as nothing and so raises no more findings.
    pub(super) fn value(&mut self, number: &RawNumber, quantity: Quantity, what: &str) -> Value {
        match &number.value {
            RawValue::Invalid => Value::Const(f64::NAN),
            RawValue::Const(x) => {
                if let Some(message) = quantity.is_beyond(*x) {
                    let help = format!("write a number in SI units of at most {LARGEST:e}; a mass may also be 0");
                    self.findings.error(number.span, format!("{what}: {message}"), help);
                    return Value::Const(f64::NAN);
                }
                if let Some((message, help)) = quantity.suspicion(*x) {
                    self.findings.warning(number.span, format!("{what}: {message}"), help);
                }
                Value::Const(*x)
            }
            RawValue::Param(name) => {
                if let Some(&k) = self.index.get(name.as_str()) {
                    self.used[k] = true;
                    return Value::Param(k);
                }
                let help = did_you_mean(name, self.params.iter().map(|p| p.name.value.as_str()), || {
                    format!("declare it with its default under `[params]`: {}", quote(&format!("{name} = 0.0")))
                });
                self.findings.error(number.span, format!("{what}: {} is not a parameter", quote(name)), help);
                Value::Const(f64::NAN)
            }
        }
    }

    pub(super) fn or_zero<'n>(
        &mut self,
        number: impl Into<Option<&'n RawNumber>>,
        quantity: Quantity,
        what: &str,
    ) -> Value {
        number.into().map_or(Value::ZERO, |n| self.value(n, quantity, what))
    }

    /// A number that no parameter may replace; `help` says what to write instead. NaN for what was reported.
    pub(super) fn constant(&mut self, number: &RawNumber, quantity: Quantity, what: &str, help: &str) -> f64 {
        if let RawValue::Param(_) = number.value {
            self.findings.error(number.span, format!("{what} cannot depend on a parameter"), help);
            return f64::NAN;
        }
        self.value(number, quantity, what).constant().unwrap_or(f64::NAN)
    }

    pub(super) fn vec3(&mut self, list: &RawVec3, quantity: Quantity, what: &str) -> [Value; 3] {
        [0, 1, 2].map(|k| self.value(&list.value[k], quantity, what))
    }

    pub(super) fn rotation(&mut self, rotation: &RawRotation, what: &str) -> Rotation {
        match rotation {
            RawRotation::Rpy(rpy) => Rotation::Rpy(self.vec3(rpy, Quantity::Angle, what)),
            RawRotation::AxisAngle { axis, angle } => {
                let angle = self.value(angle, Quantity::Angle, what);
                let axis = axis.as_ref().and_then(|axis| self.direction(axis, &format!("{what}: axis of rotation")));
                Rotation::AxisAngle { axis: axis.unwrap_or([0.0, 0.0, 1.0]), angle }
            }
        }
    }

    pub(super) fn placement(&mut self, placement: &RawPlacement, what: &str) -> Placement {
        let xyz = placement.xyz.as_ref().map(|v| self.vec3(v, Quantity::Length, &format!("{what}: origin")));
        let rotation = placement.rotation.as_ref().map(|r| self.rotation(r, &format!("{what}: orientation")));
        Placement { xyz: xyz.unwrap_or([Value::ZERO; 3]), rotation: rotation.unwrap_or(Rotation::NONE) }
    }

    /// A direction that can be scaled to unit length.
    pub(super) fn direction(&mut self, axis: &Spanned<[f64; 3]>, what: &str) -> Option<[f64; 3]> {
        // Far outside this range squares leave the range of an f64 (or an f32).
        let problem = match norm(axis.value) {
            0.0 => "is zero and so has no direction",
            n if n < 1e-9 => "is too short to be a direction",
            n if n < 1e9 => return Some(axis.value),
            _ => "is too long to be a direction",
        };
        self.findings.error(
            axis.span,
            format!("{what} {problem}"),
            "write a direction such as `0 0 1`; it need not have unit length",
        );
        None
    }

    /// Value at the defaults of the parameters.
    pub(super) fn at_default(&self, value: Value) -> f64 {
        match value {
            Value::Const(x) => x,
            Value::Param(k) => default_of(&self.params[k]),
        }
    }

    pub(super) fn params(&self) -> Vec<Param> {
        self.params.iter().map(|p| Param { name: p.name.value.clone(), default: default_of(p) }).collect()
    }

    /// Unused parameters; where there are errors their users may be among what could not be read.
    pub(super) fn report_unused(&mut self) {
        if self.findings.has_errors() {
            return;
        }
        for (p, _) in self.params.iter().zip(&self.used).filter(|(_, used)| !**used) {
            let name = &p.name.value;
            let message = format!("parameter {} is not used", quote(name));
            let help = format!("remove it, or use it: {}", quote(&format!("mass = {{ param = \"{name}\" }}")));
            self.findings.unused(p.name.span, message, help);
        }
    }
}

fn default_of(param: &RawParam) -> f64 {
    match param.default.value {
        RawValue::Const(x) => x,
        _ => f64::NAN,
    }
}

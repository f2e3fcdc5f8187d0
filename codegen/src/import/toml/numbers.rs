//! Numbers: constants, parameters, degrees; alone and in lists.

use ::toml::de::{DeInteger, DeTable, DeValue};
use ::toml::Spanned as Toml;

use super::super::raw::{RawFreedoms, RawNumber, RawValue, RawVec3};
use super::super::source::{Findings, Span, Spanned};
use super::table::{type_name, Table};

/// Whether a number may be in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    /// An angle, which may.
    Angle,
    /// Anything else.
    Plain,
}

impl Unit {
    /// The one for numbers with `unit`.
    pub(super) fn of(unit: crate::model::Unit) -> Unit {
        match unit {
            crate::model::Unit::Radian => Unit::Angle,
            crate::model::Unit::Metre | crate::model::Unit::One => Unit::Plain,
        }
    }
}

/// A number in one of its three forms. `what` names it, as in ``body `arm`: `mass` ``.
pub(super) fn number(value: &Toml<DeValue>, unit: Unit, what: &str, findings: &mut Findings) -> RawNumber {
    let span: Span = value.span().into();
    let found = match value.get_ref() {
        DeValue::Table(t) => wrapped(t, span, unit, what, findings),
        plain => constant(plain, span, what, findings),
    };
    Spanned::new(found, span)
}

/// Default of a parameter: a constant, degrees allowed.
pub(super) fn default_value(value: &Toml<DeValue>, what: &str, findings: &mut Findings) -> RawNumber {
    let found = number(value, Unit::Angle, what, findings);
    if let RawValue::Param(_) = found.value {
        findings.error(found.span, format!("{what}: a default cannot be a parameter"), "write a number");
        return Spanned::new(RawValue::Invalid, found.span);
    }
    found
}

/// `{ param = "x" }` or `{ deg = 90 }`.
fn wrapped(t: &DeTable, span: Span, unit: Unit, what: &str, findings: &mut Findings) -> RawValue {
    let table = Table::new(t, span, what.to_string());
    let known = ["param", "deg"];
    table.reject_unknown(&known, "a number", findings);
    match (table.get("param"), table.get("deg")) {
        (Some(_), None) => table.text("param", findings).map_or(RawValue::Invalid, |name| RawValue::Param(name.value)),
        (None, Some((at, _))) if unit == Unit::Plain => {
            findings.error(at, format!("{what} is not an angle"), "write it without `deg`, in SI units");
            RawValue::Invalid
        }
        (None, Some((at, inner))) => degrees(inner, at, what, findings),
        (Some(_), Some((at, _))) => {
            findings.error(at, format!("{what}: `param` and `deg` together"), PARAM_IN_DEGREES);
            RawValue::Invalid
        }
        (None, None) => {
            if t.is_empty() {
                findings.error(span, format!("{what} is an empty table"), "write a number, or `{ param = \"name\" }`");
            }
            RawValue::Invalid
        }
    }
}

const PARAM_IN_DEGREES: &str =
    "a parameter is in radians: write `{ param = \"name\" }` alone, and its default as `{ deg = .. }` under [params]";

fn degrees(inner: &DeValue, span: Span, what: &str, findings: &mut Findings) -> RawValue {
    match inner {
        DeValue::Table(_) => {
            findings.error(span, format!("{what}: `deg` takes a number only"), PARAM_IN_DEGREES);
            RawValue::Invalid
        }
        DeValue::Array(_) => {
            findings.error(span, format!("{what} is one angle, not a list"), "write `{ deg = 90 }`");
            RawValue::Invalid
        }
        plain => match constant(plain, span, what, findings) {
            RawValue::Const(x) => RawValue::Const(x.to_radians()),
            other => other,
        },
    }
}

fn constant(value: &DeValue, span: Span, what: &str, findings: &mut Findings) -> RawValue {
    let x = match value {
        DeValue::Float(f) => f.as_str().parse().ok(),
        DeValue::Integer(i) => integer(i),
        other => {
            let help = match other {
                DeValue::String(s) if s.trim().parse::<f64>().is_ok() => "remove the quotes",
                DeValue::String(_) => "write a number, or `{ param = \"name\" }` for a run-time parameter",
                DeValue::Array(_) => "write a single number",
                _ => "write a number",
            };
            findings.error(span, format!("{what} must be a number, not {}", type_name(other)), help);
            return RawValue::Invalid;
        }
    };
    match x {
        Some(x) if f64::is_finite(x) => RawValue::Const(x),
        _ => {
            findings.error(span, format!("{what} is not a finite number"), "write a finite number");
            RawValue::Invalid
        }
    }
}

fn integer(i: &DeInteger) -> Option<f64> {
    match i.radix() {
        10 => i.as_str().parse().ok(),
        radix => i128::from_str_radix(i.as_str(), radix).ok().map(|x| x as f64),
    }
}

/// A list of numbers, each on its own or, for angles, `{ deg = [..] }` as a whole. `None` if it is no list (reported).
pub(super) fn numbers(
    value: &Toml<DeValue>,
    units: &[Unit],
    what: &str,
    findings: &mut Findings,
) -> Option<Vec<RawNumber>> {
    let unit_of = |k: usize| units.get(k).or(units.last()).copied().unwrap_or(Unit::Plain);
    let span: Span = value.span().into();
    match value.get_ref() {
        DeValue::Array(items) => {
            let each = items.iter().enumerate().map(|(k, item)| number(item, unit_of(k), what, findings));
            Some(each.collect())
        }
        DeValue::Table(t) if t.contains_key("deg") => {
            let table = Table::new(t, span, what.to_string());
            table.reject_unknown(&["deg"], "a list in degrees", findings);
            let inner = table.raw("deg")?;
            let DeValue::Array(items) = inner.get_ref() else {
                findings.error(
                    inner.span().into(),
                    format!("{what}: `deg` must be a list here"),
                    "write `{ deg = [0, 90, 0] }`",
                );
                return None;
            };
            if units.contains(&Unit::Plain) {
                findings.error(
                    span,
                    format!("{what} holds numbers that are not angles"),
                    "write `{ deg = .. }` around each angle",
                );
                return None;
            }
            let one = |item: &Toml<DeValue>| {
                let at: Span = item.span().into();
                Spanned::new(degrees(item.get_ref(), at, what, findings), at)
            };
            Some(items.iter().map(one).collect())
        }
        DeValue::Table(t) if t.contains_key("param") => {
            findings.error(
                span,
                format!("{what} is a list, and a parameter is one number"),
                "name a parameter for each component: `[0, 0, { param = \"name\" }]`",
            );
            None
        }
        other => {
            let message = format!("{what} must be a list of numbers, not {}", type_name(other));
            findings.error(span, message, "write the numbers in brackets: `[0, 0, 1]`");
            None
        }
    }
}

/// Three numbers.
pub(super) fn vec3(value: &Toml<DeValue>, unit: Unit, what: &str, findings: &mut Findings) -> Option<RawVec3> {
    let list = numbers(value, &[unit], what, findings)?;
    let count = list.len();
    match <[RawNumber; 3]>::try_from(list) {
        Ok(three) => Some(Spanned::new(three, value.span())),
        Err(_) => {
            findings.error(value.span().into(), format!("{what} needs 3 numbers and has {count}"), "write `[x, y, z]`");
            None
        }
    }
}

/// Three constants.
pub(super) fn direction(value: &Toml<DeValue>, what: &str, findings: &mut Findings) -> Option<Spanned<[f64; 3]>> {
    let list = vec3(value, Unit::Plain, what, findings)?;
    let mut out = [0.0; 3];
    let mut fine = true;
    for (slot, x) in out.iter_mut().zip(&list.value) {
        match &x.value {
            RawValue::Const(x) => *slot = *x,
            RawValue::Invalid => fine = false,
            RawValue::Param(_) => {
                let message = format!("{what} cannot depend on a parameter");
                findings.error(
                    x.span,
                    message,
                    "write constants, and turn the joint or frame by `rotate` with a parameter as its angle",
                );
                fine = false;
            }
        }
    }
    fine.then(|| Spanned::new(out, list.span))
}

/// One number for all degrees of freedom or a list with one for each, with one of `units` for each.
pub(super) fn freedoms(
    value: &Toml<DeValue>,
    units: &[Unit],
    what: &str,
    findings: &mut Findings,
) -> Option<RawFreedoms> {
    let is_list = match value.get_ref() {
        DeValue::Array(_) => true,
        DeValue::Table(t) => t.get("deg").is_some_and(|inner| inner.get_ref().is_array()),
        _ => false,
    };
    if is_list {
        numbers(value, units, what, findings).map(|list| RawFreedoms::Each(Spanned::new(list, value.span())))
    } else {
        let all_angles = !units.is_empty() && units.iter().all(|u| *u == Unit::Angle);
        let unit = if all_angles { Unit::Angle } else { Unit::Plain };
        Some(RawFreedoms::All(number(value, unit, what, findings)))
    }
}

/// Numbers under a key.
impl Table<'_> {
    /// A number, if the key exists.
    pub(super) fn number(&self, key: &str, unit: Unit, findings: &mut Findings) -> Option<RawNumber> {
        let value = self.raw(key)?;
        Some(number(value, unit, &format!("{}`{key}`", self.prefix()), findings))
    }

    /// Three numbers, if the key exists; invalid ones where something else is there.
    pub(super) fn vec3(&self, key: &str, unit: Unit, findings: &mut Findings) -> Option<RawVec3> {
        let value = self.raw(key)?;
        let span: Span = value.span().into();
        let read = vec3(value, unit, &format!("{}`{key}`", self.prefix()), findings);
        Some(read.unwrap_or_else(|| Spanned::new([0; 3].map(|_| Spanned::new(RawValue::Invalid, span)), span)))
    }

    /// A direction: three constants.
    pub(super) fn direction(&self, key: &str, findings: &mut Findings) -> Option<Spanned<[f64; 3]>> {
        let value = self.raw(key)?;
        direction(value, &format!("{}`{key}`", self.prefix()), findings)
    }
}

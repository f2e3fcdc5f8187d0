//! The heights of a height field, in the model or in a file of their own.

use ::toml::de::DeValue;

use super::super::raw::{RawField, RawNumber, RawValue};
use super::super::source::{Findings, Spanned};
use super::super::words::quote;
use super::contacts::scale;
use super::numbers::{numbers, Unit};
use super::table::Table;
use super::Named;
use crate::field::{FEWEST, MOST};
use crate::model::Origin;

/// What stands in examples of messages.
const ROWS: &str = "`heights = [[0, 0, 0, 0], ..]`: rows along x, the first one at the least y, in metres";

/// The entries of a height field, and its heights where the shape `is_field`.
pub(super) fn field(table: &Table, is_field: bool, named: &Named, findings: &mut Findings) -> Option<RawField> {
    let keys = ["spacing", "heights"].into_iter().filter(|key| table.has(key));
    let keys: Vec<_> = keys.map(|key| (key, table.key_span(key))).collect();
    if !is_field {
        return (!keys.is_empty()).then_some(RawField { keys, spacing: None, heights: None });
    }
    let (spacing, heights) = (spacing(table, findings), heights(table, named, findings));
    Some(RawField { keys, spacing, heights })
}

/// The distances of neighbours along x and y, m.
fn spacing(table: &Table, findings: &mut Findings) -> Option<[f64; 2]> {
    let value = table.raw("spacing")?;
    let what = format!("{}`spacing`", table.prefix());
    let list = numbers(value, &[Unit::Plain], &what, findings)?;
    let help = "write the distances of neighbouring heights along x and y: `spacing = [0.1, 0.1]`, in metres";
    let Ok(two) = <[RawNumber; 2]>::try_from(list) else {
        findings.error(value.span().into(), format!("{what} does not have 2 numbers"), help);
        return None;
    };
    let one = |x: &RawNumber, findings: &mut Findings| match x.value {
        RawValue::Const(x) if x > 0.0 => Some(x),
        RawValue::Invalid => None,
        _ => {
            findings.error(x.span, format!("{what} has a number that is no constant greater than 0"), help);
            None
        }
    };
    let [x, y] = [one(&two[0], findings), one(&two[1], findings)];
    Some([x?, y?])
}

/// Rows of heights of the same length, m; `None` where something was reported.
fn heights(table: &Table, named: &Named, findings: &mut Findings) -> Option<Vec<Vec<f64>>> {
    let what = table.prefix();
    let (at, rows) = match (table.has("heights"), table.has("file")) {
        (true, true) => {
            findings.error(table.key_span("file"), format!("{what}`heights` and `file` together"), "keep one of them");
            return None;
        }
        (true, false) if table.has("scale") => {
            let help = "remove it, and write the heights in metres";
            findings.error(table.key_span("scale"), format!("{what}`scale` is that of a `file`"), help);
            return None;
        }
        (true, false) => (table.get("heights").map_or(table.span, |(span, _)| span), listed(table, findings)?),
        (false, _) => {
            let (factor, file) = (scale(table, findings), table.text("file", findings)?);
            let rows = of_file(&file, factor?, &what, named, findings)?;
            (file.span, rows)
        }
    };
    let columns = rows.first().map_or(0, Vec::len);
    let uneven = rows.iter().position(|row| row.len() != columns);
    if let Some(k) = uneven {
        let message = format!("{what}row {} has {} heights, the first one {columns}", k + 1, rows[k].len());
        findings.error(at, message, "give all rows the same number of heights");
        return None;
    }
    let (n, few) = (rows.len(), columns < FEWEST || rows.len() < FEWEST);
    if few || n * columns > MOST {
        let message = format!("{what}{n} rows of {columns} heights are too {}", if few { "few" } else { "many" });
        let help = format!("write at least {FEWEST} rows of {FEWEST} heights, and at most {MOST} heights");
        findings.error(at, message, help);
        return None;
    }
    Some(rows)
}

/// The rows that stand in the model.
fn listed(table: &Table, findings: &mut Findings) -> Option<Vec<Vec<f64>>> {
    let value = table.raw("heights")?;
    let DeValue::Array(items) = value.get_ref() else {
        table.wrong_type("heights", "a list of rows", ROWS, findings);
        return None;
    };
    let mut fine = true;
    let mut rows = Vec::new();
    for (k, item) in items.iter().enumerate() {
        let what = format!("{}row {} of `heights`", table.prefix(), k + 1);
        let Some(row) = numbers(item, &[Unit::Plain], &what, findings) else {
            fine = false;
            continue;
        };
        rows.push(Vec::new());
        for x in &row {
            match x.value {
                RawValue::Const(height) => rows.last_mut().into_iter().for_each(|row| row.push(height)),
                RawValue::Invalid => fine = false,
                RawValue::Param(_) => {
                    let help = "write constants, and move the shape by `xyz` with a parameter";
                    findings.error(x.span, format!("{what} cannot depend on a parameter"), help);
                    fine = false;
                }
            }
        }
    }
    fine.then_some(rows)
}

/// Lines of a file that are told one by one.
const TOLD: usize = 10;

/// The rows of a file: a line each, with commas, semicolons or spaces between the numbers. Empty lines and those that begin
/// with `#` are left out.
fn of_file(
    file: &Spanned<String>,
    factor: f64,
    what: &str,
    named: &Named,
    findings: &mut Findings,
) -> Option<Vec<Vec<f64>>> {
    let (path, bytes) = named.read(file, what, findings)?;
    let name = quote(&file.value);
    let help = "write a row of heights in each line, with commas or spaces between them";
    let Ok(text) = String::from_utf8(bytes) else {
        findings.error(file.span, format!("{what}{name}: it is no text"), help);
        return None;
    };
    let mut rows = Vec::new();
    let mut wrong = 0;
    for (k, line) in
        text.lines().enumerate().filter(|(_, line)| !matches!(line.trim().chars().next(), None | Some('#')))
    {
        let words = line.split([',', ';', ' ', '\t', '\r']).filter(|word| !word.is_empty());
        let mut row = Vec::new();
        for word in words {
            match word.parse::<f64>() {
                Ok(x) if (factor * x).is_finite() => row.push(factor * x),
                _ => {
                    wrong += 1;
                    if wrong <= TOLD {
                        let column = line[..word.as_ptr() as usize - line.as_ptr() as usize].chars().count() + 1;
                        let at = Origin { file: path.to_string_lossy().as_ref().into(), line: k + 1, column };
                        findings.error_at(&at, format!("{what}{} is not a finite number", quote(word)), help);
                    }
                }
            }
        }
        rows.push(row);
    }
    if let more @ 1.. = wrong.saturating_sub(TOLD) {
        findings.error(file.span, format!("{what}{name}: {more} more of such numbers"), help);
    }
    (wrong == 0).then_some(rows)
}

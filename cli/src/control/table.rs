//! Tables in CSV files: times, and columns by their names.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};
use multibody::codegen::words::{did_you_mean, list, quote};

use crate::output::note;
use crate::{source, Failure, Outcome};

/// Number of findings of a file that are told.
const TOLD: usize = 20;

/// Columns of a table over its times.
#[derive(Clone, Debug)]
pub struct Table {
    /// Times, s, increasing.
    pub times: Vec<f64>,
    /// Columns that were asked for: what each is, and its values at all times.
    pub columns: Vec<(usize, Vec<f64>)>,
}

/// A name that a column may have, and what it then is.
pub type Name = (String, usize);

/// The findings of a file.
struct Findings<'a> {
    path: &'a Path,
    count: usize,
}

impl Findings<'_> {
    fn add(&mut self, line: u64, what: &str, help: &str) {
        self.count += 1;
        if self.count <= TOLD {
            note(format_args!("{}:{line}: error: {what}\n  help: {help}", self.path.display()));
        }
    }
}

impl Table {
    /// Reads a CSV file: one line of names, then one line for each time. One column is `t` or `time`, s; the others have
    /// some of the `names`. Columns in `beside` are left out: the table of another run has them too.
    ///
    /// # Errors
    /// All mistakes of the file, told with their lines.
    pub fn read(path: &Path, names: &[Name], beside: &[String]) -> Outcome<Table> {
        let text = source::read(path)?;
        let unreadable = |e: csv::Error| {
            Failure::new(format!("cannot read `{}`: {e}", path.display()), "expected a CSV file, UTF-8, with commas")
        };
        let mut builder = ReaderBuilder::new();
        let mut reader = builder.trim(Trim::All).flexible(true).comment(Some(b'#')).from_reader(text.as_bytes());
        let header = reader.headers().map_err(unreadable)?.clone();
        let mut findings = Findings { path, count: 0 };
        let (time, fields) = places(&header, names, beside, &mut findings);
        let mut table =
            Table { times: Vec::new(), columns: fields.iter().map(|(_, what)| (*what, Vec::new())).collect() };
        for record in reader.records() {
            let record = record.map_err(unreadable)?;
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() != header.len() {
                let what = format!("{} fields, but the first line names {}", record.len(), header.len());
                findings.add(line, &what, "give every column a number");
                continue;
            }
            let mut number = |field: usize| -> f64 {
                let (text, name) = (&record[field], quote(header.get(field).unwrap_or_default()));
                match text.parse::<f64>() {
                    Ok(x) if x.is_finite() => x,
                    _ => {
                        let what = format!("{} in column {name} is not a finite number", quote(text));
                        findings.add(line, &what, "give a number, with a point for the fraction");
                        f64::NAN
                    }
                }
            };
            let t = time.map_or(f64::NAN, &mut number);
            let last = table.times.last().copied();
            for ((field, _), (_, values)) in fields.iter().zip(&mut table.columns) {
                values.push(number(*field));
            }
            if last.is_some_and(|last| t <= last) {
                findings.add(line, &format!("the time {t} s does not come after the one before it"), "sort the lines");
            }
            table.times.push(t);
        }
        if table.times.is_empty() && findings.count == 0 {
            findings.add(1, "there is no line with numbers", "give at least one, for the time 0");
        }
        if findings.count > TOLD {
            note(format_args!("{}: {} more errors", path.display(), findings.count - TOLD));
        }
        match findings.count {
            0 => Ok(table),
            _ => Err(Failure::Shown),
        }
    }

    /// Index of the last row that is not later than `t`, or of the first row.
    pub fn row(&self, t: f64) -> usize {
        self.times.partition_point(|time| *time <= t).saturating_sub(1)
    }
}

/// The field of the time, and fields of columns with what they are.
fn places(
    header: &StringRecord,
    names: &[Name],
    beside: &[String],
    findings: &mut Findings,
) -> (Option<usize>, Vec<(usize, usize)>) {
    let (mut time, mut fields): (Option<usize>, Vec<(usize, usize)>) = (None, Vec::new());
    for (field, name) in header.iter().enumerate() {
        // Spreadsheets begin a file with a mark of its byte order.
        let name = name.trim_start_matches('\u{feff}');
        let twice = || format!("a second column of {}", quote(name));
        if matches!(name, "t" | "time") {
            if time.replace(field).is_some() {
                findings.add(1, &twice(), "leave one of them out");
            }
        } else if let Some((_, what)) = names.iter().find(|(known, _)| known == name) {
            if fields.iter().any(|(_, other)| other == what) {
                findings.add(1, &twice(), "leave one of them out");
            }
            fields.push((field, *what));
        } else if !beside.iter().any(|other| other == name) {
            let known = || names.iter().map(|(name, _)| name.as_str());
            let help = did_you_mean(name, known(), || format!("columns may be {}", list(known())));
            findings.add(1, &format!("unknown column {}", quote(name)), &help);
        }
    }
    if time.is_none() {
        findings.add(1, "there is no column of the time", "name it `t` or `time`, in s");
    }
    if fields.is_empty() && findings.count == 0 {
        let known = list(names.iter().map(|(name, _)| name.as_str()));
        findings.add(1, "there is no column but the time", &format!("columns may be {known}"));
    }
    (time, fields)
}

//! `hfield`: heights on a grid, from the file itself or from one of MuJoCo's binary format.

use std::cell::RefCell;
use std::collections::HashMap;

use super::assets::{add_named, extension, Assets};
use super::element::{number, numbers, parsed, Element};
use crate::diag::Severity;
use crate::field::{FEWEST, MOST};
use crate::import::raw::RawField;
use crate::import::source::{Span, Spanned};
use crate::import::words::{did_you_mean, quote};
use crate::import::xml::{place, Reader};
use roxmltree::Node;

const ATTRIBUTES: &[&str] = &["name", "content_type", "file", "nrow", "ncol", "elevation", "size"];

/// The kinds of files by MuJoCo's words.
const CUSTOM: &str = "image/vnd.mujoco.hfield";
const PNG: &str = "image/png";

/// What to do about files, and about anything else.
const WRITE: &str =
    "write the heights as `elevation`, or as a file of MuJoCo's own format: numbers of rows and columns as \
                     32-bit integers, then rows of 32-bit floats, the first one at the least y";
const GIVE: &str = "give it a `file`, or `nrow` and `ncol` with `elevation`";

/// The height fields of a file, each of which is read where a geom names it.
pub(super) struct Fields<'m, 'd> {
    all: HashMap<String, Element<'d>>,
    /// What was read; `None` where something was reported.
    read: RefCell<HashMap<String, Option<RawField>>>,
    assets: &'m Assets<'m>,
    /// How much a field that cannot be read matters: much where there is a floor, because shapes touch fields there.
    severity: Severity,
}

/// Rows of heights, with their place.
struct Grid {
    rows: Vec<Vec<f32>>,
    span: Span,
}

/// What is wrong with a field, and what to do.
struct Problem {
    span: Span,
    message: String,
    help: &'static str,
}

impl<'m, 'd> Fields<'m, 'd> {
    /// The fields of the `asset` elements. `touched` says whether shapes touch them.
    pub fn new(reader: &mut Reader, sections: &[Node<'d, 'd>], assets: &'m Assets<'m>, touched: bool) -> Self {
        let mut all = HashMap::new();
        for node in sections.iter().flat_map(|asset| asset.children()).filter(|node| node.has_tag_name("hfield")) {
            let element = Element::plain(node);
            reader.attributes(node, ATTRIBUTES);
            add_named(reader, &mut all, element, "height field");
        }
        let severity = if touched { Severity::Error } else { Severity::Warning };
        Fields { all, read: RefCell::default(), assets, severity }
    }

    /// The field that a geom names; `None` where something was reported, once for each field, or it has no heights.
    pub fn of_geom(&self, reader: &mut Reader, name: Option<&Spanned<&str>>, geom: Span) -> Option<RawField> {
        let Some(name) = name else {
            let message = "a `geom` of type `hfield` without `hfield`";
            reader.findings.error(geom, message, "name an `hfield` of `asset`: `hfield=\"..\"`");
            return None;
        };
        if let Some(known) = self.read.borrow().get(name.value) {
            return known.clone();
        }
        let field = match self.all.get(name.value) {
            Some(element) => self.of_asset(reader, element, name.value),
            None => {
                let message = format!("{} is not a height field", quote(name.value));
                let mut names: Vec<&str> = self.all.keys().map(String::as_str).collect();
                names.sort_unstable();
                let help = did_you_mean(name.value, names, || "add an `hfield` to `asset`".into());
                reader.findings.error(name.span, message, help);
                None
            }
        };
        self.read.borrow_mut().insert(name.value.to_string(), field.clone());
        field
    }

    fn of_asset(&self, reader: &mut Reader, element: &Element, name: &str) -> Option<RawField> {
        let whose = format!("height field {}: ", quote(name));
        let span = place(element.node);
        let size = size(reader, element, &whose)?;
        let read = match element.attribute("file") {
            Some(file) => self.of_file(element, &file).map(Some),
            None => listed(reader, element, &whose)?,
        };
        let field = read.and_then(|grid| grid.map(|grid| field(&grid, size)).transpose());
        match field {
            Ok(Some(field)) => Some(field),
            Ok(None) => {
                let message = format!("{whose}its heights are not in the file; its geoms touch nothing");
                reader.findings.notice(span, message);
                None
            }
            Err(Problem { span, message, help }) => {
                let message = format!("{whose}{message}; its geoms touch nothing");
                reader.findings.add(self.severity, span, message, help);
                None
            }
        }
    }

    fn of_file(&self, element: &Element, file: &Spanned<&str>) -> Result<Grid, Problem> {
        let problem = |message: String, help| Problem { span: file.span, message, help };
        let stated = element.attribute("content_type").map(|word| word.value);
        let png = || extension(file.value).as_deref() == Some("png");
        match stated {
            None if png() => {
                return Err(problem(format!("{} is a PNG file, which is not read", quote(file.value)), WRITE))
            }
            None | Some(CUSTOM) => {}
            Some(PNG) => return Err(problem(format!("{} is not read", quote(PNG)), WRITE)),
            Some(other) => return Err(problem(format!("{} is no height field", quote(other)), WRITE)),
        }
        let relative = "write its path relative to the main file, or to the `meshdir` or `assetdir` of `compiler`";
        let bytes = self.assets.bytes(file.value).map_err(|message| problem(message, relative))?;
        let rows = rows(&bytes).map_err(|message| problem(format!("{}: {message}", quote(file.value)), WRITE))?;
        Ok(Grid { rows, span: file.span })
    }
}

/// Half lengths along x and y, greatest height, and depth of the ground below, m.
fn size(reader: &mut Reader, element: &Element, whose: &str) -> Option<[f64; 4]> {
    let help = "write half of its lengths along x and y, its greatest height, and how deep the ground below it is, all in metres \
                and greater than 0: `size=\"10 10 1 0.1\"`";
    let Some(size) = element.attribute("size") else {
        reader.findings.error(place(element.node), format!("{whose}it has no `size`"), help);
        return None;
    };
    let all = numbers(reader, element, "size", 4..=4, whose)?;
    let all = <[f64; 4]>::try_from(all.value).ok()?;
    if let Some(x) = all.iter().find(|x| **x <= 0.0) {
        reader.findings.error(size.span, format!("{whose}a `size` of {x}"), help);
        return None;
    }
    Some(all)
}

/// Heights that stand in the file; of these, the first row is that of the greatest y. `Ok(None)` where programs write them
/// later; `None` where something was reported.
fn listed(reader: &mut Reader, element: &Element, whose: &str) -> Option<Result<Option<Grid>, Problem>> {
    let mut counts = [0, 0];
    for (key, count) in ["nrow", "ncol"].into_iter().zip(&mut counts) {
        let Some(text) = element.attribute(key) else { continue };
        let x = number(reader, element, key, whose)?.value;
        if x.fract() != 0.0 || !(0.0..=1e9).contains(&x) {
            let help = "write a whole number: as many as there are heights along that axis";
            reader.findings.error(text.span, format!("{whose}`{key}` is {}", quote(text.value)), help);
            return None;
        }
        *count = x as usize;
    }
    let [rows, columns] = counts;
    if rows == 0 || columns == 0 {
        reader.findings.error(place(element.node), format!("{whose}it has no heights"), GIVE);
        return None;
    }
    let Some(text) = element.attribute("elevation") else { return Some(Ok(None)) };
    let all = parsed(reader, &text, "elevation", 0..=usize::MAX, whose)?.value;
    if all.len() != rows * columns {
        let n = all.len();
        let message =
            format!("{whose}`elevation` has {n} numbers, and {rows} rows of {columns} are {}", rows * columns);
        let help = "write one number for each row and column, row by row, the first one at the greatest y";
        reader.findings.error(text.span, message, help);
        return None;
    }
    let rows = all.chunks_exact(columns).rev().map(|row| row.iter().map(|x| *x as f32).collect()).collect();
    Some(Ok(Some(Grid { rows, span: text.span })))
}

/// The heights of a file of MuJoCo's own format.
fn rows(bytes: &[u8]) -> Result<Vec<Vec<f32>>, String> {
    let four = |at: usize| bytes.get(at..at + 4).and_then(|four| <[u8; 4]>::try_from(four).ok());
    let count = |at: usize| four(at).and_then(|four| usize::try_from(i32::from_le_bytes(four)).ok()).filter(|n| *n > 0);
    let (Some(rows), Some(columns)) = (count(0), count(4)) else {
        return Err("it does not begin with the numbers of its rows and columns".into());
    };
    // Of numbers as large as integers are.
    let size = 8 + 4 * rows as u128 * columns as u128;
    if bytes.len() as u128 != size {
        let n = bytes.len();
        return Err(format!("it has {n} bytes, and {rows} rows of {columns} heights take {size}"));
    }
    let row =
        |k: usize| (0..columns).map(|c| four(8 + 4 * (k * columns + c)).map_or(f32::NAN, f32::from_le_bytes)).collect();
    Ok((0..rows).map(row).collect())
}

/// The field through heights, which MuJoCo scales, in single precision, so that the least is 0 and the greatest `size[2]`.
fn field(grid: &Grid, size: [f64; 4]) -> Result<RawField, Problem> {
    let (rows, columns) = (grid.rows.len(), grid.rows.first().map_or(0, Vec::len));
    let problem = |message: String, help| Problem { span: grid.span, message, help };
    let few = rows < FEWEST || columns < FEWEST;
    if few || rows * columns > MOST {
        let many = if few { "few" } else { "many" };
        let help = match few {
            true => "give it at least 4 rows of 4 heights, or make it a box",
            false => "leave rows and columns out: at most 65,536 heights are read",
        };
        return Err(problem(format!("{rows} rows of {columns} heights are too {many}"), help));
    }
    let odd = grid.rows.iter().flatten().filter(|x| !x.is_finite()).count();
    if odd > 0 {
        return Err(problem(format!("{odd} of its heights are not finite"), WRITE));
    }
    let all = || grid.rows.iter().flatten().copied();
    let (low, high) = (all().fold(f32::INFINITY, f32::min), all().fold(f32::NEG_INFINITY, f32::max));
    let range = high - low;
    let part = |x: f32| if f64::from(range) > LEVEL { (x - low) / range } else { x - low };
    let heights = grid.rows.iter().map(|row| row.iter().map(|x| f64::from(part(*x)) * size[2]).collect());
    let spacing = [(columns, size[0]), (rows, size[1])].map(|(n, half)| 2.0 * half / (n - 1) as f64);
    let keys = vec![("spacing", grid.span), ("heights", grid.span)];
    Ok(RawField { keys, spacing: Some(spacing), heights: Some(heights.collect()) })
}

/// Heights within this are the same to MuJoCo.
const LEVEL: f64 = 1e-14;

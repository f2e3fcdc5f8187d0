//! Hulls of points and of meshes, and what is said about them.

use std::path::Path;

use super::mesh::Problem;
use super::source::{Findings, Span, Spanned};
use super::words::quote;
use crate::model::Origin;

/// Fewest and most corners of a hull that may be asked for, and their number where nothing is said.
pub(crate) const MOST: (usize, usize, usize) = (4, 256, 32);

/// The corners of a hull.
pub(crate) struct Corners {
    /// In the order of the points.
    pub corners: Vec<[f64; 3]>,
    /// Number of the points.
    of: usize,
    /// How far points lie outside of the hull of the corners, m; 0 where none does.
    pub depth: f64,
    /// Whether they lie in a plane.
    pub flat: bool,
}

/// What to say about points in a plane, and what to do.
pub(crate) const FLAT: [&str; 2] =
    ["its points lie in a plane", "it touches planes like other hulls; if it should have a volume, add points"];

/// At most `most` of points that are the corners of their hull.
///
/// # Errors
/// There is no point, or the program was built without hulls and there are too many.
pub(crate) fn corners(points: &[[f64; 3]], most: usize) -> Result<Corners, String> {
    if points.is_empty() {
        return Err("it has no points".into());
    }
    let of = points.len();
    #[cfg(feature = "hulls")]
    {
        let hull = crate::hull::hull(points, most);
        let corners = hull.corners.iter().map(|k| points[*k]).collect();
        Ok(Corners { corners, of, depth: hull.depth, flat: hull.flat })
    }
    #[cfg(not(feature = "hulls"))]
    match of <= most {
        true => Ok(Corners { corners: points.to_vec(), of, depth: 0.0, flat: false }),
        false => Err(format!("of its {of} points, {most} cannot be chosen here: {WITHOUT}")),
    }
}

#[cfg(not(feature = "hulls"))]
pub(crate) const WITHOUT: &str = "this program was built without the feature `hulls`";

/// The points of a mesh, scaled, m.
///
/// # Errors
/// All that is wrong with it.
#[cfg(feature = "hulls")]
pub(crate) fn of_mesh(path: &Path, bytes: &[u8], scale: [f64; 3]) -> Result<Vec<[f64; 3]>, Vec<Problem>> {
    let mut points = super::mesh::points(path, bytes)?;
    for point in &mut points {
        (0..3).for_each(|k| point[k] *= scale[k]);
    }
    near(points).map_err(Problem::whole)
}

/// Points of a mechanism, m.
///
/// # Errors
/// Some are too far away, or not finite.
#[cfg(feature = "hulls")]
pub(crate) fn near(points: Vec<[f64; 3]>) -> Result<Vec<[f64; 3]>, String> {
    let near = |point: &[f64; 3]| point.iter().all(|x| x.abs() <= FARTHEST);
    match points.iter().filter(|point| !near(point)).count() {
        0 => Ok(points),
        n => Err(format!("{n} of its points are farther away than {FARTHEST:e} m")),
    }
}

#[cfg(not(feature = "hulls"))]
pub(crate) fn of_mesh(_: &Path, _: &[u8], _: [f64; 3]) -> Result<Vec<[f64; 3]>, Vec<Problem>> {
    Err(Problem::whole(format!("meshes are not read here: {WITHOUT}")))
}

/// Problems of a mesh that are told one by one.
const TOLD: usize = 10;

/// What to do about a mesh.
const HELP: &str = "write the mesh anew by the program that made it, or describe the shape by `points`";

/// Reports what is wrong with the mesh that `file` names, at its place: of a text in the text.
pub(crate) fn report(problems: &[Problem], path: &Path, file: &Spanned<String>, what: &str, findings: &mut Findings) {
    let (named, source) = (quote(&file.value), path.to_string_lossy());
    for problem in problems.iter().take(TOLD) {
        match *problem {
            Problem { line: 0, ref message, .. } => {
                findings.error(file.span, format!("{what}{named}: {message}"), HELP);
            }
            Problem { line, column, ref message } => {
                let at = Origin { file: source.as_ref().into(), line, column };
                findings.error_at(&at, format!("{what}{message}"), HELP);
            }
        }
    }
    if let more @ 1.. = problems.len().saturating_sub(TOLD) {
        findings.error(file.span, format!("{what}{named}: {more} more of such lines"), HELP);
    }
}

/// Beyond this, points are not those of a mechanism, m.
#[cfg(feature = "hulls")]
const FARTHEST: f64 = 1e9;

impl Corners {
    /// What is said about the hull of the points of `source`, a file or `it`; `None` where all points are corners of a list.
    pub(crate) fn told(&self, file: Option<&str>) -> Option<String> {
        let (n, of) = (self.corners.len(), self.of);
        let source = file.map_or("its".into(), |file| format!("{file} has {of} points;"));
        match (file, self.depth > 0.0) {
            (None, false) if n == of => None,
            (None, false) => Some(format!("{} of {source} {of} points lie within the hull of the others", of - n)),
            (None, true) => Some(format!("{n} of {source} {of} points are used; {}", outside(self.depth))),
            (Some(_), false) => Some(format!("{source} their hull has {n} corners")),
            (Some(_), true) => Some(format!("{source} {n} of them are used, and {}", outside(self.depth))),
        }
    }
}

/// What is said once of all meshes that became hulls.
#[derive(Debug)]
pub(crate) struct Told {
    count: usize,
    /// Number of those with points outside.
    reduced: usize,
    /// How far these lie outside, m.
    depth: f64,
    /// Place of the first.
    first: Span,
}

impl Default for Told {
    fn default() -> Self {
        Told { count: 0, reduced: 0, depth: 0.0, first: Span::FILE }
    }
}

impl Told {
    /// Counts a hull, and what it loses if it is the first of its mesh.
    pub fn add(&mut self, at: Span, corners: Option<&Corners>) {
        if self.count == 0 {
            self.first = at;
        }
        self.count += 1;
        if let Some(depth) = corners.map(|corners| corners.depth).filter(|depth| *depth > 0.0) {
            (self.reduced, self.depth) = (self.reduced + 1, self.depth.max(depth));
        }
    }

    /// Says how many there are.
    pub fn tell(&self, findings: &mut Findings) {
        let meshes = match self.count {
            0 => return,
            1 => "1 mesh is a hull".to_string(),
            n => format!("{n} meshes are hulls"),
        };
        let outside = match self.reduced {
            0 => String::new(),
            n => format!(
                "; of {n}, {} points are used, and the others lie up to {} outside of their hull",
                MOST.2,
                millimetres(self.depth)
            ),
        };
        findings.notice(self.first, format!("{meshes} for contacts{outside}"));
    }
}

/// How far others lie outside.
fn outside(depth: f64) -> String {
    format!("the others lie up to {} outside of their hull", millimetres(depth))
}

/// A length with three digits.
pub(crate) fn millimetres(x: f64) -> String {
    let text = format!("{:.2e}", x * 1e3);
    format!("{} mm", text.parse().unwrap_or(x * 1e3))
}

//! Bodies on the page: outlines with a thickness, and the marks of their joints.

use std::fmt::Write as _;

use super::shapes::Line;
use super::view::{hull, Page, View};
use crate::ink::COLOURS;

/// Least width of a body and width of its edge, pixels.
const THIN: f64 = 1.6;
const EDGE: f64 = 2.6;

/// A body on the page.
pub struct Outline {
    /// Corners in order, pixels; two for a bar, none for a body without extent.
    pub corners: Vec<[f64; 2]>,
    /// Width about the corners, pixels.
    pub width: f64,
    /// Index of the colour; `None` for what is fixed to the ground.
    pub colour: Option<usize>,
    /// Joints, and whether each is prismatic.
    pub marks: Vec<([f64; 2], bool)>,
}

impl Outline {
    /// The outline of a part; corners that only an enlargement shows are left out.
    pub fn new(line: &Line, page: &Page, view: &View) -> Outline {
        let points: Vec<[f64; 2]> = line.points.iter().map(|p| view.project(*p)).collect();
        let fits = points.iter().flatten().all(|x| x.is_finite());
        let corners = match (fits, line.closed) {
            (false, _) => Vec::new(),
            (true, true) => points,
            // Round ones have many points.
            (true, false) => hull(&points, (if points.len() > 20 { 1.2e-4 } else { line.flat }) * page.size()),
        };
        Outline {
            corners: corners.iter().map(|p| page.place(*p)).collect(),
            width: (2.0 * line.radius * page.scale).max(THIN),
            colour: line.colour,
            marks: line.marks.iter().map(|(p, slides)| (page.place(view.project(*p)), *slides)).collect(),
        }
    }

    /// Classes and widths of the strokes that draw the body. A bar is its edge and what is within it; what is behind an area
    /// can be seen through it.
    pub fn strokes(&self) -> Vec<(String, f64)> {
        match (self.colour.map(|k| k % COLOURS), self.corners.len()) {
            (Some(k), 2) => vec![(format!("n c{k}"), self.width + EDGE), (format!("b{k}"), self.width)],
            (Some(k), _) => vec![(format!("glass b{k} c{k}"), THIN)],
            (None, 2) => vec![("n fixed".into(), self.width + EDGE), ("plate".into(), self.width)],
            (None, _) => vec![("fixed".into(), THIN)],
        }
    }

    /// The path, with the commands of a path.
    pub fn path(corners: &[[f64; 2]]) -> String {
        let list: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
        let end = if corners.len() > 2 { "Z" } else { "" };
        format!("M{}{end}", list.join("L"))
    }

    /// Draws the body, and its joints if they are wanted.
    pub fn draw(&self, text: &mut String, joints: bool) {
        if self.corners.len() > 1 {
            let d = Outline::path(&self.corners);
            for (class, width) in self.strokes() {
                let _ = writeln!(text, "<path class=\"round {class}\" stroke-width=\"{width:.1}\" d=\"{d}\"/>");
            }
        }
        for (place, slides) in self.marks.iter().filter(|_| joints) {
            mark(text, *place, *slides, self.mark_size(), "");
        }
    }

    /// Radius of the marks of joints, pixels.
    pub fn mark_size(&self) -> f64 {
        (0.3 * self.width).clamp(2.2, 4.0)
    }
}

/// The mark of a joint, with something inside the element.
pub fn mark(text: &mut String, [x, y]: [f64; 2], slides: bool, size: f64, inside: &str) {
    let _ = match slides {
        true => writeln!(
            text,
            "<rect class=\"pin\" x=\"{:.1}\" y=\"{:.1}\" width=\"{2:.1}\" height=\"{2:.1}\">{inside}</rect>",
            x - 1.3 * size,
            y - 1.3 * size,
            2.6 * size
        ),
        false => writeln!(text, "<circle class=\"pin\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{size:.1}\">{inside}</circle>"),
    };
}

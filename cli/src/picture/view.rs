//! Projection from space onto the page.

/// A parallel projection.
pub struct View {
    right: [f64; 3],
    up: [f64; 3],
    eye: [f64; 3],
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let norm = a.iter().fold(0.0_f64, |n, x| n.hypot(*x));
    a.map(|x| x / norm)
}

/// Direction to the eye where the mechanism does not move in a plane.
pub const OBLIQUE: [f64; 3] = [0.5, -1.0, 0.45];

impl View {
    /// The projection along a direction; if none is given, along the normal of the plane in which all points lie.
    pub fn new(direction: Option<[f64; 3]>, points: &[[f64; 3]]) -> View {
        let extent: [f64; 3] = std::array::from_fn(|k| {
            let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p[k]), b.max(p[k])));
            high - low
        });
        let flat = 1e-6 * extent.iter().fold(0.0, |m: f64, x| m.max(*x));
        let planes = [(1, [0.0, -1.0, 0.0]), (0, [1.0, 0.0, 0.0]), (2, [0.0, 0.0, 1.0])];
        let across = planes.into_iter().find(|(k, _)| extent[*k] <= flat).map(|(_, direction)| direction);
        let eye = unit(direction.or(across).unwrap_or(OBLIQUE));
        let above = if eye[2].abs() > 0.999 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let right = unit(cross(above, eye));
        View { right, up: cross(eye, right), eye }
    }

    /// Whether the eye looks along an axis of the ground.
    pub fn sees_a_plane(&self) -> bool {
        self.eye.iter().any(|x| x.abs() == 1.0)
    }

    /// Coordinates of a point to the right and up, m.
    pub fn project(&self, p: [f64; 3]) -> [f64; 2] {
        [dot(p, self.right), dot(p, self.up)]
    }

    /// Coordinate of a point towards the eye, m.
    pub fn depth(&self, p: [f64; 3]) -> f64 {
        dot(p, self.eye)
    }
}

/// Corners of the convex hull in order; two points where all lie within `flat` of a line.
pub fn hull(points: &[[f64; 2]], flat: f64) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) <= flat);
    if sorted.len() < 3 {
        return sorted;
    }
    let turn = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    let half = |order: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut side: Vec<[f64; 2]> = Vec::new();
        for p in order {
            while let [.., a, b] = side[..] {
                if turn(a, b, p) > flat * (b[0] - a[0]).hypot(b[1] - a[1]) {
                    break;
                }
                side.pop();
            }
            side.push(p);
        }
        side
    };
    let mut lower = half(&mut sorted.iter().copied());
    let mut upper = half(&mut sorted.iter().rev().copied());
    lower.pop();
    upper.pop();
    lower.extend(upper);
    lower
}

/// Width of the picture, pixels.
pub const WIDTH: f64 = 720.0;
/// Least and largest height of the mechanism's part of the picture, pixels.
const HEIGHTS: [f64; 2] = [200.0, 640.0];
/// Edge around the mechanism, which has room for names, pixels.
pub const MARGIN: f64 = 38.0;
/// Height of the legend above the picture, and of the scale and the caption below it, pixels.
pub const HEAD: f64 = 26.0;
pub const FOOT: f64 = 44.0;

/// Scale and place.
pub struct Page {
    /// Pixels per metre.
    pub scale: f64,
    left: f64,
    top: f64,
    /// Height above the foot, pixels.
    pub height: f64,
    size: f64,
}

impl Page {
    /// A page on which all points fit below a head of some pixels.
    pub fn new(points: impl Iterator<Item = [f64; 2]>, head: f64) -> Page {
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for p in points.filter(|p| p.iter().all(|x| x.is_finite())) {
            low = std::array::from_fn(|k| low[k].min(p[k]));
            high = std::array::from_fn(|k| high[k].max(p[k]));
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let extent: [f64; 2] = std::array::from_fn(|k| (high[k] - low[k]).max(1e-9));
        let size = extent[0].max(extent[1]).max(1e-6);
        let inner = WIDTH - 2.0 * MARGIN;
        let scale = (inner / extent[0].max(1e-3 * size)).min((HEIGHTS[1] - 2.0 * MARGIN) / extent[1].max(1e-3 * size));
        let height = (extent[1] * scale + 2.0 * MARGIN).clamp(HEIGHTS[0], HEIGHTS[1]);
        let left = (WIDTH - extent[0] * scale) / 2.0 - low[0] * scale;
        let top = head + (height + extent[1] * scale) / 2.0 + low[1] * scale;
        Page { scale, left, top, height: head + height, size }
    }

    /// The larger extent, m.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// A point on the page.
    pub fn place(&self, p: [f64; 2]) -> [f64; 2] {
        [self.left + p[0] * self.scale, self.top - p[1] * self.scale]
    }
}

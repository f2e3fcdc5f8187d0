//! Height fields: smooth ground over a rectangular grid.

use crate::lists::array;
use crate::Scalar;

/// A height field: a surface `z = h(x, y)` that is twice continuously differentiable, a bicubic spline over cells of the same
/// size. Its numbers are the control numbers of B-splines, which go on by those of the edge outside of the grid: the ground
/// becomes level there within two cells, and stays so.
///
/// Cells are found by [`Scalar::look_up`], not by branches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Lengths of a cell along x and y, m.
    pub spacing: [f64; 2],
    /// Number of heights along x and y; the origin is in their middle.
    pub points: [usize; 2],
    /// Control numbers, m: eight more than there are heights along x and along y, x changing fastest. The first four along
    /// each axis are equal, and the last four.
    pub net: &'static [f64],
    /// For x and y: the number of each cell, from 0; three of them lie before the grid and three behind it.
    pub cells: [&'static [f64]; 2],
    /// For x and y: for each cell 1, for the first and the last one 0.
    pub inside: [&'static [f64]; 2],
    /// A bound of the slope `|∇h|`.
    pub slope: f64,
}

/// The ground at a place.
#[derive(Clone, Copy, Debug)]
pub struct Ground<S> {
    /// Height, m.
    pub height: S,
    /// Its derivatives along x and y.
    pub slope: [S; 2],
    /// Its second derivatives by x twice, by x and y, by y twice, 1/m.
    pub bend: [S; 3],
}

/// Six times the four cubic B-splines of a cell, twice their derivatives, and their second derivatives, at `u` from 0 to 1.
fn splines<S: Scalar>(u: S) -> [[S; 4]; 3] {
    let [two, three, four, six] = [2.0, 3.0, 4.0, 6.0].map(S::constant);
    let v = S::one() - u;
    let (uu, vv) = (u * u, v * v);
    [
        [v * vv, (three * u - six) * uu + four, (three * v - six) * vv + four, u * uu],
        [-vv, (three * u - four) * u, -((three * v - four) * v), uu],
        [v, three * u - two, three * v - two, u],
    ]
}

fn dot4<S: Scalar>(a: [S; 4], b: [S; 4]) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

impl Field {
    /// Control numbers along x.
    fn width(&self) -> usize {
        self.points[0] + 8
    }

    /// The ground at a place in the axes of the field, m.
    pub fn at<S: Scalar>(&self, place: [S; 2]) -> Ground<S> {
        // In cells, from the beginning of the first one.
        let at: [S; 2] = array(|k| {
            let middle = 0.5 * (self.points[k] as f64 - 1.0) + 3.0;
            place[k] * S::constant(1.0 / self.spacing[k]) + S::constant(middle)
        });
        let cell: [S; 2] = array(|k| at[k].look_up(self.cells[k], 0));
        // Where all control numbers of a cell are equal, the place in it makes no difference.
        let [x, y] = array(|k| splines(at[k].look_up(self.inside[k], 0) * (at[k] - cell[k])));
        let first = cell[1] * S::constant(self.width() as f64) + cell[0];
        let along = |order: usize, rows: &[[S; 4]; 4]| rows.map(|row| dot4(x[order], row));
        let rows: [[S; 4]; 4] = array(|j| array(|i| first.look_up(self.net, j * self.width() + i)));
        let [value, slope, bend] = [0, 1, 2].map(|order| along(order, &rows));
        let [dx, dy] = self.spacing;
        let part = |x: f64, sum: S| S::constant(x) * sum;
        Ground {
            height: part(1.0 / 36.0, dot4(y[0], value)),
            slope: [part(1.0 / (12.0 * dx), dot4(y[0], slope)), part(1.0 / (12.0 * dy), dot4(y[1], value))],
            bend: [
                part(1.0 / (6.0 * dx * dx), dot4(y[0], bend)),
                part(1.0 / (4.0 * dx * dy), dot4(y[1], slope)),
                part(1.0 / (6.0 * dy * dy), dot4(y[2], value)),
            ],
        }
    }
}

/// A place in the axes of a field under which a ball lies that touches it.
#[derive(Clone, Copy, Debug)]
pub struct Foot<S> {
    /// Where they touch, by x and y, m.
    pub place: [S; 2],
    /// The ground there.
    pub ground: Ground<S>,
    /// Cosine of its slope.
    pub cosine: S,
    /// How far the middle of a ball that touches there lies from where it was to be, m.
    pub off: [S; 2],
}

/// A ball on a height field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball<S> {
    /// Radius, m.
    pub radius: S,
    /// Steps of Newton's method in [`Field::under`], each of which squares the error.
    pub steps: usize,
}

impl Field {
    /// Where a ball, or a point, touches that is let down along z with its middle over a place, m. It touches at one place
    /// where it has a smaller radius than every hollow.
    pub fn under<S: Scalar>(&self, middle: [S; 2], ball: Option<Ball<S>>) -> Foot<S> {
        let Some(Ball { radius, steps }) = ball else { return self.foot(middle, middle, None) };
        // Two steps from any place near the solution give it its derivatives up to the third.
        let early = steps.saturating_sub(2);
        let (still, of_early) = (middle.map(S::still), radius.still());
        let mut place = if early > 0 { still } else { middle };
        for _ in 0..early {
            place = self.foot(place, still, Some(of_early)).next(of_early);
        }
        for _ in early..steps {
            place = self.foot(place, middle, Some(radius)).next(radius);
        }
        self.foot(place, middle, Some(radius))
    }

    /// Where a ball of a radius, or a point, lies that touches at a `place`, m, beside where its `middle` was to be.
    pub fn foot<S: Scalar>(&self, place: [S; 2], middle: [S; 2], radius: Option<S>) -> Foot<S> {
        let ground = self.at(place);
        let [p, q] = ground.slope;
        let cosine = S::one() / (S::one() + (p * p + q * q)).sqrt();
        let off = match radius {
            Some(radius) => {
                let out = radius * cosine;
                array(|k| place[k] - middle[k] - out * ground.slope[k])
            }
            None => [S::zero(); 2],
        };
        Foot { place, ground, cosine, off }
    }
}

impl<S: Scalar> Foot<S> {
    /// How the ground bends: `(1 − w² ∇h ∇hᵀ) H` with the cosine `w` and the second derivatives `H`, 1/m. Its eigenvalues are
    /// the principal curvatures over `w`.
    pub fn curvature(&self) -> [[S; 2]; 2] {
        let Foot { ground: Ground { slope: [p, q], bend: [a, b, c], .. }, cosine, .. } = *self;
        let along = [a * p + b * q, b * p + c * q].map(|x| cosine * cosine * x);
        [[a - p * along[0], b - p * along[1]], [b - q * along[0], c - q * along[1]]]
    }

    /// The place after a step of Newton's method, m.
    fn next(&self, radius: S) -> [S; 2] {
        let Foot { place, cosine, off, .. } = *self;
        // The derivative of `off` by `place`: 1 − r w (1 − w² ∇h ∇hᵀ) H.
        let (one, factor, [[a, b], [c, d]]) = (S::one(), radius * cosine, self.curvature());
        let m = [[one - factor * a, -(factor * b)], [-(factor * c), one - factor * d]];
        let inverse = (m[0][0] * m[1][1] - m[0][1] * m[1][0]).reciprocal_above(S::constant(1e-6));
        let step = [m[1][1] * off[0] - m[0][1] * off[1], m[0][0] * off[1] - m[1][0] * off[0]];
        array(|k| place[k] - inverse * step[k])
    }
}

//! The minimum of a quadratic function between bounds.

use super::Real;

/// The number between two bounds that is next to `x`.
pub fn clamp<S: Real>(x: S, low: S, high: S) -> S {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// The minimum of a quadratic function in a box.
pub struct BoxMinimum<S, const N: usize> {
    /// The minimum.
    pub x: [S; N],
    /// Which components are between their bounds.
    pub free: [bool; N],
    /// `L` and `D` of the free part of the matrix, the unit matrix elsewhere.
    factor: [[S; N]; N],
}

/// The minimum of `½ xᵀ H x + gᵀ x` between two bounds, by projected Newton steps; `None` where the free part of `H` is not
/// positive definite. The bounds enclose zero.
pub fn box_minimum<S: Real, const N: usize>(
    h: &[[S; N]; N],
    g: &[S; N],
    bounds: &[[S; N]; 2],
) -> Option<BoxMinimum<S, N>> {
    let zero = S::zero();
    let value = |x: &[S; N]| {
        (0..N).fold(zero, |sum, i| {
            let hx = (0..N).fold(zero, |sum, j| sum + h[i][j] * x[j]);
            sum + x[i] * (g[i] + S::constant(0.5) * hx)
        })
    };
    let (mut x, mut free, mut factor) = ([zero; N], [true; N], *h);
    for round in 0..4 * N + 4 {
        let gradient: [S; N] = core::array::from_fn(|i| (0..N).fold(g[i], |sum, j| sum + h[i][j] * x[j]));
        let now: [bool; N] = core::array::from_fn(|i| {
            !(x[i] <= bounds[0][i] && gradient[i] > zero || x[i] >= bounds[1][i] && gradient[i] < zero)
        });
        let settled = round > 0 && now == free;
        free = now;
        factor = factored(h, &free)?;
        let step = solved(&factor, &core::array::from_fn(|i| if free[i] { -gradient[i] } else { zero }));
        let (before, mut length) = (value(&x), S::one());
        let mut next = x;
        for _ in 0..20 {
            next = core::array::from_fn(|i| clamp(x[i] + length * step[i], bounds[0][i], bounds[1][i]));
            if value(&next) <= before {
                break;
            }
            length = length * S::constant(0.5);
        }
        let still = next == x;
        x = next;
        // A full Newton step within the box, over the components that stay free, is the minimum.
        if still || settled && (0..N).all(|i| !free[i] || x[i] > bounds[0][i] && x[i] < bounds[1][i]) {
            break;
        }
    }
    Some(BoxMinimum { x, free, factor })
}

impl<S: Real, const N: usize> BoxMinimum<S, N> {
    /// `−H⁻¹ Q` over the free components, zero for the others.
    pub fn gains<const M: usize>(&self, q: &[[S; M]; N]) -> [[S; M]; N] {
        let mut out = [[S::zero(); M]; N];
        for j in 0..M {
            let right = core::array::from_fn(|i| if self.free[i] { -q[i][j] } else { S::zero() });
            let column = solved(&self.factor, &right);
            (0..N).for_each(|i| out[i][j] = column[i]);
        }
        out
    }
}

/// `L D Lᵀ` of the free part of a symmetric matrix: `L` below the diagonal, `D` on it.
fn factored<S: Real, const N: usize>(h: &[[S; N]; N], free: &[bool; N]) -> Option<[[S; N]; N]> {
    let mut f = [[S::zero(); N]; N];
    for i in 0..N {
        for j in 0..=i {
            let mut x = match free[i] && free[j] {
                true => h[i][j],
                false if i == j => S::one(),
                false => S::zero(),
            };
            for k in 0..j {
                x = x - f[i][k] * f[j][k] * f[k][k];
            }
            f[i][j] = if i == j { x } else { x / f[j][j] };
        }
        let positive = f[i][i] > S::zero();
        if !positive {
            return None;
        }
    }
    Some(f)
}

fn solved<S: Real, const N: usize>(f: &[[S; N]; N], right: &[S; N]) -> [S; N] {
    let mut x = *right;
    for i in 0..N {
        for j in 0..i {
            x[i] = x[i] - f[i][j] * x[j];
        }
    }
    for i in (0..N).rev() {
        x[i] = x[i] / f[i][i];
        for j in i + 1..N {
            x[i] = x[i] - f[j][i] * x[j];
        }
    }
    x
}

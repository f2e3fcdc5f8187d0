//! Placements, axes and passive elements.

use mbd_codegen::model::{JointKind, Placement, Rotation, Value, JOINTS};

use super::builder::Builder;

const QUARTERS: [f64; 3] = [std::f64::consts::FRAC_PI_2, -std::f64::consts::FRAC_PI_2, std::f64::consts::PI];

/// Sine of the angle between two directions.
pub fn sine(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    norm(cross) / (norm(a) * norm(b))
}

impl Builder<'_> {
    /// A random vector of about the given size, or one along an axis.
    pub fn vector(&mut self, size: f64) -> [f64; 3] {
        if self.rng.chance(self.distribution.skew) {
            return std::array::from_fn(|_| self.rng.around(size));
        }
        let mut v = [0.0; 3];
        if self.rng.chance(0.85) {
            v[self.rng.below(3)] = self.rng.around(size);
        }
        v
    }

    /// A direction, not always of unit length.
    pub fn direction(&mut self) -> [f64; 3] {
        if !self.rng.chance(self.distribution.skew) {
            let mut v = [0.0; 3];
            v[self.rng.below(3)] = self.rng.pick(&[1.0, 1.0, -1.0, 2.0]);
            return v;
        }
        loop {
            let v: [f64; 3] = std::array::from_fn(|_| self.rng.around(1.0));
            if v.iter().map(|x| x * x).sum::<f64>() > 0.04 {
                return v;
            }
        }
    }

    /// An angle of a placement. For aligned placements it is a multiple of 90°, sometimes written with few digits.
    fn angle(&mut self, general: bool) -> Value {
        if general {
            let x = self.rng.around(3.1);
            return self.value(x);
        }
        match self.rng.below(20) {
            0..=9 => Value::ZERO,
            10 => Value::Const((QUARTERS[0] * 1e7).floor() / 1e7),
            11 => self.value(QUARTERS[0]),
            _ => Value::Const(self.rng.pick(&QUARTERS)),
        }
    }

    /// A random orientation, written in one of the ways that the model description has.
    pub fn rotation(&mut self) -> Rotation {
        let general = self.rng.chance(self.distribution.skew);
        if self.rng.chance(0.25) {
            let axis = self.direction();
            return Rotation::AxisAngle { axis, angle: self.angle(general) };
        }
        Rotation::Rpy(std::array::from_fn(|_| self.angle(general)))
    }

    /// Pose of a frame about `length` m away.
    pub fn placement(&mut self, length: f64) -> Placement {
        let xyz = self.vector(length).map(|x| self.value_or_zero(x));
        Placement { xyz, rotation: if self.rng.chance(0.15) { Rotation::NONE } else { self.rotation() } }
    }

    /// Kind and axes of a joint.
    pub fn kind(&mut self) -> JointKind {
        let spec = &JOINTS[self.rng.weighted(&self.distribution.kinds)];
        let mut axes = [[0.0; 3]; 2];
        loop {
            axes[..spec.axes.len()].fill_with(|| self.direction());
            if spec.axes.len() < 2 || sine(axes[0], axes[1]) > 0.5 {
                break;
            }
        }
        let pitch = if spec.pitch { self.rng.around(0.3) } else { 0.0 };
        (spec.make)(axes, if spec.pitch { self.value(pitch) } else { Value::ZERO })
    }

    /// One number for each degree of freedom. Either all are the same, or they differ and some are zero.
    pub fn per_freedom(&mut self, n: usize, chance: f64, low: f64, high: f64) -> Vec<Value> {
        if !self.rng.chance(chance) {
            return vec![Value::ZERO; n];
        }
        if n > 1 && self.rng.chance(0.4) {
            let x = self.rng.range(low, high);
            return vec![self.value(x); n];
        }
        (0..n)
            .map(|_| {
                let x = self.rng.range(low, high);
                if n > 1 && self.rng.chance(0.3) {
                    Value::ZERO
                } else {
                    self.value(x)
                }
            })
            .collect()
    }
}

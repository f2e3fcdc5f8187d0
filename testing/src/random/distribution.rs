//! Distribution of random mechanisms.

use super::rng::Rng;

/// Probabilities and ranges of [`super::random_model`]. The fields are independent of each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Smallest and largest number of bodies.
    pub bodies: (usize, usize),
    /// Probability that a body's parent is any earlier body instead of the latest.
    pub branching: f64,
    /// Probability that a body after the first one is connected to the ground.
    pub roots: f64,
    /// Probability that a placement or axis is general rather than along the axes.
    pub skew: f64,
    /// Factor on masses and lengths from parent to child.
    pub taper: f64,
    /// Weights of revolute, prismatic, cylindrical, helical, universal, planar, spherical, floating, fixed.
    pub kinds: [f64; 9],
    /// Probability that a joint is prescribed.
    pub prescribed: f64,
    /// Probability that a joint of one degree of freedom is a mimic joint.
    pub mimic: f64,
    /// Probability that an inner body has no mass, or is a point mass.
    pub massless: f64,
    /// Probability that an inertia has products and axes of its own.
    pub products: f64,
    /// Probability of damping on a joint.
    pub damping: f64,
    /// Probability of springs on a joint that can have them.
    pub springs: f64,
    /// Probability of armature on a joint.
    pub armature: f64,
    /// Probability of an external wrench on a body.
    pub wrenches: f64,
    /// Probability of a further named frame, for each body.
    pub frames: f64,
    /// Weights of constant gravity, zero gravity, and gravity as an input.
    pub gravity: [f64; 3],
    /// Probability that a number is a run-time parameter.
    pub params: f64,
}

impl Default for Distribution {
    /// An open tree of revolute joints under gravity, without anything else.
    fn default() -> Self {
        Distribution {
            bodies: (1, 6),
            branching: 0.0,
            roots: 0.0,
            skew: 1.0,
            taper: 0.9,
            kinds: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            prescribed: 0.0,
            mimic: 0.0,
            massless: 0.0,
            products: 1.0,
            damping: 0.0,
            springs: 0.0,
            armature: 0.0,
            wrenches: 0.0,
            frames: 0.0,
            gravity: [1.0, 0.0, 0.0],
            params: 0.0,
        }
    }
}

impl Distribution {
    /// All kinds of joints and elements on up to `bodies` bodies; the probabilities themselves are random.
    pub fn everything(seed: u64, bodies: usize) -> Distribution {
        let mut rng = Rng::new(seed, 1);
        let all = [4.0, 2.0, 1.5, 1.5, 1.5, 1.5, 1.5, 1.0, 1.5];
        // One in three mechanisms has only a few kinds of joints.
        let few = rng.chance(0.33);
        let kinds = all.map(|w| if few && rng.chance(0.6) { 0.0 } else { w });
        let kinds = if kinds[..8].iter().all(|w| *w == 0.0) { all } else { kinds };
        let mimic = if rng.chance(0.5) { 0.8 } else { 0.0 };
        // Only joints of one degree of freedom can be mimics and their leaders.
        let single = if mimic > 0.0 { 3.0 } else { 1.0 };
        let kinds = std::array::from_fn(|k| if matches!(k, 0 | 1 | 3) { single * kinds[k] } else { kinds[k] });
        let mut some = |p: f64| if rng.chance(0.5) { 0.0 } else { p };
        Distribution {
            bodies: (1, bodies),
            branching: some(0.5),
            roots: some(0.3),
            prescribed: some(0.3),
            massless: some(0.5),
            damping: some(0.5),
            springs: some(0.5),
            armature: some(0.4),
            wrenches: some(0.4),
            frames: some(0.4),
            params: some(0.25),
            products: rng.unit(),
            skew: rng.pick(&[0.0, 0.2, 0.5, 0.8, 1.0]),
            taper: rng.range(0.6, 1.1),
            mimic,
            kinds,
            gravity: [2.0, 1.0, 1.0],
        }
    }
}

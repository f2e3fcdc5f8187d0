//! Names of values: body and quantity.

use mbd_runtime::sweep::Quantity;

/// A name as a snake-case identifier: what is not a letter or digit becomes `_`.
pub fn identifier(name: &str) -> String {
    let mut out: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect();
    if !out.starts_with(|c: char| c.is_ascii_alphabetic()) {
        out.insert_str(0, "b_");
    }
    out
}

/// The same in upper case, for constants.
pub fn constant(name: &str) -> String {
    identifier(name).to_ascii_uppercase()
}

/// Short name of a quantity and what to say of it in a comment.
pub fn quantity(q: Quantity) -> (&'static str, &'static str) {
    match q {
        Quantity::Pose => ("pose", "sine and cosine, rotation"),
        Quantity::Inertia => ("inertia", "inertia carried to the parent, M* (4.48)"),
        Quantity::Pivot => ("pivot", "U, Mj, k and the reduced inertia M' (4.44)"),
        Quantity::BiasMomentum => ("rest", "momentum remainder D, D' (4.45, 4.49)"),
        Quantity::Velocity => ("vel", "velocity and joint rate (4.40)"),
        Quantity::Rate => ("rate", "coordinate rates"),
        Quantity::Acceleration => ("acc", "acceleration"),
        Quantity::Momentum => ("mom", "momentum"),
        Quantity::MomentumRate => ("pdot", "momentum rate (4.36)"),
        Quantity::Load => ("load", "gravity and wrenches"),
        Quantity::Energy => ("energy", "energy"),
        Quantity::MassMatrix => ("mass", "mass matrix by composite inertias"),
        Quantity::Placement => ("place", "placement"),
        Quantity::Reaction => ("react", "reaction wrench (4.66)"),
        Quantity::Effort => ("effort", "joint force"),
        Quantity::Jacobian => ("jac", "Jacobian"),
        Quantity::Derivative => ("deriv", "derivatives of the rates"),
        Quantity::Constraint => ("loop", "loops and couplings"),
    }
}

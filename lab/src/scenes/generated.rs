//! Generated code of scenes, by their names.

#[path = "../../../generated/scenes/mod.rs"]
#[rustfmt::skip]
mod code;

pub use code::*;

use super::dynamics::Dynamics;
use multibody::runtime::{Differentiable, System};

/// What is done with the generated system of a scene.
pub trait Visit<S> {
    /// What comes of it.
    type Out;
    /// Does it.
    fn visit<Y: Dynamics<Scalar = S> + 'static>(self, system: Y) -> Self::Out;
}

/// The same where derivatives are needed.
pub trait VisitDifferentiable<S> {
    /// What comes of it.
    type Out;
    /// Does it.
    fn visit<Y: Dynamics<Scalar = S> + Differentiable + 'static>(self, system: Y) -> Self::Out;
}

/// One number type: its types with derivatives, then those without, each with the scenes it belongs to.
macro_rules! scenes {
    ($scalar:ty, $any:ident, $differentiable:ident,
     { $($($smooth:literal)|+ => $with:ty,)* }, { $($plain:literal => $without:ty,)* }) => {
        /// Does something with the generated system of a scene; `None` where there is none.
        pub fn $any<V: Visit<$scalar>>(scene: &str, visitor: V) -> Option<V::Out> {
            match scene {
                $($($smooth)|+ => Some(visitor.visit(<$with>::new())),)*
                $($plain => Some(visitor.visit(<$without>::new())),)*
                _ => None,
            }
        }

        /// The same for those with derivatives.
        pub fn $differentiable<V: VisitDifferentiable<$scalar>>(scene: &str, visitor: V) -> Option<V::Out> {
            match scene {
                $($($smooth)|+ => Some(visitor.visit(<$with>::new())),)*
                _ => None,
            }
        }
    };
}

scenes!(f64, visit_f64, visit_differentiable_f64, {
    "double_pendulum" | "double_pendulum_chaotic" => double_pendulum::DoublePendulum,
    "ur5" => ur5::Ur5,
    "panda_arm" => panda_arm::PandaArm,
    "arm7" => arm7::Arm7,
    "chain10" | "chain10_swing" => chain10::Chain10,
    "chain10_friction" => chain10_friction::Chain10Friction,
    "rotor" => rotor::Rotor,
}, {
    "chain50_friction" => chain50_friction::Chain50Friction,
    "chain100_friction" => chain100_friction::Chain100Friction,
    "tree150_friction" => tree150_friction::Tree150Friction,
    "quadruped" => quadruped::Quadruped,
});

scenes!(f32, visit_f32, visit_differentiable_f32, {
    "double_pendulum" | "double_pendulum_chaotic" => double_pendulum_f32::DoublePendulumF32,
    "ur5" => ur5_f32::Ur5F32,
    "panda_arm" => panda_arm_f32::PandaArmF32,
    "arm7" => arm7_f32::Arm7F32,
    "chain10" | "chain10_swing" => chain10_f32::Chain10F32,
}, {});

/// What is done with a system of which nothing but the rates is needed.
pub trait VisitRates {
    /// What comes of it.
    type Out;
    /// Does it.
    fn visit<Y: System<Scalar = f64> + 'static>(self, system: Y) -> Self::Out;
}

/// Does something with the generated chains and trees of [`experiments`](super::experiments) that have friction: kind and number
/// of links.
pub fn visit_chain<V: VisitRates>(family: &str, links: usize, visitor: V) -> Option<V::Out> {
    Some(match (family, links) {
        ("open", 10) => visitor.visit(chain10_friction::Chain10Friction::new()),
        ("open", 50) => visitor.visit(chain50_friction::Chain50Friction::new()),
        ("open", 100) => visitor.visit(chain100_friction::Chain100Friction::new()),
        ("tree", 150) => visitor.visit(tree150_friction::Tree150Friction::new()),
        ("closed", 10) => visitor.visit(closed10::Closed10::new()),
        ("closed", 100) => visitor.visit(closed100::Closed100::new()),
        _ => return None,
    })
}

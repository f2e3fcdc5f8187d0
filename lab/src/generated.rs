//! Generated code of scenes, by their names. `build.rs` says which scenes have it, and calls the macro `scenes`.

use multibody::runtime::{Differentiable, System};

use crate::scenes::Dynamics;

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

include!(concat!(env!("OUT_DIR"), "/scenes.rs"));

/// What is done with a system of which nothing but the rates is needed.
pub trait VisitRates {
    /// What comes of it.
    type Out;
    /// Does it.
    fn visit<Y: System<Scalar = f64> + 'static>(self, system: Y) -> Self::Out;
}

/// Does something with the generated chains and trees of [`experiments`](crate::scenes::experiments) that have friction: kind and number
/// of links.
pub fn visit_chain<V: VisitRates>(family: &str, links: usize, visitor: V) -> Option<V::Out> {
    Some(match (family, links) {
        ("open", 10) => visitor.visit(chain10_friction::Scene::new()),
        ("open", 50) => visitor.visit(chain50_friction::Scene::new()),
        ("open", 100) => visitor.visit(chain100_friction::Scene::new()),
        ("tree", 150) => visitor.visit(tree150_friction::Scene::new()),
        ("closed", 10) => visitor.visit(closed10::Scene::new()),
        ("closed", 100) => visitor.visit(closed100::Scene::new()),
        _ => return None,
    })
}

//! Generated code of scenes, by name. `build.rs` lists the scenes that have it, and calls the macro `scenes`.

use multibody::runtime::{Differentiable, System};

use crate::scenes::Dynamics;

/// An operation on the generated system of a scene.
pub trait Visit<S> {
    /// Its result.
    type Out;
    /// Runs the operation.
    fn visit<Y: Dynamics<Scalar = S> + 'static>(self, system: Y) -> Self::Out;
}

/// An operation that needs derivatives.
pub trait VisitDifferentiable<S> {
    /// Its result.
    type Out;
    /// Runs the operation.
    fn visit<Y: Dynamics<Scalar = S> + Differentiable + 'static>(self, system: Y) -> Self::Out;
}

/// The functions for one number type: its types with derivatives, then those without, each with its scenes.
macro_rules! scenes {
    ($scalar:ty, $any:ident, $differentiable:ident,
     { $($($smooth:literal)|+ => $with:ty,)* }, { $($plain:literal => $without:ty,)* }) => {
        /// Runs an operation on the generated system of a scene; `None` where there is none.
        pub fn $any<V: Visit<$scalar>>(scene: &str, visitor: V) -> Option<V::Out> {
            match scene {
                $($($smooth)|+ => Some(visitor.visit(<$with>::new())),)*
                $($plain => Some(visitor.visit(<$without>::new())),)*
                _ => None,
            }
        }

        /// Runs an operation that needs derivatives; `None` where there is no such system.
        pub fn $differentiable<V: VisitDifferentiable<$scalar>>(scene: &str, visitor: V) -> Option<V::Out> {
            match scene {
                $($($smooth)|+ => Some(visitor.visit(<$with>::new())),)*
                _ => None,
            }
        }
    };
}

include!(concat!(env!("OUT_DIR"), "/scenes.rs"));

/// An operation that needs the rates only.
pub trait VisitRates {
    /// Its result.
    type Out;
    /// Runs the operation.
    fn visit<Y: System<Scalar = f64> + 'static>(self, system: Y) -> Self::Out;
}

/// Runs an operation on the generated chain or tree of [`experiments`](crate::scenes::experiments) with friction of a
/// given kind and number of links.
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

//! What a mechanism looks like: the sources of the command's pictures.
#![allow(dead_code)]

#[path = "../../cli/src/picture/flesh.rs"]
pub mod flesh;
#[path = "../../cli/src/picture/limbs.rs"]
pub mod limbs;
#[path = "../../cli/src/picture/shapes.rs"]
pub mod shapes;
#[path = "../../cli/src/picture/solid.rs"]
pub mod solid;
#[path = "../../cli/src/picture/touch.rs"]
pub mod touch;
#[path = "../../cli/src/picture/view.rs"]
mod view;

/// The page has no height fields.
mod terrain {
    use multibody::codegen::model::ShapeKind;
    use multibody::runtime::field::Field;
    use multibody::runtime::sweep::FrameState;

    pub fn field_of(_: &ShapeKind) -> Option<&'static Field> {
        None
    }

    pub fn lines(_: &Field, _: &FrameState<f64>, _: &[[f64; 3]]) -> Vec<Vec<[f64; 3]>> {
        Vec::new()
    }
}

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

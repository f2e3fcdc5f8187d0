//! Generated code of scenes.

#[path = "../../generated/scenes/mod.rs"]
#[rustfmt::skip]
mod code;

pub use code::*;

//! Readers of file formats: text to [`raw::RawModel`]. Nothing outside this module knows the formats.

pub mod raw;
pub mod source;
pub mod toml;
pub mod urdf;
pub mod words;

use crate::choice::choice;

choice! {
    /// How the root of a robot that states none is attached to the ground.
    pub enum Base {
        /// The root is welded to the ground.
        Fixed = "fixed",
        /// The root is free in space, with seven coordinates.
        Floating = "floating",
        /// The root slides on the ground's x-y plane and turns about z.
        Planar = "planar",
    }
}

/// What a file does not say, or what is to be changed about it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImportOptions {
    /// Attachment of the root; for URDF only.
    pub base: Base,
    /// Gravity in ground axes, m/s², instead of that of the file (URDF states none: `[0, 0, -9.81]`).
    pub gravity: Option<[f64; 3]>,
    /// Whether `limit`s are stops; for URDF only.
    pub limits: bool,
    /// A floor that the shapes of the robot can touch; for URDF only. Without one, they touch nothing.
    pub floor: Option<Floor>,
}

/// How the file that a description names as its base is read.
pub type ReadFile<'f> = &'f dyn Fn(&std::path::Path) -> std::io::Result<String>;

/// A floor across z of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Height above the ground's origin, m.
    pub height: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

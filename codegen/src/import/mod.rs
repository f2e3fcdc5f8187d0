//! Readers of file formats: text to [`raw::RawModel`]. Nothing outside this module knows the formats.

mod floor;
pub(crate) mod hull;
mod mesh;
pub mod mjcf;
pub mod raw;
pub mod source;
pub(crate) mod taken;
mod tally;
pub mod toml;
pub mod urdf;
pub mod words;
mod xml;

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
    /// Gravity in ground axes, m/s², instead of that of the file (URDF states none: `[0, 0, -9.81]`, which is also the
    /// default of MJCF).
    pub gravity: Option<[f64; 3]>,
    /// Whether joint limits are stops; for URDF and MJCF only.
    pub limits: bool,
    /// A floor that the shapes of the robot can touch; for URDF and MJCF only. Without one, they touch nothing.
    pub floor: Option<Floor>,
    /// Contacts between the bodies of the robot, with this coefficient of friction; for URDF and MJCF only. Bodies that a
    /// joint connects make none, and neither do shapes that overlap at the described start or at that
    /// within the ranges of the joints.
    pub self_contact: Option<f64>,
}

impl ImportOptions {
    /// The coefficient of friction between the bodies of a robot, where contacts between them are asked for, and built in.
    #[inline]
    pub(crate) fn between_bodies(&self) -> Option<f64> {
        self.self_contact.filter(|_| cfg!(feature = "self_contact"))
    }
}

/// The formats of XML files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum XmlFormat {
    /// Robots of links and joints.
    Urdf,
    /// Models of MuJoCo.
    Mjcf,
}

impl XmlFormat {
    /// The format by the outermost element; `None` where it is another one.
    pub fn of(text: &str) -> Option<XmlFormat> {
        let mut rest = text.trim_start_matches('\u{feff}').trim_start();
        // Declarations and comments may stand before it.
        while let Some((start, end)) =
            [("<?", "?>"), ("<!--", "-->"), ("<!", ">")].iter().find(|p| rest.starts_with(p.0))
        {
            rest = rest[start.len()..].split_once(end).map_or("", |(_, rest)| rest.trim_start());
        }
        match rest {
            _ if rest.starts_with("<mujoco") => Some(XmlFormat::Mjcf),
            _ if rest.starts_with("<robot") || text.contains("<robot") => Some(XmlFormat::Urdf),
            _ => None,
        }
    }
}

/// How the files that a description names, as its base or to include them, are read.
pub type ReadFile<'f> = &'f dyn Fn(&std::path::Path) -> std::io::Result<Vec<u8>>;

/// The text of a file that a description names.
fn text(files: ReadFile, path: &std::path::Path) -> std::io::Result<String> {
    let wrong = |_| std::io::Error::new(std::io::ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(files(path)?).map_err(wrong)
}

/// A floor across z of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Height above the ground's origin, m.
    pub height: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

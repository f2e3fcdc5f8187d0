//! Readers of file formats. Nothing outside this module knows them.

pub mod raw;
pub mod source;
pub mod toml;
pub mod urdf;
pub mod words;

use self::source::{Findings, Span};
use self::words::quote;
use crate::choice::choice;
use crate::diag::Diagnostics;
use crate::model::Model;

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
}

/// Reads and checks a description in the format its file name ends in: `.toml`, `.urdf`, or `.xml` with a `<robot>` in it.
///
/// `file` names the source in the findings; nothing is read from disk. All findings come back at once, in the order of the text; a model
/// only if none of them is an error.
pub fn load(file: &str, text: &str, options: &ImportOptions) -> (Option<Model>, Diagnostics) {
    let extension = std::path::Path::new(file).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("toml") => toml::read_with(file, text, options),
        Some("urdf") => urdf::read(file, text, options),
        Some("xml") if text.contains("<robot") => urdf::read(file, text, options),
        Some("xml") => refuse(file, text, "no `<robot>` in this file", "of XML formats only URDF can be read"),
        Some("xacro") => {
            refuse(file, text, "xacro files have to be expanded first", "run `xacro model.xacro > model.urdf`")
        }
        Some(other) => refuse(file, text, &format!("cannot read files that end in {}", quote(other)), KNOWN),
        None => refuse(file, text, "the file name does not tell the format", KNOWN),
    }
}

const KNOWN: &str = "models are read from `.toml` and `.urdf` files";

fn refuse(file: &str, text: &str, message: &str, help: &str) -> (Option<Model>, Diagnostics) {
    let mut findings = Findings::new(file, text);
    findings.error(Span::FILE, message, help);
    (None, findings.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Gravity, Value};

    const TEXT: &str =
        "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'a'\n";

    #[test]
    fn the_extension_decides() {
        let options = ImportOptions::default();
        assert!(load("m.toml", TEXT, &options).0.is_some());
        assert!(load("dir/m.TOML", TEXT, &options).0.is_some());
        for (file, text, expect) in [
            ("m.sdf", TEXT, "m.sdf: error: cannot read files that end in `sdf`"),
            ("m", TEXT, "m: error: the file name does not tell the format"),
            ("m.xml", TEXT, "m.xml: error: no `<robot>` in this file"),
            ("m.xacro", TEXT, "m.xacro: error: xacro files have to be expanded first"),
        ] {
            let (model, findings) = load(file, text, &options);
            assert!(model.is_none());
            assert_eq!(findings.to_string().lines().next(), Some(expect));
        }
    }

    #[test]
    fn options_apply_to_toml() {
        let gravity = |g| load("m.toml", TEXT, &ImportOptions { gravity: Some(g), base: Base::Fixed });
        let (model, findings) = gravity([0.0, -1.62, 0.0]);
        assert_eq!(findings.0, []);
        let wanted = Gravity::Constant([Value::Const(0.0), Value::Const(-1.62), Value::Const(0.0)]);
        assert_eq!(model.map(|m| m.gravity), Some(wanted));
        let (model, findings) = gravity([0.0, f64::NAN, 0.0]);
        assert!(model.is_none());
        assert!(findings.to_string().contains("gravity"), "{findings}");
        let (model, findings) = load("m.toml", TEXT, &ImportOptions { base: Base::Floating, gravity: None });
        assert!(model.is_none());
        assert!(findings.to_string().contains("states its own base"), "{findings}");
    }
}

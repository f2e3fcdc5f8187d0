//! From files that were dropped to a model.

use std::collections::BTreeMap;
use std::path::Path;

use multibody::codegen::diag::Diagnostics;
use multibody::codegen::model::Model;
use multibody::codegen::read::{load_with, Base, Floor, ImportOptions};

/// Files that were dropped together, by their names without folders.
pub type Files = BTreeMap<String, Vec<u8>>;

/// How a file is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reading {
    /// Attachment of the root of a URDF.
    pub floating: bool,
    /// Whether a floor lies below the mechanism that its shapes touch.
    pub floor: Option<f64>,
}

/// Reads a file into a model.
///
/// # Errors
/// All findings where one of them is an error.
pub fn read(name: &str, text: &str, reading: Reading, files: &Files) -> Result<(Model, Diagnostics), Diagnostics> {
    let options = ImportOptions {
        base: if reading.floating { Base::Floating } else { Base::Fixed },
        floor: reading.floor.map(|height| Floor { height, friction: 0.8 }),
        ..ImportOptions::default()
    };
    let dropped = |path: &Path| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let missing =
            || std::io::Error::new(std::io::ErrorKind::NotFound, "drop it on the page together with this file");
        files.get(&name).cloned().ok_or_else(missing)
    };
    let (read, findings) = load_with(name, text, &options, &dropped);
    match read {
        Some((model, _)) => Ok((model, findings)),
        None => Err(findings),
    }
}

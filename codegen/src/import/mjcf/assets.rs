//! Files that assets name: where they are, as the settings of `compiler` say.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::element::{flag, Element};
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use crate::import::ReadFile;
use roxmltree::Node;

/// The files of meshes and height fields.
pub(super) struct Assets<'m> {
    folder: PathBuf,
    /// Whether folders in front of the names of files are dropped.
    strip: bool,
    files: ReadFile<'m>,
}

impl<'m> Assets<'m> {
    /// `main` is the path of the main file, to whose folder those of `compiler` are relative.
    pub fn new(reader: &mut Reader, compilers: &[Node], (main, files): (&Path, ReadFile<'m>)) -> Self {
        let stated = |key: &str| compilers.iter().rev().find_map(|node| Element::plain(*node).attribute(key));
        let folder = stated("meshdir").or(stated("assetdir")).map_or("", |folder| folder.value);
        let strip = compilers.iter().any(|node| flag(reader, &Element::plain(*node), "strippath", "") == Some(true));
        Assets { folder: main.parent().unwrap_or(Path::new("")).join(folder), strip, files }
    }

    /// The content of a file, by its name in the model.
    ///
    /// # Errors
    /// Its path is absolute, or it cannot be read.
    pub fn bytes(&self, name: &str) -> Result<Vec<u8>, String> {
        let mut path = Path::new(name);
        if self.strip {
            path = path.file_name().map_or(path, Path::new);
        }
        if path.is_absolute() || path.has_root() {
            return Err("its path is not relative to the main file".into());
        }
        (self.files)(&self.folder.join(path)).map_err(|error| format!("cannot read {}: {error}", quote(name)))
    }
}

/// The name of an asset: its own, or that of its file without folder and extension.
fn name_of(element: &Element) -> Option<String> {
    let file = || Path::new(element.attribute("file")?.value).file_stem();
    element.name().map(|name| name.value.to_string()).or_else(|| Some(file()?.to_string_lossy().into_owned()))
}

/// Adds an asset to all of its kind, which is called `what`, by its name.
pub(super) fn add_named<'d>(
    reader: &mut Reader,
    all: &mut HashMap<String, Element<'d>>,
    element: Element<'d>,
    what: &str,
) {
    match name_of(&element) {
        Some(name) if all.contains_key(&name) => {
            let message = format!("{what} {} is defined twice", quote(&name));
            reader.findings.error(place(element.node), message, "rename one of them");
        }
        Some(name) => {
            all.insert(name, element);
        }
        None => {}
    }
}

/// The extension of a file in small letters.
pub(super) fn extension(name: &str) -> Option<String> {
    Path::new(name).extension().map(|e| e.to_string_lossy().to_ascii_lowercase())
}

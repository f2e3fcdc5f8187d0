//! `mesh` of a `collision`: a hull.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::shape::{numbers, Unread};
use crate::import::hull::{self, Told};
use crate::import::words::quote;
use crate::import::xml::{place, Reader};
use crate::import::ReadFile;
use roxmltree::Node;

/// What is said where neither a floor nor contacts between bodies are asked for.
pub(super) const IDLE: &str =
    "`mesh` of a `collision` is not used: meshes are read where a floor or contacts between bodies are asked for";
const LOST: &str = "`mesh` of a `collision` is not used: its file was not found";
const OTHER: &str = "`mesh` of a `collision` is not used: only STL and OBJ files are read";
const WITHOUT: &str = "`mesh` of a `collision` is not used: this program was built without the feature `hulls`";

/// How many folders above that of the robot a mesh is looked for in.
const ABOVE: usize = 4;

/// The meshes of a robot.
pub(super) struct Meshes<'m> {
    /// Where paths may start.
    folders: Vec<PathBuf>,
    files: ReadFile<'m>,
    /// Hulls by the names of files, with their scales.
    known: HashMap<(String, [u64; 3]), Vec<[f64; 3]>>,
    told: Told,
}

impl<'m> Meshes<'m> {
    /// Those of the robot in the file `path`.
    pub fn new(path: &Path, files: ReadFile<'m>) -> Self {
        let own = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut folders = vec![own];
        for _ in 0..ABOVE {
            let last = &folders[folders.len() - 1];
            folders.push(last.join(".."));
        }
        Meshes { folders, files, known: HashMap::new(), told: Told::default() }
    }

    /// The corners of the hull of a mesh.
    pub fn hull(&mut self, reader: &Reader, node: Node) -> Result<Vec<[f64; 3]>, Unread> {
        let at = place(node);
        let faulty = |what: String| Unread::Faulty(at, what);
        let name = reader.attribute(node, "filename").map(|name| name.value.trim()).filter(|name| !name.is_empty());
        let name = name.ok_or_else(|| faulty("a mesh needs a `filename`".into()))?;
        let scale = numbers::<3>(reader, node, "scale")?.map_or([1.0; 3], |scale| scale.value);
        if scale.contains(&0.0) {
            return Err(faulty("its `scale` has a 0".into()));
        }
        if !cfg!(feature = "hulls") {
            return Err(Unread::Mesh(at, WITHOUT));
        }
        let extension = Path::new(name).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension.as_deref(), Some("stl" | "obj")) {
            return Err(Unread::Mesh(at, OTHER));
        }
        let key = (name.to_string(), scale.map(f64::to_bits));
        if let Some(known) = self.known.get(&key) {
            self.told.add(at, None);
            return Ok(known.clone());
        }
        let found = self.paths(name).into_iter().find_map(|path| (self.files)(&path).ok().map(|bytes| (path, bytes)));
        let (path, bytes) = found.ok_or(Unread::Mesh(at, LOST))?;
        let points = hull::of_mesh(&path, &bytes, scale).map_err(|problems| {
            let first = problems.first();
            let line = first.filter(|p| p.line > 0).map_or(String::new(), |p| format!("line {}: ", p.line));
            faulty(format!("{}: {line}{}", quote(name), first.map_or("", |p| &p.message)))
        })?;
        let corners = hull::corners(&points, hull::MOST.2).map_err(faulty)?;
        self.told.add(at, Some(&corners));
        let corners = corners.corners;
        self.known.insert(key, corners.clone());
        Ok(corners)
    }

    /// Where the file may be that a `filename` names: as it is beside the robot and in the folders above, of which one is
    /// that of the package.
    fn paths(&self, name: &str) -> Vec<PathBuf> {
        let package = name.strip_prefix("package://").or(name.strip_prefix("model://"));
        match package {
            Some(path) => {
                let inside = path.split_once('/').map_or(path, |(_, inside)| inside);
                self.folders.iter().flat_map(|folder| [folder.join(path), folder.join(inside)]).collect()
            }
            None => {
                let path = name.strip_prefix("file://").unwrap_or(name);
                self.folders.iter().map(|folder| folder.join(path)).collect()
            }
        }
    }

    /// Says how many there are.
    pub fn tell(self, reader: &mut Reader) {
        self.told.tell(reader.findings);
    }
}

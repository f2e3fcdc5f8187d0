//! `mbd view`: a page for browsers, one file without requests, in which the mechanism moves.
//!
//! The page has the readers, the generator and the integrators as WebAssembly, `page.wasm.lzma`, and its scripts, the
//! JavaScript files of this folder, with its style as `page.js.lzma`. `.ci/page.sh` builds both.

mod gltf;
mod serve;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use multibody::codegen::model::ShapeKind;
use multibody::codegen::read::{load_with, to_toml, Base, Floor, ImportOptions};
use serde_json::json;

use super::args::ViewArgs;
use super::output::{note, writable, write_files};
use super::{ink, source, Failure, Outcome};

/// What runs in the page's worker, compressed.
const WASM: &[u8] = include_bytes!("page.wasm.lzma");
/// The JavaScript files and the style, packed by `page/scripts.mjs` and compressed.
const SCRIPTS: &[u8] = include_bytes!("page.js.lzma");
/// What decompresses both in the page.
const UNPACK: &str = include_str!("unpack.js");
const TEMPLATE: &str = include_str!("page.html");

/// A script without comments, and without spaces and line ends that it does not need; lines with texts in them are kept.
fn compact(text: &str) -> String {
    const MARKS: &str = "=+-*/%&|<>?:,;(){}[]";
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//"));
    let mut out = String::new();
    for line in lines {
        if line.contains(['"', '`', '\'']) {
            out = out + line + "\n";
            continue;
        }
        let mut rest = line.chars().peekable();
        while let Some(letter) = rest.next() {
            let beside = out.ends_with(|c| MARKS.contains(c)) || rest.peek().is_some_and(|c| MARKS.contains(*c));
            if letter != ' ' || !beside {
                out.push(letter);
            }
        }
        if !out.ends_with([';', '{', '}', ',']) {
            out.push('\n');
        }
    }
    out
}

/// Writes the page of a model, or serves an empty one on which files can be dropped.
pub fn run(args: &ViewArgs, out: &mut dyn Write) -> Outcome {
    if let (Some(file), Some(model)) = (&args.gltf, &args.model) {
        return gltf::run(args, model, file, out);
    }
    let given = match &args.model {
        Some(model) => Given::read(args, model)?,
        None if args.output.is_none() => return serve::run(&page(&Given::default()), args.port, out),
        None => Given::default(),
    };
    let file = args.output.clone().unwrap_or_else(|| PathBuf::from(given.file_name()));
    if file == Path::new("-") {
        return Ok(out.write_all(page(&given).as_bytes())?);
    }
    writable(&file)?;
    let page = page(&given);
    write_files(&[(&file, &page)])?;
    let (shown, size) = (file.display(), page.len() / 1000);
    Ok(writeln!(out, "{shown}: {size} kB; open it in a browser (xdg-open {shown})")?)
}

/// The files of a page's mechanism.
#[derive(Default)]
struct Given {
    /// Name of the mechanism.
    title: Option<String>,
    /// Name of the description among the files.
    name: Option<String>,
    files: BTreeMap<String, Vec<u8>>,
    floating: bool,
    floor: Option<f64>,
}

impl Given {
    /// Reads a model, and what it includes.
    fn read(args: &ViewArgs, path: &Path) -> Outcome<Given> {
        let text = source::read(path)?;
        let options = ImportOptions { floor: floor(args.floor), ..args.import.import() };
        let included = RefCell::new(BTreeMap::new());
        let files = |path: &Path| {
            let bytes = source::base(path)?;
            included.borrow_mut().insert(file_name(path), bytes.clone());
            Ok(bytes)
        };
        let (read, findings) = load_with(&path.to_string_lossy(), &text, &options, &files);
        if !findings.0.is_empty() {
            note(format_args!("{findings}"));
        }
        let (model, _) = read.ok_or(Failure::Shown)?;
        if options.gravity.is_some() || options.base == Base::Planar {
            let help = "convert the model with these options first: `mbd convert MODEL --gravity .. -o model.toml`";
            return Err(Failure::new("the page takes neither --gravity nor --base planar", help));
        }
        if model.shapes.iter().any(|shape| matches!(shape.kind, ShapeKind::HeightField { .. })) {
            let help = "remove the shape and its contacts; `mbd simulate --picture` draws height fields on the ground";
            return Err(Failure::new("the page has no height fields", help));
        }
        let mut name = file_name(path);
        let mut files = included.into_inner();
        // The page makes no hulls: it is given their corners.
        let hulls = model.shapes.iter().any(|shape| matches!(shape.kind, ShapeKind::Hull { .. }));
        match hulls.then(|| to_toml(&path.to_string_lossy(), &text, &options, &source::base)) {
            Some(Ok((converted, _))) => {
                name = Path::new(&name).with_extension("toml").to_string_lossy().into_owned();
                files = BTreeMap::from([(name.clone(), converted.into_bytes())]);
            }
            Some(Err(_)) => {
                note(format_args!("{}: notice: the page leaves out hulls of meshes", path.display()));
                files.insert(name.clone(), text.into_bytes());
            }
            None => drop(files.insert(name.clone(), text.into_bytes())),
        }
        let floating = options.base == Base::Floating;
        Ok(Given { title: Some(model.name), name: Some(name), files, floating, floor: args.floor })
    }

    /// Name of the page's file where none is given: that of the description.
    fn file_name(&self) -> String {
        let stem = Path::new(self.name.as_deref().unwrap_or("mbd-view")).file_stem().unwrap_or_default();
        format!("{}.html", stem.to_string_lossy())
    }

    /// What the page's script reads.
    fn json(&self) -> String {
        let files: Vec<[String; 2]> = self.files.iter().map(|(name, bytes)| [name.clone(), base64(bytes)]).collect();
        let options = json!({ "floating": self.floating, "floor": self.floor });
        for_script(&json!({ "name": self.name, "files": files, "options": options }).to_string())
    }
}

/// Friction of the floor, as that of the page.
const FRICTION: f64 = 0.8;

/// A floor at a height.
fn floor(height: Option<f64>) -> Option<Floor> {
    height.map(|height| Floor { height, friction: FRICTION })
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// JSON in an element `script`, which no text in it may end.
fn for_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// The page.
fn page(given: &Given) -> String {
    let title = given.title.as_ref().map_or("mbd view".to_string(), |name| format!("{name} · mbd view"));
    let (title, json, inks) = (ink::escaped(&title), given.json(), ink::json());
    let (wasm, scripts) = (letters(WASM), letters(SCRIPTS));
    filled(
        TEMPLATE,
        &[
            ("TITLE", &title),
            ("GIVEN", &json),
            ("WASM", &wasm),
            ("SCRIPTS", &scripts),
            ("UNPACK", &compact(UNPACK)),
            ("INKS", &inks),
        ],
    )
}

/// A template with its places, `@NAME@`, filled in their order.
fn filled(template: &str, places: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = template;
    for (name, value) in places {
        if let Some((before, after)) = rest.split_once(&format!("@{name}@")) {
            out += before;
            out += value;
            rest = after;
        }
    }
    out + rest
}

/// Bytes as letters of seven bits each, which UTF-8 writes as one byte, so that a page has 8/7 of the bytes and not 4/3 as with
/// Base64. Where HTML would change a letter (0, the return of the carriage, `<`), it and the next one are one letter of two
/// bytes, from 256 on. `unpack.js` reads them.
fn letters(bytes: &[u8]) -> String {
    const CHANGED: [u8; 3] = [0, 13, 60];
    let mut out = String::with_capacity(bytes.len() / 7 * 8 + 8);
    let bit = |k: usize| bytes.get(k / 8).map_or(0, |byte| byte >> (7 - k % 8) & 1);
    let mut sevens = (0..(8 * bytes.len()).div_ceil(7)).map(|k| (0..7).fold(0, |seven, i| seven << 1 | bit(7 * k + i)));
    while let Some(seven) = sevens.next() {
        match CHANGED.iter().position(|changed| *changed == seven) {
            None => out.push(char::from(seven)),
            Some(k) => {
                let next = u32::from(sevens.next().unwrap_or_default());
                out.extend(char::from_u32(256 + 128 * k as u32 + next));
            }
        }
    }
    out
}

/// Bytes in the letters of Base64 (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let all = three.iter().fold(0_u32, |all, byte| all << 8 | u32::from(*byte)) << (8 * (3 - three.len()));
        let letters = (0..4).map(|k| LETTERS[(all >> (18 - 6 * k) & 63) as usize] as char);
        out.extend(letters.take(three.len() + 1));
        out.extend(std::iter::repeat_n('=', 3 - three.len()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_none_that_html_changes() {
        let bytes: Vec<u8> = (0..=255).chain([0; 20]).chain([60; 3]).collect();
        let text = letters(&bytes);
        assert!(!text.contains(['\0', '\r', '<']) && text.len() <= bytes.len() / 7 * 8 + 10);
        assert_eq!(letters(&[0b0000_0010, 0b0100_0000]), "\u{1}\u{10}\u{100}");
    }

    #[test]
    fn base64_of_the_standard() {
        for (bytes, letters) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(bytes.as_bytes()), letters);
        }
    }
}

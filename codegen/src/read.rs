//! Reading a description: text to a raw model by its format, then the checks. The one door to both.

use std::io::Read;
use std::path::Path;

use crate::check::{changed, check};
use crate::diag::Diagnostics;
use crate::import::raw::RawModel;
use crate::import::source::{Findings, Span};
use crate::import::words::{did_you_mean, list, quote};
use crate::import::{mjcf, toml, urdf, XmlFormat};
use crate::model::Model;
use crate::names::rust_name;

pub use crate::import::{Base, Floor, ImportOptions, ReadFile};

/// A model that was read.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reading {
    /// The model.
    pub model: Model,
    /// Its variants, in the order of the text.
    pub variants: Vec<Variant>,
    /// Warnings and notices about its description.
    pub findings: Diagnostics,
}

/// A model after changes of its tree, as its description says (`[[variant]]`).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Variant {
    /// Name.
    pub name: String,
    /// The model. It is called after the model that it is a variant of, and the variant.
    pub model: Model,
}

/// Reads and checks a description in the format its file name ends in: `.toml`, `.urdf`, `.mjcf`, or `.xml` with a
/// `<robot>` (URDF) or a `<mujoco>` (MJCF) in it.
///
/// `file` names the source in the findings and in the origins of the model, and gives the model its name if the text
/// does not. Of other files, only the `[base]` and the meshes that a TOML text names, the included files and meshes of an MJCF text, and,
/// with a floor or contacts between bodies, the meshes of a URDF text are read, from their paths relative to the folder of `file`.
///
/// # Errors
/// All findings at once, in the order of the text, where one of them is an error.
pub fn model(file: &str, text: &str, options: &ImportOptions) -> Result<Reading, Diagnostics> {
    match load_all(file, text, options) {
        (Some((model, variants)), findings) => Ok(Reading { model, variants, findings }),
        (None, findings) => Err(findings),
    }
}

impl Model {
    /// Reads and checks a description: [`model`] of a file, with the import options at their defaults. Warnings and
    /// notices are not returned.
    ///
    /// # Errors
    /// All findings at once where one of them is an error; a file that cannot be read is one.
    pub fn load(path: impl AsRef<Path>) -> Result<Model, Diagnostics> {
        read_file(path.as_ref()).map(|reading| reading.model)
    }

    /// [`Model::load`], but the variant `name` of the model.
    ///
    /// # Errors
    /// Those of [`Model::load`]; a variant that there is not is one.
    pub fn load_variant(path: impl AsRef<Path>, name: &str) -> Result<Model, Diagnostics> {
        let reading = read_file(path.as_ref())?;
        reading.into_variant(name).map_err(|(message, help)| {
            let mut findings = Findings::new(&path.as_ref().display().to_string(), "");
            findings.error(Span::FILE, message, help);
            findings.finish()
        })
    }
}

impl Reading {
    /// The variant called so.
    ///
    /// # Errors
    /// There is none: a message, and what to do.
    pub fn into_variant(self, name: &str) -> Result<Model, (String, String)> {
        chosen(self.model, self.variants, Some(name))
    }
}

/// A model or, where a name is given, its variant of that name.
///
/// # Errors
/// There is none: a message, and what to do.
pub fn chosen(model: Model, variants: Vec<Variant>, name: Option<&str>) -> Result<Model, (String, String)> {
    let Some(name) = name else { return Ok(model) };
    let names: Vec<String> = variants.iter().map(|variant| variant.name.clone()).collect();
    let found = variants.into_iter().find(|variant| variant.name == name);
    found.map(|variant| variant.model).ok_or_else(|| {
        let names = || names.iter().map(String::as_str);
        let help = did_you_mean(name, names(), || match names().count() {
            0 => "describe it in the file as a `[[variant]]`".into(),
            _ => format!("the variants are {}", list(names())),
        });
        (format!("the model has no variant {}", quote(name)), help)
    })
}

fn read_file(path: &Path) -> Result<Reading, Diagnostics> {
    let name = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => model(&name, &text, &ImportOptions::default()),
        Err(error) => {
            let mut findings = Findings::new(&name, "");
            let help = "check its name and its access rights";
            findings.error(Span::FILE, format!("cannot read the file: {error}"), help);
            Err(findings.finish())
        }
    }
}

/// The same for tools that show findings either way: a model exactly where no finding is an error, and all findings,
/// those about its variants too.
pub fn load(file: &str, text: &str, options: &ImportOptions) -> (Option<Model>, Diagnostics) {
    let (model, findings) = load_all(file, text, options);
    (model.map(|(model, _)| model), findings)
}

/// [`load_with`], of the variant of that name if there is one; that there is no such variant is an error.
pub fn load_variant(
    file: &str,
    text: &str,
    options: &ImportOptions,
    files: ReadFile,
    variant: Option<&str>,
) -> (Option<Model>, Diagnostics) {
    let (read, mut findings) = load_with(file, text, options, files);
    let Some((model, variants)) = read else { return (None, findings) };
    match chosen(model, variants, variant) {
        Ok(model) => (Some(model), findings),
        Err((message, help)) => {
            let mut error = Findings::new(file, text);
            error.error(Span::FILE, message, help);
            findings.0.splice(0..0, error.finish().0);
            (None, findings)
        }
    }
}

/// [`load`], with all variants.
pub fn load_all(file: &str, text: &str, options: &ImportOptions) -> (Option<(Model, Vec<Variant>)>, Diagnostics) {
    load_with(file, text, options, &read_bytes)
}

/// Largest size of a description, bytes. None is as long, but a device file may be endless.
const LONGEST: u64 = 256 << 20;

/// Reads a file of at most 256 MiB.
///
/// # Errors
/// Those of reading, and a longer file.
pub fn read_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let length = std::fs::File::open(path)?.take(LONGEST + 1).read_to_end(&mut bytes)?;
    if length as u64 > LONGEST {
        return Err(std::io::Error::other(format!("it is longer than {} MiB", LONGEST >> 20)));
    }
    Ok(bytes)
}

/// [`load_all`], with the files that a text names read by `files`, to which their paths are given as they are relative to
/// `file`.
pub fn load_with(
    file: &str,
    text: &str,
    options: &ImportOptions,
    files: ReadFile,
) -> (Option<(Model, Vec<Variant>)>, Diagnostics) {
    let mut findings = Findings::new(file, text);
    let raw = raw_model(file, text, options, &mut findings, files);
    let mut variants = Vec::new();
    let model = raw.and_then(|raw| {
        let model = check(&raw, &mut findings);
        let base = findings.clone();
        for variant in &raw.variants {
            let mut of_variant = base.fresh();
            let raw = changed(&raw, variant, &mut of_variant);
            let model_of_variant = check(&raw, &mut of_variant);
            findings.take_variant(&quote(&variant.name.value), &base, of_variant);
            if let (Some(model), Some(mut changed)) = (&model, model_of_variant) {
                changed.name = rust_name(&format!("{}_{}", model.name, variant.name.value));
                variants.push(Variant { name: variant.name.value.clone(), model: changed });
            }
        }
        model
    });
    (model.filter(|_| !findings.has_errors()).map(|model| (model, variants)), findings.finish())
}

/// The model of a text before the checks, by the format that the file name ends in.
fn raw_model(
    file: &str,
    text: &str,
    options: &ImportOptions,
    findings: &mut Findings,
    files: ReadFile,
) -> Option<RawModel> {
    let extension = Path::new(file).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let mut refuse = |message: &str, help: &str| {
        findings.error(Span::FILE, message, help);
        None
    };
    if options.self_contact.is_some() && !cfg!(feature = "self_contact") {
        let help = "build it with the feature `self_contact` of `mbd-codegen`";
        return refuse("contacts between bodies are not part of this program", help);
    }
    const KNOWN: &str = "models are read from `.toml`, `.urdf` and `.xml` files";
    match extension.as_deref() {
        Some("toml") => toml::read(text, options, findings, files),
        Some("urdf") => urdf::read(text, options, findings, (Path::new(file), files)),
        Some("mjcf") => mjcf::read(text, options, findings, files),
        Some("xml") => match XmlFormat::of(text) {
            Some(XmlFormat::Urdf) => urdf::read(text, options, findings, (Path::new(file), files)),
            Some(XmlFormat::Mjcf) => mjcf::read(text, options, findings, files),
            None => refuse("no `<robot>` or `<mujoco>` in this file", "of XML formats, URDF and MJCF are read"),
        },
        Some("xacro") => refuse("xacro files have to be expanded first", "run `xacro model.xacro > model.urdf`"),
        Some(other) => refuse(&format!("cannot read files that end in {}", quote(other)), KNOWN),
        None => refuse("the file name does not tell the format", KNOWN),
    }
}

/// A JSON Schema (draft 4) of the TOML format, for editors.
pub fn json_schema() -> String {
    toml::schema()
}

/// A description of any format as one of the TOML format, which parameters, loops, frames and the rest can be added to.
/// The text is read back and compared: it describes an equal model, with equal variants. Comments are lost. With the text
/// come the warnings and notices about the source. A `[base]` is read by `files` and becomes part of the text.
///
/// # Errors
/// All findings where one of them is an error, and a floor or contacts between bodies in the options, which the TOML format describes
/// by shapes and contacts.
pub fn to_toml(
    file: &str,
    text: &str,
    options: &ImportOptions,
    files: ReadFile,
) -> Result<(String, Diagnostics), Diagnostics> {
    let (read, findings) = load_with(file, text, options, files);
    let Some(read) = read else { return Err(findings) };
    let refused = |message: &str, help: &str| {
        let mut findings = Findings::new(file, text);
        findings.error(Span::FILE, message, help);
        Err(findings.finish())
    };
    if options.floor.is_some() {
        return refused(
            "a floor of the options is not converted",
            "convert without it, and add a `plane` and contacts",
        );
    }
    if options.self_contact.is_some() {
        return refused(
            "contacts between bodies of the options are not converted",
            "convert without them, and add contacts",
        );
    }
    let Some(mut raw) = raw_model(file, text, options, &mut Findings::new(file, text), files) else {
        return Err(findings);
    };
    // Files of this project are judged strictly wherever they pass.
    for lenient in [false, raw.lenient] {
        raw.lenient = lenient;
        let converted = toml::write(&raw, &read.0.name);
        if load_all("converted.toml", &converted, &ImportOptions::default()).0.as_ref() == Some(&read) {
            return Ok((converted, findings));
        }
    }
    refused("the TOML format cannot express this model", "report this file: it shows a defect of the converter")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Gravity, Value};

    const TEXT: &str =
        "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'revolute'\nchild = 'a'\n";

    #[test]
    fn the_extension_decides() {
        let options = ImportOptions::default();
        assert!(model("m.toml", TEXT, &options).is_ok());
        assert!(model("dir/m.TOML", TEXT, &options).is_ok());
        for (file, text, expect) in [
            ("m.sdf", TEXT, "m.sdf: error: cannot read files that end in `sdf`"),
            ("m", TEXT, "m: error: the file name does not tell the format"),
            ("m.xml", TEXT, "m.xml: error: no `<robot>` or `<mujoco>` in this file"),
            ("m.xacro", TEXT, "m.xacro: error: xacro files have to be expanded first"),
        ] {
            let findings = model(file, text, &options).expect_err("a refusal");
            assert_eq!(findings.to_string().lines().next(), Some(expect));
        }
    }

    #[test]
    fn options_apply_to_toml() {
        let gravity = |g| model("m.toml", TEXT, &ImportOptions { gravity: Some(g), ..ImportOptions::default() });
        let read = gravity([0.0, -1.62, 0.0]).expect("a model");
        assert_eq!(read.findings.0, []);
        let wanted = Gravity::Constant([Value::Const(0.0), Value::Const(-1.62), Value::Const(0.0)]);
        assert_eq!(read.model.gravity, wanted);
        let findings = gravity([0.0, f64::NAN, 0.0]).expect_err("a refusal");
        assert!(findings.to_string().contains("gravity"), "{findings}");
        let findings = model("m.toml", TEXT, &ImportOptions { base: Base::Floating, ..ImportOptions::default() })
            .expect_err("a refusal");
        assert!(findings.to_string().contains("states its own base"), "{findings}");
    }
}

//! Reading a description: text to a raw model by its format, then the checks. The one door to both.

use std::path::Path;

use crate::check::check;
use crate::diag::Diagnostics;
use crate::import::source::{Findings, Span};
use crate::import::words::quote;
use crate::import::{toml, urdf};
use crate::model::Model;

pub use crate::import::{Base, Floor, ImportOptions};

/// A model that was read.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reading {
    /// The model.
    pub model: Model,
    /// Warnings and notices about its description.
    pub findings: Diagnostics,
}

/// Reads and checks a description in the format its file name ends in: `.toml`, `.urdf`, or `.xml` with a `<robot>` in
/// it.
///
/// `file` names the source in the findings and in the origins of the model, and gives the model its name if the text
/// does not; nothing is read from disk.
///
/// # Errors
/// All findings at once, in the order of the text, where one of them is an error.
pub fn model(file: &str, text: &str, options: &ImportOptions) -> Result<Reading, Diagnostics> {
    match load(file, text, options) {
        (Some(model), findings) => Ok(Reading { model, findings }),
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
        let name = path.as_ref().display().to_string();
        match std::fs::read_to_string(&path) {
            Ok(text) => model(&name, &text, &ImportOptions::default()).map(|reading| reading.model),
            Err(error) => {
                let mut findings = Findings::new(&name, "");
                findings.error(
                    Span::FILE,
                    format!("cannot read the file: {error}"),
                    "check its name and its access rights",
                );
                Err(findings.finish())
            }
        }
    }
}

/// The same for tools that show findings either way: a model exactly where no finding is an error, and all findings.
pub fn load(file: &str, text: &str, options: &ImportOptions) -> (Option<Model>, Diagnostics) {
    let mut findings = Findings::new(file, text);
    let extension = Path::new(file).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let mut refuse = |message: &str, help: &str| {
        findings.error(Span::FILE, message, help);
        None
    };
    const KNOWN: &str = "models are read from `.toml` and `.urdf` files";
    let raw = match extension.as_deref() {
        Some("toml") => toml::read(text, options, &mut findings),
        Some("urdf") => urdf::read(text, options, &mut findings),
        Some("xml") if text.contains("<robot") => urdf::read(text, options, &mut findings),
        Some("xml") => refuse("no `<robot>` in this file", "of XML formats only URDF can be read"),
        Some("xacro") => refuse("xacro files have to be expanded first", "run `xacro model.xacro > model.urdf`"),
        Some(other) => refuse(&format!("cannot read files that end in {}", quote(other)), KNOWN),
        None => refuse("the file name does not tell the format", KNOWN),
    };
    let model = raw.and_then(|raw| check(&raw, &mut findings));
    (model.filter(|_| !findings.has_errors()), findings.finish())
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
            ("m.xml", TEXT, "m.xml: error: no `<robot>` in this file"),
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

//! `mbd generate`.

use std::io::Write;
use std::path::Path;

use multibody::codegen::{self, GenerateError, Options};

use super::args::GenerateArgs;
use super::output::write_file;
use super::{source, Failure, Outcome};

/// Runs `mbd generate`: prints the code or writes it to a file.
pub fn run(args: &GenerateArgs, out: &mut dyn Write) -> Outcome {
    let path = &args.model.model;
    let model = source::model_of(&args.model)?;
    let base = Options { runtime: args.runtime.clone(), source: shown(path), ..args.code.options(&model.name) };
    let generated = codegen::generate(&model, &base).map_err(failure)?;
    source::tell_notices(path, &generated.notices);
    match &args.output {
        Some(file) => write_file(file, &generated.source),
        None => Ok(out.write_all(generated.source.as_bytes())?),
    }
}

/// Errors that remain possible with a valid model: unknown frames in the options, degrees of freedom without inertia.
pub fn failure(error: GenerateError) -> Failure {
    let help = match error {
        GenerateError::UnknownFrame { .. } => {
            "--frames takes names of bodies and of [[frame]] tables; leave it out for all"
        }
        GenerateError::OutputNeedsConstraints { .. } | GenerateError::OutputLacksConstraints { .. } => {
            "leave the output out; `mbd generate --help` says which models have it"
        }
        _ => "give the bodies behind that joint mass and inertia, or the joint an armature",
    };
    Failure::new(error.to_string(), help)
}

/// A path as it is written in the header of the code, the same on every machine.
pub fn shown(path: &Path) -> String {
    let name = || path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let parts: Vec<String> = path.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    let shown = match path.is_absolute() {
        true => name(),
        false => parts.into_iter().filter(|p| p != "." && p != "..").collect::<Vec<_>>().join("/"),
    };
    // The path is in a comment of one line.
    shown.replace(char::is_control, "?")
}

//! `mbd convert`.

use std::io::Write;

use multibody::codegen::read::{to_toml, ImportOptions};

use super::args::ConvertArgs;
use super::output::{mentioned, note, write_result};
use super::{source, Failure, Outcome};

/// Converts a description to the TOML format. Findings about the source go to standard error.
pub fn run(args: &ConvertArgs, out: &mut dyn Write) -> Outcome {
    let text = source::read(&args.model)?;
    let options = ImportOptions { limits: args.limits, ..args.import.import() };
    let file = args.model.to_string_lossy();
    let (toml, findings) =
        match mentioned(format!("converting {file}"), || to_toml(&file, &text, &options, &source::base)) {
            Ok(converted) => converted,
            Err(findings) => {
                note(format_args!("{findings}"));
                return Err(Failure::Shown);
            }
        };
    if !findings.0.is_empty() {
        note(format_args!("{findings}"));
    }
    write_result(args.output.as_deref(), &toml, out)
}

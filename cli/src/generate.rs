//! `mbd generate`.

use std::io::Write;
use std::path::{Path, PathBuf};

use multibody::codegen::model::Model;
use multibody::codegen::{self, c, wasm, GenerateError, Options};

use super::args::{GenerateArgs, Language};
#[cfg(feature = "fmu")]
use super::fmu;
use super::output::{write_files, write_result};
use super::{modes, source, Failure, Outcome};

/// Runs `mbd generate`: prints the code or writes it to files.
pub fn run(args: &GenerateArgs, out: &mut dyn Write) -> Outcome {
    let path = &args.model.model;
    #[cfg(feature = "fmu")]
    if args.lang == Language::Fmu {
        return fmu::run(args);
    }
    // Wrong names of files are reported before anything is computed.
    let file = args.output.as_deref();
    let c_files = (args.lang == Language::C).then(|| c_files(file)).transpose()?;
    let webassembly = matches!(args.lang, Language::Wasm | Language::WasmLanes);
    let module = webassembly.then(|| module_file(file)).transpose()?;
    let model = source::model_of(&args.model)?;
    let base = options(args, &model)?;
    if let Some(CFiles { source: file, header, name }) = c_files {
        let generated = c::generate(&model, &base, &name).map_err(failure)?;
        source::tell_notices(path, &generated.notices);
        return write_files(&[(&file, &generated.source), (&header, &generated.header)]);
    }
    if let Some(module) = module {
        let generate = if args.lang == Language::WasmLanes { wasm::generate_lanes } else { wasm::generate };
        let generated = generate(&model, &base).map_err(failure)?;
        source::tell_notices(path, &generated.notices);
        let (wrapper, types) = (module.with_extension("js"), module.with_extension("d.ts"));
        return write_files(&[
            (module, &generated.module[..]),
            (&wrapper, generated.wrapper.as_bytes()),
            (&types, generated.types.as_bytes()),
        ]);
    }
    let generated = codegen::generate(&model, &base).map_err(failure)?;
    source::tell_notices(path, &generated.notices);
    write_result(file, &generated.source, out)
}

/// Options of the generator.
pub fn options(args: &GenerateArgs, model: &Model) -> Outcome<Options> {
    let source = shown(&args.model.model);
    let modes = args.modes.as_deref().map(|modes| modes::choice(modes, Path::new(""), model)).transpose()?;
    Ok(Options { runtime: args.runtime.clone(), source, modes, ..args.code.options(&model.name) })
}

/// The two files of C.
struct CFiles {
    source: PathBuf,
    header: PathBuf,
    /// What both are called.
    name: String,
}

fn c_files(output: Option<&Path>) -> Outcome<CFiles> {
    let help = "name the source, as in -o robot.c; robot.h is written beside it";
    let Some(source) = output else { return Err(Failure::new("C is written to two files", help)) };
    let name = source.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if source.extension().is_none_or(|extension| extension != "c") || !plain {
        let rule = "made of letters from a to z, digits, `_` and `-`, with `.c` at the end";
        let what = format!("`{}` is no name of a C source, {rule}", source.display());
        return Err(Failure::new(what, help));
    }
    Ok(CFiles { source: source.to_path_buf(), header: source.with_extension("h"), name })
}

/// The file of a WebAssembly module, which stands beside its wrapper.
fn module_file(file: Option<&Path>) -> Outcome<&Path> {
    match file {
        Some(file) if file.extension().is_some_and(|extension| extension == "wasm") => Ok(file),
        _ => Err(Failure::new(
            "WebAssembly needs the name of a file that ends with `.wasm`",
            "`-o robot.wasm` writes robot.wasm, robot.js and robot.d.ts",
        )),
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
        GenerateError::ModesNeedContacts { .. } => "leave --modes out, or add [[shape]] and [[contact]] to the model",
        GenerateError::NumberOfModes { .. } | GenerateError::TooManyModes { .. } => {
            "`mbd simulate MODEL --record-modes FILE` writes the sets that a motion visits; `--modes FILE` takes them"
        }
        GenerateError::ModesNeedRust => "leave --modes or --lang out",
        GenerateError::OutputNeedsContacts { .. } => "add --modes masked",
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

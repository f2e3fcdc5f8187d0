//! `mbd generate --lang fmu`: units of the Functional Mock-up Interface.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use multibody::codegen::c::{self, Fmu};
use multibody::codegen::Precision;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::args::GenerateArgs;
use super::generate::{failure, options};
use super::output::{note, writable, write_files};
use super::{source, Failure, Outcome};

/// Folder of the shared library for this machine, if the standard has a name for it.
const BINARIES: Option<&str> = match (cfg!(target_os = "linux"), cfg!(target_arch = "x86_64")) {
    (true, true) => Some("binaries/linux64"),
    _ => None,
};

/// Writes a unit for model exchange.
pub fn run(args: &GenerateArgs) -> Outcome {
    let path = &args.model.model;
    let Some(file) = args.output.as_deref() else {
        return Err(Failure::new("an FMU is written to a file", "name it, as in -o robot.fmu"));
    };
    writable(file)?;
    if args.code.scalar != Precision::F64 {
        return Err(Failure::new("numbers of an FMU are doubles", "leave `--scalar` out"));
    }
    let model = source::model_of(&args.model)?;
    if !model.constraints.is_empty() {
        let what = format!("an FMU cannot keep the loops and couplings of `{}` closed", model.name);
        return Err(Failure::new(what, "model exchange has no projection of states: use generated Rust or C"));
    }
    if !model.contacts.is_empty() {
        let what = format!("an FMU would leave out the contacts and stops of `{}`", model.name);
        return Err(Failure::new(
            what,
            "its unit has no events: take the contacts and limits out, or use generated Rust",
        ));
    }
    let unit = c::fmu(&model, &options(args, &model)?).map_err(failure)?;
    source::tell_notices(path, &unit.notices);
    let library = library(&unit)?;
    let content = zipped(&unit, library.as_deref())
        .map_err(|e| Failure::new(format!("cannot make `{}`: {e}", file.display()), "is there memory for it?"))?;
    write_files(&[(file, content)])
}

/// The files as a zip file, the same bytes whenever it is made.
fn zipped(unit: &Fmu, library: Option<&[u8]>) -> Result<Vec<u8>, zip::result::ZipError> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let plain = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in &unit.files {
        zip.start_file(name.as_str(), plain)?;
        zip.write_all(content.as_bytes())?;
    }
    if let (Some(library), Some(folder)) = (library, BINARIES) {
        zip.start_file(format!("{folder}/{}.so", unit.identifier), plain.unix_permissions(0o755))?;
        zip.write_all(library)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// The shared library of a unit, or a note why there is none.
fn library(unit: &Fmu) -> Outcome<Option<Vec<u8>>> {
    let without = |why: &str| {
        note(format_args!("notice: {why}: the FMU has its sources, and no shared library"));
        Ok(None)
    };
    if BINARIES.is_none() {
        return without("shared libraries are made on Linux with x86-64 only");
    }
    let Some(compiler) = compiler() else { return without("no C compiler was found (CC, cc, gcc, clang)") };
    let folder = Folder::new().map_err(|e| {
        Failure::new(format!("cannot write temporary files: {e}"), "check the folder of the variable TMPDIR")
    })?;
    match compiled(unit, &compiler, &folder.0) {
        Ok(library) => Ok(Some(library)),
        Err(words) => without(&format!("`{compiler}` does not compile the sources ({words})")),
    }
}

fn compiled(unit: &Fmu, compiler: &str, folder: &Path) -> Result<Vec<u8>, String> {
    let words = |e: std::io::Error| e.to_string();
    let mut sources = Vec::new();
    for (name, content) in unit.files.iter().filter_map(|(path, c)| Some((path.strip_prefix("sources/")?, c))) {
        std::fs::write(folder.join(name), content).map_err(words)?;
        sources.extend(name.ends_with(".c").then_some(name));
    }
    let flags =
        ["-std=c99", "-O3", "-ffp-contract=fast", "-fPIC", "-shared", "-fvisibility=hidden", "-lm", "-o", "unit.so"];
    let output = Command::new(compiler).current_dir(folder).args(sources).args(flags).output().map_err(words)?;
    match output.status.success() {
        true => std::fs::read(folder.join("unit.so")).map_err(words),
        false => Err(String::from_utf8_lossy(&output.stderr).lines().next().unwrap_or("no message").to_string()),
    }
}

/// The compiler of the variable `CC`, or the first that is there.
fn compiler() -> Option<String> {
    let named = std::env::var("CC").ok().filter(|name| !name.is_empty());
    let mut names = named.into_iter().chain(["cc", "gcc", "clang"].map(String::from));
    names.find(|name| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success()))
}

/// A folder that is removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new() -> std::io::Result<Folder> {
        // One of a run that was killed may be there, of a process with the same number.
        let name = |k: u32| std::env::temp_dir().join(format!("mbd-fmu-{}-{k}", std::process::id()));
        let mut k = 0;
        loop {
            match std::fs::create_dir(name(k)) {
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists && k < 1000 => k += 1,
                made => return made.map(|()| Folder(name(k))),
            }
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

//! `mbd generate --lang c` and `--lang fmu`: files, messages, the example, a simulation by FMPy.

use std::path::Path;
use std::process::Command;

use crate::run::{bad, err, files, folder, good, is_there, read, run_in, skipped, write, ROOT};

const STRICT: [&str; 8] =
    ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-O2", "-ffp-contract=fast"];

/// Runs another program, which must succeed, and returns what it prints.
fn printed(command: &mut Command) -> String {
    let output = command.output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The committed C of the example. `mbd generate models/double_pendulum.toml --lang c -o examples/c/double_pendulum.c`
/// writes it anew.
#[test]
fn the_example_is_current_and_keeps_its_energy() {
    let folder = folder("c_example");
    let model = "models/double_pendulum.toml";
    let target = folder.join("double_pendulum.c");
    good(run_in(Path::new(ROOT), &["generate", model, "--lang", "c", "-o", target.to_str().expect("a path")]));
    assert_eq!(files(&folder), ["double_pendulum.c", "double_pendulum.h"]);
    let example = Path::new(ROOT).join("examples/c");
    for name in files(&folder) {
        assert!(read(&folder, &name) == read(&example, &name), "examples/c/{name} is not current");
    }
    for compiler in ["gcc", "clang"].into_iter().filter(|compiler| is_there(compiler)) {
        let sources = ["rk4.c", "double_pendulum.c"].map(|name| example.join(name));
        let program = folder.join(compiler);
        printed(Command::new(compiler).args(STRICT).args(sources).arg("-o").arg(&program));
        keeps_its_energy(&program);
    }
}

/// The example's program says how much its energy changes.
fn keeps_its_energy(program: &Path) {
    let text = printed(&mut Command::new(program));
    let change = text.split("changed by ").nth(1).and_then(|rest| rest.split(' ').next());
    let change: f64 = change.and_then(|x| x.parse().ok()).unwrap_or_else(|| panic!("{text}"));
    // The local error of the method is some h⁵ = 1e-15 J in each of 10,000 steps.
    assert!(change.abs() < 1e-9, "{text}");
}

#[test]
fn cmake_builds_the_example() {
    if !is_there("cmake") {
        return;
    }
    let (folder, source) = (folder("c_cmake"), Path::new(ROOT).join("examples/c"));
    let build = folder.join("build");
    printed(Command::new("cmake").arg("-S").arg(source).arg("-B").arg(&build).arg("-DCMAKE_C_FLAGS=-Werror"));
    printed(Command::new("cmake").arg("--build").arg(&build));
    keeps_its_energy(&build.join("rk4"));
}

#[test]
fn headers_compile_as_cpp() {
    let folder = folder("c_header");
    good(run_in(
        &folder,
        &["generate", &format!("{ROOT}/models/panda.urdf"), "--lang", "c", "--outputs", "all", "-o", "panda.c"],
    ));
    if is_there("g++") {
        write(
            &folder,
            "main.cpp",
            "#include \"panda.h\"\nint main() { panda_inputs in; panda_inputs_init(&in); return 0; }\n",
        );
        let flags = ["-std=c++11", "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only", "main.cpp"];
        printed(Command::new("g++").current_dir(&folder).args(flags));
    }
}

#[test]
fn failures_leave_both_files_alone() {
    let folder = folder("c_failures");
    write(&folder, "old.c", "as it was");
    let model = format!("{ROOT}/models/ur5.urdf");
    let generate = |more: &[&str]| run_in(&folder, &[&["generate", &model, "--lang", "c"], more].concat());
    bad(generate(&[]), &["C is written to two files", "-o robot.c"]);
    bad(generate(&["-o", "robot.rs"]), &["`robot.rs` is no name of a C source"]);
    for name in ["1 b.c", "ä.c", "a+b.c", "a.b.c"] {
        bad(generate(&["-o", name]), &[&format!("`{name}` is no name of a C source"), "letters from a to z, digits"]);
    }
    bad(generate(&["-o", "none/robot.c"]), &["cannot write `none/robot.c`"]);
    bad(generate(&["-o", "old.c", "--outputs", "frames", "--frames", "nose"]), &["no frame or body is named `nose`"]);
    assert_eq!((files(&folder), read(&folder, "old.c")), (vec!["old.c".to_string()], "as it was".to_string()));
}

/// What FMPy does with a unit: its checks, and the angles and the change of energy after two seconds.
const FMPY: &str = "
import sys, fmpy, fmpy.validation
assert not fmpy.validation.validate_fmu('unit.fmu')
out = ['q.shoulder', 'q.elbow', 'energy.kinetic', 'energy.potential']
r = fmpy.simulate_fmu('unit.fmu', stop_time=2.0, start_values={'q.shoulder': 1.0}, output=out, relative_tolerance=1e-10)
e = r['energy.kinetic'] + r['energy.potential']
print(r['q.shoulder'][-1], r['q.elbow'][-1], e[-1] - e[0])
";

#[test]
fn fmpy_simulates_the_unit() {
    let folder = folder("fmu");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let unit = |name: &str| good(run_in(&folder, &["generate", &model, "--lang", "fmu", "-o", name]));
    let first = unit("unit.fmu");
    unit("again.fmu");
    let bytes = |name: &str| std::fs::read(folder.join(name)).expect("a unit");
    assert!(bytes("unit.fmu") == bytes("again.fmu"), "not the same bytes");
    assert_eq!(files(&folder), ["again.fmu", "unit.fmu"]);
    bad(run_in(&folder, &["generate", &model, "--lang", "fmu"]), &["an FMU is written to a file"]);
    bad(run_in(&folder, &["generate", &model, "--lang", "fmu", "--scalar", "f32", "-o", "x.fmu"]), &["doubles"]);
    let loops = format!("{ROOT}/models/mechanisms/fourbar.toml");
    bad(run_in(&folder, &["generate", &loops, "--lang", "fmu", "-o", "x.fmu"]), &["cannot keep the loops"]);
    let contacts = format!("{ROOT}/models/contacts/quadruped.toml");
    bad(
        run_in(&folder, &["generate", &contacts, "--lang", "fmu", "-o", "x.fmu"]),
        &["leave out the contacts and stops"],
    );
    if err(&first).contains("no shared library") {
        return skipped("no shared library was made");
    }
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_string());
    let has_fmpy = Command::new(&python).args(["-c", "import fmpy"]).output().is_ok_and(|o| o.status.success());
    if !has_fmpy {
        return skipped(&format!("`{python}` has no FMPy (pip install fmpy; PYTHON chooses the interpreter)"));
    }
    let text = printed(Command::new(python).current_dir(&folder).args(["-c", FMPY]));
    let found: Vec<f64> = text.split_whitespace().map(|x| x.parse().expect("a number")).collect();
    let options = ["--time", "2", "--q", "1,0", "--v", "0,0", "--rows", "1", "--csv", "s.csv", "--svg", "s.svg"];
    good(run_in(&folder, &[&["simulate", &model][..], &options].concat()));
    let table = read(&folder, "s.csv");
    let last: Vec<f64> = table.lines().last().expect("rows").split(',').map(|x| x.parse().expect("a number")).collect();
    // CVode sums errors of 1e-10 over some hundred steps, which the motion makes some ten times larger.
    for (found, expected) in found.iter().zip(&last[1..3]).chain([(&found[2], &0.0)]) {
        assert!((found - expected).abs() < 1e-6, "{text}\n{table}");
    }
}

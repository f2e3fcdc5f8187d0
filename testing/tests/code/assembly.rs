//! Code for lanes compiles to vector instructions. The test compiles emitted code and counts instructions of its
//! assembly.

use std::path::{Path, PathBuf};
use std::process::Command;

use mbd_codegen::model::Model;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{generate, Options, Output, Precision};

/// Runs the compiler that built this test, or the first one on the path.
fn rustc(arguments: &[&str], source: &Path, folder: &Path) {
    let compiler = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut command = Command::new(compiler);
    command.args([
        "--edition",
        "2021",
        "--crate-type",
        "rlib",
        "-C",
        "opt-level=3",
        "-C",
        "symbol-mangling-version=v0",
    ]);
    command.args(["--cap-lints", "allow", "--out-dir"]).arg(folder).args(arguments).arg(source);
    let output = command.output().expect("rustc runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The UR5.
fn arm() -> Model {
    let file = format!("{}/../models/ur5.urdf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&file).expect("the model");
    let (model, findings) = read::load(&file, &text, &ImportOptions::default());
    model.unwrap_or_else(|| panic!("{findings}"))
}

/// Fifty pendulums side by side: so many numbers are read and written that the compiler no longer tells which of many small arrays
/// overlap.
fn pendulums() -> Model {
    let one = |k: usize| {
        format!(
            "[[body]]\nname = \"b{k}\"\nmass = 1\ncom = [0, 0.1, {k}]\ninertia = [0.01, 0.02, 0.03]\n\n[[joint]]\nname = \"j{k}\"\ntype = \
             \"revolute\"\nchild = \"b{k}\"\naxis = [1, 0, 0]\n\n"
        )
    };
    let text: String = (0..50).map(one).collect();
    let text = format!("name = \"pendulums\"\n\n{text}");
    read::model("pendulums.toml", &text, &ImportOptions::default())
        .unwrap_or_else(|findings| panic!("{findings}"))
        .model
}

fn source(model: &Model, name: &str, precision: Precision) -> String {
    let options = Options {
        type_name: "Arm".to_string(),
        runtime: "mbd_runtime".to_string(),
        outputs: vec![Output::Rates],
        precision,
        ..Options::default()
    };
    let code = generate(model, &options).expect("code");
    let (t, lanes) = match precision {
        Precision::F64 => ("f64", 8),
        Precision::F32 => ("f32", 16),
    };
    format!(
        "mod {name} {{ {}
            pub fn use_lanes(arm: &ArmLanes<{lanes}>, q: &[[{t}; {lanes}]; Arm::NQ], p: &[[{t}; {lanes}]; Arm::NV],
                qd: &mut [[{t}; {lanes}]; Arm::NQ], pd: &mut [[{t}; {lanes}]; Arm::NV]) {{ arm.rates(q, p, qd, pd); }}
        }}
        pub use {name}::use_lanes as {name}_lanes;\n",
        code.source.replace("//!", "//")
    )
}

/// Bodies of the functions whose symbols contain all of the given words.
fn functions<'a>(assembly: &'a str, words: &[&str]) -> Vec<Vec<&'a str>> {
    let mut found = Vec::new();
    let mut body: Option<Vec<&str>> = None;
    for line in assembly.lines() {
        match line.strip_suffix(':') {
            Some(label) if !label.starts_with(['.', ' ', '\t']) => {
                found.extend(body.take());
                body = words.iter().all(|w| label.contains(w)).then(Vec::new);
            }
            _ if line.contains(".cfi_endproc") => found.extend(body.take()),
            _ => body.iter_mut().for_each(|b| b.push(line.trim())),
        }
    }
    found
}

/// Numbers of arithmetic instructions: on whole vectors of 32 bytes, and on single numbers.
fn arithmetic(body: &[&str], packed: &str, single: &str) -> (usize, usize) {
    let is = |word: &str, suffix: &str| {
        let name = word.strip_suffix(suffix).and_then(|n| n.strip_prefix('v')).unwrap_or("");
        ["add", "sub", "mul", "div", "fmadd", "fmsub", "fnmadd", "fnmsub"]
            .iter()
            .any(|k| name.strip_prefix(k).is_some_and(|rest| rest.chars().all(|c| c.is_ascii_digit())))
    };
    let count = |suffix: &str, register: &str| {
        let all = body.iter().filter(|l| l.split_whitespace().next().is_some_and(|word| is(word, suffix)));
        all.filter(|l| l.contains(register)).count()
    };
    (count(packed, "ymm"), count(single, "xmm"))
}

#[test]
fn lanes_are_vectors() {
    if !cfg!(target_arch = "x86_64") {
        eprintln!("this test does not check the assembly of {}", std::env::consts::ARCH);
        return;
    }
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("assembly");
    std::fs::create_dir_all(&folder).expect("room for the assembly");
    let runtime = Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/src/lib.rs");
    // A stand-in for libm, the only dependency of the runtime. Only integrators and intervals use its functions.
    let one = ["sqrt", "exp", "exp2", "log", "log2", "cbrt", "ceil", "floor", "rint"].map(|f| {
        let method = match f {
            "log" => "ln",
            "rint" => "round_ties_even",
            _ => f,
        };
        format!("pub fn {f}(x: f64) -> f64 {{ x.{method}() }}\n")
    });
    let stand_in = folder.join("libm.rs");
    std::fs::write(&stand_in, one.concat() + "pub fn pow(x: f64, y: f64) -> f64 { x.powf(y) }\n").expect("the source");
    rustc(&["--crate-name", "libm"], &stand_in, &folder);
    let math = format!("libm={}", folder.join("liblibm.rlib").display());
    // The code is compiled for AVX2, which every compiler knows, not for AVX-512. The runtime is compiled without the
    // interpreter, so that there is nothing else to link.
    let features = ["--cfg", "feature=\"std\"", "--crate-name", "mbd_runtime", "--extern", &math];
    rustc(&features, &runtime, &folder);
    let sources =
        [(arm(), "double", Precision::F64), (arm(), "single", Precision::F32), (pendulums(), "many", Precision::F64)];
    let text: String = sources.map(|(model, name, precision)| source(&model, name, precision)).concat();
    let file = folder.join("arms.rs");
    std::fs::write(&file, text).expect("the source");
    let library = format!("mbd_runtime={}", folder.join("libmbd_runtime.rlib").display());
    let here = folder.display().to_string();
    let emit = ["--emit", "asm", "-C", "codegen-units=1", "-L", &here, "--extern", &library, "--crate-name", "arms"];
    rustc(&emit, &file, &folder);
    let assembly = std::fs::read_to_string(folder.join("arms.s")).expect("the assembly");
    // The rates of the arm take about three hundred operations, those of the pendulums three each; sines and cosines take some forty,
    // in a loop where they are many.
    let expected = [("6double", "pd", "sd", 250, 80), ("6single", "ps", "ss", 250, 80), ("4many", "pd", "sd", 200, 80)];
    for (word, packed, single, least, least_fused) in expected {
        let bodies = functions(&assembly, &["9processor5fused", word]);
        let largest = bodies.iter().max_by_key(|b| b.len()).unwrap_or_else(|| panic!("no function of `{word}`"));
        let (vectors, numbers) = arithmetic(largest, packed, single);
        let fused = largest.iter().filter(|l| l.starts_with("vf") && l.contains("ymm")).count();
        eprintln!(
            "{word}: {vectors} instructions on whole vectors, {fused} of them fused; {numbers} on single numbers"
        );
        assert!(vectors > least && fused > least_fused, "{word}: {vectors} on vectors, {fused} fused");
        assert_eq!(numbers, 0, "{word}: on single numbers");
    }
}

//! The command `mbd`, run as a program.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::{json, Value};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// An empty directory for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cli_{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a directory");
    folder
}

fn run_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mbd")).current_dir(folder).args(arguments).output().expect("mbd runs")
}

/// Runs in the root of the repository.
fn run(arguments: &[&str]) -> Output {
    run_in(Path::new(ROOT), arguments)
}

fn out(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("UTF-8")
}

fn err(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).expect("UTF-8")
}

#[track_caller]
fn good(output: Output) -> Output {
    assert_eq!(output.status.code(), Some(0), "{}", err(&output));
    output
}

/// Exit status 1, nothing on standard output, a help line, and all of the texts in the messages.
#[track_caller]
fn bad(output: Output, texts: &[&str]) {
    let messages = err(&output);
    assert_eq!(output.status.code(), Some(1), "{messages}");
    assert_eq!(out(&output), "");
    assert!(messages.contains("\n  help: "), "{messages}");
    for text in texts {
        assert!(messages.contains(text), "`{text}` is not in:\n{messages}");
    }
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a directory")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path.to_string_lossy().into_owned()
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("a file")
}

#[test]
fn help_teaches() {
    let output = good(run(&["--help"]));
    for word in ["tour", "check", "count", "generate", "eval", "simulate", "explain", "Exit status"] {
        assert!(out(&output).contains(word), "{word}");
    }
    for command in ["check", "count", "generate", "eval", "simulate", "explain"] {
        let output = good(run(&[command, "--help"]));
        assert!(out(&output).contains("--gravity"), "{command}");
    }
    assert_eq!(run(&["chekc"]).status.code(), Some(2));
    let output = run(&["generate", "models/ur5.urdf", "--outputs", "rates,momemta"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(err(&output).contains("did you mean `momenta`?"), "{}", err(&output));
    assert_eq!(run(&["count", "models/ur5.urdf", "--gravity", "1,2"]).status.code(), Some(2));
}

#[test]
fn check_tells_what_is_sound() {
    let output = good(run(&["check", "models/satellite.toml", "models/panda.urdf"]));
    let lines: Vec<&str> = out(&output).lines().collect();
    assert_eq!(
        lines[0],
        "models/satellite.toml: sound: 3 bodies, 3 joints (1 floating, 2 pin), nq 7, nv 6, mass 138 kg, \
         prescribed joints: 2, external wrenches: 1"
    );
    assert!(lines[1].contains("joints that follow others: 1"), "{}", lines[1]);
    assert!(err(&output).contains("models/panda.urdf:28:5: notice:"), "{}", err(&output));
    let floating = good(run(&["check", "models/solo12.urdf", "--base", "floating"]));
    assert!(out(&floating).contains("nq 19, nv 18"), "{}", out(&floating));
}

#[test]
fn check_tells_all_findings() {
    let file = "codegen/tests/broken/toml/tree_unknown_names.toml";
    let expected = std::fs::read_to_string(format!("{ROOT}/codegen/tests/broken/toml/tree_unknown_names.txt"));
    let findings = expected.expect("the findings").lines().filter(|l| l.contains(": error: ")).count();
    let output = run(&["check", file]);
    let found = err(&output).lines().filter(|l| l.starts_with(&format!("{file}:")) && l.contains(": error: ")).count();
    assert!(findings > 1 && found == findings, "{findings} expected, {found} found");
    bad(output, &[]);
    // A sound model beside it is still told.
    let both = run(&["check", file, "models/ur5.urdf"]);
    assert_eq!(both.status.code(), Some(1));
    assert!(out(&both).contains("models/ur5.urdf: sound"), "{}", out(&both));
}

#[test]
fn files_that_cannot_be_read() {
    bad(run(&["check", "models/urf5.urdf"]), &["cannot read `models/urf5.urdf`", "did you mean `ur5.urdf`?"]);
    bad(run(&["count", "models"]), &["cannot read `models`"]);
    let folder = folder("unreadable");
    std::fs::write(folder.join("latin.toml"), b"name = 'a'\n# \xe9\n").expect("a file");
    bad(run_in(&folder, &["check", "latin.toml"]), &["latin.toml:2:3: error: not UTF-8 text"]);
}

fn json_of(output: &Output) -> Value {
    serde_json::from_str(out(output)).expect("JSON")
}

#[test]
fn counts() {
    let output = good(run(&["count", "models/chain6.toml", "--outputs", "all", "--json"]));
    let value = json_of(&output);
    assert_eq!(value["published"][0]["operations"], 363 * 6 - 475);
    let outputs = value["outputs"].as_array().expect("outputs");
    assert_eq!(outputs.len(), 8);
    for output in outputs {
        for key in ["total", "additions", "multiplications", "divisions", "square_roots", "sine_cosine_pairs"] {
            let sweeps = output["sweeps"].as_array().expect("sweeps");
            let sum: u64 = sweeps.iter().map(|s| s[key].as_u64().expect("a number")).sum();
            assert_eq!(output[key], sum, "{} {key}", output["output"]);
        }
    }
    let total = outputs[0]["total"].as_u64().expect("a number");
    assert!(total < 363 * 6 - 475, "{total} operations");
    let table = good(run(&["count", "models/chain6.toml"]));
    assert!(out(&table).contains("363n - 475") && out(&table).contains(&total.to_string()), "{}", out(&table));
    // The formulas hold for serial chains of pins on the ground alone.
    for other in [&["count", "models/panda.urdf"][..], &["count", "models/ur5.urdf", "--base", "floating"]] {
        let output = good(run(other));
        assert!(!out(&output).contains("363n"), "{}", out(&output));
    }
    // What is not there costs nothing.
    let rates = |more: &[&str]| {
        let arguments = [&["count", "models/ur5.urdf", "--outputs", "rates", "--json"], more].concat();
        json_of(&good(run(&arguments)))["outputs"][0]["total"].as_u64().expect("a number")
    };
    assert!(rates(&["--gravity", "0,0,0"]) < rates(&[]));
    assert!(rates(&["--no-efforts"]) < rates(&[]));
}

#[test]
fn generates_the_same_bytes() {
    let folder = folder("generate");
    let model = format!("{ROOT}/models/ur5.urdf");
    let printed = good(run(&["generate", "models/ur5.urdf", "--outputs", "rates,energy", "--name", "Arm"]));
    assert!(out(&printed).contains("pub struct Arm {") && out(&printed).contains("from models/ur5.urdf."));
    let written = |name: &str| {
        let arguments = ["generate", &model, "--outputs", "rates,energy", "--name", "Arm", "-o", name];
        assert_eq!(out(&good(run_in(&folder, &arguments))), "");
        read(&folder, name)
    };
    let (a, b) = (written("a.rs"), written("b.rs"));
    assert_eq!(a, b);
    // An absolute path shows as the name of the file.
    assert!(!a.contains(ROOT));
    assert_eq!(a.replace("from ur5.urdf.", "from models/ur5.urdf."), out(&printed));
    assert_eq!(files(&folder), ["a.rs", "b.rs"]);
    let single =
        good(run(&["generate", "models/double_pendulum.toml", "--scalar", "f32", "--runtime", "::mbd_runtime"]));
    assert!(out(&single).contains("[f32; 2]") && out(&single).contains("::mbd_runtime::System for DoublePendulum"));
}

#[test]
fn failures_leave_files_alone() {
    let folder = folder("failures");
    write(&folder, "old.rs", "as it was");
    let broken = format!("{ROOT}/codegen/tests/broken/toml/tree_cycle.toml");
    bad(run_in(&folder, &["generate", &broken, "-o", "old.rs"]), &["tree_cycle.toml:"]);
    let model = format!("{ROOT}/models/ur5.urdf");
    let unknown = ["generate", &model, "--outputs", "frames", "--frames", "nose", "-o", "old.rs"];
    bad(run_in(&folder, &unknown), &["no frame or body is named `nose`"]);
    bad(run_in(&folder, &["generate", &model, "-o", "none/new.rs"]), &["cannot write `none/new.rs`"]);
    bad(run_in(&folder, &["generate", &model, "-o", "."]), &["cannot write `.`"]);
    assert_eq!(files(&folder), ["old.rs"]);
    assert_eq!(read(&folder, "old.rs"), "as it was");
}

fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        v => vec![v.as_f64().expect("a number")],
    }
}

/// `mbd eval` on the states of the stored Pinocchio data, in Pinocchio's layout.
fn compare_with_reference(name: &str) {
    let text = std::fs::read_to_string(format!("{ROOT}/tests/reference/{name}.json")).expect("the data");
    let data: Value = serde_json::from_str(&text).expect("JSON");
    let states = data["states"].as_array().expect("states");
    let given = |s: &Value| {
        let wrenches = s.get("wrenches").cloned().unwrap_or(json!([]));
        json!({ "q": s["q"], "v": s["v"], "tau": s["tau"], "wrenches": wrenches })
    };
    let links: Vec<&str> =
        data["wrenches"].as_array().expect("wrenches").iter().map(|w| w["link"].as_str().expect("a link")).collect();
    let input = json!({ "states": states.iter().map(given).collect::<Vec<_>>() });
    let folder = folder(&format!("reference_{name}"));
    let input = write(&folder, "states.json", &input.to_string());
    let (file, base) = (data["file"].as_str().expect("a file"), data["base"].as_str().expect("a base"));
    let links = links.join(",");
    let mut arguments = vec!["eval", file, "--base", base, "--layout", "pinocchio", "--input", &input];
    if !links.is_empty() {
        arguments.extend(["--wrench", &links]);
    }
    let output = good(run(&arguments));
    let results = json_of(&output);
    let results = results["states"].as_array().expect("states");
    assert_eq!(results.len(), states.len());
    for key in ["p", "qd", "pd", "qdd", "kinetic", "potential", "M"] {
        for (ours, theirs) in results.iter().zip(states) {
            let (ours, theirs) = (numbers(&ours[key]), numbers(&theirs[key]));
            assert_eq!(ours.len(), theirs.len(), "{key}");
            // As in tests/reference.rs.
            let size = theirs.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
            for (a, b) in ours.iter().zip(&theirs) {
                assert!((a - b).abs() <= 1e-11 * size, "{name}: {key}: {a} and {b}");
            }
        }
    }
}

#[test]
fn eval_agrees_with_pinocchio() {
    for name in ["ur5", "kinova", "ur10", "pr2", "solo12"] {
        compare_with_reference(name);
    }
}

#[test]
fn eval_says_what_is_wrong() {
    let folder = folder("eval_errors");
    let eval = |model: &str, text: &str, texts: &[&str]| {
        let input = write(&folder, "in.json", text);
        bad(run(&["eval", model, "--input", &input]), texts);
    };
    let pendulum = "models/double_pendulum.toml";
    eval(pendulum, "{\"states\": [}", &["in.json:1:13: error: expected value"]);
    eval(pendulum, "[]", &["the file: error: not an object"]);
    eval(pendulum, "{\"state\": []}", &["unknown key `state`", "did you mean `states`?", "states: error: no list"]);
    let two = r#"{"states": [{"q": [0, 0], "v": [0, 0]}, {"q": [0], "v": [0, "a"], "tua": []}]}"#;
    let texts = [
        "states[1].q: error: 1 numbers, expected 2\n  help: in order: ",
        "states[1].v: error: not a list of numbers",
        "states[1]: error: unknown key `tua`\n  help: did you mean `tau`?",
    ];
    eval(pendulum, two, &texts);
    eval(pendulum, r#"{"states": [{"q": [0, 0]}]}"#, &["states[0].v: error: missing"]);
    eval(pendulum, r#"{"states": [{"q": [0, 1e999], "v": [0, 0]}]}"#, &["number out of range"]);
    let huge = r#"{"states": [{"q": [0, 0], "v": [0, 0]}, {"q": [0, 1], "v": [1e200, 1e200]}]}"#;
    eval(pendulum, huge, &["states[1]: the result `pd` is not finite"]);
    let gravity = r#"{"states": [{"q": [0, 0], "v": [0, 0], "gravity": [0, 0, 1]}], "params": {"m": 1}}"#;
    eval(pendulum, gravity, &["states[0].gravity: error: gravity is no input", "params: error: unknown key `m`"]);
    let ball = r#"{"states": [{"q": [0, 0, 0, 0.9, 0], "v": [0, 0, 0, 0], "wrenches": [[1]]}]}"#;
    eval("models/spherical_pendulum.toml", ball, &["has length 0.9, expected 1", "states[0].wrenches: error"]);
    bad(run(&["eval", pendulum, "--input", "no.json"]), &["cannot read `no.json`"]);
    bad(
        run(&["eval", pendulum, "--input", "no.json", "--wrench", "uper"]),
        &["--wrench: no body is named `uper`", "did you mean `upper`?"],
    );
    // A mass without size on a pin through it.
    let point = "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'a'\n\
                 [[body]]\nname = 'b'\nmass = { param = 'm' }\ncom = [1, 0, 0]\n[[joint]]\nname = 'k'\ntype = 'pin'\n\
                 parent = 'a'\nchild = 'b'\nxyz = [1, 0, 0]\n[params]\nm = 1\n";
    let point = write(&folder, "point.toml", point);
    let zero = r#"{"params": {"m": 0}, "states": [{"q": [0, 0], "v": [0, 0]}]}"#;
    eval(&point, zero, &["states[0]: the mass matrix is singular: freedom `k`"]);
}

/// Rotates by a quaternion w, x, y, z.
fn rotate(q: &[f64], x: &[f64]) -> Vec<f64> {
    let cross = |a: &[f64], b: &[f64]| -> Vec<f64> {
        (0..3).map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]).collect()
    };
    let once = cross(&q[1..4], x);
    let twice = cross(&q[1..4], &once);
    (0..3).map(|k| x[k] + 2.0 * (q[0] * once[k] + twice[k])).collect()
}

#[test]
fn eval_in_the_layout_of_mujoco() {
    let folder = folder("mujoco");
    // A free body with its mass at the origin: in outer axes it falls with g, whatever it does. Motions must not be zero.
    let body = "[[body]]\nname = 'a'\nmass = 2\ninertia = [1, 2, 2.5]\n[[joint]]\nname = 'j'\ntype = 'floating'\nchild = 'a'\n";
    let body = write(&folder, "body.toml", body);
    let q = [0.3, -1.0, 2.0, 0.5, -0.1, 0.7, 0.5];
    let state = json!({ "states": [{ "q": q, "v": [1.0, 2.0, 3.0, -1.0, 0.5, 2.0] }] });
    let input = write(&folder, "body.json", &state.to_string());
    let results = json_of(&good(run(&["eval", &body, "--input", &input, "--layout", "mujoco"])));
    let near = |a: &Value, b: &[f64]| {
        let a = numbers(a);
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} and {b:?}");
    };
    let state = &results["states"][0];
    near(&Value::from(numbers(&state["qdd"])[..3].to_vec()), &[0.0, 0.0, -9.81]);
    near(&Value::from(numbers(&state["p"])[..3].to_vec()), &[2.0, 4.0, 6.0]);
    near(&Value::from(numbers(&state["pd"])[..3].to_vec()), &[0.0, 0.0, -19.62]);
    near(&Value::from(numbers(&state["qd"])[..3].to_vec()), &[1.0, 2.0, 3.0]);
    // A robot: the force on all of it is its weight; momenta and mass matrix turn with the base.
    let q: Vec<f64> = q.iter().copied().chain((0..12).map(|k| 0.1 * f64::from(k) - 0.5)).collect();
    let v: Vec<f64> = (0..18).map(|k| 0.3 * f64::from(k) - 2.0).collect();
    let input = write(&folder, "solo.json", &json!({ "states": [{ "q": q, "v": v }] }).to_string());
    let solo = ["eval", "models/solo12.urdf", "--base", "floating", "--input", &input, "--layout", "mujoco"];
    let results = json_of(&good(run(&solo)));
    let (state, mass) = (&results["states"][0], 2.500_002_79);
    near(&Value::from(numbers(&state["pd"])[..3].to_vec()), &[0.0, 0.0, -9.81 * mass]);
    let (m, p) = (numbers(&state["M"]), numbers(&state["p"]));
    let product: Vec<f64> = m.chunks(18).map(|row| row.iter().zip(&v).map(|(a, b)| a * b).sum()).collect();
    near(&state["p"], &product);
    let twice: f64 = p.iter().zip(&v).map(|(p, v)| p * v).sum();
    near(&state["kinetic"], &[twice / 2.0]);
    // The same state in body axes.
    let back = [q[3], -q[4], -q[5], -q[6]];
    let own_q: Vec<f64> = [&q[..3], &q[4..7], &q[3..4], &q[7..]].concat();
    let own_v: Vec<f64> = [&rotate(&back, &v[..3])[..], &v[3..]].concat();
    let input = write(&folder, "own.json", &json!({ "states": [{ "q": own_q, "v": own_v }] }).to_string());
    let own = json_of(&good(run(&["eval", "models/solo12.urdf", "--base", "floating", "--input", &input])));
    let own_p = numbers(&own["states"][0]["p"]);
    near(&state["p"], &[&rotate(&q[3..7], &own_p[..3])[..], &own_p[3..]].concat());
}

#[test]
fn eval_picks_outputs_and_takes_all_inputs() {
    let folder = folder("eval_inputs");
    let state = json!({ "states": [{
        "q": [0, 0, 0, 0, 0, 0, 1], "v": [0, 0, 0, 0, 0, 0], "wrenches": [[1, 0, 0, 0, 0, 0]],
        "drive_q": [0.1, 0.2], "drive_v": [0, 1], "drive_a": [1, 0]
    }] });
    let input = write(&folder, "in.json", &state.to_string());
    let arguments = ["eval", "models/satellite.toml", "--input", &input, "--outputs", "qdd,kinetic", "-o"];
    let file = folder.join("out.json");
    assert_eq!(out(&good(run(&[&arguments[..], &[&file.to_string_lossy()]].concat()))), "");
    let results: Value = serde_json::from_str(&read(&folder, "out.json")).expect("JSON");
    let state = results["states"][0].as_object().expect("an object");
    let mut keys: Vec<&String> = state.keys().collect();
    keys.sort();
    assert_eq!(keys, ["kinetic", "qdd"]);
    assert!(state["kinetic"].as_f64() > Some(0.0), "the panel turns");
}

#[test]
fn simulates() {
    let folder = folder("simulate");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let output = good(run_in(&folder, &["simulate", &model, "--time", "2", "--every", "100"]));
    assert_eq!(files(&folder), ["double_pendulum.csv", "double_pendulum.svg"]);
    let table = read(&folder, "double_pendulum.csv");
    let rows: Vec<Vec<&str>> = table.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len(), 2 + 2000 / 100);
    assert_eq!(rows[0].len(), 1 + 2 + 2 + 2 + 3);
    assert!(rows.iter().all(|r| r.len() == rows[0].len()));
    let energy = |row: &Vec<&str>| row.last().expect("a column").parse::<f64>().expect("a number");
    let (first, last) = (energy(&rows[1]), energy(&rows[rows.len() - 1]));
    // Fourth order with a step of 1 ms: far below.
    assert!((first - last).abs() < 1e-6, "{first} and {last}");
    let picture = read(&folder, "double_pendulum.svg");
    assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
    assert!(picture.contains("time [s]") && picture.contains("angle [rad]"));
    assert!(out(&output).contains("energy error") && out(&output).contains("double_pendulum.svg"), "{}", out(&output));
    let start =
        ["simulate", &model, "--q", "0.1,-0.2", "--v", "-1,0", "--time", "0.01", "--csv", "a.csv", "--svg", "a.svg"];
    good(run_in(&folder, &start));
    assert!(read(&folder, "a.csv").lines().nth(1).expect("a row").starts_with("0,0.1,-0.2,-1,"));
}

#[test]
fn failed_simulations_write_nothing() {
    let folder = folder("simulate_failures");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let simulate = |more: &[&str]| run_in(&folder, &[&["simulate", &model], more].concat());
    bad(
        simulate(&["--v", "1e8,1e8", "--step", "1"]),
        &["the simulation failed", "is not finite after the step from t = "],
    );
    bad(simulate(&["--q", "1"]), &["--q has 1 numbers, expected 2", "in order: "]);
    bad(simulate(&["--csv", "a", "--svg", "a"]), &["both to be written to `a`"]);
    bad(simulate(&["--step", "1e-12"]), &["steps are too many"]);
    assert_eq!(simulate(&["--time", "-1"]).status.code(), Some(2));
    assert_eq!(simulate(&["--q", "nan,0"]).status.code(), Some(2));
    assert!(files(&folder).is_empty(), "{:?}", files(&folder));
}

#[test]
fn explains() {
    for (stage, texts) in [
        ("frames", &["way: Rx(-90°)", "zero in it:", "Vanished:"][..]),
        ("trace", &["made", "needed"]),
        ("simplify", &["= sin(q[", "results, in order"]),
        ("schedule", &["values alive at once", "longest chain"]),
    ] {
        let output = good(run(&["explain", "models/ur5.urdf", "--after", stage, "--outputs", "rates"]));
        for text in texts {
            assert!(out(&output).contains(text), "{stage}: {text}");
        }
    }
    for model in ["panda.urdf", "satellite.toml", "spherical_pendulum.toml", "chain6.toml"] {
        good(run(&["explain", &format!("models/{model}")]));
    }
}

#[test]
fn committed_code_is_fresh() {
    good(run(&["check", "--generated"]));
}

#[test]
fn stale_code_is_found_and_mended() {
    let root = folder("stale");
    let models = root.join("models");
    let folder = root.join("generated");
    std::fs::create_dir_all(&models).expect("a directory");
    std::fs::create_dir_all(&folder).expect("a directory");
    std::fs::copy(format!("{ROOT}/models/double_pendulum.toml"), models.join("double_pendulum.toml")).expect("a copy");
    let manifest =
        "[[file]]\nfile = \"pendulum.rs\"\nmodel = \"../models/double_pendulum.toml\"\ntype = \"Pendulum\"\n\
                    outputs = [\"rates\"]\n";
    write(&folder, "manifest.toml", manifest);
    bad(run_in(&root, &["check", "--generated"]), &["pendulum.rs: error: the file is missing", "--update"]);
    good(run_in(&root, &["check", "--generated", "--update"]));
    good(run_in(&root, &["check", "--generated", "generated"]));
    let fresh = read(&folder, "pendulum.rs");
    assert!(fresh.contains("from models/double_pendulum.toml."), "{}", &fresh[..200]);
    write(&folder, "pendulum.rs", &fresh.replacen("pub const NQ: usize = 2", "pub const NQ: usize = 3", 1));
    let line = fresh.lines().position(|l| l.contains("const NQ")).expect("the line") + 1;
    let place = format!("pendulum.rs:{line}:1: error: stale: `pub const NQ: usize = 3;` should be");
    bad(run_in(&root, &["check", "--generated"]), &[&place]);
    good(run_in(&root, &["check", "--generated", "--update"]));
    assert_eq!(read(&folder, "pendulum.rs"), fresh);
    write(&folder, "stray.rs", "");
    bad(run_in(&root, &["check", "--generated"]), &["stray.rs: error: not in manifest.toml"]);
    std::fs::remove_file(folder.join("stray.rs")).expect("removed");
    write(&folder, "manifest.toml", &manifest.replace("[\"rates\"]", "[\"rate\"]"));
    bad(run_in(&root, &["check", "--generated"]), &["`pendulum.rs`: `rate` is no output"]);
    write(&folder, "manifest.toml", &manifest.replace("outputs", "outptus"));
    bad(run_in(&root, &["check", "--generated"]), &["manifest.toml:5:1: error: unknown field `outptus`"]);
}

#[test]
fn the_tour() {
    let folder = folder("tour");
    let output = good(run_in(&folder, &[]));
    assert_eq!(files(&folder), ["mbd-tour.svg"]);
    for text in ["363n - 475", "equal bit for bit", "energy error", "mbd-tour.svg"] {
        assert!(out(&output).contains(text), "{text}");
    }
}

#[test]
fn nobody_listens() {
    let folder = folder("pipe");
    for arguments in
        [&["explain", "models/panda.urdf", "--after", "simplify"][..], &["--help"], &["check", "models/ur5.urdf"]]
    {
        let errors = std::fs::File::create(folder.join("stderr")).expect("a file");
        let mut child = Command::new(env!("CARGO_BIN_EXE_mbd"))
            .current_dir(ROOT)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(errors)
            .spawn()
            .expect("mbd runs");
        drop(child.stdout.take());
        let status = child.wait().expect("mbd ends");
        assert!(status.success(), "{arguments:?}: {status}");
        assert!(!read(&folder, "stderr").contains("panicked"), "{}", read(&folder, "stderr"));
    }
}

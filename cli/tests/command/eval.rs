//! The subcommand `mbd eval`.

use std::io::{ErrorKind, Write};
use std::process::{ChildStdin, Command, Output, Stdio};

use crate::run::*;
use serde_json::{json, Value};

/// All numbers of a value, in order.
pub fn numbers(v: &Value) -> Vec<f64> {
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
        json!({ "q": s["q"], "v": s["v"], "a": s["qdd"], "tau": s["tau"], "wrenches": wrenches })
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
    for key in ["p", "qd", "pd", "qdd", "kinetic", "potential", "M", "tau"] {
        for (ours, theirs) in results.iter().zip(states) {
            let (ours, theirs) = (numbers(&ours[key]), numbers(&theirs[key]));
            assert_eq!(ours.len(), theirs.len(), "{key}");
            // The tolerance is that of `tests/facade/reference.rs`.
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
fn many_states_have_the_numbers_of_the_interpreter() {
    let folder = folder("eval_many");
    let state = |k: u32| {
        let x = f64::from(k);
        json!({ "q": [x.sin(), (2.0 * x).cos()], "v": [0.3 * x.cos(), 0.1], "a": [0.2, x.sin()], "tau": [0.5, -x.cos()] })
    };
    let input = json!({ "states": (0..1000).map(state).collect::<Vec<_>>() });
    let input = write(&folder, "states.json", &input.to_string());
    let arguments = ["eval", "models/double_pendulum.toml", "--input", &input];
    let compiled = good(run(&arguments));
    assert!(err(&compiled).contains("states: 1000, evaluated by machine code (exact arithmetic"), "{}", err(&compiled));
    let interpreted = good(run(&[&arguments[..], &["--interpreted"]].concat()));
    assert!(
        err(&interpreted).contains("states: 1000, evaluated by the interpreter (--interpreted)"),
        "{}",
        err(&interpreted)
    );
    let few = json!({ "states": (0..3).map(state).collect::<Vec<_>>() });
    let few =
        good(run(&["eval", "models/double_pendulum.toml", "--input", &write(&folder, "few.json", &few.to_string())]));
    assert_eq!(err(&few), "");
    let of = |output: &_| json_of(output)["states"].as_array().expect("states").clone();
    for (a, b) in of(&compiled).iter().zip(&of(&interpreted)) {
        for key in ["p", "qd", "pd", "qdd", "M", "h", "tau"] {
            assert_eq!(numbers(&a[key]), numbers(&b[key]), "{key}");
        }
        assert_eq!((&a["kinetic"], &a["potential"]), (&b["kinetic"], &b["potential"]));
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
    let twice = "{\"q\": [0, 0],\n \"v\": [0, 0], \"v\": [1, 1]}";
    eval(pendulum, twice, &["in.json:2:17: error: the key `v` stands twice in one object"]);
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
    // The parameter removes the mass of the second body, so that its revolute joint has no inertia.
    let point = "[[body]]\nname = 'a'\nmass = 1\ncom = [1, 0, 0]\n[[joint]]\nname = 'j'\ntype = 'pin'\nchild = 'a'\n\
                 [[body]]\nname = 'b'\nmass = { param = 'm' }\ncom = [1, 0, 0]\n[[joint]]\nname = 'k'\ntype = 'pin'\n\
                 parent = 'a'\nchild = 'b'\nxyz = [1, 0, 0]\n[params]\nm = 1\n";
    let point = write(&folder, "point.toml", point);
    let zero = r#"{"params": {"m": 0}, "states": [{"q": [0, 0], "v": [0, 0]}]}"#;
    eval(&point, zero, &["states[0]: the mass matrix is singular: freedom `"]);
}

/// Runs `mbd eval` on states from standard input, to which `write` writes until it ends or the command does.
fn eval_piped(write: impl FnOnce(&mut ChildStdin) -> std::io::Result<()>) -> Output {
    let mut child = Command::new(PROGRAM)
        .current_dir(ROOT)
        .args(["eval", "models/double_pendulum.toml", "--input", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut input = child.stdin.take().expect("its standard input");
    let written = write(&mut input);
    drop(input);
    // A command that reads no further closes its end.
    assert!(written.is_ok() || written.is_err_and(|e| e.kind() == ErrorKind::BrokenPipe));
    child.wait_with_output().expect("the program ends")
}

#[test]
fn eval_reads_standard_input_up_to_its_limit() {
    let states = r#"{"states": [{"q": [0.1, 0.2], "v": [0.3, -0.4]}]}"#;
    let piped = good(eval_piped(|input| input.write_all(states.as_bytes())));
    let file = write(&folder("eval_piped"), "states.json", states);
    let of_file = good(run(&["eval", "models/double_pendulum.toml", "--input", &file]));
    assert_eq!(out(&piped), out(&of_file));
    // 257 MiB of blanks: one that read all of them would say that they are no JSON.
    let blanks = vec![b' '; 1 << 20];
    let endless = eval_piped(|input| (0..257).try_for_each(|_| input.write_all(&blanks)));
    bad(endless, &["cannot read standard input: it is longer than 256 MiB\n  help: pipe fewer states in"]);
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
    // The centre of mass of a free body is at its origin. In outer axes, the origin falls with g for any motion, so the
    // velocities of the test are not zero.
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
    // A floating robot: the total force is its weight, and momenta and mass matrix are in the axes of the layout.
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
    // The default layout gives the same state in body axes.
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
    // Some editors put a byte order mark in front.
    let marked = write(&folder, "marked.json", &format!("\u{feff}{}", read(&folder, "in.json")));
    let again = good(run(&["eval", "models/satellite.toml", "--input", &marked, "--outputs", "qdd,kinetic"]));
    assert_eq!(out(&again), read(&folder, "out.json"));
}

//! What the commands say about the digits of their results.

use std::path::Path;

use serde_json::Value;

use crate::eval::numbers;
use crate::run::*;

/// A body on one joint: a point of 1 kg at 1 m above it, or as the arguments say.
fn single(joint: &str, body: &str) -> String {
    format!(
        "name = \"single\"\n[[body]]\nname = \"body\"\nmass = 1.0\n{body}\n[[joint]]\nname = \"joint\"\nchild = \"body\"\n\
         {joint}\n"
    )
}

const UPRIGHT: &str = "com = [0, 0, 1]";
const REVOLUTE: &str = "type = \"revolute\"\naxis = [0, 1, 0]";

/// Simulates a model with few rows; returns the exit status, the report, and the messages.
fn simulate(folder: &Path, model: &str, more: &[&str]) -> (Option<i32>, String, String) {
    let arguments = [&["simulate", model, "--rows", "50", "--csv", "a.csv", "--svg", "a.svg"], more].concat();
    let output = run_in(folder, &arguments);
    (output.status.code(), out(&output).to_string(), err(&output).to_string())
}

/// The last row of the table.
fn end(folder: &Path) -> Vec<f64> {
    let table = read(folder, "a.csv");
    table.lines().last().expect("a row").split(',').map(|x| x.parse().expect("a number")).collect()
}

#[test]
fn the_energy_is_measured_by_the_tolerance() {
    let folder = folder("trust_energy");
    let pendulum = format!("{ROOT}/models/double_pendulum.toml");
    for tolerance in ["1e-5", "1e-9"] {
        let (code, report, messages) = simulate(&folder, &pendulum, &["--tolerance", tolerance]);
        assert_eq!((code, messages.as_str()), (Some(0), ""));
        let (found, allowed) = (number(&report, " J, "), number(&report, "steps allow "));
        assert!(found < allowed, "{report}");
        let relative = number(&report, "energy error: at most ");
        assert!((relative / tolerance.parse::<f64>().expect("a number") / found - 1.0).abs() < 0.3, "{report}");
    }
    // This parallelogram keeps its energy where its bars are in one line.
    let equal = format!("{ROOT}/models/mechanisms/fourbar_equal.toml");
    let (code, report, messages) = simulate(&folder, &equal, &["--time", "1", "--v", "8,0,0"]);
    assert!(code == Some(0) && !messages.contains("warning"), "{messages}");
    assert!(number(&report, "energy error: at most ") < 1e-10, "{report}");
    assert!(report.contains("\nsingular positions: passed at t = 0.4204 s (loop `closing_pin`"), "{report}");
    // By the errors of the coordinates alone, steps are too large for the momenta of a stiff spring.
    let stiff = write(&folder, "stiff.toml", &single("type = \"prismatic\"\naxis = [1, 0, 0]\nstiffness = 1e8", ""));
    let partial =
        ["--partial", "--tolerance", "1e-2", "--q", "0.1", "--v", "0", "--time", "0.2", "--method", "rodas5p"];
    let (code, _, messages) = simulate(&folder, &stiff, &partial);
    assert!(code == Some(1) && messages.contains("no digit of this motion can be trusted"), "{messages}");
    assert!(messages.contains("help: lower --tolerance"), "{messages}");
    let (_, report, messages) = simulate(&folder, &pendulum, &["--project", "--step", "0.01"]);
    assert!(report.contains("--project keeps it, so that it does not measure this run"), "{report}{messages}");
}

#[test]
fn dampers_take_what_the_energy_loses() {
    let folder = folder("trust_damped");
    let damped = write(&folder, "damped.toml", &single(&format!("{REVOLUTE}\ndamping = 0.5"), UPRIGHT));
    let balance = |more: &[&str]| {
        let (code, report, messages) = simulate(&folder, &damped, &[&["--q", "2", "--v", "1"], more].concat());
        assert_eq!((code, messages.as_str()), (Some(0), ""), "{report}");
        // Some joules of 4.8 are taken.
        assert!(number(&report, "energy: changes by up to ") > 1.0, "{report}");
        number(&report, "energy and work of the dampers differ by at most ")
    };
    for method in ["verner9", "dop853", "tsit5", "radau5", "adams", "rodas5p"] {
        for tolerance in [1e-5, 1e-9] {
            let found = balance(&["--method", method, "--tolerance", &format!("{tolerance:e}")]);
            // Measured: up to 3.5 times the tolerance.
            assert!(found < 20.0 * tolerance, "{method}: {found:e} at {tolerance:e}");
        }
    }
    assert!(balance(&["--step", "0.01"]) < 1e-5);
}

#[test]
fn runs_without_digits_say_so() {
    let folder = folder("trust_refusals");
    let pendulum = format!("{ROOT}/models/double_pendulum.toml");
    let far = "the step is far too large: it does not follow the motion";
    for method in ["rk4", "gauss6", "abm4", "implicit-midpoint", "euler"] {
        let (code, _, messages) = simulate(&folder, &pendulum, &["--step", "100", "--method", method]);
        let failed = messages.contains("the simulation failed") || messages.contains(far);
        assert!(code == Some(1) && failed && messages.contains("help: lower --step"), "{method}: {messages}");
    }
    // The energy is lost before the steps are too large to follow the motion.
    let (code, report, messages) = simulate(&folder, &pendulum, &["--step", "0.02", "--method", "euler"]);
    assert!(code == Some(1) && !messages.contains(far), "{messages}");
    assert!(messages.contains("no digit of this motion can be trusted"), "{messages}");
    assert!(number(&report, "step error: at most ") < 0.1, "{report}");
    let (code, report, messages) = simulate(&folder, &pendulum, &["--step", "0.01"]);
    assert_eq!((code, messages.as_str()), (Some(0), ""), "{report}");
    // The error of a step of order 4 falls with the fifth power of its size, by 32 for half of it.
    let (_, half, _) = simulate(&folder, &pendulum, &["--step", "0.005"]);
    let ratio = number(&report, "step error: at most ") / number(&half, "step error: at most ");
    assert!((16.0..64.0).contains(&ratio), "{ratio}");
    std::fs::remove_file(folder.join("a.csv")).expect("the table");
    bad(
        run_in(&folder, &["simulate", &pendulum, "--tolerance", "1e30"]),
        &["--tolerance 1e30 means nothing", "give one below 1"],
    );
    bad(
        run_in(&folder, &["simulate", &pendulum, "--q", "0,1e300"]),
        &["the start has no digits: doubles near the value of `elbow` are 2.2e284 rad or m apart"],
    );
    assert_eq!(files(&folder), ["a.svg"]);
    let (code, _, messages) = simulate(&folder, &pendulum, &["--q", "1e7,0", "--time", "0.1"]);
    assert_eq!(code, Some(0));
    assert!(messages.contains("doubles near the values of `shoulder` are 2.2e-9 rad or m apart"), "{messages}");
}

#[test]
fn trust_measures_the_error_of_the_motion() {
    let folder = folder("trust_error");
    // x = 0.1 cos 20 t: the error is known.
    let spring = single("type = \"prismatic\"\naxis = [1, 0, 0]\nstiffness = 400", "");
    let spring = write(&folder, "spring.toml", &spring);
    for (how, more) in
        [("tenth", ["--tolerance", "1e-6"]), ("wide", ["--tolerance", "1e-6"]), ("tenth", ["--step", "0.005"])]
    {
        let start = ["--q", "0.1", "--v", "0", "--time", "7", "--trust", how];
        let (code, report, messages) = simulate(&folder, &spring, &[&start[..], &more].concat());
        assert_eq!((code, messages.as_str()), (Some(0), ""), "{report}");
        let angle: f64 = 20.0 * 7.0;
        let (x, v) = (end(&folder)[1] - 0.1 * angle.cos(), end(&folder)[2] + 2.0 * angle.sin());
        let found = (number(&report, "  joint  "), number(&report, "velocity joint "));
        // The second run has an error of its own, a tenth of this one or a 256th.
        assert!((found.0 / x.abs() - 1.0).abs() < 0.25, "{how} {more:?}: {found:?} {x:e}\n{report}");
        assert!((found.1 / v.abs() - 1.0).abs() < 0.25, "{how} {more:?}: {found:?} {v:e}\n{report}");
        // A harmonic motion keeps distances; the error of its energy is its own.
        assert!(report.contains("growth: not exponential"), "{report}");
    }
}

#[test]
fn trust_measures_how_errors_grow() {
    let folder = folder("trust_growth");
    // Upright, errors grow with the square root of m g l over the inertia about the joint.
    let pendulum = write(&folder, "pendulum.toml", &single(REVOLUTE, UPRIGHT));
    let top = single("type = \"spherical\"", &format!("{UPRIGHT}\ninertia = [0.5, 0.5, 0.1]"));
    let top = write(&folder, "top.toml", &top);
    for (model, v, expected) in [(&pendulum, "0", 9.81_f64.sqrt()), (&top, "0,0,0", (9.81_f64 / 1.5).sqrt())] {
        let start = ["--v", v, "--time", "5", "--trust"];
        let start = if model == &pendulum { [&start[..], &["--q", "0"]].concat() } else { start.to_vec() };
        let (code, report, _) = simulate(&folder, model, &start);
        assert_eq!(code, Some(0), "{report}");
        let found = number(&report, "largest Lyapunov exponent ");
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}\n{report}");
    }
    // Hanging, the pendulum is a regular motion; a chaotic one loses its digits, and says when.
    let (code, report, _) = simulate(&folder, &pendulum, &["--q", "3", "--v", "0", "--trust"]);
    assert!(code == Some(0) && report.contains("growth: not exponential"), "{report}");
    let double = format!("{ROOT}/models/double_pendulum.toml");
    let chaos = ["--q", "2,2", "--v", "0,0", "--time", "40", "--trust"];
    let (code, report, messages) = simulate(&folder, &double, &chaos);
    assert_eq!(code, Some(1), "{report}");
    assert!(messages.contains("warning: no digit of the motion is left at the end"), "{messages}");
    let lost = number(&report, "no digit left of what moves at the end; none from ");
    let rate = number(&report, "largest Lyapunov exponent ");
    assert!(lost < 40.0 && (0.5..5.0).contains(&rate), "{report}");
    // A shorter run keeps digits, and expects their end about where the longer one finds it.
    let (code, report, _) = simulate(&folder, &double, &["--q", "2,2", "--v", "0,0", "--time", "8", "--trust"]);
    assert_eq!(code, Some(0), "{report}");
    let expected = number(&report, "none after about ");
    assert!((0.3..3.0).contains(&(expected / lost)), "{expected} {lost}");
}

#[test]
fn trust_of_loops_and_quaternions() {
    let folder = folder("trust_loops");
    for (name, more) in [
        ("mechanisms/fourbar.toml", &["--v", "8,0,0", "--time", "1"][..]),
        ("mechanisms/rolling_disc.toml", &["--v=1.8,0,0,0,9,1.5", "--time", "1"]),
        ("satellite.toml", &["--time", "3", "--method", "radau5", "--tolerance", "1e-6"]),
    ] {
        let model = format!("{ROOT}/models/{name}");
        for how in ["tenth", "wide"] {
            let (code, report, messages) = simulate(&folder, &model, &[more, &["--trust", how]].concat());
            assert_eq!(code, Some(0), "{messages}{report}");
            assert!(number(&report, "digits: ") > 5.0, "{report}");
        }
    }
}

#[test]
fn eval_scales_quaternions_and_knows_the_condition() {
    let folder = folder("trust_eval");
    let ball = format!("{ROOT}/models/spherical_pendulum.toml");
    let file = folder.join("ball.json");
    let eval = |length: f64, layout: &str| {
        let q: Vec<f64> = [0.0, 0.6, 0.0, 0.8].iter().map(|x| x * length).chain([0.3]).collect();
        std::fs::write(&file, format!("{{\"states\": [{{\"q\": {q:?}, \"v\": [1, 2, 3, 4]}}]}}")).expect("a file");
        run(&["eval", &ball, "--input", &file.to_string_lossy(), "--layout", layout])
    };
    for layout in ["mbd", "mujoco"] {
        let exact = good(eval(1.0, layout));
        assert_eq!(err(&exact), "");
        let (near, off) = (1.0 + 2.0_f64.powi(-32), 1.0 + 2.0_f64.powi(-24));
        for (length, told) in [(near, false), (off, true)] {
            let output = good(eval(length, layout));
            let text = "ball.json: states[0].q: warning: ";
            assert_eq!(
                err(&output).contains(text) && err(&output).contains("scaled to unit length"),
                told,
                "{}",
                err(&output)
            );
            let flat = |v: &Value| -> Vec<f64> { numbers(&v["states"][0]["qdd"]) };
            for (a, b) in flat(&json_of(&output)).iter().zip(flat(&json_of(&exact))) {
                assert!((a - b).abs() < 1e-12, "{layout} {length}: {a} {b}");
            }
        }
        bad(eval(1.00001, layout), &["has length 1.0000", "expected 1"]);
    }
    // Two sliders on one line: the condition is (1 + c)/(1 - c), c² = 1/(1 + m), about 4/m for a small mass m of the
    // first.
    let sliders = |m: f64, more: &[&str]| {
        let slider = "type = \"prismatic\"\naxis = [1, 0, 0]";
        let text = format!(
            "name = \"sliders\"\n[[body]]\nname = \"a\"\nmass = {m:e}\n[[body]]\nname = \"b\"\nmass = 1\n[[joint]]\nname = \
             \"first\"\nchild = \"a\"\n{slider}\n[[joint]]\nname = \"second\"\nparent = \"a\"\nchild = \"b\"\n{slider}\n"
        );
        let model = write(&folder, "sliders.toml", &text);
        let input = write(&folder, "s.json", "{\"states\": [{\"q\": [0, 0], \"v\": [1, 1]}]}");
        let output = good(run(&["eval", &model, "--input", &input]));
        let arguments = ["simulate", &model, "--time", "0.01", "--rows", "1"];
        (err(&output).to_string(), run_in(&folder, &[&arguments[..], more].concat()))
    };
    // The threshold is 0.1/(2 ε), 2.3e14.
    let (evaluated, simulated) = sliders(1e-12, &[]);
    let simulated = good(simulated);
    assert_eq!((evaluated.as_str(), err(&simulated)), ("", ""));
    let (evaluated, simulated) = sliders(2.0_f64.powi(-46), &[]);
    assert!(evaluated.contains("states[0]: warning: the mass matrix has condition 2."), "{evaluated}");
    assert!(evaluated.contains("`second`") && evaluated.contains("help: "), "{evaluated}");
    let simulated = good(simulated);
    let messages = err(&simulated);
    assert!(messages.contains("warning: at the start, the mass matrix has condition 2."), "{messages}");
    // From 0.1/ε on, 4.5e14, steps have no error that means anything.
    let (_, simulated) = sliders(2.0_f64.powi(-47), &[]);
    bad(simulated, &["error: at the start, the mass matrix has condition 5.", "`second`", "fixed steps (--step)"]);
    let (evaluated, simulated) = sliders(2.0_f64.powi(-47), &["--step", "0.001"]);
    assert!(evaluated.contains("states[0]: warning: the mass matrix has condition 5."), "{evaluated}");
    let messages = err(&simulated);
    assert!(messages.contains("warning: at the start, the mass matrix has condition 5."), "{messages}");
}

/// A damper that takes the velocity within 1e-8 s lets an explicit method take steps of that length only: the run would have
/// 1e8 of them or more, which it tells after the first ones and when it is interrupted.
#[cfg(unix)]
#[test]
fn a_run_that_crawls_says_why() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let folder = folder("trust_crawls");
    let model = single("type = \"prismatic\"\naxis = [1, 0, 0]\nstiffness = 400\ndamping = 1e8", "");
    let model = write(&folder, "damped.toml", &model);
    let start = ["--q", "0.1", "--v", "0"];
    let arguments = [&["simulate", &model, "--csv", "a.csv", "--svg", "a.svg"], &start[..]].concat();
    let mut command = Command::new(PROGRAM);
    command.current_dir(&folder).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program runs");
    let messages = BufReader::new(child.stderr.take().expect("messages"));
    let mut lines = messages.lines().map(|line| line.expect("UTF-8"));
    let hint = lines.find(|line| line.starts_with("hint: ")).expect("a hint");
    let help = lines.next().expect("help");
    // Before anything can fail: the run would go on for hours.
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill").success());
    assert!(hint.contains("20000 steps have led to ") && hint.contains("stiff or nearly singular"), "{hint}");
    assert!(help.starts_with("  help: take `--method rodas5p` or `--method radau5`"), "{help}");
    // It is told once.
    let rest: Vec<String> = lines.collect();
    assert!(!rest.iter().any(|line| line.contains("hint")), "{rest:?}");
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130), "{rest:?}");
    let report = out(&output);
    assert!(report.contains(&format!("\n{hint}; {}\n", help.trim_start_matches("  help: "))), "{report}");
    // The same by a method that is made for it.
    let (code, report, messages) = simulate(&folder, &model, &[&start[..], &["--method", "rodas5p"]].concat());
    assert!(code == Some(0) && !messages.contains("hint"), "{report}{messages}");
}

/// Where nothing moves, energies are rounding errors, and measure nothing.
#[test]
fn rest_is_trusted() {
    let folder = folder("trust_rest");
    let spring = single("type = \"prismatic\"\nstiffness = 100\nrest = 0.3\nstart = 0.30000000000000004", "");
    let model = write(&folder, "rest.toml", &format!("gravity = [0, 0, 0]\n{spring}"));
    for more in [&["--time", "5"][..], &["--time", "5", "--step", "0.01"]] {
        let (status, report, messages) = simulate(&folder, &model, more);
        assert_eq!(status, Some(0), "{report}\n{messages}");
        assert!(
            report.contains("; the mechanism is at rest, no coordinate moves by more than ") && messages.is_empty()
        );
    }
    // A motion that is short is not one at rest.
    let moving = write(&folder, "moving.toml", &single(REVOLUTE, UPRIGHT));
    let (_, report, _) = simulate(&folder, &moving, &["--time", "1e-10", "--v", "0.5"]);
    assert!(!report.contains("at rest"), "{report}");
}

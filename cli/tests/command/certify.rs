//! The subcommand `mbd certify`: bounds against samples in double-double numbers.

use std::path::Path;

use serde_json::{json, Value};

use crate::run::*;

/// Values of an attribute of all joint limits of a URDF, in the order of the file: that of the chain, for serial arms.
fn limits(model: &str, attribute: &str) -> Vec<f64> {
    let text = read(Path::new(ROOT), model);
    let tags = text.split("<limit ").skip(1).map(|rest| rest.split('>').next().expect("a tag"));
    let value = |tag: &str| {
        let rest = tag.split(&format!("{attribute}=\"")).nth(1)?;
        rest.split('"').next().expect("a value").parse().ok()
    };
    tags.filter_map(value).collect()
}

/// Certifies in JSON; returns the exit status, every output, and the messages other than notices.
fn certify(folder: &Path, model: &str, region: &Value, more: &[&str]) -> (Option<i32>, Vec<Value>, String) {
    let region = write(folder, "box.json", &region.to_string());
    let output = run(&[&["certify", model, "--box", &region, "--json"], more].concat());
    let outputs = if out(&output).is_empty() {
        Vec::new()
    } else {
        json_of(&output)["outputs"].as_array().expect("a list").clone()
    };
    let messages = err(&output).lines().filter(|line| !line.contains(": notice: ")).collect::<Vec<_>>().join("\n");
    (output.status.code(), outputs, messages)
}

fn get(entry: &Value, key: &str) -> f64 {
    entry[key].as_f64().unwrap_or_else(|| panic!("no number `{key}` in {entry}"))
}

/// Width of the bounds, and of the samples in them.
fn widths(entry: &Value) -> (f64, f64) {
    let sample = |k: usize| entry["samples"][k].as_f64().expect("a number");
    let (low, high) = (get(entry, "low"), get(entry, "high"));
    // Samples are rounded to doubles.
    let slack = sample(0).abs().max(sample(1).abs()) * f64::EPSILON;
    assert!(low - slack <= sample(0) && sample(1) <= high + slack, "{entry}");
    (high - low, sample(1) - sample(0))
}

/// Arms with a state inside their limits.
const ARMS: [(&str, [f64; 7], usize); 2] = [
    ("models/ur5.urdf", [0.4, -1.1, 1.3, -0.7, 0.9, 0.2, 0.0], 6),
    ("models/panda_arm.urdf", [0.3, -0.5, 0.2, -1.9, 0.4, 1.6, 0.7], 7),
];

#[test]
fn rounding_errors_of_arms_at_a_state() {
    let folder = folder("certify_state");
    for (model, q, n) in ARMS {
        let v: Vec<f64> = (0..n).map(|k| 0.3 + 0.2 * k as f64).collect();
        let (code, outputs, messages) =
            certify(&folder, model, &json!({ "q": q[..n], "v": v, "tau": v }), &["--samples", "1"]);
        assert_eq!((code, messages.as_str()), (Some(0), ""));
        assert_eq!(outputs.len(), 6 * n + 2 + n * n);
        let largest = outputs.iter().map(|entry| get(entry, "value").abs()).fold(0.0, f64::max);
        let mut worst = 0.0_f64;
        for entry in &outputs {
            let (width, _) = widths(entry);
            let (value, error) = (get(entry, "value"), get(entry, "error"));
            assert!(error <= width * (1.0 + 1e-9) + 1e-15 * value.abs(), "{entry}");
            // The exact value, rounded.
            let exact = entry["samples"][0].as_f64().expect("a number");
            assert!((value - exact).abs() <= error + exact.abs() * f64::EPSILON, "{entry}");
            worst = worst.max(error / largest);
        }
        println!("{model}: largest bound of an error {worst:.1e} of the largest output");
        assert!(worst < 1e-11, "{model}: {worst:e}");
    }
}

#[test]
fn small_boxes_are_enclosed_tightly() {
    let folder = folder("certify_small");
    for (model, q, n) in ARMS {
        let side = |x: f64| [x - 1e-4, x + 1e-4];
        let region = json!({
            "q": q[..n].iter().map(|x| side(*x)).collect::<Vec<_>>(),
            "v": (0..n).map(|k| side(0.2 * k as f64)).collect::<Vec<_>>(),
        });
        let (code, outputs, messages) =
            certify(&folder, model, &region, &["--samples", "1500", "--outputs", "p,pd,qdd,h"]);
        assert_eq!((code, messages.as_str()), (Some(0), ""));
        let moving = outputs.iter().map(widths).filter(|(_, samples)| *samples > 1e-9);
        let mut ratios: Vec<f64> = moving.map(|(bounds, samples)| bounds / samples).collect();
        ratios.sort_by(f64::total_cmp);
        let (median, most) = (ratios[ratios.len() / 2], ratios[ratios.len() - 1]);
        println!("{model}: bounds {median:.2} times as wide as 1500 samples (median), at most {most:.2} times");
        // Random states do not reach the corners where sums of many inputs are largest; the rest is excess.
        assert!(median < 1.5 && most < 3.0, "{model}: {median} {most}");
    }
}

#[test]
fn joint_limits_of_arms() {
    let folder = folder("certify_limits");
    for (model, _, n) in ARMS {
        let (lower, upper, velocity) = (limits(model, "lower"), limits(model, "upper"), limits(model, "velocity"));
        assert_eq!((lower.len(), upper.len(), velocity.len()), (n, n, n), "{model}");
        let region = json!({
            "q": (0..n).map(|k| [lower[k], upper[k]]).collect::<Vec<_>>(),
            "v": (0..n).map(|k| [-velocity[k], velocity[k]]).collect::<Vec<_>>(),
        });
        let given = ["--outputs", "p,kinetic,potential,h", "--samples", "1500", "--split", "2"];
        let (code, outputs, messages) = certify(&folder, model, &region, &given);
        assert_eq!((code, messages.as_str()), (Some(0), ""), "{model}");
        let mut ratios: Vec<f64> = outputs.iter().map(widths).filter(|(_, s)| *s > 1e-6).map(|(b, s)| b / s).collect();
        ratios.sort_by(f64::total_cmp);
        println!(
            "{model}: over the joint limits {:.1} times as wide as 1500 samples (median)",
            ratios[ratios.len() / 2]
        );
        let (code, outputs, messages) = certify(&folder, model, &region, &["--outputs", "qdd"]);
        assert_eq!(code, Some(1));
        assert!(
            messages.contains("no bound was found for `qdd.") && messages.contains("help: narrow the box"),
            "{messages}"
        );
        assert!(outputs.iter().all(|entry| entry["low"].is_null() && entry["high"].is_null()), "{outputs:?}");
    }
}

#[test]
fn parts_of_a_box_narrow_the_bounds() {
    let folder = folder("certify_split");
    let region = json!({ "q": [[-0.5, 0.5], [0.2, 1.2]], "v": [[-1.0, 1.0], [-1.0, 1.0]] });
    let pendulum = "models/double_pendulum.toml";
    let given = |split| ["--outputs", "qd,qdd,h,kinetic", "--samples", "1000", "--split", split];
    // Undivided, a pivot of the momenta's sweep may be zero.
    let (code, _, messages) = certify(&folder, pendulum, &region, &given("1"));
    assert!(code == Some(1) && messages.contains("no bound was found for `qd.shoulder`, `qd.elbow`"), "{messages}");
    let mut last = f64::INFINITY;
    for split in ["16", "128"] {
        let (code, outputs, messages) = certify(&folder, pendulum, &region, &given(split));
        assert_eq!((code, messages.as_str()), (Some(0), ""), "{split}");
        let widest: f64 = outputs.iter().map(|entry| widths(entry).0 / widths(entry).1).fold(0.0, f64::max);
        println!("{split} parts: at most {widest:.2} times as wide as the samples");
        assert!(widest < last, "{split}: {widest} {last}");
        last = widest;
    }
    assert!(last < 5.0, "{last}");
}

#[test]
fn loops_and_quaternions_at_a_state() {
    let folder = folder("certify_loops");
    good(run_in(
        &folder,
        &[
            "simulate",
            &format!("{ROOT}/models/mechanisms/fourbar.toml"),
            "--time",
            "0.01",
            "--rows",
            "1",
            "--v",
            "8,0,0",
        ],
    ));
    let table = read(&folder, "fourbar.csv");
    let row: Vec<f64> = table.lines().nth(1).expect("a row").split(',').map(|x| x.parse().expect("a number")).collect();
    let outputs = ["--outputs", "qd,pd,qdd,phi,lambda,M", "--samples", "1"];
    let (code, list, messages) =
        certify(&folder, "models/mechanisms/fourbar.toml", &json!({ "q": row[1..4], "v": row[4..7] }), &outputs);
    assert_eq!((code, messages.as_str()), (Some(0), ""));
    assert!(list.iter().all(|entry| get(entry, "error") < 1e-7), "{list:?}");
    let ball = json!({ "q": [0.0, 0.6, 0.0, 0.8, 0.3], "v": [1, 2, 3, 4] });
    let (code, list, messages) = certify(&folder, "models/spherical_pendulum.toml", &ball, &["--samples", "1"]);
    assert_eq!((code, messages.as_str()), (Some(0), ""));
    assert!(list.iter().all(|entry| get(entry, "error") < 1e-10), "{list:?}");
}

#[test]
fn certify_prints_and_refuses() {
    let folder = folder("certify_text");
    let region = write(&folder, "box.json", r#"{"q": [0.1, [0.2, 0.3]]}"#);
    let pendulum = "models/double_pendulum.toml";
    let output = good(run(&["certify", pendulum, "--box", &region, "--outputs", "M,potential", "--samples", "10"]));
    for text in ["bounds of outputs over a box of states, in 1 parts", "M.shoulder,elbow", " .. ", "all 10 states"] {
        assert!(out(&output).contains(text), "`{text}` is not in:\n{}", out(&output));
    }
    let state = write(&folder, "state.json", r#"{"q": [0.1, 0.2], "v": [1, 1]}"#);
    let output = good(run(&["certify", pendulum, "--box", &state]));
    assert!(out(&output).contains(" ± ") && out(&output).contains("qdd.elbow"), "{}", out(&output));
    let marked = write(&folder, "marked.json", "\u{feff}{\"q\": [0.1, 0.2]}");
    good(run(&["certify", pendulum, "--box", &marked]));
    for outputs in ["phi", "M,lambda"] {
        let arguments = ["certify", pendulum, "--box", &state, "--outputs", outputs];
        bad(run(&arguments), &["--outputs: `double_pendulum` has no loops or couplings", "leave both out"]);
    }
    let refuse = |text: &str, texts: &[&str]| {
        let region = write(&folder, "bad.json", text);
        bad(run(&["certify", pendulum, "--box", &region]), texts);
    };
    refuse("{", &["bad.json:1:1: not JSON"]);
    refuse("[]", &["not an object", "help: write {\"q\""]);
    refuse(r#"{"q": [1], "w": 1}"#, &["unknown key `w`", "q: 1 entries, expected 2", "in order: shoulder, elbow"]);
    refuse(
        r#"{"q": [[2, 1], "a"]}"#,
        &["q: `shoulder` is [2,1], neither a number nor [low, high]", "`elbow` is \"a\""],
    );
    refuse(r#"{"v": [0, 0]}"#, &["`q` is missing"]);
}

//! The benches of the integrators, on a few scenes.
#![cfg(feature = "generated")]

#[path = "../../cli/tests/command/run.rs"]
mod command;

use command::{bad, folder, good, out, read, run, run_in};

#[test]
fn work_against_error() {
    let folder = folder("bench_work");
    let choice =
        ["--scenes", "double_pendulum", "--methods", "rk4,verner9,radau5", "--figures", ".", "--samples", "a.jsonl"];
    let output = good(run_in(&folder, &[&["bench", "work-precision"], &choice[..]].concat()));
    let text = out(&output);
    for line in
        ["generated: rk4", "generated: verner9", "generated, f32: rk4", "interpreted: verner9", "accelerations: rk4"]
    {
        assert!(text.contains(line), "{line}:\n{text}");
    }
    assert!(read(&folder, "double_pendulum.svg").starts_with("<svg"));
    let samples: Vec<serde_json::Value> =
        read(&folder, "a.jsonl").lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    let verner: Vec<_> = samples.iter().filter(|s| s["method"] == "verner9" && s["variant"] == "generated").collect();
    // A tighter tolerance needs more evaluations and gives a smaller error; a single error may be larger by chance.
    for pair in verner.windows(2) {
        assert!(pair[1]["evaluations"].as_u64() > pair[0]["evaluations"].as_u64());
    }
    let best = verner.iter().filter_map(|s| s["end_error"].as_f64()).fold(1.0, f64::min);
    assert!(best < 1e-12, "{best:e}");
}

#[test]
fn long_runs() {
    let output =
        good(run(&["bench", "longrun", "--scenes", "double_pendulum", "--methods", "verner9", "--steps", "5000"]));
    let row = |name: &str| -> Vec<f64> {
        let line = out(&output).lines().find(|l| l.starts_with(&format!("| {name} "))).expect("a row");
        line.split('|').filter_map(|cell| cell.trim().parse().ok()).collect()
    };
    // The columns are setting, work, time, energy, trajectory, and the last two with projection.
    let (rk4, verner9) = (row("rk4"), row("verner9"));
    assert!((0.8..1.1).contains(&verner9[1]), "work {}", verner9[1]);
    assert!(rk4[3] > 1e3 * verner9[3] && rk4[4] > 1e3 * verner9[4], "{rk4:?} {verner9:?}");
    assert!(verner9[5] < 1e-12, "{}", verner9[5]);
}

#[test]
fn stress_says_why() {
    let output = good(run(&["bench", "stress", "--scenes", "vanishing_tip,point_tip", "--methods", "verner9"]));
    let text = out(&output);
    assert!(text.contains("| vanishing_tip | verner9") && text.contains("singular"), "{text}");
    assert!(text.contains("| massless_tip |") && text.contains("refused"), "{text}");
    assert!(!text.contains("NOT SAID"), "{text}");
    bad(run(&["bench", "stress", "--scenes", "nowhere"]), &["there is no scene `nowhere`", "double_pendulum"]);
}

//! The command on models with loops: closing, messages about loops that do not close, simulation, pictures, evaluation.

use crate::run::{bad, err, files, folder, good, number, out, run, run_in, Rows, ROOT};
use serde_json::Value;

const FOURBAR: &str = include_str!("../../../models/mechanisms/fourbar.toml");

/// Path of a shipped mechanism.
fn shipped(name: &str) -> String {
    format!("{}/models/mechanisms/{name}.toml", ROOT)
}

#[test]
fn check_tells_rank_and_mobility() {
    let output = good(run(&["check", "models/mechanisms/strandbeest_leg.toml", "models/mechanisms/stewart.toml"]));
    let lines: Vec<&str> = out(&output).lines().collect();
    assert!(
        lines[0].contains("3 loops: closed in ") && lines[0].ends_with("15 rows, 6 independent, mobility 1"),
        "{lines:?}"
    );
    assert!(lines[1].ends_with("18 rows, 18 independent, mobility 6"), "{lines:?}");
    let line = 1 + include_str!("../../../models/mechanisms/strandbeest_leg.toml")
        .lines()
        .position(|l| l == "name = \"middle\"")
        .expect("it");
    let note = format!("strandbeest_leg.toml:{line}:8: note: loop `middle`: 5 rows, rank 2: 3 follow from the rest");
    assert!(err(&output).contains(&note), "{}", err(&output));
}

#[test]
fn loops_that_do_not_close() {
    let folder = folder("loops_open");
    let line = 1 + FOURBAR.lines().position(|l| l == "name = \"closing_pin\"").expect("it");
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
    // The crank is held at 60°. The distance from its end to the other pivot exceeds the length of the other two bars
    // by hypot(0.9 - 0.15 cos 60°, 0.15 sin 60°) - 0.65 = 0.1852.
    write("far.toml", &FOURBAR.replace("xyz = [0.4, 0, 0]", "xyz = [0.9, 0, 0]"));
    let place =
        format!("far.toml:{line}:8: error: loop `closing_pin` does not close: what is left is 1.852e-1 m after ");
    bad(run_in(&folder, &["check", "far.toml"]), &[&place, "rank ", "help: look at lengths"]);
    bad(run_in(&folder, &["simulate", "far.toml"]), &[&place]);
    assert_eq!(files(&folder), ["far.toml"]);
    // This loop can close, but not with the held angle of the crank.
    write("held.toml", &FOURBAR.replace("xyz = [0.4, 0, 0]", "xyz = [0.75, 0, 0]"));
    bad(run_in(&folder, &["check", "held.toml"]), &["does not close", "help: with no joint `held` all is met"]);
}

/// A model of two wheels with couplings between them.
fn gears(couplings: &[(&str, [f64; 2], f64)]) -> String {
    let mut text = String::new();
    for name in ["a", "b"] {
        text += &format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\n");
        text += &format!("[[joint]]\nname = \"j{name}\"\ntype = \"revolute\"\nchild = \"{name}\"\n");
    }
    for (name, ratios, offset) in couplings {
        text += &format!(
            "[[coupling]]\nname = \"{name}\"\njoints = [\"ja\", \"jb\"]\nratios = {ratios:?}\noffset = {offset}\n"
        );
    }
    text
}

#[test]
fn couplings_that_contradict_or_repeat_or_lock() {
    let folder = folder("loops_gears");
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
    write("contradict.toml", &gears(&[("gear", [1.0, 2.0], 0.0), ("belt", [2.0, 4.0], 0.1)]));
    // The least squares of φ₁ = x and φ₂ = 2x − 0.1 are at x = 0.04, with residuals 0.04 and −0.02.
    let texts = [
        "coupling `gear` cannot be met: what is left is 4.000e-2 rad",
        "coupling `belt` cannot be met: what is left is 2.000e-2 rad",
        "(rank 1 of 2 rows)",
    ];
    bad(run_in(&folder, &["check", "contradict.toml"]), &texts);
    write("repeat.toml", &gears(&[("gear", [1.0, 2.0], 0.0), ("belt", [2.0, 4.0], 0.0)]));
    let output = good(run_in(&folder, &["check", "repeat.toml"]));
    assert!(err(&output).contains("note: coupling `belt`: 1 row, rank 0: 1 follows from the rest"), "{}", err(&output));
    assert!(out(&output).contains("mobility 1"), "{}", out(&output));
    write("lock.toml", &gears(&[("gear", [1.0, 2.0], 0.0), ("belt", [2.0, 1.0], 0.0)]));
    let output = good(run_in(&folder, &["check", "lock.toml"]));
    assert!(err(&output).contains("warning: nothing can move"), "{}", err(&output));
}

#[test]
fn simulates_and_draws() {
    let folder = folder("loops_simulate");
    let model = shipped("fourbar");
    let arguments =
        ["simulate", &model, "--time", "0.2", "--v", "8,0,0", "--picture", "a.svg", "--trace", "coupler_point"];
    let output = good(run_in(&folder, &arguments));
    let text = out(&output);
    for part in ["loops: closed in ", "mobility 1", "drift: loops open by up to ", "closed again to ", "energy error: "]
    {
        assert!(text.contains(part), "`{part}` is not in:\n{text}");
    }
    let picture = std::fs::read_to_string(folder.join("a.svg")).expect("the picture");
    assert!(picture.starts_with("<svg ") && picture.ends_with("</svg>\n") && !picture.contains("NaN"));
    assert_eq!(picture.matches("<g opacity").count(), 9);
    // The held joint keeps its velocity, and the others follow.
    let table = std::fs::read_to_string(folder.join("fourbar.csv")).expect("the table");
    let first: Vec<&str> = table.lines().nth(1).expect("a row").split(',').collect();
    let number = |k: usize| first[k].parse::<f64>().expect("a number");
    assert!((number(4) - 8.0).abs() < 1e-12 && number(5).abs() > 0.1, "{first:?}");
    // The output mentions `--hold` when drift is not removed.
    let output = good(run_in(&folder, &["simulate", &model, "--time", "0.2", "--step", "0.005", "--hold", "none"]));
    assert!(out(&output).contains("--hold says how they are kept closed"), "{}", out(&output));
    bad(run_in(&folder, &["simulate", &model, "--project"]), &["--project does not keep loops closed"]);
    let unknown = ["simulate", &model, "--picture", "b.svg", "--trace", "coupler_pont"];
    bad(run_in(&folder, &unknown), &["no body or frame is named `coupler_pont`", "coupler_point"]);
}

#[test]
fn evaluates() {
    let folder = folder("loops_eval");
    let model = shipped("fourbar");
    good(run_in(&folder, &["simulate", &model, "--time", "0.01", "--rows", "1", "--v", "8,0,0"]));
    let table = std::fs::read_to_string(folder.join("fourbar.csv")).expect("the table");
    let row: Vec<f64> = table.lines().nth(1).expect("a row").split(',').map(|x| x.parse().expect("a number")).collect();
    let state = serde_json::json!({"states": [{"q": row[1..4], "v": row[4..7]}, {"q": [0, 0.1, 0.3], "v": [1, 1, 1]}]});
    std::fs::write(folder.join("states.json"), state.to_string()).expect("a file");
    let output = good(run_in(&folder, &["eval", &model, "--input", "states.json"]));
    let results: Value = serde_json::from_str(out(&output)).expect("JSON");
    let list = |key: &str| -> Vec<f64> {
        results["states"][0][key].as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
    };
    let (phi, lambda) = (list("phi"), list("lambda"));
    assert!(phi.len() == 5 && phi.iter().all(|x| x.abs() < 1e-12), "{phi:?}");
    // Two multipliers are forces in the plane of the bars; those of the three redundant rows are zero.
    assert_eq!(lambda.iter().filter(|x| x.abs() > 1e-9).count(), 2, "{lambda:?}");
    // The constraint forces have no power: v · (M v̇ + h) = −(Φv) · λ = 0. Single terms are some watts.
    let (v, a, h) = (&row[4..7], list("qdd"), list("h"));
    let m: Vec<Vec<f64>> = serde_json::from_value(results["states"][0]["M"].clone()).expect("a matrix");
    let power: f64 = (0..3).map(|i| v[i] * (h[i] + (0..3).map(|k| m[i][k] * a[k]).sum::<f64>())).sum();
    assert!(power.abs() < 1e-10, "{power}");
    let messages = err(&output);
    assert!(!messages.contains("states[0]"), "{messages}");
    assert!(messages.contains("states[1]: warning: `q` leaves loop `closing_pin` open by "), "{messages}");
    assert!(messages.contains("states[1]: warning: `v` breaks loop `closing_pin` by "), "{messages}");
    assert!(
        messages.contains("; `qd`, `pd` and `kinetic` are those of the nearest velocities it allows"),
        "{messages}"
    );
    // The nearest velocities in the metric of the mass matrix have no more kinetic energy than those that were given.
    let other = &results["states"][1];
    let m: Vec<Vec<f64>> = serde_json::from_value(other["M"].clone()).expect("a matrix");
    let given = 0.5 * m.iter().flatten().sum::<f64>();
    let qd: Vec<f64> = serde_json::from_value(other["qd"].clone()).expect("rates");
    let nearest = 0.5 * (0..3).map(|i| qd[i] * (0..3).map(|k| m[i][k] * qd[k]).sum::<f64>()).sum::<f64>();
    let kinetic = other["kinetic"].as_f64().expect("a number");
    assert!((kinetic - nearest).abs() < 1e-12 && kinetic < given - 1e-6, "{kinetic} {nearest} {given}");
}

/// The table of the book is what its commands print, up to a factor of three in what rounding decides.
#[test]
fn the_table_of_mechanisms_is_what_is_printed() {
    let folder = folder("loops_table");
    let page = include_str!("../../../book/src/mechanisms.md");
    let mut rows = 0;
    for row in page.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [_, name, _, count, independent, mobility, energy, drift, _] = cells[..] else { continue };
        let file = format!("models/mechanisms/{}.toml", name.trim_matches('`'));
        let command = page.lines().find(|line| line.trim_start().starts_with(&format!("mbd simulate {file} ")));
        let words: Vec<&str> = command.unwrap_or_else(|| panic!("no command for {file}")).split_whitespace().collect();
        // The start and the length of the motion; pictures and tables are not written.
        let all = words.iter().position(|word| *word == "--picture").unwrap_or(words.len());
        let arguments: Vec<String> =
            words[1..all].iter().map(|word| word.replace("models/", &format!("{ROOT}/models/"))).collect();
        let output = good(run_in(&folder, &arguments.iter().map(String::as_str).collect::<Vec<_>>()));
        let text = out(&output);
        assert!(
            text.contains(&format!("{count} rows, {independent} independent, mobility {mobility}")),
            "{row}\n{text}"
        );
        for (what, told) in [("energy error: at most ", energy), ("loops open by up to ", drift)] {
            let (found, told) = (number(text, what), told.parse::<f64>().expect("a number"));
            assert!(found < 3.0 * told && told < 3.0 * found, "{name}: {what}{found:e}, in the book {told:e}");
        }
        rows += 1;
    }
    assert_eq!(rows, 10);
}

/// A leg passes a position in which it cannot follow its foot by itself. The mechanism can: its trunk is free.
#[test]
fn a_straight_knee_is_not_a_singular_position() {
    let folder = folder("loops_knee");
    let body = |name: &str, mass: f64, com: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = {mass}\ncom = [0, 0, {com}]\ninertia = [0.2, 0.2, 0.1]\n")
    };
    let bodies =
        [("trunk", 5.0, 0.0), ("thigh", 1.0, -0.25), ("shank", 0.7, -0.25)].map(|(n, m, c)| body(n, m, c)).concat();
    let text = format!(
        "name = \"knee\"\ngravity = [0, 0, 0]\n{bodies}
        [[joint]]
        name = \"root\"
        type = \"floating\"
        child = \"trunk\"
        start = [0, 0, 1, 0, 0, 0, 1]
        [[joint]]
        name = \"hip\"
        type = \"universal\"
        parent = \"trunk\"
        child = \"thigh\"
        start = [0, -0.4]
        [[joint]]
        name = \"knee\"
        type = \"revolute\"
        parent = \"thigh\"
        child = \"shank\"
        axis = [0, 1, 0]
        xyz = [0, 0, -0.5]
        start = 0.8
        [[frame]]
        name = \"foot\"
        body = \"shank\"
        xyz = [0, 0, -0.5]
        [[loop]]
        name = \"pin\"
        type = \"spherical\"
        between = [\"ground\", \"foot\"]
        "
    );
    std::fs::write(folder.join("knee.toml"), text).expect("a file");
    // The knee passes zero in both directions.
    for tolerance in ["1e-6", "1e-7", "1e-9"] {
        let start = ["--v", "0,0,1,0,0,0,0,0,-0.5", "--csv", "knee.csv"];
        let output = good(run_in(
            &folder,
            &[&["simulate", "knee.toml", "--time", "3", "--tolerance", tolerance], &start[..]].concat(),
        ));
        let knee = Rows::read(&folder, "knee.csv").column("q.knee");
        assert!(knee.windows(2).any(|pair| pair[0] * pair[1] < 0.0), "the knee does not become straight");
        assert!(!out(&output).contains("singular"), "{}", out(&output));
    }
}

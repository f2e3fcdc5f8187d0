//! The subcommands of `mbd`, except those of loops and `mbd eval`.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::documented::agrees_with_pages;
use crate::run::*;

#[test]
fn help_teaches() {
    let output = good(run(&["--help"]));
    for word in ["tour", "check", "count", "generate", "eval", "certify", "simulate", "explain", "Exit status"] {
        assert!(out(&output).contains(word), "{word}");
    }
    for command in ["check", "convert", "count", "generate", "eval", "certify", "simulate", "explain"] {
        let output = good(run(&[command, "--help"]));
        assert!(out(&output).contains("--gravity"), "{command}");
    }
    assert_eq!(run(&["chekc"]).status.code(), Some(2));
    let output = run(&["generate", "models/ur5.urdf", "--outputs", "rates,momemta"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(err(&output).contains("did you mean `momenta`?"), "{}", err(&output));
    assert_eq!(run(&["count", "models/ur5.urdf", "--gravity", "1,2"]).status.code(), Some(2));
}

/// The options of a command that stand under a heading of its help.
fn options_under(help: &str, heading: &str) -> Vec<String> {
    let (_, rest) = help.split_once(&format!("\n{heading}:\n")).expect("the heading");
    // The next heading begins a line.
    let lines = rest.lines().take_while(|line| line.is_empty() || line.starts_with(' '));
    let options = lines.filter_map(|line| line.strip_prefix("      --"));
    options.map(|option| option.split(' ').next().unwrap_or_default().to_string()).collect()
}

#[test]
fn only_options_of_the_control_stand_under_it() {
    let control = [
        "efforts",
        "set-points",
        "wrenches",
        "interpolation",
        "kp",
        "kd",
        "gravity-compensation",
        "actuated",
        "unlimited",
    ];
    for (command, others) in [("simulate", &["time", "project", "csv", "names"][..]), ("modes", &["time", "record"])] {
        let output = good(run(&[command, "--help"]));
        assert_eq!(options_under(out(&output), "Control"), control, "{command}");
        let options = options_under(out(&output), "Options");
        for name in others {
            assert!(options.iter().any(|option| option == name), "{command}: {name}");
        }
    }
}

#[test]
fn check_tells_what_is_sound() {
    let output = good(run(&["check", "models/satellite.toml", "models/panda.urdf"]));
    let lines: Vec<&str> = out(&output).lines().collect();
    assert_eq!(
        lines[0],
        "models/satellite.toml: sound: 3 bodies, 3 joints (1 floating, 2 revolute), nq 7, nv 6, mass 138 kg, \
         prescribed joints: 2, external wrenches: 1"
    );
    assert!(lines[1].contains("joints that follow others: 1"), "{}", lines[1]);
    assert!(err(&output).contains("models/panda.urdf:28:5: notice:"), "{}", err(&output));
    let floating = good(run(&["check", "models/solo12.urdf", "--base", "floating"]));
    assert!(out(&floating).contains("nq 19, nv 18"), "{}", out(&floating));
}

/// Freedoms without inertia that no body alone shows: the leader of a mimic joint with nothing heavy on either, two joints that
/// slide one body along one line, a base without mass that turns about the joint of the only body that it carries.
#[test]
fn check_tells_of_mass_matrices_that_are_singular_everywhere() {
    let folder = folder("singular");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    // A body with what it has, on its parent by a joint of a type with what else that has.
    let link = |parent: &str, (joint, kind): (&str, &str), (body, has): (&str, &str), more: &str| {
        let parent = if parent.is_empty() { String::new() } else { format!("parent = \"{parent}\"\n") };
        let axis = if kind == "floating" { "" } else { "axis = [0, 0, 1]\n" };
        format!(
            "[[body]]\nname = \"{body}\"\n{has}[[joint]]\nname = \"{joint}\"\ntype = \"{kind}\"\n{parent}child = \"{body}\"\n{axis}{more}"
        )
    };
    let heavy = "mass = 1\ninertia = [1, 1, 1]\n";
    let on_light = |first: (&str, &str), second: (&str, &str)| {
        link("", first, ("light", ""), "") + &link("light", second, ("heavy", heavy), "")
    };
    let mimic = [
        link("", ("turn", "revolute"), ("base", heavy), ""),
        link("base", ("lead", "revolute"), ("left", ""), ""),
        link("base", ("follow", "revolute"), ("right", ""), "mimic = { joint = \"lead\" }\n"),
    ]
    .concat();
    let slides = on_light(("first", "prismatic"), ("second", "prismatic"));
    let base = on_light(("motion", "floating"), ("hinge", "revolute"));
    for (name, text, velocity) in [("mimic", mimic, "lead"), ("slides", slides, "second"), ("base", base, "hinge")] {
        let path = file(&format!("{name}.toml"), &format!("name = \"{name}\"\n{text}"));
        bad(
            run(&["check", &path]),
            &["the mass matrix is singular in every state", &format!("`{velocity}`"), "armature"],
        );
    }
}

#[test]
fn variants_are_checked_and_chosen() {
    let model = "models/variants/chain.toml";
    let output = good(run(&["check", model]));
    let lines: Vec<&str> = out(&output).lines().collect();
    assert_eq!(lines.len(), 4, "{lines:?}");
    assert!(lines[1].starts_with("models/variants/chain.toml: variant `broken`: sound: 4 bodies"), "{}", lines[1]);
    assert!(lines[2].contains("variant `held`") && lines[2].contains("nq 2, nv 2"), "{}", lines[2]);
    let code = good(run(&["generate", model, "--variant", "broken", "--outputs", "momenta"]));
    assert!(out(&code).contains("pub struct ChainBroken"), "{}", out(&code));
    good(run(&["count", model, "--variant", "held"]));
    bad(run(&["count", model, "--variant", "brocken"]), &["no variant `brocken`", "did you mean `broken`?"]);
    bad(run(&["count", "models/ur5.urdf", "--variant", "held"]), &["no variant `held`", "`[[variant]]`"]);
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
    // A sound model in the same call is still reported.
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

/// Rolled code of long chains is counted turn by turn: the operations are an affine function of the number of links, and the
/// sweeps add up to them.
#[test]
fn counts_of_long_chains() {
    let folder = folder("count_long");
    let total = |n: usize| {
        let link = |k: usize| {
            let (parent, along) = if k == 0 { ("ground".to_string(), 0.0) } else { (format!("b{}", k - 1), 0.5) };
            format!(
                "[[body]]\nname = \"b{k}\"\nmass = 1\ncom = [0.25, 0, 0]\ninertia = [0.01, 0.02, 0.02]\n\
                 [[joint]]\nname = \"j{k}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"b{k}\"\nxyz = [{along}, 0, 0]\n"
            )
        };
        let text = format!("name = \"long\"\n{}", (0..n).map(link).collect::<String>());
        let model = write(&folder, &format!("{n}.toml"), &text);
        let output = json_of(&good(run(&["count", &model, "--outputs", "rates", "--json"])));
        let rates = &output["outputs"][0];
        assert_eq!(rates["rolled"], true);
        let number = |v: &serde_json::Value| v["total"].as_u64().expect("a number");
        let sweeps: u64 = rates["sweeps"].as_array().expect("sweeps").iter().map(number).sum();
        assert_eq!(sweeps, number(rates));
        number(rates)
    };
    let [a, b, c] = [610, 620, 640].map(total);
    assert_eq!(2 * (b - a), c - b);
    // Nothing is counted that takes several times as long.
    let output = good(run(&["count", &folder.join("610.toml").display().to_string(), "--outputs", "rates"]));
    let text = out(&output);
    assert!(text.contains("Of more than 600 bodies") && !text.contains("What the scene costs"), "{text}");
    assert!(text.contains("critical path"), "{text}");
}

/// Where loops are generated, their operations are told beside those of straight-line code, as generated code has them.
#[test]
fn counts_of_loops() {
    let folder = folder("count_loops");
    for model in [&["models/solo12.urdf", "--base", "floating"][..], &["models/chain100.toml"]] {
        let of = |command, rest: &[&str]| run(&[&[command], model, &["--outputs", "rates"], rest].concat());
        let rates = &json_of(&good(of("count", &["--json"])))["outputs"][0];
        let loops = rates["loops"]["total"].as_u64().expect("a number");
        assert!(loops > rates["total"].as_u64().expect("a number"));
        let file = folder.join("code.rs").display().to_string();
        good(of("generate", &["-o", &file]));
        let code = std::fs::read_to_string(&file).expect("generated code");
        assert!(code.contains(&format!("/// {loops} operations: ")), "{model:?}: {loops}");
        let table = good(of("count", &[]));
        assert!(out(&table).contains(&format!("They execute: rates {loops}\n")), "{}", out(&table));
    }
    let none = json_of(&good(run(&["count", "models/ur5.urdf", "--outputs", "rates", "--json"])));
    assert!(none["outputs"][0].get("loops").is_none());
}

/// What a scene does not have costs nothing, in fast arithmetic too.
#[test]
fn parts_that_are_not_there_are_not_counted() {
    for model in ["double_pendulum.toml", "chain6.toml", "panda_arm.urdf"] {
        let model = format!("models/{model}");
        let output = good(run(&["count", &model, "--outputs", "rates"]));
        let text = out(&output);
        assert!(text.contains("  gravity ") && !text.contains("external wrenches"), "{text}");
        assert!(model.contains("panda") || !text.contains("dampers, springs"), "{text}");
    }
}

#[test]
fn counts() {
    let output = good(run(&["count", "models/chain6.toml", "--outputs", "all", "--json"]));
    let value = json_of(&output);
    assert_eq!(value["published"][0]["operations"], 363 * 6 - 475);
    let outputs = value["outputs"].as_array().expect("outputs");
    assert_eq!(outputs.len(), multibody::codegen::Output::available(false).count());
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
    // The formulas are for serial chains of revolute joints on the ground only.
    for other in [&["count", "models/panda.urdf"][..], &["count", "models/ur5.urdf", "--base", "floating"]] {
        let output = good(run(other));
        assert!(!out(&output).contains("363n"), "{}", out(&output));
    }
    // Gravity and joint forces that do not exist cost nothing.
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
    // Of an absolute path, the code contains the name of the file only.
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

#[test]
fn names_of_frames_ask_for_the_output_frames() {
    let code = |model: &str, more: &[&str]| {
        let output = good(run(&[&["generate", model], more].concat()));
        out(&output).to_string()
    };
    let pendulum = "models/double_pendulum.toml";
    assert!(!code(pendulum, &[]).contains("pub fn frames("));
    let one = code(pendulum, &["--frames", "tip"]);
    assert!(
        one.contains("pub fn frames(")
            && one.contains("pub fn momenta(")
            && one.contains("position: &mut [[f64; 3]; 1]")
    );
    let jacobians = code(pendulum, &["--outputs", "rates,jacobians", "--frames", "tip"]);
    assert!(!jacobians.contains("pub fn frames(") && jacobians.contains("pub fn jacobians("));
    // A model with loops keeps the outputs that only such models have.
    let loops = code("models/mechanisms/fourbar.toml", &["--frames", "coupler_point"]);
    assert!(loops.contains("pub fn frames(") && loops.contains("pub fn constraint_residuals("));
    bad(run(&["generate", pendulum, "--frames", "nose"]), &["no frame or body is named `nose`"]);
}

/// Names of the columns of a table, and its rows of numbers.
fn columns(table: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = table.lines();
    let names: Vec<String> = lines.next().expect("names").split(',').map(String::from).collect();
    let rows = lines.map(|l| l.split(',').map(|x| x.parse().expect("a number")).collect());
    let rows: Vec<Vec<f64>> = rows.collect();
    assert!(rows.iter().all(|r| r.len() == names.len()));
    (names, rows)
}

#[test]
fn simulates() {
    let folder = folder("simulate");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let output = good(run_in(&folder, &["simulate", &model, "--time", "2", "--every", "0.1"]));
    assert_eq!(files(&folder), ["double_pendulum.csv", "double_pendulum.svg"]);
    let (names, rows) = columns(&read(&folder, "double_pendulum.csv"));
    assert_eq!((names.len(), rows.len()), (1 + 2 + 2 + 2 + 3, 21));
    for (k, row) in rows.iter().enumerate() {
        assert!((row[0] - 0.1 * k as f64).abs() < 1e-12, "{}", row[0]);
        let (energy, start) = (row[row.len() - 1], rows[0][row.len() - 1]);
        // The tolerance is 1e-9 and the energy a few J.
        assert!((energy - start).abs() < 1e-7, "{energy} {start}");
    }
    let picture = read(&folder, "double_pendulum.svg");
    assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
    assert!(picture.contains("time [s]") && picture.contains("angle [rad]"));
    for text in ["by verner9", "tolerance 1e-9", "energy error", "work: ", "rejected", "time: ", "rates", "(21 rows)"] {
        assert!(out(&output).contains(text), "{text}:\n{}", out(&output));
    }
    let start =
        ["simulate", &model, "--q", "0.1,-0.2", "--v", "-1,0", "--time", "0.01", "--csv", "a.csv", "--svg", "a.svg"];
    good(run_in(&folder, &start));
    assert!(read(&folder, "a.csv").lines().nth(1).expect("a row").starts_with("0,0.1,-0.2,-1,"));
    // The default is ten seconds with a thousand rows and that of the start.
    good(run_in(&folder, &["simulate", &model]));
    let (_, rows) = columns(&read(&folder, "double_pendulum.csv"));
    assert_eq!((rows.len(), rows[1000][0]), (1001, 10.0));
}

/// Two paths of one file that is not there yet are found before anything is computed, and nothing is written.
#[test]
fn results_of_a_simulation_are_files_of_their_own() {
    let folder = folder("simulate_one_file");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let absolute = folder.join("double_pendulum.svg");
    let absolute = absolute.to_str().expect("text");
    for file in ["double_pendulum.svg", "./double_pendulum.svg", absolute, "./double_pendulum.csv"] {
        let output = run_in(&folder, &["simulate", &model, "--time", "0.1", "--picture", file]);
        bad(output, &["is to hold the table or plot already", "give it a name of its own"]);
    }
    // Drawings are SVG, and no other format is promised.
    for (option, file) in [("--picture", "a.png"), ("--picture", "a.PDF"), ("--svg", "a.jpeg"), ("--svg", "b.csv")] {
        let output = run_in(&folder, &["simulate", &model, "--time", "0.1", option, file]);
        bad(output, &[&format!("{option} {file}: drawings are SVG"), "ends with `.svg`"]);
    }
    bad(
        run_in(&folder, &["simulate", &model, "--time", "0.1", "--csv", "a.csv", "--svg", "./a.csv"]),
        &["table and plot are both to be written to", "give --csv and --svg two names"],
    );
    assert!(files(&folder).is_empty());
}

/// Machine code made at run time and the interpreter write the same table, loops, dampers, dense rows and all.
#[test]
fn simulates_the_same_interpreted() {
    let folder = folder("simulate_interpreted");
    let run = |model: &str, more: &[&str]| {
        let model = format!("{ROOT}/models/{model}");
        let arguments =
            [&["simulate", &model, "--time", "0.3", "--rows", "17", "--csv", "a.csv", "--svg", "a.svg"], more];
        let output = good(run_in(&folder, &arguments.concat()));
        (read(&folder, "a.csv"), out(&output).to_string())
    };
    let arguments: [(&str, &[&str]); 5] = [
        ("ur5.urdf", &[]),
        ("solo12.urdf", &["--base", "floating", "--method", "radau5"]),
        ("mechanisms/fourbar.toml", &["--method", "adams"]),
        ("mechanisms/strandbeest_leg.toml", &["--step", "0.001"]),
        ("chain100.toml", &["--method", "dop853"]),
    ];
    for (model, more) in arguments {
        let (compiled, interpreted) = (run(model, more), run(model, &[more, &["--interpreted"]].concat()));
        assert_eq!(compiled.0, interpreted.0, "{model}");
        assert!(compiled.1.contains("(machine code, made in "), "{}", compiled.1);
        assert!(interpreted.1.contains("(interpreter)"), "{}", interpreted.1);
    }
}

#[test]
fn simulates_on_the_energy_of_the_start() {
    let folder = folder("simulate_project");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let energies = |more: &[&str]| -> Vec<f64> {
        let arguments = [&["simulate", &model, "--time", "5", "--rows", "50", "--step", "0.01"], more].concat();
        good(run_in(&folder, &arguments));
        let (_, rows) = columns(&read(&folder, "double_pendulum.csv"));
        rows.iter().map(|row| row[row.len() - 1]).collect()
    };
    let drift = |energies: &[f64]| energies.iter().map(|e| (e - energies[0]).abs()).fold(0.0, f64::max);
    let (free, kept) = (drift(&energies(&[])), drift(&energies(&["--project"])));
    // Steps end at the rows of the table. The bound is rounding of energies of some tens of joules.
    assert!(kept < 1e-13 && free > 1e3 * kept, "{kept:e} {free:e}");
    let damped = format!("{ROOT}/models/chain100.toml");
    bad(run_in(&folder, &["simulate", &damped, "--project"]), &["dampers", "--no-damping"]);
}

#[test]
fn simulates_by_any_method() {
    let folder = folder("simulate_methods");
    let ball = format!("{ROOT}/models/spherical_pendulum.toml");
    let run = |more: &[&str]| {
        let arguments =
            [&["simulate", &ball, "--time", "1", "--rows", "7", "--csv", "a.csv", "--svg", "a.svg"], more].concat();
        let output = good(run_in(&folder, &arguments));
        (columns(&read(&folder, "a.csv")).1, out(&output).to_string())
    };
    let (reference, _) = run(&["--tolerance", "1e-12"]);
    assert_eq!(reference.len(), 8);
    let apart = |rows: &[Vec<f64>]| {
        let pairs = rows.iter().flatten().zip(reference.iter().flatten());
        pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
    };
    for method in multibody::runtime::catalogue::entries() {
        let low = method.title.contains("order 2") || method.title.contains("Euler");
        let (rows, text) = run(&["--method", method.name, "--step", "0.002"]);
        println!("{}: {:.1e}", method.name, apart(&rows));
        // The first bound is for methods of order one and two, with steps of 2 ms and rates of some tens.
        assert!(apart(&rows) < if low { 1.0 } else { 1e-5 }, "{}: {:e}", method.name, apart(&rows));
        assert!(text.contains(&format!("by {} ({}), steps of 0.002 s", method.name, method.title)), "{text}");
        assert!(text.contains("work: 500 steps, 0 more rejected"), "{text}");
        if method.adaptive {
            let (rows, text) = run(&["--method", method.name, "--tolerance", "1e-8"]);
            assert!(apart(&rows) < 1e-5, "{}: {:e}", method.name, apart(&rows));
            assert!(text.contains("tolerance 1e-8"), "{text}");
        } else {
            let arguments = ["simulate", &ball, "--method", method.name];
            bad(run_in(&folder, &arguments), &["estimates no error", "give --step"]);
        }
    }
    let (rows, text) = run(&["--partial"]);
    assert!(apart(&rows) < 1e-6 && text.contains("tolerance of coordinates 1e-9"), "{text}");
    // With a step and no method, the method is RK4.
    assert!(run(&["--step", "0.01"]).1.contains("by rk4"));
}

#[test]
fn failed_simulations_write_nothing() {
    let folder = folder("simulate_failures");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let simulate = |more: &[&str]| run_in(&folder, &[&["simulate", &model], more].concat());
    bad(
        simulate(&["--v", "1e8,1e8", "--step", "1"]),
        &["the simulation failed", "is not finite in the step from t = ", "lower --step", "nothing was written"],
    );
    bad(
        simulate(&["--v", "1e200,1e200"]),
        &["the simulation failed", "from t = 0 s", "`elbow`", "--v", "nothing was written"],
    );
    bad(simulate(&["--q", "1"]), &["--q has 1 numbers, expected 2", "in order: "]);
    bad(simulate(&["--csv", "a", "--svg", "a"]), &["both to be written to `a`"]);
    bad(simulate(&["--step", "1e-12"]), &["steps are too many"]);
    bad(simulate(&["--every", "1e-12"]), &["rows are too many"]);
    // The error is found before the simulation, and neither of the two files is written.
    bad(simulate(&["--time", "1e9", "--svg", "none/a.svg"]), &["cannot write `none/a.svg`"]);
    bad(simulate(&["--time", "1e9", "--csv", "."]), &["cannot write `.`"]);
    for wrong in [
        &["--time", "-1"][..],
        &["--q", "nan,0"],
        &["--method", "rk5"],
        &["--tolerance", "0"],
        &["--step", "0.1", "--tolerance", "1e-6"],
        &["--rows", "0"],
        &["--rows", "5", "--every", "1"],
        // Without a picture, and without a table.
        &["--strobes", "3"],
        &["--interpolation", "linear"],
    ] {
        assert_eq!(simulate(wrong).status.code(), Some(2), "{wrong:?}");
    }
    assert!(err(&simulate(&["--method", "dop"])).contains("dop853"));
    assert!(files(&folder).is_empty(), "{:?}", files(&folder));
}

/// Negative values of options that take a number are answered by what the numbers must be.
#[test]
fn negative_numbers_are_refused_as_such() {
    let positive = "the number must be positive";
    let angle = "the angle must lie between 0 and 0.1 rad";
    for (arguments, answer) in [
        (&["simulate", "m.toml", "--time", "-1"][..], positive),
        (&["simulate", "m.toml", "--step", "-0.1"], positive),
        (&["simulate", "m.toml", "--tolerance", "-1"], positive),
        (&["simulate", "m.toml", "--contact-step", "-1"], positive),
        (&["simulate", "m.toml", "--every", "-1"], positive),
        (&["simulate", "m.toml", "--rows", "-1"], "the number must be whole and positive"),
        (&["simulate", "m.toml", "--strobes", "-1", "--picture", "m.svg"], "-1 is not in 1..=500"),
        (&["simulate", "m.urdf", "--friction", "-1", "--floor", "0"], "the number must not be negative"),
        (&["simulate", "m.toml", "--snap", "-1"], angle),
        (&["generate", "m.toml", "--snap", "-1"], angle),
        (&["generate", "m.toml", "--chunk", "-1"], "-1 is not in 1..="),
        (&["eval", "m.toml", "-i", "s.json", "--snap", "-1"], angle),
        (&["certify", "m.toml", "--box", "s.json", "--snap", "-1"], angle),
        (&["certify", "m.toml", "--box", "s.json", "--split", "-1"], "-1 is not in 1..=1000000"),
        (&["certify", "m.toml", "--box", "s.json", "--samples", "-1"], "-1 is not in 0..="),
        (&["view", "m.toml", "--gltf", "m.glb", "--time", "-1"], positive),
        (&["view", "--port", "-1"], "-1 is not in 0..=65535"),
    ] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(err(&output).contains(answer), "{arguments:?}: {}", err(&output));
    }
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
    good(run(&["check", "--generated", "cli/tour"]));
    assert_eq!(read(Path::new(ROOT), "cli/tour/ur5.urdf"), read(Path::new(ROOT), "models/ur5.urdf"), "copied anew");
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
    write(&folder, "manifest.toml", &manifest.replace("model = \"../models/double_pendulum.toml\"\n", ""));
    bad(run_in(&root, &["check", "--generated"]), &["manifest.toml:1:1: error: missing field `model`"]);
    write(&folder, "manifest.toml", &manifest.replace("outputs", "outptus"));
    bad(run_in(&root, &["check", "--generated"]), &["manifest.toml:5:1: error: unknown field `outptus`"]);
}

#[test]
fn the_tour() {
    let folder = folder("tour");
    let output = good(run_in(&folder, &[]));
    assert_eq!(files(&folder), ["mbd-tour.svg"]);
    // The README shows a release build, which does not say what it is.
    let lines = out(&output).lines().filter(|line| !line.contains("(this is a debug build"));
    let printed: String = lines.flat_map(|line| [line, "\n"]).collect();
    assert_eq!(agrees_with_pages(&[], &printed), 1, "the README shows it");
}

#[test]
fn closed_standard_output_is_no_failure() {
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

/// An arm with six revolute joints, the first along gravity, has one base inertial parameter of the first link and
/// seven of each other one (M. Gautier, W. Khalil, 1990): 36. A damping and a dry friction of every joint come to them.
#[test]
fn base_parameters_are_named() {
    let output = good(run(&["identifiable", "models/ur5.urdf"]));
    let text = out(&output);
    let head = "ur5: 72 dynamic parameters of 6 bodies and 6 velocities; 48 base parameters, 9 without effect\n";
    assert!(text.starts_with(head), "{text}");
    for line in [
        "upper_arm_link.mz + 0.425 forearm_link.m + 0.425 wrist_1_link.m + 0.425 wrist_2_link.m + 0.425 wrist_3_link.m",
        "wrist_3_link.ixx - wrist_3_link.izz",
        "elbow_joint.friction",
    ] {
        assert!(text.lines().any(|l| l == line), "{line}:\n{text}");
    }
    let names = "shoulder_link.m, shoulder_link.mx, shoulder_link.my, shoulder_link.mz";
    assert!(text.contains(&format!("\nwithout effect: {names}, ")), "{text}");
}

#[test]
fn inputs_are_not_overwritten() {
    let folder = folder("overwrite");
    let text = std::fs::read_to_string(format!("{ROOT}/models/double_pendulum.toml")).expect("the model");
    let states = r#"{"states": [{"q": [0.1, 0.2], "v": [0, 0]}]}"#;
    write(&folder, "m.toml", &text);
    write(&folder, "s.json", states);
    for arguments in [
        &["generate", "m.toml", "-o", "m.toml"][..],
        &["simulate", "m.toml", "--time", "0.1", "--csv", "m.toml"],
        &["simulate", "m.toml", "--time", "0.1", "--svg", "../cli_overwrite/m.toml"],
        &["eval", "m.toml", "-i", "s.json", "-o", "s.json"],
    ] {
        bad(run_in(&folder, arguments), &["cannot write", "it is the input of this command"]);
    }
    assert_eq!(read(&folder, "m.toml"), text);
    assert_eq!(read(&folder, "s.json"), states);
    assert_eq!(files(&folder), ["m.toml", "s.json"]);
    // Beside the report, standard output takes no table.
    for option in ["--csv", "--svg", "--picture"] {
        let output = run_in(&folder, &["simulate", "m.toml", "--time", "0.1", option, "-"]);
        bad(output, &["cannot write `-`", "name a file"]);
    }
    assert_eq!(files(&folder), ["m.toml", "s.json"]);
    // A dash is standard output.
    let code = good(run_in(&folder, &["generate", "m.toml", "-o", "-"]));
    assert!(out(&code).contains("pub fn rates") || out(&code).contains("fn rates"), "{}", out(&code));
    assert_eq!(files(&folder), ["m.toml", "s.json"]);
}

/// A robot of one joint whose link carries an antenna of one milligram.
fn with_antenna(antenna: &str) -> String {
    format!(
        "<robot name='连杆'><link name='base'/><link name='臂'><inertial><mass value='2'/><origin xyz='0 0 0.3'/>\
         <inertia ixx='0.02' iyy='0.02' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>\
         <link name='antenna'><inertial><mass value='1e-6'/>\
         <inertia ixx='-1e-7' iyy='1e-7' izz='1e-7' ixy='0' ixz='0' iyz='0'/></inertial></link>\
         <joint name='j' type='continuous'><parent link='base'/><child link='臂'/><axis xyz='0 1 0'/></joint>\
         <joint name='a' type='{antenna}'><parent link='臂'/><child link='antenna'/><axis xyz='0 1 0'/></joint></robot>"
    )
}

#[test]
fn robots_of_others_are_judged_by_what_moves() {
    let folder = folder("others");
    // The antenna is fixed: what moves has a sound inertia. A declaration after blank lines, names in any script.
    write(&folder, "fixed.urdf", &format!("\n\n<?xml version=\"1.0\"?>\n{}", with_antenna("fixed")));
    let output = good(run_in(&folder, &["check", "fixed.urdf"]));
    for text in [
        "fixed.urdf:3:1: warning: the XML declaration does not stand at the start",
        "warning: inertia of `antenna` has a negative moment; together with what is fixed to it, it is sound",
        "model `连杆` is called `u8fde_u6746` in generated code",
    ] {
        assert!(err(&output).contains(text), "{text}: {}", err(&output));
    }
    assert!(out(&output).contains("2 fixed"), "{}", out(&output));
    let code = good(run_in(&folder, &["generate", "fixed.urdf", "--outputs", "rates"]));
    assert!(out(&code).contains("pub struct U8fdeU6746"), "{}", out(&code));
    write(&folder, "moving.urdf", &with_antenna("continuous"));
    bad(run_in(&folder, &["check", "moving.urdf"]), &["error: inertia of `antenna` has a negative moment\n"]);
}

#[test]
fn robots_are_converted() {
    let folder = folder("convert");
    let robot = format!("{ROOT}/models/solo12.urdf");
    good(run_in(&folder, &["convert", &robot, "--base", "floating", "-o", "solo12.toml"]));
    let sound = |arguments: &[&str]| {
        let output = good(run_in(&folder, arguments));
        out(&output).split_once(": ").expect("a summary").1.to_string()
    };
    assert_eq!(sound(&["check", "solo12.toml"]), sound(&["check", &robot, "--base", "floating"]));
    let code = |model: &str, base: &[&str]| {
        let all = [&["generate", model, "--outputs", "rates"], base].concat();
        // The header names the source.
        let output = good(run_in(&folder, &all));
        out(&output).lines().filter(|line| !line.contains("solo12.")).map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(code("solo12.toml", &[]), code(&robot, &["--base", "floating"]));
    // A converted robot can be added to.
    let mut text = read(&folder, "solo12.toml");
    text += "\n[[frame]]\nname = \"camera\"\nbody = \"base_link\"\nxyz = [0.2, 0, 0]\n";
    write(&folder, "seeing.toml", &text);
    good(run_in(&folder, &["check", "seeing.toml"]));
    bad(run_in(&folder, &["convert", "solo12.toml", "-o", "solo12.toml"]), &["it is the input of this command"]);
}

#[test]
fn robots_are_added_to() {
    let folder = folder("base");
    std::fs::copy(format!("{ROOT}/models/ur5.urdf"), folder.join("ur5.urdf")).expect("a copy");
    std::fs::copy(format!("{ROOT}/models/ur5_tool.toml"), folder.join("tool.toml")).expect("a copy");
    let output = good(run_in(&folder, &["check", "tool.toml"]));
    assert!(out(&output).contains("12 bodies") && out(&output).contains("external wrenches: 1"), "{}", out(&output));
    good(run_in(&folder, &["convert", "tool.toml", "-o", "whole.toml"]));
    let whole = good(run_in(&folder, &["check", "whole.toml"]));
    assert_eq!(out(&whole).replace("whole.toml", "tool.toml"), out(&output));
    // The base is input, too.
    bad(run_in(&folder, &["generate", "tool.toml", "-o", "ur5.urdf"]), &["it is the input of this command"]);
    std::fs::remove_file(folder.join("ur5.urdf")).expect("the copy");
    bad(run_in(&folder, &["check", "tool.toml"]), &["tool.toml:7:8: error: cannot read the base `ur5.urdf`"]);
}

#[test]
fn shells_complete() {
    let names: Vec<String> = {
        let help = good(run(&["--help"]));
        let commands = out(&help).split_once("Commands:").expect("a list of commands").1.to_string();
        let words = commands.lines().skip(1).map_while(|line| line.split_whitespace().next().map(String::from));
        words.filter(|word| word != "help").collect()
    };
    assert!(names.len() >= 11, "{names:?}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh", "man"] {
        let output = good(run(&["completions", shell]));
        for name in &names {
            assert!(out(&output).contains(name), "{shell}: {name}");
        }
        assert!(out(&output).contains("tolerance"), "{shell}");
    }
    if is_there("bash") {
        let script = "source <(\"$0\" completions bash); COMP_WORDS=(mbd simulate --tol); COMP_CWORD=2; _mbd mbd --tol simulate; \
                      echo \"${COMPREPLY[@]}\"";
        let output = Command::new("bash").args(["-c", script, env!("CARGO_BIN_EXE_mbd")]).output().expect("bash");
        assert!(out(&output).contains("--tolerance"), "{} {}", out(&output), err(&output));
    }
}

//! `mbd simulate` under control: efforts, set-points and wrenches of tables, limits, runs that are continued or
//! interrupted, and chosen columns.

use std::path::Path;

use crate::run::{bad, files, folder, good, out, read, run_in, write, Rows, ROOT};

/// A bar of 1 m and 2 kg that hangs down, with its hinge at the origin.
const PENDULUM: &str = r#"
name = "pendulum"

[[body]]
name = "bar"
mass = 2.0
com = [0, 0, -0.5]
inertia = [0.17, 0.17, 0.001]

[[joint]]
name = "hinge"
type = "revolute"
child = "bar"
axis = [0, 1, 0]

[[frame]]
name = "tip"
body = "bar"
xyz = [0, 0, -1]
"#;

/// A block of 2 kg on a track without gravity.
const BLOCK: &str = r#"
name = "block"
gravity = [0, 0, 0]

[[body]]
name = "block"
mass = 2.0
inertia = [1, 1, 1]

[[joint]]
name = "track"
type = "prismatic"
child = "block"
axis = [1, 0, 0]
"#;

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} and {b} differ by {:.1e}", (a - b).abs());
}

fn run(folder: &Path, model: &str, more: &[&str]) -> String {
    let output = good(run_in(folder, &[&["simulate", model], more].concat()));
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(!messages.contains("warning"), "{messages}");
    out(&output).to_string()
}

#[test]
fn gravity_compensation_holds_a_robot() {
    let folder = folder("control_hold");
    let model = format!("{ROOT}/models/ur5.urdf");
    let start = ["--q", "0.1,-1,1.2,0.3,-0.4,0.5", "--v", "0,0,0,0,0,0", "--time", "5"];
    let text = run(&folder, &model, &[&start[..], &["--gravity-compensation"]].concat());
    assert!(text.contains("control: gravity compensated on 6 axes"), "{text}");
    let table = Rows::read(&folder, "ur5.csv");
    for (joint, q) in ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"].iter().zip([0.1, -1.0, 1.2]) {
        // Rounding errors of the forces, integrated twice over the time: the position is unstable.
        close(table.last(&format!("q.{joint}")), q, 1e-12);
    }
}

#[test]
fn gains_leave_the_error_that_gravity_makes() {
    let folder = folder("control_gains");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    let hold = ["--kp", "50", "--kd", "20", "--q", "0.8", "--v", "0", "--time", "30"];
    run(&folder, &model, &hold);
    let table = Rows::read(&folder, "pendulum.csv");
    let q = table.last("q.hinge");
    // kp (q* - q) = m g l sin q at rest.
    close(50.0 * (0.8 - q), 2.0 * 9.81 * 0.5 * q.sin(), 1e-7);
    close(table.last("tau.hinge"), 50.0 * (0.8 - q), 1e-6);
    // With the weight taken, there is no error at the end of a step of the set-point.
    let steps = write(&folder, "steps.csv", "time,hinge\n0,0.5\n2,-0.4\n");
    let more = ["--gravity-compensation", "--set-points", &steps];
    run(&folder, &model, &[&hold[..], &more].concat());
    close(Rows::read(&folder, "pendulum.csv").last("q.hinge"), -0.4, 1e-8);
}

#[test]
fn implicit_methods_know_the_gains() {
    let folder = folder("control_implicit");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    let ramp = write(&folder, "ramp.csv", "t,q.hinge\n0,0\n1,1\n2,0.5\n");
    let end = |method: &str| {
        let arguments =
            ["--kp", "80", "--kd", "3", "--set-points", &ramp, "--interpolation", "linear", "--method", method];
        run(&folder, &model, &[&arguments[..], &["--time", "3", "--q", "0.2", "--v", "0"]].concat());
        Rows::read(&folder, "pendulum.csv").last("q.hinge")
    };
    let best = end("verner9");
    for method in ["radau5", "rodas5p", "adams"] {
        // A hundred times the tolerance of 1e-9.
        close(end(method), best, 1e-7);
    }
    let refused = ["simulate", &model, "--gravity-compensation", "--method", "radau5"];
    bad(run_in(&folder, &refused), &["the derivatives of --gravity-compensation are not known", "take one of"]);
}

/// Constant force over each of two seconds: parabolas, and the work is force times way.
#[test]
fn efforts_of_a_table_are_held_or_linear() {
    let folder = folder("control_efforts");
    let model = write(&folder, "block.toml", BLOCK);
    let table = write(&folder, "push.csv", "t,track\n0,4\n1,-2\n");
    let start = ["--efforts", &table, "--time", "2", "--q", "0", "--v", "0", "--every", "0.5"];
    let text = run(&folder, &model, &start);
    let rows = Rows::read(&folder, "block.csv");
    // a = 2 m/s², then -1 m/s².
    close(rows.column("q.track")[2], 1.0, 1e-12);
    close(rows.last("q.track"), 1.0 + 2.0 - 0.5, 1e-12);
    assert_eq!(rows.column("tau.track"), [4.0, 4.0, -2.0, -2.0, -2.0]);
    assert!(text.contains("the control does 1.000000 J of work"), "{text}");
    run(&folder, &model, &[&start[..], &["--interpolation", "linear"]].concat());
    // a = 2 - 3 t, then -1 m/s².
    let rows = Rows::read(&folder, "block.csv");
    close(rows.column("q.track")[2], 0.5, 1e-12);
    close(rows.last("q.track"), 0.5 + 0.5 - 0.5, 1e-12);
    // Fixed steps end at the jumps as well.
    run(&folder, &model, &[&start[..], &["--step", "0.3"]].concat());
    close(Rows::read(&folder, "block.csv").last("q.track"), 2.5, 1e-12);
}

#[test]
fn a_run_is_repeated_by_its_efforts_and_continued_from_its_end() {
    let folder = folder("control_again");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    let start = ["--q", "0.3", "--v", "0", "--every", "0.001"];
    run(&folder, &model, &[&start[..], &["--kp", "60", "--kd", "2", "--time", "1", "--csv", "first.csv"]].concat());
    let first = Rows::read(&folder, "first.csv");
    let repeat = ["--efforts", "first.csv", "--interpolation", "linear", "--time", "1", "--csv", "second.csv"];
    run(&folder, &model, &[&start[..], &repeat].concat());
    let second = Rows::read(&folder, "second.csv");
    // Linear interpolation errs by h² / 8 of the second derivative of the torque.
    close(first.last("q.hinge"), second.last("q.hinge"), 1e-5);
    assert!(first.last("q.hinge") != second.last("q.hinge"));
    // One second, and once more from there: two seconds.
    let gains = ["--kp", "60", "--kd", "2", "--actuated", "hinge", "--set-points", "zero.csv"];
    write(&folder, "zero.csv", "t,hinge\n0,0\n");
    run(&folder, &model, &[&gains[..], &start, &["--time", "2", "--csv", "whole.csv"]].concat());
    run(&folder, &model, &[&gains[..], &start, &["--time", "1", "--csv", "half.csv"]].concat());
    run(&folder, &model, &[&gains[..], &["--start", "half.csv", "--time", "1", "--csv", "rest.csv"]].concat());
    let [whole, rest] = ["whole.csv", "rest.csv"].map(|name| Rows::read(&folder, name));
    close(whole.last("q.hinge"), rest.last("q.hinge"), 1e-9);
    let missing = write(&folder, "missing.csv", "t,q.hinge\n0,1\n");
    bad(run_in(&folder, &["simulate", &model, "--start", &missing]), &["has no columns `v.hinge`"]);
}

#[test]
fn wrenches_of_a_table_do_work() {
    let folder = folder("control_wrench");
    let model = write(&folder, "block.toml", BLOCK);
    let table = write(&folder, "pull.csv", "t,block.fx,wrench.block.mz\n0,6,1\n");
    let arguments = ["--wrench", "block", "--wrenches", &table, "--time", "2", "--q", "0", "--v", "0"];
    let text = run(&folder, &model, &arguments);
    close(Rows::read(&folder, "block.csv").last("q.track"), 0.5 * 3.0 * 4.0, 1e-11);
    assert!(text.contains("the control does 36.000000 J of work"), "{text}");
    let none = ["simulate", &model, "--wrenches", &table];
    bad(run_in(&folder, &none), &["--wrenches: no external wrench acts on the model", "--wrench LIST"]);
}

#[test]
fn efforts_are_limited_and_what_is_passed_is_told() {
    let folder = folder("control_limits");
    let bounded = BLOCK.replace("axis =", "range = [-1, 2]\nmax_velocity = 1.5\nmax_effort = 3\naxis =");
    let model = write(&folder, "block.toml", &bounded);
    let table = write(&folder, "push.csv", "t,track\n0,4\n1,1\n");
    let start = ["--efforts", &table, "--time", "2", "--q", "0", "--v", "0"];
    let text = run(&folder, &model, &start);
    // a = 1.5 m/s², then 0.5 m/s².
    close(Rows::read(&folder, "block.csv").last("q.track"), 0.75 + 1.5 + 0.25, 1e-12);
    assert!(text.contains("efforts at their limits: `track` for 1.000 s at 3 N"), "{text}");
    assert!(
        text.contains("positions beyond their ranges: `track` from") && text.contains(", 2.500 m of 2.000"),
        "{text}"
    );
    assert!(
        text.contains("speeds beyond their limits: `track` from") && text.contains(", 2.000 m/s of 1.500"),
        "{text}"
    );
    let text = run(&folder, &model, &[&start[..], &["--unlimited"]].concat());
    close(Rows::read(&folder, "block.csv").last("q.track"), 1.0 + 2.0 + 0.25, 1e-12);
    assert!(!text.contains("at their limits") && text.contains("efforts: at most 4.000 N at `track`"), "{text}");
    // Without a word of the user, the motion starts within the range.
    let model = write(&folder, "block.toml", &bounded.replace("[-1, 2]", "[1, 2]"));
    run(&folder, &model, &["--time", "0.1", "--v", "0"]);
    assert_eq!(Rows::read(&folder, "block.csv").column("q.track")[0], 1.5);
}

/// A block is pressed against a stop, which pushes back, and pulled away from it.
#[test]
fn contacts_feel_the_control() {
    let folder = folder("control_contacts");
    let model = write(&folder, "block.toml", &BLOCK.replace("axis =", "limits = { upper = 1 }\naxis ="));
    let table = write(&folder, "push.csv", "t,track\n0,4\n3,-2\n");
    let arguments = ["--efforts", &table, "--time", "5", "--q", "0", "--v", "0", "--every", "0.5"];
    run(&folder, &model, &[&arguments[..], &["--columns", "q,tau,forces"]].concat());
    let rows = Rows::read(&folder, "block.csv");
    assert_eq!(
        rows.header,
        ["t", "q.track", "tau.track", "force.track/upper.n", "force.track/upper.t1", "force.track/upper.t2"]
    );
    // It arrives after a second and stays for two.
    close(rows.column("q.track")[5], 1.0, 1e-12);
    close(rows.column("force.track/upper.n")[5], 4.0, 1e-9);
    // a = -1 m/s² for two seconds.
    close(rows.last("q.track"), 1.0 - 2.0, 1e-9);
    assert_eq!(rows.last("force.track/upper.n"), 0.0);
    // Its modes are visited in turn, which a free block would not.
    let modes = ["modes", &model, "--efforts", &table, "--time", "5", "--q", "0", "--v", "0"];
    let text = out(&good(run_in(&folder, &modes))).to_string();
    assert!(text.contains("Sets of modes that it visits: 2"), "{text}");
    let stepping = ["--contacts", "stepping", "--contact-step", "0.001"];
    run(&folder, &model, &[&arguments[..], &stepping].concat());
    close(Rows::read(&folder, "block.csv").last("q.track"), 1.0 - 2.0, 0.01);
}

#[test]
fn columns_are_chosen() {
    let folder = folder("control_columns");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    run(&folder, &model, &["--time", "1", "--columns", "q.hinge,frames,energy,reactions"]);
    let rows = Rows::read(&folder, "pendulum.csv");
    for (k, q) in rows.column("q.hinge").into_iter().enumerate() {
        // The tip is at -z of a bar that turns about y.
        close(rows.column("frame.tip.x")[k], -q.sin(), 1e-14);
        close(rows.column("frame.tip.z")[k], -q.cos(), 1e-14);
    }
    assert!(rows.header.iter().any(|name| name == "reaction.bar.my") && !rows.header.iter().any(|n| n == "p.hinge"));
    bad(
        run_in(&folder, &["simulate", &model, "--columns", "q,frame.tp.x"]),
        &["--columns: no column is named `frame.tp.x`", "did you mean `frame.tip.x`"],
    );
    // The help names every group.
    let help = good(run_in(&folder, &["simulate", "--help"]));
    let (_, about) = out(&help).split_once("--columns <LIST>").expect("the option");
    let (about, _) = about.split_once("--record-modes").expect("the next option");
    for group in ["q", "v", "p", "energy", "tau", "frames", "multipliers", "reactions", "forces"] {
        assert!(about.contains(&format!("`{group}`")), "{group}: {about}");
    }
    bad(run_in(&folder, &["simulate", &model, "--columns", "tau"]), &["without control there are no joint forces"]);
    let loops = format!("{ROOT}/models/mechanisms/fourbar_equal.toml");
    run(&folder, &loops, &["--time", "0.5", "--columns", "multipliers"]);
    assert!(Rows::read(&folder, "fourbar_equal.csv").rows[3][1..3].iter().all(|x| x.is_finite() && *x != 0.0));
}

#[test]
fn mistakes_in_tables_are_told_all_at_once() {
    let folder = folder("control_mistakes");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    let table = write(&folder, "bad.csv", "t,hnge\n0,1\n0,x\n1\n");
    let output = run_in(&folder, &["simulate", &model, "--efforts", &table]);
    bad(
        output,
        &[
            "bad.csv:1: error: unknown column `hnge`",
            "did you mean `hinge`",
            "bad.csv:3: error: the time 0 s does not come after the one before it",
            "bad.csv:4: error: 1 fields, but the first line names 2",
        ],
    );
    let table = write(&folder, "bad.csv", "hinge,hinge\n0,1e999\n");
    bad(
        run_in(&folder, &["simulate", &model, "--efforts", &table]),
        &[
            "there is no column of the time",
            "a second column of `hinge`",
            "`1e999` in column `hinge` is not a finite number",
        ],
    );
    for (arguments, text) in [
        (&["--kp", "elbow=3"][..], "--kp: no joint that a controller acts on is named `elbow`"),
        (&["--kp", "3,4"], "--kp: a second gain for all joints"),
        (&["--kd", "hinge=3,1,hinge=4"], "--kd: a second gain for `hinge`"),
        (&["--actuated", "hinge"], "--actuated: nothing is controlled"),
        (&["--actuated", "elbow", "--kp", "1"], "--actuated: no joint that a controller acts on is named `elbow`"),
        (&["--gravity-compensation", "--project"], "--project keeps the energy, which the control changes"),
        (&["--efforts", "none.csv"], "cannot read `none.csv`"),
    ] {
        bad(run_in(&folder, &[&["simulate", &model], arguments].concat()), &[text]);
    }
    assert_eq!(files(&folder), ["bad.csv", "pendulum.toml"]);
}

/// The gain of a joint counts wherever it stands, and a column is written once.
#[test]
fn gains_have_no_order() {
    let folder = folder("control_gains_order");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    let table = |gains: &str| {
        let arguments = ["simulate", &model, "--time", "0.2", "--kp", gains, "--kd", "1", "--columns", "q,v,q,q.hinge"];
        good(run_in(&folder, &arguments));
        read(&folder, "pendulum.csv")
    };
    let named = table("hinge=40");
    assert_eq!(table("7,hinge=40"), named);
    assert_eq!(table("hinge=40,7"), named);
    assert!(table("7") != named);
    assert_eq!(named.lines().next(), Some("t,q.hinge,v.hinge"));
}

/// A run that would take hours ends at once, with what it has.
#[cfg(unix)]
#[test]
fn an_interrupted_run_writes_what_it_has() {
    let folder = folder("control_interrupt");
    let model = write(&folder, "pendulum.toml", PENDULUM);
    let mut child = crate::run::start_in(&folder, &["simulate", &model, "--time", "1e5", "--every", "0.1"]);
    crate::run::wait_until_it_computes(&mut child);
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill").success());
    let status = child.wait().expect("an end");
    assert_eq!(status.code(), Some(130));
    let rows = Rows::read(&folder, "pendulum.csv");
    assert!(rows.rows.len() > 10, "{}", rows.rows.len());
    // The last row is the end, which lies between those at equal times.
    let tenths = 10.0 * rows.last("t");
    assert!((tenths - tenths.round()).abs() > 1e-9, "{tenths}");
    assert!(read(&folder, "pendulum.svg").contains("</svg>"));
}

/// A bound that is passed within a step is told, where a row of the table shows it.
#[test]
fn rows_within_steps_are_looked_at_for_bounds() {
    let folder = folder("control_within");
    let text = "name = \"spring\"\ngravity = [0, 0, 0]\n[[body]]\nname = \"m\"\nmass = 1\n[[joint]]\nname = \"s\"\n\
                type = \"prismatic\"\nchild = \"m\"\nstiffness = 100\nrange = [-0.4, 0.6]\nstart = 0.5\n";
    let model = write(&folder, "spring.toml", text);
    // A period, with steps of a quarter of it: the position is 0.5 m or 0 m at their ends, but for one of them.
    let more = ["--time", "0.62831853", "--method", "gauss16", "--tolerance", "1e-4", "--every", "0.01"];
    let report = run(&folder, &model, &more);
    let rows = Rows::read(&folder, "spring.csv");
    let (times, positions) = (rows.column("t"), rows.column("q.s"));
    let first = times.iter().zip(&positions).find(|(_, q)| **q < -0.4).expect("a row beyond the range");
    assert!(report.contains("positions beyond their ranges"), "{report}");
    let told: f64 =
        report.split("from ").nth(1).and_then(|r| r.split(' ').next()).and_then(|t| t.parse().ok()).expect("a time");
    assert!(told <= *first.0 + 1e-3, "{report}\nfirst row {first:?}");
}

//! The command on models with contacts: the table of events, and what is refused.

use crate::run::{bad, files, folder, good, out, run_in, Rows, ROOT};

fn shipped(name: &str) -> String {
    format!("{ROOT}/models/contacts/{name}.toml")
}

#[test]
fn the_table_of_events_has_the_bounces_of_a_ball() {
    let folder = folder("contacts_ball");
    let output = good(run_in(&folder, &["simulate", &shipped("bouncing_ball"), "--time", "3"]));
    assert!(out(&output).contains("bounce lands at 4.429447 m/s, then open"), "{}", out(&output));
    assert_eq!(files(&folder), ["bouncing_ball.csv", "bouncing_ball.svg", "bouncing_ball_events.csv"]);
    let table = std::fs::read_to_string(folder.join("bouncing_ball_events.csv")).expect("a table");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("t,contact,event,mode,approach,energy"));
    // 1 m high, restitution 0.8: every flight takes 0.8 of the time of the one before it.
    let (mut time, mut flight) = ((2.0_f64 / 9.81).sqrt(), 2.0 * 0.8 * (2.0_f64 / 9.81).sqrt());
    let mut count = 0;
    for line in lines {
        let mut words = line.split(',');
        let t: f64 = words.next().and_then(|t| t.parse().ok()).expect("a time");
        assert!((t - time).abs() < 1e-10, "{t} {time}");
        assert_eq!(words.take(3).collect::<Vec<_>>(), ["bounce", "lands", "open"]);
        (time, flight) = (time + flight, 0.8 * flight);
        count += 1;
    }
    assert_eq!(count, 6);
}

/// A walker that has fallen slides on the tip of a leg, ahead of which friction wedges it.
#[test]
fn a_jam_is_told() {
    let folder = folder("contacts_jam");
    let output = good(run_in(&folder, &["simulate", &shipped("simplest_walker"), "--time", "2.1"]));
    assert!(out(&output).contains("heel_b jams, then "), "{}", out(&output));
    assert!(out(&output).contains("\njams: 1, where friction stopped"), "{}", out(&output));
}

/// The last row of the table is at the end, whatever rounding makes of the sum of the steps.
#[test]
fn time_steps_end_with_a_row() {
    let folder = folder("contacts_rows");
    for time in [0.5, 1.0, 1.5, 2.0, 3.0] {
        let (model, text) = (shipped("block_on_incline"), time.to_string());
        let arguments =
            ["simulate", &model, "--time", &text, "--contacts", "stepping", "--rows", "4", "--csv", "rows.csv"];
        good(run_in(&folder, &arguments));
        let times = Rows::read(&folder, "rows.csv").column("t");
        assert_eq!(times, [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| part * time));
    }
}

#[test]
fn stops_have_the_units_of_their_joints() {
    let folder = folder("contacts_stop");
    let output = good(run_in(&folder, &["simulate", &shipped("fourbar_stop"), "--time", "1"]));
    assert!(out(&output).contains("rocker_pin/lower lands at 0.709727 rad/s, then open"), "{}", out(&output));
    assert!(out(&output).contains("contacts at the end: rocker_pin/lower closed"), "{}", out(&output));
}

#[test]
fn implicit_methods_take_contacts() {
    let folder = folder("contacts_implicit");
    let output = good(run_in(&folder, &["simulate", &shipped("bouncing_ball"), "--method", "radau5", "--time", "1"]));
    assert!(out(&output).contains("of their derivatives"), "{}", out(&output));
    assert!(out(&output).contains("0.451523641 s  bounce lands"), "{}", out(&output));
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let folder = folder("contacts_refused");
    let ball = shipped("bouncing_ball");
    let low = ["simulate", &ball, "--q", "0,0,0.02,0,0,0,1"];
    bad(run_in(&folder, &low), &["the bodies of contact `bounce` overlap by 3.000e-2 at the start", "give --q"]);
    assert!(files(&folder).is_empty(), "{:?}", files(&folder));
}

#[test]
fn contacts_are_followed_by_time_steps() {
    let folder = folder("contacts_stepping");
    let run = |how: &str, more: &[&str]| {
        let arguments = ["simulate", &shipped("bouncing_ball"), "--time", "3", "--rows", "3", "--contacts", how];
        let output = good(run_in(&folder, &[&arguments, more].concat()));
        let table = std::fs::read_to_string(folder.join("bouncing_ball.csv")).expect("a table");
        let last = table.lines().last().and_then(|row| row.split(',').nth(3)).expect("a height");
        (out(&output).to_string(), last.parse::<f64>().expect("a number"))
    };
    let (_, exact) = run("events", &[]);
    let (report, height) = run("stepping", &["--contact-step", "1e-4"]);
    assert!(report.contains("3 s of free motion by time steps of 0.0001 s"), "{report}");
    assert!(report.contains("regimes: 0.000000 s by events, 3.000000 s by time steps, 0 changes"), "{report}");
    assert!(report.contains("time steps: 30000, "), "{report}");
    // A landing presses in both steps between whose middles it is, and parts in the step after.
    let table = std::fs::read_to_string(folder.join("bouncing_ball_events.csv")).expect("a table");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let first: f64 = rows[0][0].parse().expect("a time");
    assert!((first - (2.0_f64 / 9.81).sqrt()).abs() < 2e-4, "{first}");
    let kinds = |from: usize| rows.iter().skip(from).step_by(2).map(|row| row[2]).collect::<Vec<_>>();
    assert_eq!((kinds(0), kinds(1)), (vec!["presses"; 6], vec!["parts"; 6]));
    // Each of six landings at up to 4.4 m/s is late by up to a step.
    assert!((height - exact).abs() < 6.0 * 2.0 * 4.4 * 1e-4, "{height} {exact}");
    // Few events: nothing changes.
    let (report, height) = run("auto", &[]);
    assert!(report.contains("regimes: 3.000000 s by events, 0.000000 s by time steps, 0 changes"), "{report}");
    assert_eq!(height, exact);

    let ball = shipped("bouncing_ball");
    let both = ["simulate", &ball, "--contacts", "stepping", "--tolerance", "1e-6", "--method", "dop853"];
    let text = "--contacts stepping has a method of its own, for which --method, --tolerance means nothing";
    bad(run_in(&folder, &both), &[text, "--contact-step"]);
    let pendulum = format!("{ROOT}/models/double_pendulum.toml");
    let alone = ["simulate", &ball, "--contact-step", "1e-4"];
    bad(
        run_in(&folder, &alone),
        &["--contact-step: contacts are followed from event to event", "`--contacts stepping`"],
    );
    let without = ["simulate", &pendulum, "--contacts", "auto"];
    bad(run_in(&folder, &without), &["--contacts: `double_pendulum` has no contacts"]);
}

/// The first ball of the cradle strikes two that touch.
#[test]
fn contacts_collide_together_or_one_after_the_other() {
    let folder = folder("contacts_impacts");
    let speeds = |how: &[&str]| -> Vec<f64> {
        let cradle = shipped("newtons_cradle");
        let arguments = ["simulate", &cradle, "--time", "0.5", "--rows", "3", "--columns", "v"];
        good(run_in(&folder, &[&arguments, how].concat()));
        let table = std::fs::read_to_string(folder.join("newtons_cradle.csv")).expect("a table");
        let last = table.lines().last().expect("a row");
        last.split(',').skip(1).map(|x| x.parse().expect("a number")).collect()
    };
    let (together, sequential) = (speeds(&[]), speeds(&["--impacts", "sequential"]));
    let fastest = sequential[2];
    assert!(fastest > 0.5 && sequential[..2].iter().all(|v| v.abs() < 1e-6), "{sequential:?}");
    // -1/3, 2/3, 2/3 where they act together; all swing back by the same law, apart from the sine of small angles.
    let parts: Vec<f64> = together.iter().map(|v| v / fastest).collect();
    let near = |a: f64, b: f64| (a - b).abs() < 0.02;
    assert!(near(parts[0], -1.0 / 3.0) && near(parts[1], 2.0 / 3.0) && near(parts[2], 2.0 / 3.0), "{parts:?}");
    let cradle = shipped("newtons_cradle");
    let steps = ["simulate", &cradle, "--contacts", "stepping", "--impacts", "sequential"];
    bad(run_in(&folder, &steps), &["--contacts stepping has a method of its own, for which --impacts means nothing"]);
    let pendulum = format!("{ROOT}/models/double_pendulum.toml");
    let without = ["simulate", &pendulum, "--impacts", "sequential"];
    bad(run_in(&folder, &without), &["--impacts: `double_pendulum` has no contacts"]);
}

#[test]
fn modes_are_recorded_counted_and_generated() {
    let folder = folder("contacts_modes");
    let hopper = shipped("hopper");
    let run = ["simulate", &hopper, "--time", "1", "--record-modes", "hopper.modes"];
    let output = good(run_in(&folder, &run));
    assert!(out(&output).contains("modes: hopper.modes (2 sets)"), "{}", out(&output));
    let recorded = std::fs::read_to_string(folder.join("hopper.modes")).expect("the sets");
    assert!(recorded.contains("\n# Contacts: landing, leg/lower, leg/upper\nopen open open # "), "{recorded}");
    let counted = good(run_in(&folder, &["count", &hopper, "--modes", "hopper.modes"]));
    let counted = out(&counted).to_string();
    let line =
        |of: &str| counted.lines().find(|l| l.starts_with(of)).unwrap_or_else(|| panic!("{of}: {counted}")).to_string();
    let operations = |of: &str| -> usize {
        let words = line(of);
        words.split_whitespace().rev().nth(1).and_then(|n| n.parse().ok()).expect("a number")
    };
    let rates = |set: &str| operations(&format!("{set:<40}rates "));
    assert!(rates("open open open") < rates("all, by numbers"), "{counted}");
    assert!(rates("slide open open") < rates("all, by numbers"), "{counted}");
    good(run_in(&folder, &["generate", &hopper, "--modes", "hopper.modes", "-o", "hopper.rs"]));
    let source = std::fs::read_to_string(folder.join("hopper.rs")).expect("the code");
    assert!(source.contains("contact::Touching for Hopper"), "the code has no contacts");
    assert!(source.contains("pub const MODES: [[::multibody::runtime::contact::Mode; 3]; 2]"), "not two sets of modes");
}

#[test]
fn modes_of_a_motion_are_found() {
    let folder = folder("contacts_find_modes");
    let hopper = shipped("hopper");
    let output = good(run_in(&folder, &["modes", &hopper, "--time", "1", "--record", "run.modes"]));
    assert!(out(&output).contains("Sets of modes that it visits: 2, with the time in each:"), "{}", out(&output));
    for set in ["open open open ", "slide open open ", "all, by numbers "] {
        assert!(out(&output).lines().any(|l| l.starts_with(set) && l.contains(" rates ")), "{}", out(&output));
    }
    assert_eq!(files(&folder), ["run.modes"]);
    good(run_in(&folder, &["generate", &hopper, "--modes", "run.modes", "-o", "hopper.rs"]));
    // Sets of many contacts do not run into the next column.
    let quadruped = shipped("quadruped");
    let output = good(run_in(&folder, &["modes", &quadruped, "--time", "0.05", "--record", "run.modes"]));
    let (_, table) = out(&output).split_once("in sets of modes:\n").expect("a table");
    let outputs = table.find("output").expect("a column");
    assert!(outputs > 40, "{table}");
    for line in table.lines().take_while(|line| !line.is_empty()) {
        assert!(line[..outputs].ends_with("  ") && !line[outputs..].starts_with(' '), "{table}");
    }
    let pendulum = format!("{ROOT}/models/double_pendulum.toml");
    bad(run_in(&folder, &["modes", &pendulum]), &["`double_pendulum` has no contacts", "--limits"]);
    bad(run_in(&folder, &["modes", &hopper, "--contacts", "stepping"]), &["time steps visit no modes"]);
}

#[test]
fn wrong_modes_are_refused() {
    let folder = folder("contacts_wrong_modes");
    let (hopper, quadruped) = (shipped("hopper"), shipped("quadruped"));
    std::fs::write(folder.join("wrong.modes"), "open open\n\nopen open stuck\n").expect("a file");
    let wrong = ["generate", &hopper, "--modes", "wrong.modes"];
    bad(run_in(&folder, &wrong), &["wrong.modes:1: `hopper` has 3 contacts", "wrong.modes:3: `stuck` is no mode"]);
    bad(run_in(&folder, &["generate", &quadruped, "--modes", "all"]), &["at most 32 get code of their own"]);
    let c = ["generate", &hopper, "--modes", "all", "--lang", "c", "-o", "hopper.c"];
    bad(run_in(&folder, &c), &["code for modes of contacts exists in Rust only"]);
    let pendulum = format!("{ROOT}/models/double_pendulum.toml");
    bad(run_in(&folder, &["generate", &pendulum, "--modes", "masked"]), &["`double_pendulum` has no contacts"]);
    let record = ["simulate", &pendulum, "--record-modes", "p.modes"];
    bad(run_in(&folder, &record), &["--record-modes: `double_pendulum` has no contacts"]);
    let steps = ["simulate", &hopper, "--contacts", "stepping", "--record-modes", "hopper.modes"];
    bad(run_in(&folder, &steps), &["--record-modes: time steps visit no modes"]);
    for taken in ["hopper.csv", "hopper.svg", "./hopper.svg", "still.svg"] {
        let onto = ["simulate", &hopper, "--picture", "still.svg", "--record-modes", taken];
        bad(run_in(&folder, &onto), &[&format!("--record-modes: `{taken}` is to hold another result already")]);
    }
    assert_eq!(files(&folder), ["wrong.modes"]);
}

#[test]
fn machine_code_and_interpreter_give_the_same_motion() {
    let tables = [&[][..], &["--interpreted"]].map(|more: &[&str]| {
        let folder = folder(if more.is_empty() { "contacts_compiled" } else { "contacts_interpreted" });
        let output = good(run_in(&folder, &[&["simulate", &shipped("hopper"), "--time", "2"], more].concat()));
        let compiled = !out(&output).contains(" 0 steps by machine code");
        assert_eq!(compiled, more.is_empty(), "{}", out(&output));
        std::fs::read_to_string(folder.join("hopper.csv")).expect("a table")
    });
    assert_eq!(tables[0], tables[1]);
}

/// It rolls to the edge, opens there before it turns to the side, bounces on the floor, and stays on it.
#[test]
fn a_ball_rolls_off_a_box() {
    let folder = folder("contacts_box");
    let output = good(run_in(&folder, &["simulate", &shipped("ball_on_box"), "--time", "4"]));
    for word in ["top lands at", "top opens", "ground lands at", "contacts at the end: ground sticks"] {
        assert!(out(&output).contains(word), "{word}: {}", out(&output));
    }
}

/// A leg with a foot on a slide, in URDF.
const LEG: &str = r#"<robot name="leg">
  <link name="hip"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="shank">
    <inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 -0.3"/><geometry><sphere radius="0.05"/></geometry></collision>
    <collision><geometry><mesh filename="shank.stl"/></geometry></collision>
  </link>
  <link name="rail"/>
  <joint name="height" type="prismatic"><parent link="rail"/><child link="hip"/><axis xyz="0 0 1"/></joint>
  <joint name="knee" type="prismatic">
    <parent link="hip"/><child link="shank"/><axis xyz="0 0 1"/>
    <limit lower="-0.1" upper="0.2" effort="10" velocity="1"/>
  </joint>
</robot>"#;

/// Shapes and limits of a robot act where they are asked for, and nowhere else.
#[test]
fn robots_touch_a_floor_that_is_asked_for() {
    let folder = folder("contacts_urdf");
    std::fs::write(folder.join("leg.urdf"), LEG).expect("a file");
    let simulate = |more: &[&str]| run_in(&folder, &[&["simulate", "leg.urdf", "--time", "0.5"][..], more].concat());
    let free = good(simulate(&[]));
    assert!(!out(&free).contains("events:"), "{}", out(&free));
    // The foot is 0.35 m below the hip and falls 0.45 m; then the hip falls on, to the stop.
    let floor = good(simulate(&["--floor", "-0.8", "--friction", "0.3", "--limits"]));
    let speed = (2.0_f64 * 9.81 * 0.45).sqrt();
    let stop = (2.0_f64 * 9.81 * 0.65).sqrt();
    for landing in [
        format!("floor/shank lands at {speed:.6} m/s, then sticks"),
        format!("knee/upper lands at {stop:.6} m/s, then closed"),
    ] {
        assert!(out(&floor).contains(&landing), "{landing}: {}", out(&floor));
    }
    let check = |more: &[&str]| good(run_in(&folder, &[&["check", "leg.urdf"][..], more].concat()));
    let plain = check(&[]);
    assert!(out(&plain).contains("shapes: 1") && !out(&plain).contains("contacts:"), "{}", out(&plain));
    assert!(crate::run::err(&plain).contains("`mesh` of a `collision` is not used"));
    let full = check(&["--floor", "-0.8", "--limits"]);
    assert!(out(&full).contains("shapes: 2, contacts: 1, stops: 2"), "{}", out(&full));
    let toml = ["check", &shipped("bouncing_ball"), "--limits"];
    bad(run_in(&folder, &toml), &["a TOML model states its own limits and contacts"]);
    assert_eq!(run_in(&folder, &["check", "leg.urdf", "--friction", "0.3"]).status.code(), Some(2));
}

/// A start that nobody has stated is within the limits; of one that is not, all joints are told that stand beyond theirs.
#[test]
fn joints_start_between_their_stops() {
    let folder = folder("contacts_limits");
    let height = "<axis xyz=\"0 0 1\"/></joint>";
    let limited = height.replace("</joint>", "<limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"1\"/></joint>");
    let leg = LEG.replace("lower=\"-0.1\" upper=\"0.2\"", "lower=\"0.3\" upper=\"0.7\"").replace(height, &limited);
    std::fs::write(folder.join("leg.urdf"), leg).expect("a file");
    let simulate = |more: &[&str]| {
        let arguments = ["simulate", "leg.urdf", "--time", "0.1", "--columns", "q.height,q.knee"];
        run_in(&folder, &[&arguments[..], more].concat())
    };
    for more in [&["--limits"][..], &["--limits", "--floor", "-2"], &["--floor", "-2", "--self-contact"]] {
        good(simulate(more));
        let table = std::fs::read_to_string(folder.join("leg.csv")).expect("a table");
        assert_eq!(table.lines().nth(1), Some("0,0,0.5"), "{more:?}");
    }
    bad(
        simulate(&["--limits", "--q", "2,0"]),
        &[
            "at the start, joint `height` stands 1.000 m beyond its upper limit, joint `knee` stands 0.300 m beyond its lower \
             limit\n",
            "help: give --q with positions within these limits",
        ],
    );
    // A stop is still one where its joint stands at it.
    good(simulate(&["--limits", "--q", "1,0.3"]));
}

/// Two rods that hang beside each other.
fn arms() -> String {
    let arm = |name: &str, x: f64| {
        format!(
            r#"<link name="{name}">
    <inertial><origin xyz="0 0 -0.25"/><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 -0.25"/><geometry><capsule radius="0.05" length="0.4"/></geometry></collision>
  </link>
  <joint name="to_{name}" type="revolute">
    <parent link="base"/><child link="{name}"/><origin xyz="{x} 0 0"/><axis xyz="0 1 0"/>
  </joint>"#
        )
    };
    format!(r#"<robot name="arms"><link name="base"/>{}{}</robot>"#, arm("left", -0.15), arm("right", 0.15))
}

/// Distance of the surfaces of both rods, which do not cross, at these angles.
fn apart([left, right]: [f64; 2]) -> f64 {
    let ends = |x: f64, angle: f64| [0.05, 0.45].map(|along: f64| [x - along * angle.sin(), -along * angle.cos()]);
    let to_line = |p: [f64; 2], [a, b]: [[f64; 2]; 2]| {
        let (way, from) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let square = way[0] * way[0] + way[1] * way[1];
        let share = ((way[0] * from[0] + way[1] * from[1]) / square).clamp(0.0, 1.0);
        (from[0] - share * way[0]).hypot(from[1] - share * way[1])
    };
    let (a, b) = (ends(-0.15, left), ends(0.15, right));
    assert!(a[1][0] < b[1][0], "the tips have passed each other");
    let all = a.map(|p| to_line(p, b)).into_iter().chain(b.map(|p| to_line(p, a)));
    all.fold(f64::INFINITY, f64::min) - 0.1
}

/// The arms of a robot strike each other where that is asked for, and pass through each other otherwise.
#[test]
fn arms_of_a_robot_strike_each_other() {
    let folder = folder("contacts_arms");
    std::fs::write(folder.join("arms.urdf"), arms()).expect("a file");
    let swing = ["simulate", "arms.urdf", "--time", "3", "--v=-4,0"];
    let free = good(run_in(&folder, &swing));
    assert!(!out(&free).contains("lands"), "{}", out(&free));
    let touching = good(run_in(&folder, &[&swing[..], &["--self-contact", "--friction", "0.2"]].concat()));
    assert!(out(&touching).contains("left/right lands at"), "{}", out(&touching));
    let table = std::fs::read_to_string(folder.join("arms.csv")).expect("a table");
    let (mut least, mut energy, mut first) = (f64::INFINITY, f64::INFINITY, None);
    for line in table.lines().skip(1) {
        let numbers: Vec<f64> = line.split(',').map(|x| x.parse().expect("a number")).collect();
        least = least.min(apart([numbers[1], numbers[2]]));
        let now = numbers[numbers.len() - 1];
        assert!(now <= energy + 1e-7, "the energy rises at {} s: {energy} {now}", numbers[0]);
        energy = now;
        first.get_or_insert(now);
    }
    assert!(least > -1e-9, "{least}");
    assert!(least < 1e-2 && first.is_some_and(|first| energy < first - 0.1), "{least} {first:?} {energy}");
    let check = good(run_in(&folder, &["check", "arms.urdf", "--self-contact"]));
    assert!(out(&check).contains("shapes: 2, contacts: 1"), "{}", out(&check));
}

/// The picture has the floor, the ball and the force on it with its scale; the motion is the same as without it.
#[test]
fn pictures_show_what_touches_and_its_forces() {
    let tables = [&[][..], &["--picture", "picture.svg", "--strobes", "4"]].map(|more: &[&str]| {
        let folder = folder(if more.is_empty() { "contacts_plain" } else { "contacts_picture" });
        let block = shipped("block_on_incline");
        let push = ["--v", "-2,0,0,0,0,0", "--time", "1"];
        good(run_in(&folder, &[&["simulate", &block], &push[..], more].concat()));
        if !more.is_empty() {
            let picture = std::fs::read_to_string(folder.join("picture.svg")).expect("a picture");
            // 2 kg on an incline of 30 degrees press with 17 N: 10 N is a scale for them.
            assert!(picture.contains(">10 N</text>") || picture.contains(">5 N</text>"), "{picture}");
            assert!(
                picture.contains("class=\"floor\"") || picture.contains("stroke-opacity=\".6\""),
                "no incline: {picture}"
            );
            // At least two corners carry the block at each of four instants; the scale is an arrow too.
            let arrows = picture.matches("class=\"force\" stroke-width=\"2\"").count();
            assert!((4 * 2 + 1..=4 * 4 + 1).contains(&arrows), "{arrows} arrows: {picture}");
        }
        std::fs::read_to_string(folder.join("block_on_incline.csv")).expect("a table")
    });
    assert_eq!(tables[0], tables[1]);
}

/// Programs that are too large for machine code are counted all the same.
#[test]
fn large_gaps_are_counted() {
    let folder = folder("contacts_large");
    let body = |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n");
    let text = format!(
        "name = \"parts\"\n{}[[joint]]\nname = \"free\"\ntype = \"floating\"\nchild = \"a\"\nstart = [0, 0, 3, 0, 0, 0, 1]\n\
         [[shape]]\nname = \"fixed\"\ntype = \"box\"\nsize = [1, 1, 1]\nrounding = 0.01\n\
         [[shape]]\nname = \"moving\"\nbody = \"a\"\ntype = \"cylinder\"\nradius = 0.5\nlength = 1\nsides = 12\n\
         [[contact]]\nname = \"both\"\nbetween = [\"fixed\", \"moving\"]\n",
        body("a")
    );
    std::fs::write(folder.join("parts.toml"), text).expect("a file");
    let output = good(run_in(&folder, &["count", "parts.toml", "--outputs", "gaps", "--modes", "masked"]));
    let text = out(&output);
    let row = text.lines().find(|line| line.contains(" gaps ")).unwrap_or_else(|| panic!("{text}"));
    let words: Vec<&str> = row.split_whitespace().rev().collect();
    let operations: u32 = words[1].parse().unwrap_or_else(|e| panic!("{e}: {row}"));
    assert!(words[0] == "-" && operations > 30_000, "{row}");
    assert!(text.contains("\n-: no machine code is made of programs that large"), "{text}");
}

/// A cylinder that stands upright has no lowest point, which the message of the failure says.
#[test]
fn upright_cylinders_are_told() {
    let folder = folder("contacts_upright");
    let can = "name = \"can\"\ngravity = [0.5, 0.2, -9.81]\n[contacts]\nfriction = 0.4\nrestitution = 0.3\npairs = \"all\"\n\
               [[body]]\nname = \"can\"\nmass = 2\ninertia = [0.01, 0.01, 0.006]\n\
               [[joint]]\nname = \"free\"\ntype = \"floating\"\nchild = \"can\"\nstart = [0.05, 0.02, 0.15, 0, 0, 0, 1]\n\
               [[shape]]\nname = \"floor\"\ntype = \"plane\"\n\
               [[shape]]\nname = \"tin\"\nbody = \"can\"\ntype = \"cylinder\"\nradius = 0.1\nlength = 0.3\n";
    std::fs::write(folder.join("can.toml"), can).expect("a file");
    bad(
        run_in(&folder, &["simulate", "can.toml", "--time", "0.1"]),
        &[
            "the simulation failed: ",
            "if cylinder `tin` stands upright on a plane there, it has no lowest point: give it corners",
        ],
    );
    assert_eq!(files(&folder), ["can.toml"]);
}

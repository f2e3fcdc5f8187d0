//! The command on models with contacts: the table of events, and what is refused.

use crate::run::{bad, files, folder, good, out, run_in, ROOT};

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

#[test]
fn stops_have_the_units_of_their_joints() {
    let folder = folder("contacts_stop");
    let output = good(run_in(&folder, &["simulate", &shipped("fourbar_stop"), "--time", "1"]));
    assert!(out(&output).contains("rocker_pin/lower lands at 0.709727 rad/s, then open"), "{}", out(&output));
    assert!(out(&output).contains("contacts at the end: rocker_pin/lower closed"), "{}", out(&output));
}

#[test]
fn what_cannot_be_simulated_is_refused() {
    let folder = folder("contacts_refused");
    let ball = shipped("bouncing_ball");
    let low = ["simulate", &ball, "--q", "0,0,0.02,0,0,0,1"];
    bad(run_in(&folder, &low), &["the bodies of contact `bounce` overlap by 3.000e-2 at the start", "give --q"]);
    let implicit = ["simulate", &ball, "--method", "radau5"];
    bad(run_in(&folder, &implicit), &["--method radau5: a motion with contacts takes explicit methods only"]);
    assert!(files(&folder).is_empty(), "{:?}", files(&folder));
}

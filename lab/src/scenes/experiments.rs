//! Model files of thesis 7.2 for any number of links, and of mechanisms with many loops: open and closed chains, trees,
//! four-bars. The files contain the initial coordinates.

use super::text::{forking, thesis_link, Link, Text, FRICTION, GRAVITY, LENGTH};

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
/// Branches of a tree: 1 + 2 + 4 + 8.
const BRANCHES: usize = 15;

/// Open planar chain of `n` links along x, at zero angles.
pub fn open(n: usize) -> String {
    super::text::chain(&format!("open{n}"), n, FRICTION)
}

/// Tree of `n ≥ 15` links that forks three times, with a fifteenth of the links in each branch.
pub fn tree(n: usize) -> String {
    let comment = format!("Planar tree of {n} links (thesis 7.2) that forks three times.");
    forking(&format!("tree{n}"), &comment, 4, FRICTION, |k| n / BRANCHES + usize::from(k < n % BRANCHES))
}

/// Initial angle of joint `i` of the chain that breaks (thesis 7.4), from 1, is this times `i`, rad.
const BREAKING_START: f64 = 0.0005;

/// Open planar chain of `n` links as in [`open`], bent (thesis 7.4), with a friction of `damping` N m s/rad in every
/// joint and a moment of inertia of `across` kg m² of a link about its centre of mass.
pub fn breaking(n: usize, damping: f64, across: f64) -> String {
    let comment = format!("Chain of {n} equal links (thesis 7.4), of which a joint breaks while it falls.");
    let mut text = Text::new(&format!("breaking{n}"), &comment, GRAVITY);
    let mut parent: Option<String> = None;
    for k in 1..=n {
        let name = format!("link{k}");
        text.link(&Link { damping, inertia: [0.0, across, across], ..thesis_link(&name, parent.as_deref()) });
        text.start(BREAKING_START * k as f64, false);
        parent = Some(name);
    }
    text.finish()
}

/// Angle of link `i` of a closed chain of `n` at the start, counted from x, rad; `i` begins at 1.
fn arc(i: usize, n: usize) -> f64 {
    1.2 - 2.0 * (i as f64 - 0.5) / n as f64
}

/// Chain of `n` links on an arc. A loop of the given type fixes its tip where it starts. With `crosswise`, every second
/// joint rotates about y, at a small angle.
pub fn closed(n: usize, kind: &str, crosswise: bool) -> String {
    let comment = format!("Closed chain of {n} equal links (thesis 7.2) in an arc; the last tip is held by a loop.");
    let axis = |i: usize| if !crosswise || i % 2 == 1 { Z } else { Y };
    chain(&format!("closed{n}"), &comment, n, axis, Some(kind))
}

/// Open chain of `n` links with revolute joints about z and y in turn.
pub fn crosswise(n: usize) -> String {
    let comment = format!("Open chain of {n} equal links, revolute joints about z and y in turn (thesis 7.2).");
    chain(&format!("crosswise{n}"), &comment, n, |i| if i % 2 == 1 { Z } else { Y }, None)
}

fn chain(name: &str, comment: &str, n: usize, axis: impl Fn(usize) -> [f64; 3], closed: Option<&str>) -> String {
    let mut text = Text::new(name, comment, GRAVITY);
    let mut parent: Option<String> = None;
    // Axes of the last link in ground axes, and its tip.
    let (mut axes, mut tip) = ([[1.0, 0.0, 0.0], Y, Z], [0.0; 3]);
    let mut before = 0.0;
    for i in 1..=n {
        let link = format!("link{i}");
        text.link(&Link { axis: axis(i), ..thesis_link(&link, parent.as_deref()) });
        if closed.is_some() {
            let angle = match axis(i) == Z {
                true => arc(i, n) - std::mem::replace(&mut before, arc(i, n)),
                false => 0.05 - 0.1 * (i / 2 % 2) as f64,
            };
            text.start(angle, false);
            turn(&mut axes, axis(i) == Z, angle);
            (0..3).for_each(|k| tip[k] += LENGTH * axes[0][k]);
        }
        parent = Some(link);
    }
    if let (Some(kind), Some(last)) = (closed, &parent) {
        text.close("end", kind, [(last, [LENGTH, 0.0, 0.0]), ("ground", tip)]);
    }
    text.finish()
}

/// Rotates axes about their third or their second one.
fn turn(axes: &mut [[f64; 3]; 3], about_z: bool, angle: f64) {
    let (s, c) = angle.sin_cos();
    let (a, b) = if about_z { (0, 1) } else { (2, 0) };
    let (u, v) = (axes[a], axes[b]);
    for k in 0..3 {
        axes[a][k] = c * u[k] + s * v[k];
        axes[b][k] = c * v[k] - s * u[k];
    }
}

/// Lengths of a four-bar, m: crank, coupler, rocker, and the distance of its two joints on the ground or on the bar
/// that carries it.
const FOUR_BAR: [f64; 4] = [0.1, 0.2, 0.2, 0.2];
/// Angle of the crank at the start, from the line through the two joints of the base, rad.
const CRANK: f64 = 1.0;

/// Angles of coupler and rocker at the start, which follow from that of the crank.
fn four_bar_start() -> [f64; 2] {
    let [crank, coupler, rocker, base] = FOUR_BAR;
    let (x, y) = (base - crank * CRANK.cos(), -crank * CRANK.sin());
    // The angle follows from the triangle of coupler, rocker and the line from the crank's tip to the rocker's joint.
    let (across, along) = (x.hypot(y), y.atan2(x));
    let angle = ((coupler.powi(2) + across.powi(2) - rocker.powi(2)) / (2.0 * coupler * across)).acos();
    let coupler_angle = along + angle;
    let tip = [coupler * coupler_angle.cos() - x, coupler * coupler_angle.sin() - y];
    [coupler_angle, tip[1].atan2(tip[0])]
}

/// `count` four-bars closed by loops of the given type: side by side on the ground, or each on the coupler of the one
/// before.
pub fn four_bars(count: usize, kind: &str, series: bool) -> String {
    let way = if series { "each on the coupler of the one before" } else { "side by side on the ground" };
    let mut text = Text::new(&format!("four_bars{count}"), &format!("{count} four-bars, {way}."), GRAVITY);
    let [crank, coupler, rocker, base] = FOUR_BAR;
    let [coupler_angle, rocker_angle] = four_bar_start();
    let mut carrier: Option<String> = None;
    for k in 1..=count {
        let names = ["crank", "coupler", "rocker"].map(|part| format!("{part}{k}"));
        let foot = if series { 0.5 * coupler } else { k as f64 };
        let foot = if carrier.is_none() && series { 0.0 } else { foot };
        let bars = [
            (carrier.as_deref(), crank, foot, CRANK),
            (Some(names[0].as_str()), coupler, crank, coupler_angle - CRANK),
            (carrier.as_deref(), rocker, foot + base, rocker_angle),
        ];
        for (name, (parent, length, at, angle)) in names.iter().zip(bars) {
            bar(&mut text, name, parent, length, at);
            text.start(angle, name == &names[0]);
        }
        let ends = [(names[1].as_str(), [coupler, 0.0, 0.0]), (names[2].as_str(), [rocker, 0.0, 0.0])];
        text.close(&format!("loop{k}"), kind, ends);
        if series {
            carrier = Some(names[1].clone());
        }
    }
    text.finish()
}

/// A uniform bar of 1 kg/m on a revolute joint about z.
fn bar(text: &mut Text, name: &str, parent: Option<&str>, length: f64, at: f64) {
    let across = length.powi(3) / 12.0;
    text.link(&Link {
        name,
        parent,
        mass: length,
        com: [length / 2.0, 0.0, 0.0],
        inertia: [0.0, across, across],
        place: [at, 0.0, 0.0],
        axis: Z,
        damping: 0.0,
    });
}

//! Boxes and hulls, sharp and rounded, and capsules on each other: gaps and rows against an independent reference, motions against
//! what is known of them.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};
use std::time::Instant;

use mbd_codegen::model::Model;
use mbd_codegen::options::{Arithmetic, Options};
use mbd_codegen::plan::Plan;
use mbd_runtime::contact::{HybridError, Mode, Way};
use mbd_runtime::spatial::{add3, dot3, scale3, Vec3};
use mbd_testing::nearest::segments;
use mbd_testing::random::Rng;

use super::fields::end;
use super::round::G;
use super::scene::{model, Scene};
use super::solid::{floating, gap_rate_of, less, norm, placed, random_pose, slip, turned};

/// All that lies within a radius of the hull of some corners.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    pub(super) kind: String,
    pub(super) corners: Vec<Vec3<f64>>,
    pub(super) radius: f64,
}

/// What lies within a radius of a box about the origin: a ball, a capsule, or a box, by how many edges have no length.
pub(super) fn around(core: Vec3<f64>, radius: f64) -> Solid {
    let kind = match core {
        [0.0, 0.0, 0.0] => format!("type = \"sphere\"\nradius = {radius}"),
        [0.0, 0.0, length] => format!("type = \"capsule\"\nradius = {radius}\nlength = {length}"),
        _ => format!("type = \"box\"\nsize = {:?}\nrounding = {radius}", core.map(|x| x + 2.0 * radius)),
    };
    let mut corners: Vec<_> = (0..8)
        .map(|k: usize| [0, 1, 2].map(|i| if k >> i & 1 == 0 { -0.5 * core[i] } else { 0.5 * core[i] } + 0.0))
        .collect();
    corners.dedup();
    Solid { kind, corners, radius }
}

pub(super) fn hull(corners: Vec<Vec3<f64>>, radius: f64) -> Solid {
    Solid { kind: format!("type = \"hull\"\npoints = {corners:?}\nrounding = {radius}"), corners, radius }
}

/// A hull of corners on an ellipsoid.
fn pebble(corners: u64, radius: f64) -> Solid {
    let mut rng = Rng::new(corners, 5);
    let mut corner = || loop {
        let x: Vec3<f64> = [0; 3].map(|_| rng.around(1.0));
        let n = norm(x);
        if n > 0.1 && n < 1.0 {
            return [0, 1, 2].map(|k| [0.3, 0.2, 0.25][k] * x[k] / n);
        }
    };
    hull((0..corners).map(|_| corner()).collect(), radius)
}

fn sharp() -> Solid {
    around([0.3, 0.4, 0.6], 0.0)
}

pub(super) fn round() -> Solid {
    around([0.2, 0.5, 0.1], 0.05)
}

pub(super) fn capsule() -> Solid {
    around([0.0, 0.0, 0.5], 0.1)
}

pub(super) fn rod() -> Solid {
    around([0.0, 0.0, 0.5], 0.05)
}

pub(super) fn block() -> Solid {
    around([0.28, 0.18, 0.38], 0.01)
}

impl Solid {
    fn text(&self, name: &str, body: &str) -> String {
        format!("[[shape]]\nname = \"{name}\"\nbody = \"{body}\"\n{}\n", self.kind)
    }
}

/// The places nearest to each other of two hulls: of a corner and a triangle of corners, or of two lines between corners, all of
/// which lie within. `None` where the hulls overlap: then nothing lies between the planes across the way between these places.
pub(super) fn nearest([a, b]: [&Solid; 2], q: &[f64]) -> Option<[Vec3<f64>; 2]> {
    let all = [(a, &q[..7]), (b, &q[7..])].map(|(s, q)| s.corners.iter().map(|x| placed(q, *x)).collect::<Vec<_>>());
    let mut best = [all[0][0], all[1][0]];
    let mut take = |pair: [Vec3<f64>; 2]| {
        if norm(less(pair[1], pair[0])) < norm(less(best[1], best[0])) {
            best = pair;
        }
    };
    let lines = |all: &[Vec3<f64>]| -> Vec<_> {
        let ends = (0..all.len()).flat_map(|i| (0..=i).map(move |k| (i, k)));
        let line = |(i, k): (usize, usize)| {
            let way = less(all[i], all[k]);
            let axis = if i == k { [1.0, 0.0, 0.0] } else { scale3(1.0 / norm(way), way) };
            (scale3(0.5, add3(all[i], all[k])), axis, 0.5 * norm(way))
        };
        ends.map(line).collect()
    };
    let others = lines(&all[1]);
    for (middle, axis, half) in lines(&all[0]) {
        for (other, along, long) in &others {
            let found = segments([axis, *along], [half, *long], less(*other, middle));
            let there = add3(*other, found.arm);
            take([less(there, found.apart), there]);
        }
    }
    for (from, to) in [(0, 1), (1, 0)] {
        let n = all[to].len();
        for (i, j, k) in (0..n).flat_map(|i| (0..i).flat_map(move |j| (0..j).map(move |k| (i, j, k)))) {
            let [o, e, f] = [all[to][i], less(all[to][j], all[to][i]), less(all[to][k], all[to][i])];
            let (ee, ef, ff) = (dot3(e, e), dot3(e, f), dot3(f, f));
            for place in &all[from] {
                let d = less(*place, o);
                let (de, df, square) = (dot3(d, e), dot3(d, f), ee * ff - ef * ef);
                let [u, w] = [(de * ff - df * ef) / square, (df * ee - de * ef) / square];
                if u >= 0.0 && w >= 0.0 && u + w <= 1.0 {
                    let foot = add3(o, add3(scale3(u, e), scale3(w, f)));
                    take(if from == 0 { [*place, foot] } else { [foot, *place] });
                }
            }
        }
    }
    let way = less(best[1], best[0]);
    let beyond = |k: usize, sign: f64| all[k].iter().all(|x| sign * dot3(less(*x, best[k]), way) > -1e-12 * norm(way));
    (beyond(0, -1.0) && beyond(1, 1.0)).then_some(best)
}

pub(super) fn pair([a, b]: [&Solid; 2], names: [&str; 2]) -> Model {
    let contact = format!("[[contact]]\nname = \"c\"\nbetween = {names:?}\nfriction = 1\n");
    let bodies = format!("{}{}", floating("a"), floating("b"));
    model(&format!("name = \"pair\"\n{bodies}{}{}{contact}", a.text("a", "a"), b.text("b", "b")))
}

/// Gaps of all contacts and the rates of their rows.
pub(super) fn all(scene: &mut Scene, q: &[f64], v: &[f64]) -> Vec<(f64, [f64; 3])> {
    let [gaps, rates] = scene.rows_at(q, v);
    gaps.chunks(3).zip(rates.chunks(3)).map(|(gap, rate)| (gap[0], [rate[0], rate[1], rate[2]])).collect()
}

/// Cores that are nearer than this are left out: the directions between them have few digits.
const NEAR: f64 = 0.02;

/// The least gap of all contacts of a pair is the distance, and where bodies touch, its rows are the velocities of the points
/// that do.
#[test]
fn the_least_gap_is_the_distance() {
    let pairs = [
        [sharp(), capsule()],
        [round(), capsule()],
        [round(), around([0.0; 3], 0.1)],
        [sharp(), round()],
        [round(), round()],
        [capsule(), capsule()],
        [pebble(9, 0.0), around([0.0; 3], 0.1)],
        [pebble(9, 0.05), capsule()],
        [pebble(7, 0.0), round()],
        [pebble(7, 0.05), sharp()],
        [pebble(6, 0.0), pebble(8, 0.1)],
        // A plate, and one that is a hull of all corners of a box.
        [hull(vec![[0.2, 0.1, 0.0], [-0.2, 0.1, 0.0], [0.0, -0.2, 0.0], [0.3, 0.0, 0.0]], 0.0), capsule()],
        [hull(sharp().corners, 0.0), capsule()],
    ];
    let mut found = Agreement::default();
    for (k, solids) in pairs.iter().map(|[a, b]| [a, b]).enumerate() {
        let what = format!("{:?}", solids.map(|s| &s.kind));
        let models = [["a", "b"], ["b", "a"]].map(|names| pair(solids, names));
        found.add(&what, models, solids.map(|s| s.radius), k as u64, &|q| nearest(solids, q));
    }
    println!("{found:?}");
}

/// The places of two bodies that are nearest to each other, in ground axes.
pub(super) type Places = [Vec3<f64>; 2];

/// How much gaps, rows and rates differ at most from what is known of them, and how many of all pairs touch at several places.
#[derive(Debug, Default)]
pub(super) struct Agreement {
    gaps: f64,
    rows: f64,
    rates: f64,
    common: usize,
    all: usize,
}

impl Agreement {
    /// Compares a pair, named in either order, at random places with the places of both cores that are nearest to each other; `radii`
    /// within which bodies lie around these.
    pub(super) fn add(
        &mut self,
        what: &str,
        models: [Model; 2],
        radii: [f64; 2],
        seed: u64,
        nearest: &dyn Fn(&[f64]) -> Option<Places>,
    ) {
        let [mut scene, mut swapped] = models.map(|model| Scene::new(model, &[0.0; 14], &[0.0; 12]));
        let mut rng = Rng::new(seed, 12);
        let mut count = 0;
        while count < 40 {
            let mut q = [random_pose(&mut rng, 0.2), random_pose(&mut rng, 0.6)].concat();
            let v: Vec<f64> = (0..12).map(|_| rng.around(1.0)).collect();
            let Some([p, r]) = nearest(&q) else { continue };
            let distance = norm(less(r, p));
            if distance < NEAR {
                continue;
            }
            count += 1;
            let gap = least(&all(&mut scene, &q, &v));
            // Rounding of places, over the sines of the angles of triangles and lines.
            let off = (gap - (distance - radii[0] - radii[1])).abs();
            self.gaps = self.gaps.max(off);
            assert!(off < 1e-13, "{what}: {gap} {distance}");
            // Then the second body moves until both touch.
            let n = scale3(1.0 / distance, less(r, p));
            (0..3).for_each(|k| q[7 + k] -= gap * n[k]);
            let at = add3(p, scale3(radii[0], n));
            let found = all(&mut scene, &q, &v);
            let touching: Vec<usize> = (0..found.len()).filter(|k| found[*k].0 < 1e-12).collect();
            assert!(!touching.is_empty() && least(&found) > -1e-12);
            self.all += 1;
            self.common += usize::from(touching.len() > 1);
            let [normal, across] = slip(&q, &v, at, n);
            for k in touching {
                let rates = found[k].1;
                let got = (rates[1] * rates[1] + rates[2] * rates[2]).sqrt();
                self.rows = self.rows.max((rates[0] - normal).abs()).max((got - across).abs());
                // Places from the reference are right to the root of the rounding of distances.
                assert!((rates[0] - normal).abs() < 1e-6, "{what}: {} {normal}", rates[0]);
                assert!((got - across).abs() < 1e-6, "{what}: {got} {across}");
                let rate = gap_rate_of(&mut scene, &q, &v, 3 * k);
                self.rates = self.rates.max((rate - rates[0]).abs());
                // The quotient errs by curvature times h² and rounding over h, 1e-9, unless a nearest part changes within it.
                assert!((rate - rates[0]).abs() < 1e-6, "{what}: {rate} {}", rates[0]);
            }
            // The order in which the contact names its bodies changes no distance.
            assert!((least(&all(&mut swapped, &q, &v)) - least(&found)).abs() < 1e-15, "{what}");
        }
    }
}

/// The least of all gaps.
pub(super) fn least(all: &[(f64, [f64; 3])]) -> f64 {
    all.iter().fold(f64::INFINITY, |least, (gap, _)| least.min(*gap))
}

/// A free body with the shape of a solid over one on the ground.
pub(super) fn over(ground: &str, solid: &Solid, surface: &str) -> Model {
    let contact = format!("[[contact]]\nname = \"c\"\nbetween = [\"still\", \"a\"]\n{surface}\n");
    model(&format!(
        "name = \"over\"\ngravity = [0, 0, -{G}]\n{}{}[[shape]]\nname = \"still\"\n{ground}\n{contact}",
        floating("a"),
        solid.text("a", "a")
    ))
}

/// Rotation vector to quaternion of a pose.
pub(super) fn pose(place: Vec3<f64>, turn: Vec3<f64>) -> Vec<f64> {
    let angle = norm(turn);
    let (s, c) = (0.5 * angle).sin_cos();
    let axis = scale3(if angle > 0.0 { s / angle } else { 0.0 }, turn);
    place.into_iter().chain(axis).chain([c]).collect()
}

/// Runs for a tenth of a second at a time; energy never grows, and no gap closes beyond what a landing leaves.
pub(super) fn settles(scene: &mut Scene, time: f64) -> Result<(), HybridError> {
    let mut before = scene.energy();
    for k in 1..=(10.0 * time).round() as u32 {
        let t = 0.1 * f64::from(k);
        scene.try_run(t)?;
        let now = scene.energy();
        // Steps err by 1e-9 of energies of some joules.
        assert!(now <= before + 1e-7, "{t} s: {now} J after {before} J");
        before = now;
        let least = scene.gaps().iter().step_by(3).fold(f64::INFINITY, |a: f64, b| a.min(*b));
        assert!(least > -1e-8, "{t} s: gap {least:e}");
    }
    Ok(())
}

pub(super) fn closed(scene: &Scene) -> usize {
    scene.system.modes().iter().filter(|mode| **mode != Mode::Open).count()
}

/// A rod that falls across a box lies on two of its edges, and rolls there with what speed it has left.
#[test]
fn a_rod_comes_to_rest_across_a_box() {
    let rod = around([0.0, 0.0, 1.0], 0.05);
    for (surface, yaw) in [("friction = 0.5", 0.3), ("friction = 0.5\nrestitution = 0.3", 0.0)] {
        let model = over("type = \"box\"\nsize = [0.4, 0.6, 0.2]", &rod, surface);
        // Along x but for the yaw, one end higher than the other.
        let start = pose([0.05, 0.02, 0.3], [0.0, FRAC_PI_2 + 0.1, yaw]);
        let mut scene = Scene::new(model, &start, &[0.0; 6]);
        scene.tolerance = 1e-9;
        settles(&mut scene, 2.0).unwrap();
        assert_eq!(closed(&scene), 2, "{:?}", scene.system.modes());
        // Its axis is level at the height of the box and its radius.
        let axis = turned(&scene.q, [0.0, 0.0, 1.0]);
        assert!((scene.q[2] - 0.15).abs() < 1e-10 && axis[2].abs() < 1e-10, "{} {axis:?}", scene.q[2]);
    }
}

/// Two edges that cross at a right angle, without loss and friction: where they meet, the speed of approach is turned round, by
/// an impulse at that place.
#[test]
fn a_box_falls_with_its_edge_across_that_of_another() {
    let block = around([0.2, 0.38, 0.2], 0.01);
    // An edge along x on top, sharp; the falling box is turned by an eighth about y, its lowest edge along y.
    let ground = "type = \"box\"\nsize = [0.6, 0.4, 0.4]\nrpy = [0.7853981633974483, 0, 0]";
    let model = over(ground, &block, "restitution = 1");
    let (y, z) = (0.02, 1.0);
    let mut scene = Scene::new(model, &pose([0.0, y, z], [0.0, FRAC_PI_4, 0.0]), &[0.0; 6]);
    scene.run(0.4);
    let [event] = scene.events.0[..] else { panic!("{:?}", scene.events.0) };
    let time = (2.0 * (z - 0.3 * SQRT_2 - 0.01) / G).sqrt();
    assert!((event.time - time).abs() < 1e-10, "{} {time}", event.time);
    // Half of each of the two moments about x and z of the body are about x of the ground.
    let compliance = 0.5 / 0.01 + 0.5 / 0.025;
    let impulse = 2.0 * G * time / (1.0 / 0.7 + y * y * compliance);
    let v = scene.v();
    let up = turned(&scene.q, [v[0], v[1], v[2]]);
    assert!((up[2] - (impulse / 0.7 - G * 0.4)).abs() < 1e-9, "{up:?}");
    assert!(up[0].abs() < 1e-12 && up[1].abs() < 1e-12, "{up:?}");
}

/// A box that lies askew and overhanging on another touches it at the corners of the common part of both faces, here with two
/// corners of each and where four edges cross, and carries its weight there.
#[test]
fn a_box_lies_on_another() {
    let block = around([0.28, 0.18, 0.08], 0.01);
    let model = over("type = \"box\"\nsize = [0.3, 0.2, 0.1]", &block, "friction = 0.5");
    let mut scene = Scene::new(model, &pose([0.05, 0.03, 0.12], [0.0, 0.0, 0.1]), &[0.0; 6]);
    scene.tolerance = 1e-9;
    settles(&mut scene, 0.5).unwrap();
    assert!((scene.q[2] - 0.1).abs() < 1e-10, "{:?}", scene.q);
    assert_eq!(closed(&scene), 4, "{:?}", scene.system.modes());
    let (q, p) = (scene.q.clone(), scene.p.clone());
    let weight: f64 = scene.system.forces(0.5, &q, &p).iter().map(|force| force[0]).sum();
    assert!((weight - 0.7 * G).abs() < 1e-8, "{weight}");
}

/// Equal boxes with all edges above each other touch at many places at once.
#[test]
fn a_box_lies_exactly_on_an_equal_one() {
    let block = around([0.28, 0.18, 0.08], 0.01);
    let model = over("type = \"box\"\nsize = [0.3, 0.2, 0.1]\nrounding = 0.01", &block, "friction = 0.5");
    let mut scene = Scene::new(model, &pose([0.0, 0.0, 0.12], [0.0; 3]), &[0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
    scene.tolerance = 1e-9;
    settles(&mut scene, 0.5).unwrap();
    assert!((scene.q[2] - 0.1).abs() < 1e-9, "{:?}", scene.q);
    assert!(scene.v().iter().all(|v| v.abs() < 1e-9), "{:?}", scene.v());
}

/// What lies on the ground in most tests.
const CRATE: &str = "type = \"box\"\nsize = [0.6, 0.4, 0.4]";

/// Bodies that are thrown on what lies on the ground, with any friction and some restitution, follow their motion without a gain of energy.
/// Gives the number of those that are not followed to their end.
pub(super) fn thrown(ground: &str, solid: &Solid, count: u64) -> usize {
    let mut failed = 0;
    let started = Instant::now();
    for seed in 0..count {
        let mut rng = Rng::new(seed, 77);
        let (friction, restitution) = (rng.range(0.0, 1.0), rng.range(0.0, 0.5));
        let surface = format!("friction = {friction}\nrestitution = {restitution}");
        let mut q = random_pose(&mut rng, 0.05);
        q[2] += 0.7;
        let v: Vec<f64> = (0..6).map(|_| rng.around(2.0)).collect();
        let mut scene = Scene::new(over(ground, solid, &surface), &q, &v);
        scene.tolerance = 1e-9;
        scene.steps = 3000;
        if let Err(error) = settles(&mut scene, 1.0) {
            println!("{seed}: {surface}: {error}");
            failed += 1;
        }
    }
    println!("{failed} of {count} of {:?} failed, {:?}", solid.kind, started.elapsed());
    failed
}

#[test]
fn what_is_thrown_on_a_box_gains_no_energy() {
    assert_eq!(thrown(CRATE, &rod(), 12), 0);
    assert_eq!(thrown(CRATE, &block(), 3), 0);
    assert_eq!(thrown(CRATE, &pebble(8, 0.01), 3), 0);
}

/// A hundred of each, which take minutes, or as many as `MBD_DROPS` says.
#[test]
#[ignore = "a hundred of each take minutes"]
fn many_that_are_thrown_on_a_box_gain_no_energy() {
    let count = std::env::var("MBD_DROPS").map_or(100, |count| count.parse().unwrap());
    assert_eq!([rod(), block(), pebble(8, 0.01)].map(|solid| thrown(CRATE, &solid, count)), [0; 3]);
}

/// Machine code of rods, boxes and hulls on each other has the bits of the interpreter.
#[test]
fn machine_code_of_boxes_does_what_the_interpreter_does() {
    let text = |solid: &Solid, body: &str| format!("{}{}", floating(body), solid.text(body, body));
    let contact = |names: [&str; 2]| {
        format!("[[contact]]\nname = \"{0}{1}\"\nbetween = {names:?}\nfriction = 0.4\n", names[0], names[1])
    };
    let shapes = format!(
        "[[shape]]\nname = \"still\"\ntype = \"box\"\nsize = [0.6, 0.4, 0.2]\n{}{}{}",
        text(&block(), "a"),
        text(&rod(), "b"),
        text(&pebble(5, 0.0), "c")
    );
    let contacts = [["still", "b"], ["a", "b"], ["a", "c"]].map(contact).concat();
    let model = model(&format!("name = \"m\"\ngravity = [0, 0, -9.81]\n{shapes}{contacts}"));
    let plan = Plan::new(&model, 1e-9);
    let start = [
        pose([0.0, 0.0, 0.9], [0.2, 0.1, 0.3]),
        pose([0.0, 0.1, 0.3], [0.0, FRAC_PI_2 + 0.1, 0.4]),
        pose([0.0, 0.0, 1.6], [0.2, 0.1, 0.3]),
    ]
    .concat();
    let (q, p, _) = end(plan.default_contact_interpreter::<f64>(), (start.clone(), vec![0.0; 18]), 0.6);
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let compiled = plan.compiled_with_contacts::<f64>(&options, 10).unwrap();
    let (other_q, other_p, steps) = end(compiled, (start, vec![0.0; 18]), 0.6);
    println!("{steps:?} steps");
    assert!(steps[Way::Compiled as usize] > steps[Way::Interpreted as usize], "{steps:?}");
    assert_eq!((other_q, other_p), (q, p));
}

//! Boxes, sharp and rounded, and capsules on each other: gaps and rows against an independent reference, motions against
//! what is known of them.

use mbd_codegen::model::Model;
use mbd_runtime::contact::{Mode, Touching};
use mbd_runtime::spatial::{add3, scale3, Vec3};
use mbd_runtime::Constrained;
use mbd_testing::random::Rng;

use super::scene::{model, Scene};
use super::solid::{back, floating, gap_rate_of, less, norm, placed, random_pose, slip};

/// All that lies within a radius of a box about the origin, which may have edges of no length.
#[derive(Clone, Copy, Debug)]
struct Solid {
    core: Vec3<f64>,
    radius: f64,
}

const SHARP: Solid = Solid { core: [0.3, 0.4, 0.6], radius: 0.0 };
const ROUND: Solid = Solid { core: [0.2, 0.5, 0.1], radius: 0.05 };
const CAPSULE: Solid = Solid { core: [0.0, 0.0, 0.5], radius: 0.1 };
const BALL: Solid = Solid { core: [0.0; 3], radius: 0.1 };

impl Solid {
    fn text(&self, name: &str, body: &str) -> String {
        let (Solid { core, radius }, long) = (*self, self.core[2]);
        let kind = match core {
            [0.0, 0.0, 0.0] => format!("type = \"sphere\"\nradius = {radius}"),
            [0.0, 0.0, _] => format!("type = \"capsule\"\nradius = {radius}\nlength = {long}"),
            _ => format!("type = \"box\"\nsize = {:?}\nrounding = {radius}", core.map(|x| x + 2.0 * radius)),
        };
        format!("[[shape]]\nname = \"{name}\"\nbody = \"{body}\"\n{kind}\n")
    }

    /// The place of the core that is nearest to a place of the ground.
    fn nearest(&self, q: &[f64], to: Vec3<f64>) -> Vec3<f64> {
        let x = back(q, less(to, [q[0], q[1], q[2]]));
        placed(q, [0, 1, 2].map(|k| x[k].clamp(-0.5 * self.core[k], 0.5 * self.core[k])))
    }
}

/// The nearest places of two cores that do not overlap, by going to and fro between them.
fn nearest([a, b]: [Solid; 2], q: &[f64]) -> [Vec3<f64>; 2] {
    let (qa, qb) = q.split_at(7);
    let mut there = [qb[0], qb[1], qb[2]];
    for _ in 0..1_000_000 {
        let here = a.nearest(qa, there);
        let next = b.nearest(qb, here);
        let moved = norm(less(next, there));
        there = next;
        if moved < 1e-17 {
            break;
        }
    }
    [a.nearest(qa, there), there]
}

fn pair([a, b]: [Solid; 2], names: [&str; 2]) -> Model {
    let contact = format!("[[contact]]\nname = \"c\"\nbetween = {names:?}\nfriction = 1\n");
    let bodies = format!("{}{}", floating("a"), floating("b"));
    model(&format!("name = \"pair\"\n{bodies}{}{}{contact}", a.text("a", "a"), b.text("b", "b")))
}

/// Gaps of all contacts and the rates of their rows.
fn all(scene: &mut Scene, q: &[f64], v: &[f64]) -> Vec<(f64, [f64; 3])> {
    let system = scene.system.system_mut();
    let (mut gaps, mut rates, mut entries) = (system.zero_rows(), system.zero_rows(), system.zero_entries());
    system.gaps(0.0, &q.to_vec(), &v.to_vec(), &mut gaps, &mut rates, &mut entries);
    gaps.chunks(3).zip(rates.chunks(3)).map(|(gap, rate)| (gap[0], [rate[0], rate[1], rate[2]])).collect()
}

/// Cores that are nearer than this are left out: the directions between them have few digits.
const NEAR: f64 = 0.02;

/// The least gap of all contacts of a pair is the distance, and where bodies touch, its rows are the velocities of the points
/// that do.
#[test]
fn the_least_gap_is_the_distance() {
    let pairs = [[SHARP, CAPSULE], [ROUND, CAPSULE], [ROUND, BALL], [SHARP, ROUND], [ROUND, ROUND], [CAPSULE, CAPSULE]];
    let (mut worst, mut common) = ([0.0_f64; 3], 0);
    for (k, solids) in pairs.into_iter().enumerate() {
        let mut scene = Scene::new(pair(solids, ["a", "b"]), &[0.0; 14], &[0.0; 12]);
        let mut swapped = Scene::new(pair(solids, ["b", "a"]), &[0.0; 14], &[0.0; 12]);
        let mut rng = Rng::new(k as u64, 12);
        let mut count = 0;
        while count < 40 {
            let mut q = [random_pose(&mut rng, 0.2), random_pose(&mut rng, 0.6)].concat();
            let v: Vec<f64> = (0..12).map(|_| rng.around(1.0)).collect();
            let [p, r] = nearest(solids, &q);
            let distance = norm(less(r, p));
            if distance < NEAR {
                continue;
            }
            count += 1;
            let radii = solids.map(|s| s.radius);
            let least = |all: &[(f64, [f64; 3])]| all.iter().fold(f64::INFINITY, |least, (gap, _)| least.min(*gap));
            let gap = least(&all(&mut scene, &q, &v));
            // Going to and fro ends where a turn moves by the rounding of places, and may have a hundred times as far to go.
            worst[0] = worst[0].max((gap - (distance - radii[0] - radii[1])).abs());
            assert!((gap - (distance - radii[0] - radii[1])).abs() < 1e-13, "{solids:?}: {gap} {distance}");
            // Then the second body moves until both touch.
            let n = scale3(1.0 / distance, less(r, p));
            (0..3).for_each(|k| q[7 + k] -= gap * n[k]);
            let at = add3(p, scale3(radii[0], n));
            let found = all(&mut scene, &q, &v);
            let touching: Vec<usize> = (0..found.len()).filter(|k| found[*k].0 < 1e-12).collect();
            assert!(!touching.is_empty() && least(&found) > -1e-12);
            common += usize::from(touching.len() > 1);
            let [normal, across] = slip(&q, &v, at, n);
            for k in touching {
                let rates = found[k].1;
                let got = (rates[1] * rates[1] + rates[2] * rates[2]).sqrt();
                worst[1] = worst[1].max((rates[0] - normal).abs()).max((got - across).abs());
                // Places from the reference are right to the root of the rounding of distances.
                assert!((rates[0] - normal).abs() < 1e-6, "{solids:?}: {} {normal}", rates[0]);
                assert!((got - across).abs() < 1e-6, "{solids:?}: {got} {across}");
                let rate = gap_rate_of(&mut scene, &q, &v, 3 * k);
                worst[2] = worst[2].max((rate - rates[0]).abs());
                // The quotient errs by curvature times h² and rounding over h, 1e-9, unless a nearest part changes within it.
                assert!((rate - rates[0]).abs() < 1e-6, "{solids:?}: {rate} {}", rates[0]);
            }
            // The order in which the contact names its bodies changes no distance.
            assert!((least(&all(&mut swapped, &q, &v)) - least(&found)).abs() < 1e-15, "{solids:?}");
        }
    }
    println!("gaps {:.1e}, rows {:.1e}, rates {:.1e}; {common} of 240 touch at several", worst[0], worst[1], worst[2]);
}

/// A free body with the shape of a solid over one on the ground.
fn over(ground: &str, solid: Solid, surface: &str) -> Model {
    let contact = format!("[[contact]]\nname = \"c\"\nbetween = [\"still\", \"a\"]\n{surface}\n");
    model(&format!(
        "name = \"over\"\ngravity = [0, 0, -9.81]\n{}{}[[shape]]\nname = \"still\"\n{ground}\n{contact}",
        floating("a"),
        solid.text("a", "a")
    ))
}

/// Rotation vector to quaternion of a pose.
fn pose(place: Vec3<f64>, turn: Vec3<f64>) -> Vec<f64> {
    let angle = norm(turn);
    let (s, c) = (0.5 * angle).sin_cos();
    let axis = scale3(if angle > 0.0 { s / angle } else { 0.0 }, turn);
    place.into_iter().chain(axis).chain([c]).collect()
}

/// Runs in parts of 0.1 s; energy never grows, and gaps stay open to what landings leave.
fn settles(scene: &mut Scene, time: f64) {
    let mut before = scene.energy();
    let parts = (time * 10.0).round() as usize;
    for k in 1..=parts {
        scene.run(0.1 * k as f64);
        let now = scene.energy();
        assert!(now <= before + 1e-9, "{} s: {now} J after {before} J", 0.1 * k as f64);
        before = now;
        let least = scene.gaps().iter().step_by(3).fold(f64::INFINITY, |a: f64, b| a.min(*b));
        assert!(least > -1e-9, "{} s: gap {least:e}", 0.1 * k as f64);
    }
}

#[test]
fn a_rod_comes_to_rest_across_a_box() {
    let half = std::f64::consts::FRAC_PI_2;
    for (surface, yaw) in [("friction = 0.5", 0.3), ("friction = 0.5\nrestitution = 0.3", 0.0)] {
        let rod = Solid { core: [0.0, 0.0, 1.0], radius: 0.05 };
        let model = over("type = \"box\"\nsize = [0.4, 0.6, 0.2]", rod, surface);
        // Along x, turned by some yaw, one end higher than the other.
        let start = pose([0.05, 0.02, 0.3], [0.0, half + 0.1, yaw]);
        let mut scene = Scene::new(model, &start, &[0.0; 6]);
        scene.tolerance = 1e-9;
        settles(&mut scene, 2.0);
        println!("{} events, {:?}", scene.events.0.len(), scene.q);
        let modes: Vec<Mode> = scene.system.modes().to_vec();
        assert_eq!(modes.iter().filter(|m| **m != Mode::Open).count(), 2, "{modes:?}");
        assert!((scene.q[2] - 0.15).abs() < 1e-9, "{}", scene.q[2]);
        assert!(norm([scene.v()[0], scene.v()[1], scene.v()[2]]) < 1e-9);
    }
}

#[test]
fn a_box_falls_with_its_edge_across_that_of_another() {
    let quarter = std::f64::consts::FRAC_PI_4;
    let block = Solid { core: [0.28, 0.38, 0.18], radius: 0.01 };
    // An edge of the ground's box upward along x; the falling one turned by a right angle: its lowest edge is along y.
    let ground = "type = \"box\"\nsize = [0.6, 0.4, 0.4]\nrpy = [0.7853981633974483, 0, 0]";
    let model = over(ground, block, "restitution = 1");
    let start = pose([0.0, 0.02, 1.0], [0.0, quarter, 0.0]);
    let mut scene = Scene::new(model, &start, &[0.0; 6]);
    // Lowest edge: a corner of the x-z section of the core, (-0.14, -0.09) turned by 45° about y.
    scene.run(0.3);
    println!("{:?}", scene.events.0);
}

type Start = (Vec<f64>, Vec<f64>);

fn throws(name: &str, model: &dyn Fn(f64, f64) -> Model, poses: &dyn Fn(&mut Rng) -> Start, count: u64) {
    let (mut failed, mut gained, mut events, mut steps) = (0, 0, 0, 0);
    let started = std::time::Instant::now();
    for seed in 0..count {
        let mut rng = Rng::new(seed, 77);
        let (friction, restitution) = (rng.range(0.0, 1.0), rng.range(0.0, 0.5));
        let (q, v) = poses(&mut rng);
        let mut scene = Scene::new(model(friction, restitution), &q, &v);
        scene.tolerance = 1e-9;
        scene.steps = 3000;
        let mut before = scene.energy();
        let begun = std::time::Instant::now();
        for k in 1..=10 {
            if let Err(e) = scene.try_run(0.1 * k as f64) {
                println!("{name} {seed}: {} s: {e}", 0.1 * k as f64);
                failed += 1;
                break;
            }
            let now = scene.energy();
            if now > before + 1e-7 {
                println!("{name} {seed}: gains {} J", now - before);
                gained += 1;
            }
            before = now;
            let least = scene.gaps().iter().step_by(3).fold(f64::INFINITY, |a: f64, b| a.min(*b));
            if least < -1e-8 {
                println!("{name} {seed}: gap {least:e}");
            }
        }
        if begun.elapsed().as_secs_f64() > 5.0 {
            println!("{name} {seed}: {:?}", begun.elapsed());
        }
        events += scene.events.0.len();
        steps += scene.motion.as_ref().map_or(0, |m| m.contact_statistics().steps.iter().sum::<u64>());
    }
    println!("{name}: {failed} failed, {gained} gained of {count}; {events} events, {steps} steps, {:?}", started.elapsed());
}

#[test]
#[ignore]
fn experiments() {
    let which = std::env::var("WHICH").unwrap_or_default();
    let count = std::env::var("COUNT").map_or(5, |count| count.parse().unwrap());
    let free = |rng: &mut Rng| {
        let mut q = random_pose(rng, 0.05);
        q[2] += 0.7;
        (q, (0..6).map(|_| rng.around(2.0)).collect())
    };
    let surface = |f: f64, e: f64| format!("friction = {f}\nrestitution = {e}");
    let ground = "type = \"box\"\nsize = [0.6, 0.4, 0.4]";
    if which.contains('r') {
        throws("rod", &|f, e| over(ground, Solid { core: [0.0, 0.0, 0.5], radius: 0.05 }, &surface(f, e)), &free, count);
    }
    if which.contains('b') {
        throws("box", &|f, e| over(ground, Solid { core: [0.28, 0.18, 0.38], radius: 0.01 }, &surface(f, e)), &free, count);
    }
    if which.contains('e') {
        // Equal boxes, one above the other.
        let aligned = |rng: &mut Rng| (pose([0.0, 0.0, 0.41], [0.0; 3]), vec![rng.around(0.1), 0.0, 0.0, 0.0, 0.0, 0.0]);
        throws("aligned", &|f, e| over(ground, Solid { core: [0.58, 0.38, 0.38], radius: 0.01 }, &surface(f, e)), &aligned, count);
    }
    if which.contains('o') {
        let offset = |rng: &mut Rng| (pose([rng.around(0.1), rng.around(0.1), 0.41], [0.0, 0.0, rng.around(0.5)]), vec![0.0; 6]);
        throws("offset", &|f, e| over(ground, Solid { core: [0.58, 0.38, 0.38], radius: 0.01 }, &surface(f, e)), &offset, count);
    }
}

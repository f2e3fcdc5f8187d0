//! Cylinders against capsules, boxes, hulls and each other: gaps and rows against searches over their points, motions against what
//! is known of them.

use std::f64::consts::{FRAC_PI_2, PI};

use mbd_codegen::model::Model;
use mbd_codegen::options::{Arithmetic, Options};
use mbd_codegen::plan::Plan;
use mbd_runtime::contact::{Mode, Way};
use mbd_runtime::spatial::Vec3;
use mbd_testing::random::Rng;

use super::boxes::{self, all, around, block, closed, hull, over, pose, rod, settles, thrown, Agreement, Solid};
use super::fields::end;
use super::round::G;
use super::scene::{model, Scene};
use super::solid::{back, floating, least, less, norm, placed, random_pose, turned};

/// A cylinder about its z.
#[derive(Clone, Copy, Debug)]
struct Drum {
    radius: f64,
    length: f64,
    sides: usize,
    rounding: f64,
}

const CAN: Drum = Drum { radius: 0.2, length: 0.5, sides: 0, rounding: 0.0 };
const DISC: Drum = Drum { radius: 0.3, length: 0.0, sides: 0, rounding: 0.0 };
const PIPE: Drum = Drum { radius: 0.05, length: 0.9, sides: 0, rounding: 0.0 };

impl Drum {
    fn with(self, sides: usize, rounding: f64) -> Drum {
        Drum { sides, rounding, ..self }
    }

    fn kind(&self) -> String {
        let sides = if self.sides > 0 {
            format!("sides = {}\nrounding = {}\n", self.sides, self.rounding)
        } else {
            String::new()
        };
        format!("type = \"cylinder\"\nradius = {}\nlength = {}\n{sides}", self.radius, self.length)
    }

    /// The point that is nearest to a place, of which the distance is that to the mantle and to the ends.
    fn nearest(&self, x: Vec3<f64>) -> Vec3<f64> {
        let out = (self.radius / x[0].hypot(x[1])).min(1.0);
        [out * x[0], out * x[1], x[2].clamp(-0.5 * self.length, 0.5 * self.length)]
    }

    fn distance(&self, x: Vec3<f64>) -> f64 {
        norm(less(x, self.nearest(x)))
    }

    /// The prism that it is, as a body of [`boxes`].
    fn prism(&self) -> Solid {
        let point = |k: usize| {
            let (s, c) = (2.0 * PI * k as f64 / self.sides as f64).sin_cos();
            let (r, half) = (self.radius - self.rounding, 0.5 * self.length - self.rounding);
            [[r * c, r * s, -half], [r * c, r * s, half.abs()]]
        };
        let mut corners: Vec<_> = (0..self.sides).flat_map(point).collect();
        if self.length == 0.0 {
            corners = corners.into_iter().step_by(2).collect();
        }
        Solid { kind: self.kind(), corners, radius: self.rounding }
    }

    /// How far a rim bulges beyond the lines between its points.
    fn bulge(&self) -> f64 {
        self.radius * (1.0 - (PI / self.sides as f64).cos())
    }
}

/// A place of the second body in the axes of the first.
fn seen(q: &[f64], x: Vec3<f64>) -> Vec3<f64> {
    back(&q[..7], less(placed(&q[7..], x), [q[0], q[1], q[2]]))
}

fn pair([a, b]: [&Solid; 2], names: [&str; 2]) -> Model {
    boxes::pair([a, b], names)
}

/// The place of a segment along z that is nearest to a drum, by search.
fn on_segment(drum: &Drum, length: f64, q: &[f64]) -> Vec3<f64> {
    let (place, _) = least([0.5 * length], |x| drum.distance(seen(q, [0.0, 0.0, x[0]])));
    [0.0, 0.0, place[0]]
}

/// Of a capsule and a cylinder without sides, the least gap is the distance, and where they touch, rows are the
/// velocities of the points that do.
#[test]
fn the_distance_of_a_capsule_is_exact() {
    let mut found = Agreement::default();
    for (k, drum) in [CAN, DISC, PIPE].into_iter().enumerate() {
        for (j, [length, radius]) in [[0.5, 0.1], [1.6, 0.05], [0.06, 0.1]].into_iter().enumerate() {
            let capsule = around([0.0, 0.0, length], radius);
            let what = format!("{drum:?} and {length} {radius}");
            let models = [["a", "b"], ["b", "a"]].map(|names| pair([&drum.prism(), &capsule], names));
            assert_eq!(models[0].contacts.len(), 3);
            found.add(&what, models, [0.0, radius], (3 * k + j) as u64, &|q| {
                let other = on_segment(&drum, length, q);
                let on = drum.nearest(seen(q, other));
                Some([placed(&q[..7], on), placed(&q[7..], other)])
            });
        }
    }
    println!("{found:?}");
}

/// Capsules beside, above and across a cylinder where their nearest places are many or change their part: parallel to its axis and
/// to its ends, on its axis, over the middle of the curvature of its rim.
#[test]
fn capsules_that_lie_along_cylinders() {
    let [length, radius] = [0.8, 0.05];
    let capsule = around([0.0, 0.0, length], radius);
    let mut scene = Scene::new(pair([&CAN.prism(), &capsule], ["a", "b"]), &[0.0; 14], &[0.0; 12]);
    let still = pose([0.0; 3], [0.0; 3]);
    let mut worst = 0.0_f64;
    let tilt = [0.0, 1e-13, 1e-9, 1e-6, 1e-3, 0.1, FRAC_PI_2 - 1e-6, FRAC_PI_2];
    for (k, turn) in tilt.into_iter().enumerate() {
        for place in [
            [0.3, 0.0, 0.0],
            [0.3, 0.0, 0.4],
            [0.25, 0.1, 0.7],
            [0.0, 0.0, 0.7],
            [0.0, 0.0, 0.8],
            [0.1, 0.05, 0.32],
            [0.0, 0.2, 0.33],
            [0.0, 0.2, 0.2500001],
            [0.2, 0.0, 0.8],
            [0.4, 0.0, 0.3],
        ] {
            let q = [still.clone(), pose(place, [0.0, turn, 0.0])].concat();
            let wanted = CAN.distance(seen(&q, on_segment(&CAN, length, &q))) - radius;
            if wanted + radius < 1e-6 {
                continue;
            }
            let v: Vec<f64> = (0..12).map(|k| f64::from(k) - 4.0).collect();
            let found = all(&mut scene, &q, &v);
            let gap = boxes::least(&found);
            worst = worst.max((gap - wanted).abs());
            // Over the middle of the curvature of the rim, ten steps leave a fiftieth of the radius, and a distance of 0.03 m
            // is too large by the fourth power of that, over eight times the distance.
            assert!((gap - wanted).abs() < 1e-8, "{k} {place:?}: {gap} {wanted}");
            assert!(found.iter().all(|(gap, rates)| gap.is_finite() && rates.iter().all(|x| x.is_finite())));
        }
    }
    println!("gaps differ by {worst:.1e}");
}

/// Of a cylinder with sides, the least gap is that of the prism; it is not below the distance, and above it by less than mantle and rims
/// bulge and edges are rounded.
#[test]
fn a_cylinder_with_sides_is_a_prism() {
    let round = CAN.with(5, 0.02);
    let other = Drum { radius: 0.1, length: 0.7, sides: 4, rounding: 0.0 };
    let mut found = Agreement::default();
    let block = around([0.3, 0.4, 0.6], 0.03);
    let sharp = around([0.3, 0.4, 0.6], 0.0);
    let capsule = around([0.0, 0.0, 0.5], 0.1);
    let pebble =
        hull(vec![[0.2, 0.0, 0.1], [-0.1, 0.2, 0.0], [0.0, -0.2, 0.1], [0.0, 0.1, 0.3], [0.1, 0.0, -0.2]], 0.05);
    let cases = [
        (CAN.with(7, 0.0), capsule.clone(), 2 + 21),
        (DISC.with(6, 0.0), capsule, 2 + 6),
        (CAN.with(6, 0.0), block, 8 + 12 + 12 * 18),
        (round, sharp, 8 + 10 + 12 * 15),
        (PIPE.with(3, 0.0), pebble, 5 + 6 + 9 * 9),
        (round, other.prism(), 8 + 10 + 12 * 15),
    ];
    for (k, (drum, solid, count)) in cases.into_iter().enumerate() {
        let (prism, what) = (drum.prism(), format!("{drum:?} and {}", solid.kind));
        let models = [["a", "b"], ["b", "a"]].map(|names| pair([&prism, &solid], names));
        assert_eq!(models[0].contacts.len(), count, "{what}");
        found.add(&what, models, [prism.radius, solid.radius], k as u64, &|q| boxes::nearest([&prism, &solid], q));
    }
    println!("{found:?}");
    // Against the cylinder itself.
    let half = [0.15, 0.2, 0.3];
    let (drum, block) = (CAN.with(24, 0.0), around([0.3, 0.4, 0.6], 0.03));
    let mut scene = Scene::new(pair([&drum.prism(), &block], ["a", "b"]), &[0.0; 14], &[0.0; 12]);
    let mut rng = Rng::new(1, 14);
    let mut most = 0.0_f64;
    for _ in 0..40 {
        let q = [random_pose(&mut rng, 0.2), random_pose(&mut rng, 0.6)].concat();
        let (_, distance) = least(half, |x| drum.distance(seen(&q, *x)));
        let above = boxes::least(&all(&mut scene, &q, &[0.0; 12])) + 0.03 - distance;
        if distance > 0.02 {
            most = most.max(above);
            assert!(above > -1e-13 && above < drum.bulge(), "{above} at {distance}");
        }
    }
    println!("gaps are up to {most:.1e} above the distance, of {:.1e}", drum.bulge());
    assert!(most > 0.3 * drum.bulge());
}

/// A can stands on a box, on as many points as it has sides, and a box on a can.
#[test]
fn a_can_stands_on_a_box_and_a_box_on_a_can() {
    let can = Drum { radius: 0.1, length: 0.3, sides: 8, rounding: 0.0 };
    let plate = "type = \"box\"\nsize = [0.6, 0.4, 0.2]\nrounding = 0.01";
    for (ground, solid, height, count) in
        [(plate.to_string(), can.prism(), 0.25, 8), (can.kind(), around([0.58, 0.38, 0.18], 0.01), 0.25, 8)]
    {
        let model = over(&ground, &solid, "friction = 0.5");
        let mut scene = Scene::new(model, &pose([0.02, 0.01, height + 0.01], [0.0, 0.0, 0.1]), &[0.0; 6]);
        scene.tolerance = 1e-9;
        settles(&mut scene, 0.5).unwrap();
        assert!((scene.q[2] - height).abs() < 1e-9, "{:?}", scene.q);
        assert!(closed(&scene) >= count, "{:?}", scene.system.modes());
        let (q, p) = (scene.q.clone(), scene.p.clone());
        let weight: f64 = scene.system.forces(0.5, &q, &p).iter().map(|force| force[0]).sum();
        assert!((weight - 0.7 * G).abs() < 1e-8, "{weight}");
    }
}

/// A rod rocks on a mantle across which it lies: without slip, its axis keeps the distance of both radii from that of the cylinder, and
/// its energy stays.
#[test]
fn a_rod_rocks_across_a_mantle() {
    let drum = Drum { radius: 0.3, length: 0.5, sides: 0, rounding: 0.0 };
    let ground = format!("{}rpy = [{FRAC_PI_2}, 0, 0]\n", drum.kind());
    let rod = around([0.0, 0.0, 1.0], 0.05);
    let model = over(&ground, &rod, "friction = 2");
    // It turns about y, and its middle moves along x so that it does not slip.
    let v = [0.0, 0.0, 0.05 * 0.6, 0.0, 0.6, 0.0];
    let mut scene = Scene::new(model, &pose([0.0, 0.01, 0.35], [0.0, FRAC_PI_2, 0.0]), &v);
    scene.run(0.01);
    let first = scene.energy();
    let mut tilt = 0.0_f64;
    for k in 1..=20 {
        scene.run(0.01 + 0.05 * f64::from(k));
        let axis = turned(&scene.q, [0.0, 0.0, 1.0]);
        tilt = tilt.max(axis[2].abs());
        let sticks = scene.system.modes().iter().filter(|mode| **mode == Mode::Stick).count();
        assert_eq!(sticks, 1, "{:?}", scene.system.modes());
        assert!((scene.energy() - first).abs() < 1e-8);
        let off = (scene.q[2] * axis[0] - scene.q[0] * axis[2]).abs();
        assert!((off - 0.35).abs() < 1e-10 && (scene.q[1] - 0.01).abs() < 1e-10, "{off}");
    }
    assert!(tilt > 0.05, "{tilt}");
}

/// A rod lies on the end of a drum without falling through or tilting: its straight part is held by lines of the rim on both sides.
#[test]
fn a_rod_lies_on_the_end_of_a_drum() {
    let drum = CAN.with(8, 0.0);
    let model = over(&drum.kind(), &around([0.0, 0.0, 1.0], 0.05), "friction = 0.5");
    let mut scene = Scene::new(model, &pose([0.03, 0.02, 0.32], [0.0, FRAC_PI_2 + 0.05, 0.3]), &[0.0; 6]);
    scene.tolerance = 1e-9;
    settles(&mut scene, 1.5).unwrap();
    let axis = turned(&scene.q, [0.0, 0.0, 1.0]);
    assert!((scene.q[2] - 0.3).abs() < 1e-9 && axis[2].abs() < 1e-9, "{:?} {axis:?}", scene.q);
}

/// Rods, boxes and cylinders that are thrown on a cylinder and cylinders that are thrown on a box gain no energy.
#[test]
fn what_is_thrown_on_a_cylinder_gains_no_energy() {
    let drum = Drum { radius: 0.25, length: 0.4, sides: 8, rounding: 0.0 };
    let lying = |drum: Drum| format!("{}rpy = [{FRAC_PI_2}, 0, 0]\n", drum.kind());
    let lies = lying(drum);
    let crate_ = "type = \"box\"\nsize = [0.6, 0.4, 0.4]\nrounding = 0.01";
    let can = Drum { radius: 0.15, length: 0.3, sides: 8, rounding: 0.01 }.prism();
    assert_eq!(thrown(&drum.kind(), &rod(), 6), 0);
    assert_eq!(thrown(&lying(drum.with(0, 0.0)), &rod(), 6), 0);
    assert_eq!(thrown(&drum.kind(), &block(), 3), 0);
    assert_eq!(thrown(&lies, &block(), 3), 0);
    assert_eq!(thrown(crate_, &can, 4), 0);
    assert_eq!(thrown(&lies, &can, 3), 0);
}

/// A hundred of each, which take minutes, or as many as `MBD_DROPS` says.
#[test]
#[ignore = "a hundred of each take minutes"]
fn many_that_are_thrown_on_a_cylinder_gain_no_energy() {
    let count = std::env::var("MBD_DROPS").map_or(100, |count| count.parse().unwrap());
    let drum = Drum { radius: 0.25, length: 0.4, sides: 8, rounding: 0.0 };
    let lies = format!("{}rpy = [{FRAC_PI_2}, 0, 0]\n", drum.kind());
    let crate_ = "type = \"box\"\nsize = [0.6, 0.4, 0.4]\nrounding = 0.01";
    let can = Drum { radius: 0.15, length: 0.3, sides: 8, rounding: 0.01 }.prism();
    let smooth = format!("{}rpy = [{FRAC_PI_2}, 0, 0]\n", drum.with(0, 0.0).kind());
    let cases = [(&*smooth, &rod()), (&*lies, &rod()), (&*lies, &block()), (crate_, &can), (&*lies, &can)];
    assert_eq!(cases.map(|(ground, solid)| thrown(ground, solid, count)), [0; 5]);
}

/// Machine code of capsules and boxes on cylinders has the bits of the interpreter.
#[test]
fn machine_code_of_cylinders_does_what_the_interpreter_does() {
    let drum = Drum { radius: 0.25, length: 0.6, sides: 6, rounding: 0.0 };
    let text = |solid: &Solid, body: &str| {
        format!("{}[[shape]]\nname = \"{body}\"\nbody = \"{body}\"\n{}\n", floating(body), solid.kind)
    };
    let contact = |ground: &str, name: &str| {
        format!("[[contact]]\nname = \"c{name}\"\nbetween = [\"{ground}\", \"{name}\"]\nfriction = 0.4\n")
    };
    let lies =
        |name: &str, drum: Drum| format!("[[shape]]\nname = \"{name}\"\n{}rpy = [{FRAC_PI_2}, 0, 0]\n", drum.kind());
    let still = format!("{}{}", lies("round", drum.with(0, 0.0)), lies("still", drum));
    let text = format!(
        "name = \"m\"\ngravity = [0, 0, -{G}]\n{still}{}{}{}{}",
        text(&rod(), "a"),
        text(&block(), "b"),
        contact("round", "a"),
        contact("still", "b")
    );
    let plan = Plan::new(&model(&text), 1e-9);
    let start = [pose([0.1, 0.2, 0.4], [0.1, FRAC_PI_2 + 0.2, 0.0]), pose([0.0, -0.1, 0.7], [0.3, 0.2, 0.1])].concat();
    let (q, p, _) = end(plan.default_contact_interpreter::<f64>(), (start.clone(), vec![0.0; 12]), 0.6);
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let compiled = plan.compiled_with_contacts::<f64>(&options, 10).unwrap();
    let (other_q, other_p, steps) = end(compiled, (start, vec![0.0; 12]), 0.6);
    println!("{steps:?} steps");
    assert!(steps[Way::Compiled as usize] > steps[Way::Interpreted as usize], "{steps:?}");
    assert_eq!((other_q, other_p), (q, p));
}

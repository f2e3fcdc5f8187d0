//! Contacts with height fields: gaps and rows against searches and moving points, and motions against known ones.

use mbd_codegen::model::{Model, ShapeKind};
use mbd_codegen::options::{Arithmetic, Options};
use mbd_codegen::plan::Plan;
use mbd_runtime::contact::{Hybrid, Mode, Touching, Way, WithContacts};
use mbd_runtime::field::Field;
use mbd_runtime::integrate::{Dop853, Step, Tolerances};
use mbd_runtime::spatial::{add3, scale3};
use mbd_runtime::Conjugate;
use mbd_testing::random::Rng;

use super::scene::{apart, model, Scene};
use super::solid::{back, floating, gap_rate, later, least, less, norm, placed, random_pose, rows, slip, turned};

/// A height field shape on a body, or on the ground, with heights at points that are `spacing` apart.
pub(super) fn field(body: Option<&str>, points: [usize; 2], spacing: [f64; 2], h: impl Fn(f64, f64) -> f64) -> String {
    let at = |k: usize, axis: usize| (k as f64 - 0.5 * (points[axis] - 1) as f64) * spacing[axis];
    let row = |j: usize| (0..points[0]).map(|i| h(at(i, 0), at(j, 1))).collect::<Vec<f64>>();
    let rows: Vec<Vec<f64>> = (0..points[1]).map(row).collect();
    let body = body.map_or(String::new(), |body| format!("body = \"{body}\"\n"));
    format!("[[shape]]\nname = \"hills\"\n{body}type = \"height_field\"\nspacing = {spacing:?}\nheights = {rows:?}\n")
}

pub(super) fn hills(x: f64, y: f64) -> f64 {
    0.1 * (2.0 * x + 0.3).sin() * (1.5 * y).cos() + 0.15 * x - 0.1 * y
}

fn of(model: &Model) -> &'static Field {
    let fields = model.shapes.iter().find_map(|shape| match shape.kind {
        ShapeKind::HeightField { field, .. } => Some(field),
        _ => None,
    });
    fields.expect("a height field")
}

fn pair(shape: &str, names: [&str; 2]) -> Model {
    let contact = format!("[[contact]]\nname = \"c\"\nbetween = {names:?}\nfriction = 1\n");
    let ground = field(Some("a"), [12, 9], [0.3, 0.4], hills);
    let foot = format!("[[shape]]\nname = \"foot\"\nbody = \"b\"\n{shape}");
    model(&format!("name = \"pair\"\n{}{}{ground}{foot}{contact}", floating("a"), floating("b")))
}

/// On bodies that move, a ball or a point that touches: its gap against a search over the surface, its rows against the
/// motion of the points that touch, whichever of the two the contact names first.
#[test]
fn gaps_are_distances_where_bodies_touch_and_rows_their_rates() {
    let mut worst = [0.0_f64; 4];
    for (k, radius) in [0.0, 0.05, 0.4].into_iter().enumerate() {
        let shape = match radius > 0.0 {
            true => format!("type = \"sphere\"\nradius = {radius:?}\n"),
            false => "type = \"point\"\n".into(),
        };
        let [first, second] = [["hills", "foot"], ["foot", "hills"]].map(|names| pair(&shape, names));
        let surface = of(&first);
        let mut scene = Scene::new(first, &[0.0; 14], &[0.0; 12]);
        let mut swapped = Scene::new(second, &[0.0; 14], &[0.0; 12]);
        let mut rng = Rng::new(k as u64, 12);
        for _ in 0..30 {
            // Also beside the grid, which ends at 1.65 m and 1.6 m.
            let (x, y) = (rng.around(2.5), rng.around(2.5));
            let mut q = [random_pose(&mut rng, 0.5), random_pose(&mut rng, 0.5)].concat();
            let v: Vec<f64> = (0..12).map(|_| rng.around(1.0)).collect();
            // The second body above the place, at a height that a search along the field's z finds.
            let height = |x: f64, y: f64| surface.at([x, y]).height;
            let point = |u: &[f64; 2]| [x + u[0], y + u[1], height(x + u[0], y + u[1])];
            let distance = |z: f64| least([0.7; 2], |u| norm(less([x, y, z], point(u))));
            let (mut low, mut high) = (height(x, y), height(x, y) + 2.0 * radius + 1e-3);
            for _ in 0..60 {
                let z = 0.5 * (low + high);
                let closed = if radius > 0.0 { distance(z).1 < radius } else { z < height(x, y) };
                (low, high) = if closed { (z, high) } else { (low, z) };
            }
            let place = [x, y, high];
            let middle = placed(&q, place);
            q[7..10].copy_from_slice(&middle);
            let found = rows(&mut scene, &q, &v);
            // The search knows the distance to its rounding.
            worst[0] = worst[0].max(found.gap.abs());
            assert!(found.gap.abs() < 1e-13, "{radius} at {x} {y}: {:e}", found.gap);
            // The normal: to the place that is nearest, or across the surface by differences.
            let n = match radius > 0.0 {
                true => scale3(1.0 / radius, less(place, point(&distance(high).0))),
                false => {
                    let h = 1e-5;
                    let slope = [
                        (height(x + h, y) - height(x - h, y)) / (2.0 * h),
                        (height(x, y + h) - height(x, y - h)) / (2.0 * h),
                    ];
                    let across = [-slope[0], -slope[1], 1.0];
                    scale3(1.0 / norm(across), across)
                }
            };
            let n = turned(&q, n);
            let [normal, across] = slip(&q, &v, less([q[7], q[8], q[9]], scale3(radius, n)), n);
            let got = (found.rates[1] * found.rates[1] + found.rates[2] * found.rates[2]).sqrt();
            // The search finds places to the root of rounding errors over the curvature of the distance, differences know
            // the slope to 1e-10; speeds are a few metres a second.
            worst[1] = worst[1].max((found.rates[0] - normal).abs()).max((got - across).abs());
            assert!((found.rates[0] - normal).abs() < 1e-6, "{radius}: {} {normal}", found.rates[0]);
            assert!((got - across).abs() < 1e-6, "{radius}: {got} {across}");
            // Errors of the quotient: h² times third derivatives of the surface, and rounding over h.
            let rate = gap_rate(&mut scene, &q, &v);
            worst[2] = worst[2].max((rate - found.rates[0]).abs());
            assert!((rate - found.rates[0]).abs() < 1e-8, "{radius}: {rate} {}", found.rates[0]);
            let other = rows(&mut swapped, &q, &v);
            assert!((other.gap - found.gap).abs() < 1e-15 && other.row == found.row);
            // Above and below, the gap has the right sign, and is of first order the distance.
            for (z, order) in [(1e-4, 1e-6), (-1e-4, 1e-6), (0.5, 1.0), (3.0, 10.0)] {
                let mut q = q.clone();
                let moved = placed(&q, add3(place, scale3(z, back(&q, n))));
                q[7..10].copy_from_slice(&moved);
                let gap = rows(&mut scene, &q, &v).gap;
                worst[3] = worst[3].max(if z.abs() < 0.1 { (gap - z).abs() } else { 0.0 });
                assert!(gap * z > 0.0 && (gap - z).abs() < order, "{radius}: {gap} {z}");
            }
        }
    }
    println!("gaps {:.1e}, rows {:.1e}, rates {:.1e}, beside {:.1e}", worst[0], worst[1], worst[2], worst[3]);
}

/// No gap is closed faster than the bounds say.
#[test]
fn bounds_of_how_fast_gaps_close_hold() {
    for (k, shape) in ["type = \"point\"\n", "type = \"sphere\"\nradius = 0.2\n"].into_iter().enumerate() {
        let (mut tight, mut looks) = (0.0_f64, 0);
        let mut scene = Scene::new(pair(shape, ["hills", "foot"]), &[0.0; 14], &[0.0; 12]);
        let mut rng = Rng::new(k as u64, 13);
        let mut count = 0;
        while count < 200 {
            let mut q = [random_pose(&mut rng, 0.5), random_pose(&mut rng, 2.0)].concat();
            let v: Vec<f64> = (0..12).map(|_| rng.around(1.0)).collect();
            let gap = rows(&mut scene, &q, &v).gap;
            if gap < 0.05 {
                continue;
            }
            count += 1;
            // In small steps, with the coordinates of each.
            let (mut left, steps) = (gap, 400);
            let h = 0.5 * gap / f64::from(steps);
            for _ in 0..4 * steps {
                let size = |velocity: usize| match velocity % 6 {
                    k @ 0..=2 => q[velocity / 6 * 7 + k].abs() + h * 4.0,
                    _ => 0.0,
                };
                let reaches = scene.system.system_mut().reaches().to_vec();
                let slide: f64 = reaches.iter().map(|r| r.slide * size(r.velocity)).sum();
                let speed: f64 = reaches.iter().map(|r| (r.rate + r.turn * slide) * v[r.velocity].abs()).sum();
                assert!(speed.is_finite() && speed > 0.0, "{shape}: {speed}");
                left -= h * speed;
                if left < 0.0 {
                    break;
                }
                q = later(&mut scene, &q, &v, h);
                let now = rows(&mut scene, &q, &v).gap;
                (tight, looks) = (tight.max(1.0 - now / gap), looks + 1);
                assert!(now > 0.0, "{shape}: {gap} became {now} with {left} left");
            }
        }
        println!("{shape:?}: of gaps, at most {tight:.3} was closed within the bounds, in {looks} steps");
        assert!(tight > 0.15 && looks > 5000, "{tight} {looks}");
    }
}

fn body(shape: &str) -> String {
    format!("{}[[shape]]\nname = \"foot\"\nbody = \"b\"\n{shape}\n", floating("b"))
}

fn contact(more: &str) -> String {
    format!("[[contact]]\nname = \"c\"\nbetween = [\"hills\", \"foot\"]\n{more}\n")
}

/// A field of heights of an inclined plane moves bodies as that plane does: a box that is thrown on it, with friction and
/// restitution, and a ball.
#[test]
fn an_inclined_plane_is_an_inclined_plane() {
    let normal = [-0.2, 0.1, 1.0];
    let ground = field(None, [5, 4], [3.0, 4.0], |x, y| 0.2 * x - 0.1 * y);
    let plane = format!("[[shape]]\nname = \"hills\"\ntype = \"plane\"\nnormal = {normal:?}\n");
    let shapes = ["type = \"box\"\nsize = [0.3, 0.4, 0.2]", "type = \"sphere\"\nradius = 0.25"];
    for shape in shapes {
        // Bounces of a box make rounding errors larger by powers.
        let more = contact(if shape.contains("box") { "friction = 0.4" } else { "friction = 0.4\nrestitution = 0.3" });
        let [mut a, mut b] = [&ground, &plane].map(|ground| {
            let text = format!("name = \"m\"\ngravity = [0, 0, -9.81]\n{}{ground}{more}", body(shape));
            let q = [0.1, -0.2, 0.7, 0.1, 0.2, -0.1, (1.0_f64 - 0.06).sqrt()];
            Scene::new(model(&text), &q, &[0.5, 0.2, 0.0, 0.3, 0.6, -0.4])
        });
        a.run(0.8);
        b.run(0.8);
        assert!(a.events.0.len() > 2 && a.events.0.len() == b.events.0.len(), "{shape}: {:?}", a.events.0.len());
        for (x, y) in a.events.0.iter().zip(&b.events.0) {
            // Which of two corners of an edge lands first is a matter of rounding.
            assert_eq!((x.modes, x.cause), (y.modes, y.cause), "{shape}");
            assert!((x.time - y.time).abs() < 1e-10, "{shape}: {} {}", x.time, y.time);
        }
        let off = apart(&a.q, &b.q);
        println!("{shape:?}: {} events, places differ by {off:.1e}", a.events.0.len());
        // Rounding errors, which impacts of a box make larger.
        assert!(off < 1e-10, "{shape}: {off}");
    }
}

/// Radius of the bowl's lowest point, m.
const R: f64 = 2.0;

fn bowl(x: f64, y: f64) -> f64 {
    (x * x + y * y) / (2.0 * R)
}

/// A point slides without friction in the bowl `z = (x² + y²)/2R`, which cubic splines are exactly: its period in a plane is
/// known, and energy and angular momentum about z stay in space.
#[test]
fn a_point_slides_in_a_bowl() {
    let (amplitude, gravity) = (1.0, 9.81);
    let ground = field(None, [9, 7], [0.5, 0.6], bowl);
    let text = format!("name = \"m\"\ngravity = [0, 0, -9.81]\n{}{ground}{}", body("type = \"point\""), contact(""));
    // (1 + x²/R²) ẋ² = (A² − x²) g/R: with x = A sin s, the quarter of a period is an integral whose sums converge faster
    // than any power.
    let n = 64;
    let integrand = |s: f64| ((1.0 + (amplitude * s.sin() / R).powi(2)) * R / gravity).sqrt();
    let quarter = (0..4 * n).map(|k| integrand(f64::from(k) * std::f64::consts::TAU / f64::from(4 * n))).sum::<f64>()
        * std::f64::consts::FRAC_PI_2
        / f64::from(4 * n);
    let unturned = [0.0, 0.0, 0.0, 1.0];
    let at = |x: f64, y: f64| [&[x, y, bowl(x, y)][..], &unturned].concat();
    let mut scene = Scene::new(model(&text), &at(amplitude, 0.0), &[0.0; 6]);
    for k in 1..=8_u8 {
        scene.run(f64::from(k) * quarter);
        let wanted = amplitude * [1.0, 0.0, -1.0, 0.0][usize::from(k) % 4];
        assert!((scene.q[0] - wanted).abs() < 1e-9, "{k}: {} {wanted}", scene.q[0]);
        assert!(scene.gaps()[0].abs() < 1e-11 && scene.q[1].abs() < 1e-12);
    }
    let mut scene = Scene::new(model(&text), &at(0.8, 0.1), &[0.3, 2.0, 0.15, 0.0, 0.0, 0.0]);
    let moment = |scene: &mut Scene| {
        let v = scene.v();
        scene.q[0] * v[1] - scene.q[1] * v[0]
    };
    let mut first = None;
    for k in 0..40_u8 {
        scene.run(0.25 * f64::from(k) + 1e-3);
        let now = [scene.energy(), moment(&mut scene)];
        let first = *first.get_or_insert(now);
        assert!((0..2).all(|k| (now[k] - first[k]).abs() < 1e-9), "{now:?} {first:?}");
    }
    assert_eq!(scene.system.modes(), [Mode::Slide]);
}

/// A ball falls into a hollow, stays at the lowest place, and lies there as high as its radius.
#[test]
fn a_ball_lies_in_a_hollow() {
    let ground = field(None, [9, 9], [0.3, 0.3], |x, y| bowl(x, y) + 0.05 * (x * y * y * y - x * x * x * y));
    let ball = body("type = \"sphere\"\nradius = 0.3");
    let more = contact("friction = 0.5\nrestitution = 0.4");
    let text = format!("name = \"m\"\ngravity = [0, 0, -9.81]\n{ball}{ground}{more}");
    let mut scene = Scene::new(model(&text), &[0.0, 0.0, 0.7, 0.0, 0.0, 0.0, 1.0], &[0.0; 6]);
    scene.run(3.0);
    let rest = scene.motion.as_ref().expect("it runs");
    assert_eq!(rest.contact_statistics().settled, 1);
    assert!((scene.q[2] - 0.3).abs() < 1e-11 && scene.q[0].hypot(scene.q[1]) < 1e-11, "{:?}", scene.q);
    assert!(scene.v().iter().all(|v| v.abs() < 1e-11));
    // One that rolls there without slip keeps its energy.
    let text = format!("name = \"m\"\ngravity = [0, 0, -9.81]\n{ball}{ground}{}", contact("friction = 2"));
    let mut scene = Scene::new(model(&text), &[0.4, 0.2, 0.7, 0.0, 0.0, 0.0, 1.0], &[0.0; 6]);
    scene.run(0.5);
    let first = scene.energy();
    for k in 1..=20 {
        scene.run(0.5 + 0.2 * f64::from(k));
        let now = scene.energy();
        assert!((now - first).abs() < 1e-8, "{now} {first}");
        assert!(scene.gaps()[0].abs() < 1e-10);
    }
    assert_eq!(scene.system.modes(), [Mode::Stick]);
}

/// Coordinates and momenta a `time` after given coordinates and velocities, and the steps by what served them.
pub(super) fn end<Y>(mut mechanism: Y, (mut q, v): (Vec<f64>, Vec<f64>), time: f64) -> (Vec<f64>, Vec<f64>, [u64; 5])
where
    Y: Touching<Scalar = f64, Coordinates = Vec<f64>, Momenta = Vec<f64>> + Conjugate,
{
    let mut p = v.clone();
    mechanism.conjugate_momenta(&q, &v, &mut p);
    let mut system = WithContacts::new(mechanism);
    let (method, step) = (Dop853::new(&system), Step::Adaptive(Tolerances::new(1e-9)));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).unwrap();
    motion.run(&mut system, time, &mut ()).unwrap();
    motion.state(&system, &mut q, &mut p);
    (q, p, motion.contact_statistics().steps)
}

/// Machine code that looks cells up has the bits of the interpreter.
#[test]
fn machine_code_looks_up_what_the_interpreter_does() {
    let model = model(include_str!("../../../models/contacts/ball_on_hills.toml"));
    let plan = Plan::new(&model, 1e-9);
    let start = (plan.start(), plan.start_velocity().expect("it moves"));
    let (q, p, _) = end(plan.default_contact_interpreter::<f64>(), start.clone(), 1.5);
    let options = Options { arithmetic: Arithmetic::Exact, ..Options::default() };
    let (other_q, other_p, steps) = end(plan.compiled_with_contacts::<f64>(&options, 10).unwrap(), start, 1.5);
    println!("{steps:?} steps");
    // In flight and on the ground, all but the first steps.
    assert!(steps[Way::Compiled as usize] > 3 * steps[Way::Interpreted as usize], "{steps:?}");
    assert_eq!((other_q, other_p), (q, p));
}

/// A height that is one number of a file is the same ground as in the model.
#[test]
fn heights_of_a_file_are_those_of_the_model() {
    let listed = field(None, [5, 4], [0.5, 0.25], |x, y| ((8.0 * hills(x, y)) * 1000.0).round() / 8000.0);
    let (head, rows) = listed.split_once("heights = ").expect("heights");
    let rows: Vec<String> = rows.trim().trim_matches(['[', ']']).split("], [").map(str::to_string).collect();
    // In millimetres, with all kinds of separators, comments and empty lines.
    let line = |(k, row): (usize, &String)| {
        let numbers = row.split(", ").map(|x| format!("{}", x.parse::<f64>().expect("a number") / 0.125));
        numbers.collect::<Vec<_>>().join([" ", ",", "; ", "\t"][k % 4])
    };
    let file = format!("# heights\n\n{}\n", rows.iter().enumerate().map(line).collect::<Vec<_>>().join("\n \n"));
    let ball = body("type = \"point\"");
    let [inside, outside] = ["", "file = \"ground.csv\"\nscale = 0.125\n"].map(|source| {
        let ground = if source.is_empty() { listed.clone() } else { format!("{head}{source}") };
        let text = format!("name = \"m\"\n{ball}{ground}{}", contact(""));
        let files = |path: &std::path::Path| {
            assert_eq!(path, std::path::Path::new("robots/ground.csv"));
            Ok(file.clone().into_bytes())
        };
        let (read, findings) = mbd_codegen::read::load_with("robots/m.toml", &text, &Default::default(), &files);
        // A converted model has the heights, without the file.
        let (converted, _) = mbd_codegen::read::to_toml("robots/m.toml", &text, &Default::default(), &files).unwrap();
        assert_eq!(of(&model(&converted)), of(&read.as_ref().unwrap_or_else(|| panic!("{findings}")).0));
        read.unwrap_or_else(|| panic!("{findings}")).0
    });
    assert_eq!(of(&inside), of(&outside));
    // What is wrong there is told with its line and column.
    let text = format!("name = \"m\"\n{ball}{head}file = \"ground.csv\"\n{}", contact(""));
    let wrong = |_: &std::path::Path| Ok(b"1 2 3 4\n1, two, 3, inf\n".to_vec());
    let (read, findings) = mbd_codegen::read::load_with("robots/m.toml", &text, &Default::default(), &wrong);
    let findings = findings.to_string();
    assert!(read.is_none());
    for wanted in
        ["robots/ground.csv:2:4: error: shape `hills`: `two` is not a finite number", "ground.csv:2:12: error"]
    {
        assert!(findings.contains(wanted), "{findings}");
    }
}

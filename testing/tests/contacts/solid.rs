//! Gaps and rows of capsules, boxes and cylinders at random places, against searches over all their points.

use mbd_codegen::model::Model;
use mbd_runtime::spatial::{add3, cross, dot3, scale3, Vec3};
use mbd_runtime::System;
use mbd_testing::random::Rng;

use super::scene::{model, Scene};

/// A solid of the tests, in its own axes.
#[derive(Clone, Copy, Debug)]
enum Solid {
    Point,
    Sphere(f64),
    Capsule(f64, f64),
    Box([f64; 3]),
    Cylinder(f64, f64),
}

use Solid::{Capsule, Cylinder, Point, Sphere};

const CRATE: Solid = Solid::Box([0.3, 0.4, 0.6]);
const PAIRS: [[Solid; 2]; 9] = [
    [Capsule(0.1, 0.5), Sphere(0.15)],
    [Capsule(0.1, 0.5), Point],
    [Capsule(0.1, 0.5), Capsule(0.05, 0.3)],
    [CRATE, Sphere(0.15)],
    [CRATE, Point],
    [Cylinder(0.2, 0.5), Sphere(0.15)],
    [Cylinder(0.2, 0.5), Point],
    [Cylinder(0.2, 0.0), Sphere(0.15)],
    [Sphere(0.1), Sphere(0.15)],
];

impl Solid {
    fn text(&self, name: &str) -> String {
        let kind = match self {
            Point => "type = \"point\"".into(),
            Sphere(r) => format!("type = \"sphere\"\nradius = {r}"),
            Capsule(r, l) => format!("type = \"capsule\"\nradius = {r}\nlength = {l}"),
            Solid::Box(size) => format!("type = \"box\"\nsize = {size:?}"),
            Cylinder(r, l) => format!("type = \"cylinder\"\nradius = {r}\nlength = {l}"),
        };
        format!("[[shape]]\nname = \"{name}\"\nbody = \"{name}\"\n{kind}\n")
    }

    /// Radius of the balls that fill the solid.
    fn radius(&self) -> f64 {
        match self {
            Sphere(r) | Capsule(r, _) => *r,
            _ => 0.0,
        }
    }

    /// Largest absolute values of the numbers from which [`Solid::place`] makes the middles of these balls.
    fn extent(&self) -> Vec3<f64> {
        match *self {
            Point | Sphere(_) => [0.0; 3],
            Capsule(_, l) => [0.0, 0.0, 0.5 * l],
            Solid::Box(size) => scale3(0.5, size),
            Cylinder(r, l) => [r, r, 0.5 * l],
        }
    }

    fn place(&self, x: Vec3<f64>) -> Vec3<f64> {
        match self {
            // Corners around the circle go to the circle.
            Cylinder(r, _) => {
                let out = (r / (x[0] * x[0] + x[1] * x[1]).sqrt()).min(1.0);
                [out * x[0], out * x[1], x[2]]
            }
            _ => x,
        }
    }
}

/// The least value of a function of some numbers and where it has it, by grids that close in. `extent`: their largest
/// absolute values. What is searched has one valley, so that no grid misses it.
pub(super) fn least<const N: usize>(extent: [f64; N], f: impl Fn(&[f64; N]) -> f64) -> ([f64; N], f64) {
    const POINTS: usize = 9;
    let (mut best, mut value) = ([0.0; N], f(&[0.0; N]));
    let mut reach = extent;
    // Two distances of a grid to either side of its best point hold the valley.
    for _ in 0..40 {
        let middle = best;
        for n in 0..POINTS.pow(N as u32) {
            let x = std::array::from_fn(|k| {
                let step = (n / POINTS.pow(k as u32) % POINTS) as f64 / (POINTS - 1) as f64;
                (middle[k] + (2.0 * step - 1.0) * reach[k]).clamp(-extent[k], extent[k])
            });
            let y = f(&x);
            if y < value {
                (best, value) = (x, y);
            }
        }
        reach = reach.map(|x| 0.5 * x);
    }
    (best, value)
}

pub(super) fn floating(name: &str) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmass = 0.7\ninertia = [0.01, 0.02, 0.025]\n[[joint]]\nname = \"j{name}\"\ntype = \"floating\"\nparent = \"ground\"\nchild = \"{name}\"\n"
    )
}

fn pair([a, b]: [Solid; 2], names: [&str; 2]) -> Model {
    let contact = format!("[[contact]]\nname = \"c\"\nbetween = {names:?}\nfriction = 1\n");
    model(&format!("name = \"pair\"\n{}{}{}{}{contact}", floating("a"), floating("b"), a.text("a"), b.text("b")))
}

pub(super) fn turned(q: &[f64], x: Vec3<f64>) -> Vec3<f64> {
    let (u, w) = ([q[3], q[4], q[5]], q[6]);
    let t = scale3(2.0, cross(u, x));
    add3(x, add3(scale3(w, t), cross(u, t)))
}

pub(super) fn back(q: &[f64], x: Vec3<f64>) -> Vec3<f64> {
    turned(&[0.0, 0.0, 0.0, -q[3], -q[4], -q[5], q[6]], x)
}

/// A place of a body, whose coordinates are `q`, in ground axes.
pub(super) fn placed(q: &[f64], x: Vec3<f64>) -> Vec3<f64> {
    add3([q[0], q[1], q[2]], turned(q, x))
}

pub(super) fn less(a: Vec3<f64>, b: Vec3<f64>) -> Vec3<f64> {
    add3(a, scale3(-1.0, b))
}

pub(super) fn norm(x: Vec3<f64>) -> f64 {
    dot3(x, x).sqrt()
}

/// The middles of the nearest balls of two solids.
fn nearest([a, b]: [Solid; 2], q: &[f64]) -> [Vec3<f64>; 2] {
    let (qa, qb) = q.split_at(7);
    let point = |x: &[f64; 3]| placed(qa, a.place(*x));
    match b {
        Capsule(_, l) => {
            let end = |t: f64| placed(qb, [0.0, 0.0, t]);
            let at = |x: &[f64; 2]| norm(less(end(x[1]), placed(qa, [0.0, 0.0, x[0]])));
            let (x, _) = least([a.extent()[2], 0.5 * l], at);
            [placed(qa, [0.0, 0.0, x[0]]), end(x[1])]
        }
        _ => {
            let middle = placed(qb, [0.0; 3]);
            let (x, _) = least(a.extent(), |x| norm(less(middle, point(x))));
            [point(&x), middle]
        }
    }
}

pub(super) fn random_pose(rng: &mut Rng, spread: f64) -> Vec<f64> {
    loop {
        let x: [f64; 4] = std::array::from_fn(|_| rng.around(1.0));
        let n = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        if n > 0.2 && n < 1.0 {
            let place: Vec3<f64> = std::array::from_fn(|_| rng.around(spread));
            return place.into_iter().chain(x.map(|x| x / n)).collect();
        }
    }
}

pub(super) struct Rows {
    pub gap: f64,
    pub rates: [f64; 3],
    /// The normal row.
    pub row: Vec<f64>,
}

pub(super) fn rows(scene: &mut Scene, q: &[f64], v: &[f64]) -> Rows {
    let [gaps, rates] = scene.rows_at(q, v);
    let unit = |k: usize| -> Vec<f64> { (0..v.len()).map(|j| if j == k { 1.0 } else { 0.0 }).collect() };
    let row = (0..v.len()).map(|k| scene.rows_at(q, &unit(k))[1][0]).collect();
    Rows { gap: gaps[0], rates: [rates[0], rates[1], rates[2]], row }
}

/// Coordinates of two free bodies a time `h` later at constant rates, with quaternions of unit length.
pub(super) fn later(scene: &mut Scene, q: &[f64], v: &[f64], h: f64) -> Vec<f64> {
    let (q, mut qd) = (q.to_vec(), q.to_vec());
    scene.system.system_mut().coordinate_rates(&q, &v.to_vec(), &mut qd);
    let mut q: Vec<f64> = q.iter().zip(&qd).map(|(q, qd)| q + h * qd).collect();
    for k in [3, 10] {
        let n = q[k..k + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
        q[k..k + 4].iter_mut().for_each(|x| *x /= n);
    }
    q
}

/// Rate of the first gap by a difference quotient.
pub(super) fn gap_rate(scene: &mut Scene, q: &[f64], v: &[f64]) -> f64 {
    gap_rate_of(scene, q, v, 0)
}

/// Rate of the residual of a row by a difference quotient.
pub(super) fn gap_rate_of(scene: &mut Scene, q: &[f64], v: &[f64], row: usize) -> f64 {
    let h = 1e-5;
    let [ahead, behind] = [h, -h].map(|h| {
        let q = later(scene, q, v, h);
        scene.rows_at(&q, v)[0][row]
    });
    (ahead - behind) * 0.5 / h
}

/// Velocity of the second of two free bodies against the first at a place of the ground: along a direction, and its size across it.
pub(super) fn slip(q: &[f64], v: &[f64], at: Vec3<f64>, n: Vec3<f64>) -> [f64; 2] {
    let speed = |body: usize| {
        let (k, p) = (6 * body, &q[7 * body..]);
        let [lin, ang] = [k, k + 3].map(|k| turned(p, [v[k], v[k + 1], v[k + 2]]));
        add3(lin, cross(ang, less(at, [p[0], p[1], p[2]])))
    };
    let slip = less(speed(1), speed(0));
    let normal = dot3(slip, n);
    [normal, norm(less(slip, scale3(normal, n)))]
}

/// Middles that are nearer than this are left out: the directions between them have few digits.
const NEAR: f64 = 0.02;

#[test]
fn gaps_are_the_least_distances_and_rows_their_rates() {
    let mut worst = [0.0_f64; 3];
    for (k, solids) in PAIRS.into_iter().enumerate() {
        let mut scene = Scene::new(pair(solids, ["a", "b"]), &[0.0; 14], &[0.0; 12]);
        let mut swapped = Scene::new(pair(solids, ["b", "a"]), &[0.0; 14], &[0.0; 12]);
        let mut rng = Rng::new(k as u64, 11);
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
            let [first, second] = solids.map(|s| s.radius());
            let found = rows(&mut scene, &q, &v);
            // The search finds its least value to the rounding of distances.
            worst[0] = worst[0].max((found.gap - (distance - first - second)).abs());
            assert!((found.gap - (distance - first - second)).abs() < 1e-13, "{solids:?}: {} {distance}", found.gap);
            // Then the second body moves until both touch; a point stays, since on an edge it would have more normals than
            // one. The search finds places to the root of the rounding of distances, over their curvature.
            let n = scale3(1.0 / distance, less(r, p));
            let mut at = less(r, scale3(second, n));
            if !matches!(solids[1], Point) {
                (0..3).for_each(|k| q[7 + k] -= found.gap * n[k]);
                at = less(at, scale3(found.gap, n));
            }
            let found = rows(&mut scene, &q, &v);
            assert!(found.gap.abs() < 1e-8 || matches!(solids[1], Point), "{solids:?}: {:e}", found.gap);
            let fixed = [0, 7].map(|k| back(&q[k..], less(at, [q[k], q[k + 1], q[k + 2]])));
            // Positions move by `h` along the rates, quaternions leave unit length by h²; both errors of the difference
            // quotient are about 1e-9. Places from the search are right to 1e-7. those of the places are larger, at most 1e-7.
            let h = 1e-5;
            let ahead = [h, -h].map(|h| later(&mut scene, &q, &v, h));
            let [a, b] = [0, 7].map(|k| {
                let [x, y] = [0, 1].map(|s| placed(&ahead[s][k..], fixed[k / 7]));
                scale3(0.5 / h, less(x, y))
            });
            let slip = less(b, a);
            let normal = dot3(slip, n);
            let across = norm(add3(slip, scale3(-normal, n)));
            let got = (found.rates[1] * found.rates[1] + found.rates[2] * found.rates[2]).sqrt();
            worst[1] = worst[1].max((found.rates[0] - normal).abs()).max((got - across).abs());
            assert!((found.rates[0] - normal).abs() < 1e-6, "{solids:?}: {} {normal}", found.rates[0]);
            assert!((got - across).abs() < 1e-6, "{solids:?}: {got} {across}");
            let [x, y] = [0, 1].map(|s| rows(&mut scene, &ahead[s], &v).gap);
            let rate = (x - y) * 0.5 / h;
            worst[2] = worst[2].max((rate - found.rates[0]).abs());
            assert!((rate - found.rates[0]).abs() < 1e-6, "{solids:?}: {rate} {:?}", found.rates);
            // The order in which the contact names its bodies changes nothing.
            let other = rows(&mut swapped, &q, &v);
            assert!((other.gap - found.gap).abs() < 1e-15, "{solids:?}");
            assert!(other.row.iter().zip(&found.row).all(|(a, b)| (a - b).abs() < 1e-12), "{solids:?}");
        }
    }
    println!("gaps {:.1e}, rows {:.1e}, rates {:.1e}", worst[0], worst[1], worst[2]);
}

/// An ellipsoid on a plane, both on bodies that move: its gap against a search over its surface, its rows against the
/// motion of the points that touch, whichever of the two the contact names first.
#[test]
fn an_ellipsoid_is_as_high_as_its_lowest_point() {
    let semi_axes = [0.3, 0.2, 0.1];
    let shapes = "[[shape]]\nname = \"plane\"\nbody = \"a\"\ntype = \"plane\"\nnormal = [0, 3, 4]\n\
                  [[shape]]\nname = \"egg\"\nbody = \"b\"\ntype = \"ellipsoid\"\nsemi_axes = [0.3, 0.2, 0.1]\n";
    let [mut scene, mut swapped] = [["plane", "egg"], ["egg", "plane"]].map(|names| {
        let contact = format!("[[contact]]\nname = \"c\"\nbetween = {names:?}\nfriction = 1\n");
        let text = format!("name = \"pair\"\n{}{}{shapes}{contact}", floating("a"), floating("b"));
        Scene::new(model(&text), &[0.0; 14], &[0.0; 12])
    });
    let mut rng = Rng::new(8, 11);
    for _ in 0..40 {
        let q = [random_pose(&mut rng, 0.3), random_pose(&mut rng, 0.3)].concat();
        let v: Vec<f64> = (0..12).map(|_| rng.around(1.0)).collect();
        let n = turned(&q, [0.0, 0.6, 0.8]);
        let height = |x: Vec3<f64>| dot3(n, less(placed(&q[7..], x), [q[0], q[1], q[2]]));
        // The ball of which the ellipsoid is a stretched image, by the rays through its middle.
        let on_egg = |x: &[f64; 3]| {
            let length = norm(*x);
            std::array::from_fn(|k| semi_axes[k] * x[k] / length)
        };
        let (x, lowest) = least([1.0; 3], |x| if norm(*x) == 0.0 { f64::INFINITY } else { height(on_egg(x)) });
        let found = rows(&mut scene, &q, &v);
        assert!((found.gap - lowest).abs() < 1e-13, "{} {lowest}", found.gap);
        // The velocity of the lowest point of the egg against that of the plane's body at the same place. The search finds
        // places to the root of rounding errors.
        let [normal, across] = slip(&q, &v, placed(&q[7..], on_egg(&x)), n);
        let got = (found.rates[1] * found.rates[1] + found.rates[2] * found.rates[2]).sqrt();
        assert!((found.rates[0] - normal).abs() < 1e-6, "{} {normal}", found.rates[0]);
        assert!((got - across).abs() < 1e-6, "{got} {across}");
        // Errors of the quotient: h² and rounding over h, times curvatures of a few.
        let rate = gap_rate(&mut scene, &q, &v);
        assert!((rate - found.rates[0]).abs() < 1e-8, "{rate} {}", found.rates[0]);
        let other = rows(&mut swapped, &q, &v);
        assert!((other.gap - found.gap).abs() < 1e-15 && other.row == found.row);
    }
}

/// Two capsules, exchanged with their bodies.
#[test]
fn capsules_can_be_exchanged() {
    let solids = [Capsule(0.1, 0.5), Capsule(0.05, 0.3)];
    let mut scene = Scene::new(pair(solids, ["a", "b"]), &[0.0; 14], &[0.0; 12]);
    let mut swapped = Scene::new(pair([solids[1], solids[0]], ["a", "b"]), &[0.0; 14], &[0.0; 12]);
    let mut rng = Rng::new(5, 11);
    for _ in 0..200 {
        let [a, b] = [random_pose(&mut rng, 0.3), random_pose(&mut rng, 0.3)];
        let (v, w): (Vec<f64>, Vec<f64>) = ((0..6).map(|_| rng.around(1.0)).collect(), vec![0.3; 6]);
        let found = rows(&mut scene, &[a.clone(), b.clone()].concat(), &[v.clone(), w.clone()].concat());
        let other = rows(&mut swapped, &[b, a].concat(), &[w, v].concat());
        // Rounding grows as lines become parallel and as they come near to each other.
        assert!((found.gap - other.gap).abs() < 1e-13, "{} {}", found.gap, other.gap);
        if found.gap > NEAR - 0.15 {
            assert!((found.rates[0] - other.rates[0]).abs() < 1e-10, "{:?} {:?}", found.rates, other.rates);
        }
    }
}

/// Inside of a box the gap is negative and goes on without a jump; rows are finite everywhere.
#[test]
fn gaps_go_on_inside() {
    for (solids, half) in [([CRATE, Sphere(0.15)], [0.15, 0.2, 0.3]), ([CRATE, Point], [0.15, 0.2, 0.3])] {
        let mut scene = Scene::new(pair(solids, ["a", "b"]), &[0.0; 14], &[0.0; 12]);
        let mut rng = Rng::new(3, 11);
        let v: Vec<f64> = (0..12).map(|k| 0.1 * k as f64).collect();
        let mut at = |x: Vec3<f64>| {
            let mut q = [random_pose(&mut rng, 0.2), random_pose(&mut rng, 0.0)].concat();
            let place = placed(&q, x);
            q[7..10].copy_from_slice(&place);
            rows(&mut scene, &q, &v)
        };
        let radius = solids[1].radius();
        for n in 0..9_usize.pow(3) {
            // Also on faces, edges and corners, and in the middle.
            let x = [0, 1, 2].map(|k| (n / 9_usize.pow(k) % 9) as f64 * 0.25 - 1.0);
            let x: Vec3<f64> = std::array::from_fn(|k| x[k] * half[k]);
            let depth = (0..3).map(|k| half[k] - x[k].abs()).fold(f64::INFINITY, f64::min);
            let found = at(x);
            assert!((found.gap + depth + radius).abs() < 1e-14, "{x:?}: {} {depth}", found.gap);
            assert!(found.rates.iter().chain(&found.row).all(|x| x.is_finite()), "{x:?}");
            // The normal row has a force of 1 N, on either body.
            let force = norm([found.row[0], found.row[1], found.row[2]]);
            assert!((force - 1.0).abs() < 1e-12, "{x:?}: {force}");
        }
    }
}

/// Capsules that lie along each other, that cross in one point, that are the same: nothing is infinite.
#[test]
fn special_places_have_gaps_too() {
    let solids = [Capsule(0.1, 0.5), Capsule(0.05, 0.3)];
    let mut scene = Scene::new(pair(solids, ["a", "b"]), &[0.0; 14], &[0.0; 12]);
    let still = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // Place of the second, its quaternion, distance of the lines.
    let cases: [(Vec3<f64>, [f64; 4], f64); 8] = [
        ([0.3, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], 0.3),
        ([0.3, 0.0, 0.3], [0.0, 1.0, 0.0, 0.0], 0.3),
        ([0.3, 0.0, 0.8], [0.0, 0.0, 0.0, 1.0], 0.5),
        ([0.0, 0.0, 0.6], [0.0, 0.0, 0.0, 1.0], 0.2),
        ([0.0, 0.0, 0.1], [0.0, 0.0, 0.0, 1.0], 0.0),
        ([0.0, 0.0, 0.1], [half, 0.0, 0.0, half], 0.0),
        ([0.2, 0.0, 0.1], [half, 0.0, 0.0, half], 0.2),
        // A turn of 1e-13, below which lines pass for parallel; the gap is off by 1e-13 of a length.
        ([0.3, 0.0, 0.2], [0.5e-13, 0.0, 0.0, 1.0], 0.3),
    ];
    for (place, turn, distance) in cases {
        let q: Vec<f64> = still.into_iter().chain(place).chain(turn).collect();
        let found = rows(&mut scene, &q, &[0.5; 12]);
        assert!((found.gap - (distance - 0.15)).abs() < 1e-13, "{place:?}: {}", found.gap);
        assert!(found.rates.iter().chain(&found.row).all(|x| x.is_finite()), "{place:?}");
    }
    // The middle of the common part takes the force: it lies 0.15 m above the middle of the first capsule.
    let q: Vec<f64> = still.into_iter().chain([0.3, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]).collect();
    let found = rows(&mut scene, &q, &[0.0; 12]);
    // Moments about y of the forces of 1 N along x; velocities are linear, then angular.
    assert!((found.row[4] + 0.15).abs() < 1e-14 && (found.row[10] - (-0.05)).abs() < 1e-14, "{:?}", found.row);
}

//! Mechanisms that pass singular positions, and smooth ones to compare them with.

use crate::scenes::text::{Link, Text};

/// A mechanism and the velocity that is varied.
pub struct Mechanism {
    /// Name in tables.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Text of the model.
    pub text: String,
    /// Index of the velocity that is given; the others follow from the constraints.
    pub driver: usize,
    /// Smallest and largest value of it, rad/s or m/s.
    pub speeds: [f64; 2],
    /// Length of a run, s.
    pub time: f64,
}

const CRANKS: [f64; 2] = [2.0, 20.0];

/// The mechanism without singular positions, with which the others are compared.
pub fn smooth() -> Mechanism {
    let text = include_str!("../../../models/mechanisms/fourbar.toml").to_string();
    Mechanism { name: "fourbar", title: "Crank and rocker.", text, driver: 0, speeds: CRANKS, time: 3.0 }
}

/// All mechanisms that pass singular positions.
pub fn singular() -> Vec<Mechanism> {
    let crank = |name, title, text| Mechanism { name, title, text, driver: 0, speeds: CRANKS, time: 3.0 };
    vec![
        crank("fourbar_equal", "The shipped parallelogram; speeds of its crank from 2 to 20 rad/s.", EQUAL.to_string()),
        crank("unequal_masses", "The same with a rocker of 0.9 kg and a coupler of 0.1 kg.", unequal_masses()),
        crank("skew_axes", "The same with closing frames turned by 0.6 rad: no row vanishes, two become dependent.", skew_axes()),
        crank("two_parallelograms", "Two parallelograms: the rocker of the first is the crank of the second.", parallelograms(2)),
        crank("singular_leg", "The shipped Strandbeest leg with an upper rod at which its first loop has a change point.", singular_leg()),
        Mechanism {
            name: "stewart",
            title: "The shipped Stewart platform, twisted about its vertical axis by 1 to 10 rad/s.",
            text: include_str!("../../../models/mechanisms/stewart.toml").to_string(),
            driver: 5,
            speeds: [1.0, 10.0],
            time: 1.0,
        },
        Mechanism {
            name: "four_rods",
            title: "A plate on four equal rods, twisted by 0.5 to 5 rad/s: where it is not twisted the rods are parallel, and one row is redundant.",
            text: four_rods(),
            driver: 5,
            speeds: [0.5, 5.0],
            time: 2.0,
        },
    ]
}

const EQUAL: &str = include_str!("../../../models/mechanisms/fourbar_equal.toml");

/// The text with the `n`-th occurrence of `old` replaced, counted from zero.
fn replaced(text: &str, old: &str, n: usize, new: &str) -> String {
    let (at, _) = text.match_indices(old).nth(n).expect("the model is built in");
    format!("{}{new}{}", &text[..at], &text[at + old.len()..])
}

/// The parallelogram with a rocker of 0.9 kg and a light coupler.
fn unequal_masses() -> String {
    let heavy = replaced(EQUAL, "mass = 0.314", 1, "mass = 0.9");
    replaced(&heavy, "mass = 0.628", 0, "mass = 0.1")
}

/// The parallelogram with closing frames that are rotated about the pins, so that both rows stay far from zero and
/// become dependent.
fn skew_axes() -> String {
    let first = replaced(EQUAL, "xyz = [0.4, 0, 0]\n\n", 0, "xyz = [0.4, 0, 0]\nrpy = [0, 0.6, 0]\n\n");
    replaced(&first, "xyz = [0.2, 0, 0]\n\n[[loop]]", 0, "xyz = [0.2, 0, 0]\nrpy = [0, 0.6, 0]\n\n[[loop]]")
}

/// A uniform bar of a parallelogram, along x.
fn bar<'a>(name: &'a str, parent: Option<&'a str>, place: [f64; 3], length: f64, mass: f64) -> Link<'a> {
    let across = mass * length * length / 12.0;
    let (com, inertia) = ([length / 2.0, 0.0, 0.0], [1e-5, across, across]);
    Link { name, parent, mass, com, inertia, place, axis: [0.0, -1.0, 0.0], damping: 0.0 }
}

/// `n` parallelograms side by side: the rocker of each is the crank of the next.
fn parallelograms(n: usize) -> String {
    let mut text = Text::new("parallelograms", "Parallelograms side by side.", [0.0, 0.0, -9.81]);
    let angle = 35.0_f64.to_radians();
    text.link(&bar("crank", None, [0.0; 3], 0.2, 0.314));
    text.start(angle, true);
    for k in 1..=n {
        let (coupler, rocker) = (format!("coupler{k}"), format!("rocker{k}"));
        let before = if k == 1 { "crank".to_string() } else { format!("rocker{}", k - 1) };
        text.link(&bar(&coupler, Some(&before), [0.2, 0.0, 0.0], 0.4, 0.628));
        text.start(-angle, false);
        text.link(&bar(&rocker, None, [0.4 * k as f64, 0.0, 0.0], 0.2, 0.314));
        text.start(angle, false);
    }
    for k in 1..=n {
        let (coupler, rocker) = (format!("coupler{k}"), format!("rocker{k}"));
        text.close(&format!("pin{k}"), "revolute", [(&coupler, [0.4, 0.0, 0.0]), (&rocker, [0.2, 0.0, 0.0])]);
        text.along([0.0, -1.0, 0.0]);
    }
    text.finish()
}

/// The Strandbeest leg whose upper rod is as long as shoulder, distance of the fixed pins, less the crank: the upper
/// loop has a change point where all four lie in one line.
fn singular_leg() -> String {
    let leg = include_str!("../../../models/mechanisms/strandbeest_leg.toml");
    let length = 0.415 + 0.38_f64.hypot(0.078) - 0.15;
    replaced(leg, "xyz = [0.5, 0, 0]", 0, &format!("xyz = [{length:?}, 0, 0]"))
}

/// A plate on four equal rods, which are parallel when it is not twisted: the rods then allow one motion more.
fn four_rods() -> String {
    let mut text = String::from(
        "name = \"four_rods\"\ngravity = [0, 0, -9.81]\n\n[[body]]\nname = \"plate\"\nmass = 2\ninertia = [0.03, 0.05, 0.07]\n\n\
         [[joint]]\nname = \"motion\"\ntype = \"floating\"\nchild = \"plate\"\nstart = [0, 0, 0, 0, 0, 0.15, 0.98868]\nheld = false\n",
    );
    for (k, [x, y]) in [[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]].into_iter().enumerate() {
        text += &format!(
            "\n[[frame]]\nname = \"top{k}\"\nbody = \"ground\"\nxyz = [{x:?}, {y:?}, 0.8]\n\
             \n[[frame]]\nname = \"corner{k}\"\nbody = \"plate\"\nxyz = [{x:?}, {y:?}, 0]\n\
             \n[[loop]]\nname = \"rod{k}\"\ntype = \"distance\"\nlength = 0.8\nbetween = [\"top{k}\", \"corner{k}\"]\n"
        );
    }
    text
}

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
        crank("redundant_crank", "A parallelogram with a third crank: one row follows from the others everywhere, and near the change point two more do nearly.", redundant_crank()),
        crank("singular_leg", "A Strandbeest leg whose lower loop has a change point: lower rod 0.631 m, link and foot 0.45 m, the pin of the link turned back by 20°.", singular_leg()),
        Mechanism {
            name: "stewart",
            title: "The shipped Stewart platform without springs and gravity, twisted by 2 to 10 rad/s through the pose at 90°, in which locked legs would not hold it.",
            text: free_stewart(),
            driver: 5,
            speeds: [2.0, 10.0],
            time: 1.0,
        },
        Mechanism {
            name: "four_rods",
            title: "A plate on four equal rods at the corners of a rectangle, twisted by 0.5 to 5 rad/s: one of the four rows follows from the others.",
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

/// A parallelogram whose coupler a third crank carries as well.
fn redundant_crank() -> String {
    let mut text = Text::new("redundant_crank", "A coupler on three equal cranks.", [0.0, 0.0, -9.81]);
    let angle = 35.0_f64.to_radians();
    text.link(&bar("crank", None, [0.0; 3], 0.2, 0.314));
    text.start(angle, true);
    text.link(&bar("coupler", Some("crank"), [0.2, 0.0, 0.0], 0.4, 0.628));
    text.start(-angle, false);
    let others = [("outer", 0.4), ("inner", 0.15)];
    for (name, at) in others {
        text.link(&bar(name, None, [at, 0.0, 0.0], 0.2, 0.314));
        text.start(angle, false);
    }
    for (name, at) in others {
        text.close(&format!("{name}_pin"), "revolute", [("coupler", [at, 0.0, 0.0]), (name, [0.2, 0.0, 0.0])]);
        text.along([0.0, -1.0, 0.0]);
    }
    text.finish()
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

/// The Strandbeest leg whose lower rod is as long as rocker and distance of the fixed pins, less the crank: the lower
/// loop has a change point where all four lie in one line. With the shipped lengths, the other loops keep the crank from
/// getting there.
fn singular_leg() -> String {
    let leg = include_str!("../../../models/mechanisms/strandbeest_leg.toml");
    let lower = 0.393 + 0.38_f64.hypot(0.078) - 0.15;
    let (sin, cos) = (-20.0_f64).to_radians().sin_cos();
    let [x, z] = [0.0260988 * cos - 0.40015 * sin, 0.0260988 * sin + 0.40015 * cos];
    let changes = [
        ("xyz = [0.619, 0, 0]", format!("xyz = [{lower:?}, 0, 0]")),
        ("xyz = [0.394, 0, 0]", "xyz = [0.45, 0, 0]".to_string()),
        ("xyz = [0.367, 0, 0]", "xyz = [0.45, 0, 0]".to_string()),
        ("xyz = [0.0260988, 0, 0.40015]", format!("xyz = [{x:?}, 0, {z:?}]")),
    ];
    changes.iter().fold(leg.to_string(), |text, (old, new)| replaced(&text, old, 0, new))
}

/// The Stewart platform without what turns it back before its singular pose.
fn free_stewart() -> String {
    let platform = include_str!("../../../models/mechanisms/stewart.toml");
    let kept = platform.lines().filter(|line| !line.starts_with("stiffness") && !line.starts_with("rest"));
    let text: Vec<&str> = kept.collect();
    replaced(&text.join("\n"), "gravity = [0, 0, -9.81]", 0, "gravity = [0, 0, 0]")
}

/// A plate on four equal rods at the corners of a rectangle. It stays level, and the lengths of three rods give that of
/// the fourth.
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

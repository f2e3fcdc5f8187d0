//! Model files of chains and trees with any number of links.

use std::fmt::Write;

/// A model file under construction.
pub(crate) struct Text(String);

/// A body and the revolute joint that carries it.
pub(crate) struct Link<'a> {
    /// Names of the body and of its parent, `None` for the ground.
    pub name: &'a str,
    pub parent: Option<&'a str>,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub com: [f64; 3],
    /// Moments of inertia about the centre of mass, kg m².
    pub inertia: [f64; 3],
    /// Position of the joint on the parent, m.
    pub place: [f64; 3],
    pub axis: [f64; 3],
    /// Damping, N m s/rad.
    pub damping: f64,
}

impl Text {
    /// Starts a file; `gravity` in m/s².
    pub fn new(name: &str, comment: &str, gravity: [f64; 3]) -> Text {
        Text(format!("# {comment}\nname = \"{name}\"\ngravity = {gravity:?}\n"))
    }

    /// Adds a link; its joint is named `pin_` followed by the name of the body.
    pub fn link(&mut self, link: &Link<'_>) {
        let Link { name, mass, com, inertia, place, axis, .. } = link;
        // Writing to a string cannot fail.
        let _ =
            write!(self.0, "\n[[body]]\nname = \"{name}\"\nmass = {mass:?}\ncom = {com:?}\ninertia = {inertia:?}\n");
        let _ = write!(
            self.0,
            "\n[[joint]]\nname = \"pin_{name}\"\ntype = \"revolute\"\nchild = \"{name}\"\nxyz = {place:?}\n"
        );
        let _ = writeln!(self.0, "axis = {axis:?}");
        if let Some(parent) = link.parent {
            let _ = writeln!(self.0, "parent = \"{parent}\"");
        }
        if link.damping != 0.0 {
            let _ = writeln!(self.0, "damping = {:?}", link.damping);
        }
    }

    /// Sets the initial coordinate of the last joint.
    pub fn start(&mut self, q: f64, held: bool) {
        let _ = writeln!(self.0, "start = {q:?}\nheld = {held}");
    }

    /// Adds a loop between a point of a body and a point of another body or of the ground, m.
    pub fn close(&mut self, name: &str, kind: &str, ends: [(&str, [f64; 3]); 2]) {
        for (end, (body, place)) in ["a", "b"].iter().zip(ends) {
            let _ = write!(self.0, "\n[[frame]]\nname = \"{name}_{end}\"\nbody = \"{body}\"\nxyz = {place:?}\n");
        }
        let _ = write!(
            self.0,
            "\n[[loop]]\nname = \"{name}\"\ntype = \"{kind}\"\nbetween = [\"{name}_a\", \"{name}_b\"]\n"
        );
    }

    /// Sets the axis of the last loop, in both frames.
    pub fn along(&mut self, axis: [f64; 3]) {
        let _ = writeln!(self.0, "axis = {axis:?}");
    }

    /// The text of the file.
    pub fn finish(self) -> String {
        self.0
    }
}

/// Mass of a link of thesis 7.2, kg: uniform and slender, with `m l²/3` about its joint.
pub(super) const MASS: f64 = 0.01;
/// Length of a link, m.
pub const LENGTH: f64 = 0.05;
/// Viscous friction of every joint in thesis 7.2, N m s/rad.
pub(super) const FRICTION: f64 = 0.001;
/// Gravity in the plane x-y, m/s².
pub(super) const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// A link of the thesis behind another one, on a revolute joint about z.
pub(super) fn thesis_link<'a>(name: &'a str, parent: Option<&'a str>) -> Link<'a> {
    let across = MASS * LENGTH * LENGTH / 12.0;
    Link {
        name,
        parent,
        mass: MASS,
        com: [LENGTH / 2.0, 0.0, 0.0],
        inertia: [0.0, across, across],
        place: [if parent.is_some() { LENGTH } else { 0.0 }, 0.0, 0.0],
        axis: [0.0, 0.0, 1.0],
        damping: FRICTION,
    }
}

/// Open planar chain of thesis 7.2, straight along x at zero angles, with joints about z.
pub(super) fn chain(name: &str, n: usize, damping: f64) -> String {
    let comment = format!("Open planar chain of {n} equal links (thesis 7.2), along x at zero angles.");
    let mut text = Text::new(name, &comment, GRAVITY);
    let mut parent: Option<String> = None;
    for k in 1..=n {
        let link = format!("link{k}");
        text.link(&Link { damping, ..thesis_link(&link, parent.as_deref()) });
        parent = Some(link);
    }
    text.finish()
}

/// Tree of thesis 7.2: branches of ten links that fork in two, `levels` times ten links deep; links are numbered level
/// by level, and in a level branch by branch. Straight along x at zero angles.
pub(super) fn tree(name: &str, levels: u32, damping: f64) -> String {
    let comment = format!("Planar tree (thesis 7.2): branches of ten links that fork in two, {levels} levels.");
    forking(name, &comment, levels, damping, |_| 10)
}

/// A tree whose branch `k` has `links(k)` links; branches are numbered in the order of the links.
pub(super) fn forking(name: &str, comment: &str, levels: u32, damping: f64, links: impl Fn(usize) -> usize) -> String {
    let mut text = Text::new(name, comment, GRAVITY);
    let mut tips: Vec<Option<String>> = vec![None];
    let (mut number, mut count) = (0, 0);
    for level in 0..levels {
        let mut next = Vec::new();
        for branch in 0..1_usize << level {
            let mut parent = tips[branch / 2].clone();
            for k in 0..links(count) {
                number += 1;
                // The first link of a branch determines the side of the fork.
                let side = match (level, k, branch % 2) {
                    (0, ..) | (_, 1.., _) => "",
                    (_, _, 0) => "left",
                    _ => "right",
                };
                let link = format!("link{number}{side}");
                text.link(&Link { damping, ..thesis_link(&link, parent.as_deref()) });
                parent = Some(link);
            }
            count += 1;
            next.push(parent);
        }
        tips = next;
    }
    text.finish()
}

/// Six slender links of 0.3 m in space, hanging at zero angles, with joints about y and x in turn; the first weighs
/// `mass` kg, each further one `ratio` times the one before.
pub(super) fn tapered(name: &str, mass: f64, ratio: f64) -> String {
    let comment = format!("Six links in space, each of {ratio:?} times the mass of the one before, no friction.");
    let mut text = Text::new(name, &comment, [0.0, 0.0, -9.81]);
    let (mut parent, mut mass): (Option<String>, f64) = (None, mass);
    for k in 0..6 {
        let link = format!("link{}", k + 1);
        let across = mass * 0.3 * 0.3 / 12.0;
        text.link(&Link {
            name: &link,
            parent: parent.as_deref(),
            mass,
            com: [0.0, 0.0, -0.15],
            // The inertia about the link is m r²/2 with a radius of 1 cm.
            inertia: [across, across, mass * 5e-5],
            place: [0.0, 0.0, if k == 0 { 0.0 } else { -0.3 }],
            axis: if k % 2 == 0 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] },
            damping: 0.0,
        });
        parent = Some(link);
        mass *= ratio;
    }
    text.finish()
}

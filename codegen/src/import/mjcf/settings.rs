//! `compiler` and `option`: how the numbers of a file are meant, and what acts.

use super::element::{choice, flag, number, numbers, vec3, Element};
use super::pose::sequence;
use crate::diag::Severity;
use crate::import::source::Spanned;
use crate::import::words::list;
use crate::import::xml::{place, Reader};
use roxmltree::Node;

/// What `flag` of `option` turns on and off.
const FLAGS: &[&str] = &[
    "constraint",
    "equality",
    "frictionloss",
    "limit",
    "contact",
    "passive",
    "spring",
    "damper",
    "gravity",
    "clampctrl",
    "warmstart",
    "filterparent",
    "actuation",
    "refsafe",
    "sensor",
    "midphase",
    "nativeccd",
    "eulerdamp",
    "autoreset",
    "island",
    "override",
    "energy",
    "fwdinv",
    "invdiscrete",
    "multiccd",
    "sleep",
];

/// Where the inertia of a body comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FromGeoms {
    /// From `inertial` alone.
    Never,
    /// From the geoms, whatever `inertial` says.
    Always,
    /// From the geoms where there is no `inertial`.
    Missing,
}

/// The settings of `compiler`.
#[derive(Clone, Debug)]
pub(super) struct Compiler {
    degree: bool,
    /// Axes of Euler angles, small letters for axes that turn along.
    pub eulerseq: [u8; 3],
    /// Whether a range without `limited` is a limit.
    pub autolimits: bool,
    /// Source of inertias.
    pub from_geoms: FromGeoms,
    /// Groups of geoms, first and last, whose mass counts.
    pub groups: [f64; 2],
    /// Mass of all bodies together, kg.
    pub total_mass: Option<f64>,
    /// Least mass of a body, kg.
    pub least_mass: f64,
    /// Least principal moment of a body, kg m².
    pub least_moment: f64,
    /// Whether moments that no body has are replaced by their mean.
    pub balance: bool,
    /// Whether free bodies get their principal axes as frame.
    pub align_free: bool,
}

impl Default for Compiler {
    fn default() -> Self {
        Compiler {
            degree: true,
            eulerseq: *b"xyz",
            autolimits: true,
            from_geoms: FromGeoms::Missing,
            groups: [0.0, 5.0],
            total_mass: None,
            least_mass: 0.0,
            least_moment: 0.0,
            balance: false,
            align_free: false,
        }
    }
}

impl Compiler {
    /// An angle of the file in rad.
    pub fn angle(&self, x: f64) -> f64 {
        if self.degree {
            x / 180.0 * std::f64::consts::PI
        } else {
            x
        }
    }

    /// Takes over what a `compiler` element states.
    pub fn read(&mut self, reader: &mut Reader, node: Node) {
        let (element, whose) = (Element::plain(node), "compiler: ");
        reader.attributes(node, COMPILER);
        if let Some(word) = choice(reader, &element, "coordinate", &["local", "global"], whose) {
            if word.value == "global" {
                let help = "load and save the file with MuJoCo 2.3.3 or older, which writes local coordinates";
                reader.findings.error(word.span, "global coordinates are not read", help);
            }
        }
        if let Some(word) = choice(reader, &element, "angle", &["radian", "degree"], whose) {
            self.degree = word.value == "degree";
        }
        if let Some(letters) = sequence(reader, &element) {
            self.eulerseq = letters;
        }
        if let Some(word) = choice(reader, &element, "inertiafromgeom", &["false", "true", "auto"], whose) {
            self.from_geoms = match word.value {
                "false" => FromGeoms::Never,
                "true" => FromGeoms::Always,
                _ => FromGeoms::Missing,
            };
        }
        if let Some(groups) = numbers(reader, &element, "inertiagrouprange", 2..=2, whose) {
            self.groups = [groups.value[0], groups.value[1]];
        }
        if let Some(total) = number(reader, &element, "settotalmass", whose) {
            self.total_mass = (total.value > 0.0).then_some(total.value);
        }
        for (key, slot) in [("boundmass", &mut self.least_mass), ("boundinertia", &mut self.least_moment)] {
            if let Some(least) = number(reader, &element, key, whose) {
                *slot = least.value.max(0.0);
            }
        }
        for (key, slot) in [
            ("autolimits", &mut self.autolimits),
            ("balanceinertia", &mut self.balance),
            ("alignfree", &mut self.align_free),
        ] {
            if let Some(flag) = flag(reader, &element, key, whose) {
                *slot = flag;
            }
        }
    }
}

/// Attributes of `compiler`. Those that are not read change nothing about the motion of what is read.
const COMPILER: &[&str] = &[
    "autolimits",
    "boundmass",
    "boundinertia",
    "settotalmass",
    "balanceinertia",
    "strippath",
    "coordinate",
    "angle",
    "fitaabb",
    "eulerseq",
    "meshdir",
    "texturedir",
    "assetdir",
    "discardvisual",
    "usethread",
    "fusestatic",
    "inertiafromgeom",
    "inertiagrouprange",
    "saveinertial",
    "alignfree",
    "exactmeshinertia",
    "convexhull",
    "conflict",
];

/// What `option` says about the motion.
#[derive(Clone, Debug, Default)]
pub(super) struct Options {
    /// Gravity, m/s².
    pub gravity: Option<Spanned<[f64; 3]>>,
    /// Flags that are switched off.
    off: Vec<String>,
}

impl Options {
    /// Whether a flag is on, as all are at first.
    pub fn on(&self, flag: &str) -> bool {
        !self.off.iter().any(|off| off == flag)
    }

    /// Takes over what an `option` element states.
    pub fn read(&mut self, reader: &mut Reader, node: Node) {
        let (element, whose) = (Element::plain(node), "option: ");
        reader.attributes(node, OPTION);
        if let Some(gravity) = vec3(reader, &element, "gravity", whose) {
            self.gravity = Some(gravity);
        }
        for key in ["density", "viscosity"] {
            if let Some(x) = number(reader, &element, key, whose).filter(|x| x.value != 0.0) {
                let message = "forces of a fluid (`density`, `viscosity`) are not modelled";
                let help = "add them as wrenches of your own, or set both to 0";
                reader.tally.add(Severity::Warning, "fluid", x.span, message, help);
            }
        }
        for flags in reader.children(node, &["flag"], &[]) {
            reader.attributes(flags, FLAGS);
            for a in flags.attributes() {
                self.off.retain(|off| off != a.name());
                match a.value() {
                    "disable" => self.off.push(a.name().to_string()),
                    "enable" => {}
                    _ => {
                        let message = format!("flag `{}` is neither `enable` nor `disable`", a.name());
                        reader.findings.error(a.range_value().into(), message, "write one of the two");
                    }
                }
            }
        }
        if !self.on("passive") {
            self.off.extend(["spring", "damper"].map(String::from));
        }
        if !self.on("constraint") {
            self.off.extend(["equality", "limit"].map(String::from));
        }
        let stated = |key: &&str| !ACTING.contains(key) && node.attribute(*key).is_some();
        let unused: Vec<&str> = OPTION.iter().copied().filter(stated).collect();
        if !unused.is_empty() {
            let are = if unused.len() == 1 { "is" } else { "are" };
            reader.tally.notice(place(node), &format!("{} of `option` {are} not used", list(unused)));
        }
    }
}

/// Attributes of `option` that are read.
const ACTING: [&str; 3] = ["gravity", "density", "viscosity"];

/// Attributes of `option`; those of MuJoCo's integrators and solvers, and all others that are not [`ACTING`], are not used.
const OPTION: &[&str] = &[
    "timestep",
    "impratio",
    "tolerance",
    "ls_tolerance",
    "noslip_tolerance",
    "mpr_tolerance",
    "ccd_tolerance",
    "sleep_tolerance",
    "gravity",
    "wind",
    "magnetic",
    "density",
    "viscosity",
    "o_margin",
    "o_solref",
    "o_solimp",
    "o_friction",
    "integrator",
    "collision",
    "cone",
    "jacobian",
    "solver",
    "iterations",
    "ls_iterations",
    "noslip_iterations",
    "mpr_iterations",
    "ccd_iterations",
    "sdf_iterations",
    "sdf_initpoints",
    "actuatorgroupdisable",
    "apirate",
];

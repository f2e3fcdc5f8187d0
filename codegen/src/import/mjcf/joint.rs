//! `joint` and `freejoint`: how a body moves, one joint after the other.

use super::element::{choice, limited, number, numbers, vec3, Element};
use super::pose::{about, normalised, rotate, Pose};
use super::settings::{Compiler, Options};
use super::tree::Part;
use crate::diag::Severity;
use crate::import::raw::{RawFreedoms, RawJoint, RawLimits, RawNumber};
use crate::import::source::{Span, Spanned};
use crate::import::xml::{place, Reader};
use crate::model::{JointSpec, FLOATING, PRISMATIC, REVOLUTE, SPHERICAL};
use roxmltree::Node;

/// The types of joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Hinge,
    Slide,
    Ball,
    Free,
}

impl Kind {
    /// Its word in MJCF.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Hinge => "hinge",
            Kind::Slide => "slide",
            Kind::Ball => "ball",
            Kind::Free => "free",
        }
    }

    /// The kind of joint that it is here.
    pub fn spec(self) -> &'static JointSpec {
        match self {
            Kind::Hinge => &REVOLUTE,
            Kind::Slide => &PRISMATIC,
            Kind::Ball => &SPHERICAL,
            Kind::Free => &FLOATING,
        }
    }

    /// Whether it has one coordinate.
    pub fn is_scalar(self) -> bool {
        matches!(self, Kind::Hinge | Kind::Slide)
    }
}

/// A joint in its body.
pub(super) struct Joint {
    /// Type.
    pub kind: Kind,
    /// Anchor in the body, m; of no meaning for a slide.
    pub anchor: [f64; 3],
    /// Axis in the body.
    pub axis: Spanned<[f64; 3]>,
    /// Coordinate of the body as the file places it, rad or m.
    pub reference: f64,
    damping: f64,
    stiffness: f64,
    /// Coordinate at which the spring is relaxed, rad or m.
    pub rest: f64,
    armature: f64,
    range: Option<Spanned<[f64; 2]>>,
    max_effort: Option<f64>,
    span: Span,
}

const ATTRIBUTES: &[&str] = &[
    "name",
    "class",
    "type",
    "group",
    "pos",
    "axis",
    "springdamper",
    "limited",
    "actuatorfrclimited",
    "solreflimit",
    "solimplimit",
    "solreffriction",
    "solimpfriction",
    "stiffness",
    "range",
    "actuatorfrcrange",
    "actuatorgravcomp",
    "margin",
    "ref",
    "springref",
    "armature",
    "damping",
    "frictionloss",
    "user",
    "align",
];

/// What holds for all joints of a file.
#[derive(Clone, Copy)]
pub(super) struct Rules<'r> {
    /// How numbers are meant.
    pub compiler: &'r Compiler,
    /// What acts.
    pub options: &'r Options,
    /// Whether ranges are stops.
    pub stops: bool,
}

/// Reads a joint; `None` where its type was reported.
pub(super) fn read(reader: &mut Reader, part: &Part, rules: Rules, whose: &str) -> Option<Joint> {
    let element = &part.element;
    let free = element.node.tag_name().name() == "freejoint";
    reader.leaf(element.node, if free { &["name", "group", "align"] } else { ATTRIBUTES });
    let kind = match element.attribute("type").filter(|_| !free) {
        _ if free => Kind::Free,
        None => Kind::Hinge,
        Some(_) => match choice(reader, element, "type", &["free", "ball", "slide", "hinge"], whose)?.value {
            "free" => Kind::Free,
            "ball" => Kind::Ball,
            "slide" => Kind::Slide,
            _ => Kind::Hinge,
        },
    };
    let (compiler, options) = (rules.compiler, rules.options);
    let anchor = vec3(reader, element, "pos", whose).map_or([0.0; 3], |p| p.value);
    let axis = vec3(reader, element, "axis", whose).unwrap_or(Spanned::new([0.0, 0.0, 1.0], place(element.node)));
    let axis = Spanned::new(rotate(part.frame.quat, normalised(axis.value).unwrap_or([0.0; 3])), axis.span);
    let angle = |x: f64| if kind == Kind::Hinge { compiler.angle(x) } else { x };
    let coordinate = |reader: &mut Reader, key| number(reader, element, key, whose).map_or(0.0, |x| angle(x.value));
    align(reader, element, kind, compiler, whose);
    let mut joint = Joint {
        kind,
        anchor: part.frame.point(anchor),
        axis,
        reference: if kind.is_scalar() { coordinate(reader, "ref") } else { 0.0 },
        damping: if options.on("damper") { coefficient(reader, element, "damping", whose) } else { 0.0 },
        stiffness: if options.on("spring") { coefficient(reader, element, "stiffness", whose) } else { 0.0 },
        rest: coordinate(reader, "springref"),
        armature: number(reader, element, "armature", whose).map_or(0.0, |x| x.value),
        range: None,
        max_effort: None,
        span: place(element.node),
    };
    spring(reader, element, &mut joint, whose);
    if options.on("frictionloss") {
        friction(reader, element, whose);
    }
    joint.range = range(reader, element, kind, rules, whose);
    if limited(reader, element, ("actuatorfrclimited", "actuatorfrcrange"), compiler.autolimits, whose)
        && kind.is_scalar()
    {
        let range = numbers(reader, element, "actuatorfrcrange", 2..=2, whose);
        joint.max_effort = range.map(|r| r.value[0].abs().max(r.value[1].abs())).filter(|x| *x > 0.0);
    }
    Some(joint)
}

/// A free joint whose frame MuJoCo moves to the principal axes.
fn align(reader: &mut Reader, element: &Element, kind: Kind, compiler: &Compiler, whose: &str) {
    let stated = choice(reader, element, "align", &["false", "true", "auto"], whose);
    let aligned = match &stated {
        Some(word) if word.value != "auto" => word.value == "true",
        _ => compiler.align_free,
    };
    // A body that carries others keeps its frame.
    let carries = |node: Node| node.descendants().skip(1).any(|n| n.has_tag_name("body"));
    if kind == Kind::Free && aligned && !element.node.parent_element().is_some_and(carries) {
        let message = format!("{whose}a free joint that is aligned with the principal axes is not read");
        let help = "write `align=\"false\"`: the motion is the same, with the coordinates of the body's own frame";
        reader.findings.error(stated.map_or(place(element.node), |word| word.span), message, help);
    }
}

/// A coefficient of a passive element; those of higher powers have to be zero.
fn coefficient(reader: &mut Reader, element: &Element, key: &str, whose: &str) -> f64 {
    let Some(all) = numbers(reader, element, key, 1..=3, whose) else { return 0.0 };
    if all.value[1..].iter().any(|x| *x != 0.0) {
        let message = format!("{whose}a `{key}` that is not linear is not modelled");
        reader.findings.error(all.span, message, "write one number, or add its effort as one of your own");
    }
    all.value[0]
}

fn spring(reader: &mut Reader, element: &Element, joint: &mut Joint, whose: &str) {
    if let Some(pair) = numbers(reader, element, "springdamper", 2..=2, whose).filter(|p| p.value != [0.0, 0.0]) {
        let message = format!("{whose}`springdamper` is not read");
        let help = "write `stiffness` and `damping`, which MuJoCo computes from it when it loads and saves the file";
        reader.findings.error(pair.span, message, help);
    }
    if joint.stiffness != 0.0 && !joint.kind.is_scalar() {
        let at = element.attribute("stiffness").map_or(joint.span, |text| text.span);
        let message = format!("{whose}a spring of a {} joint is not modelled", joint.kind.word());
        reader.findings.error(at, message, "set `stiffness` to 0, and add its effort as one of your own");
        joint.stiffness = 0.0;
    }
}

fn friction(reader: &mut Reader, element: &Element, whose: &str) {
    if let Some(loss) = number(reader, element, "frictionloss", whose).filter(|x| x.value != 0.0) {
        let message = "dry friction (`frictionloss`) is not modelled";
        let help = "add it as a joint torque of your own, or set it to 0";
        reader.tally.add(Severity::Warning, "frictionloss", loss.span, message, help);
    }
}

/// The range of a limited joint, rad or m.
fn range(reader: &mut Reader, element: &Element, kind: Kind, rules: Rules, whose: &str) -> Option<Spanned<[f64; 2]>> {
    if kind == Kind::Free || !limited(reader, element, ("limited", "range"), rules.compiler.autolimits, whose) {
        return None;
    }
    let given = numbers(reader, element, "range", 2..=2, whose)?;
    if kind == Kind::Ball {
        reader.tally.notice(given.span, "the `range` of a ball joint is not used");
        return None;
    }
    let angle = |x: f64| if kind == Kind::Hinge { rules.compiler.angle(x) } else { x };
    let [lower, upper] = [angle(given.value[0]), angle(given.value[1])];
    if lower >= upper {
        let message = format!("{whose}`range` from {} to {} is empty", given.value[0], given.value[1]);
        reader.findings.error(given.span, message, "write the lower end first, or `limited=\"false\"`");
        return None;
    }
    if !rules.stops {
        reader.tally.notice(given.span, IDLE);
    }
    Some(Spanned::new([lower, upper], given.span))
}

/// What is said of ranges that are not asked for.
const IDLE: &str =
    "`range` makes no stops (`--limits` of `mbd simulate` asks for them); it bounds motion under control";

impl Joint {
    /// The frame in which the joint's own motion begins, in the body frame that the file states.
    pub fn before(&self, anchor: [f64; 3]) -> Pose {
        let back = match self.kind {
            Kind::Hinge if self.reference != 0.0 => {
                Pose { xyz: [0.0; 3], quat: about(self.axis.value, -self.reference) }
            }
            Kind::Slide => Pose::translation(self.axis.value.map(|x| -self.reference * x)),
            _ => Pose::IDENTITY,
        };
        Pose::translation(anchor).then(&back)
    }

    /// The coordinates of a body that stands in the world as `pose` says; none where all are neutral.
    fn start(&self, pose: &Pose) -> Vec<f64> {
        let ([x, y, z], [w, a, b, c]) = (pose.xyz, pose.quat);
        match self.kind {
            Kind::Free if *pose != Pose::IDENTITY => vec![x, y, z, a, b, c, w],
            Kind::Hinge | Kind::Slide if self.reference != 0.0 => vec![self.reference],
            _ => Vec::new(),
        }
    }

    /// How many joints it becomes.
    pub fn parts(&self) -> usize {
        if self.kind == Kind::Free && self.armature != 0.0 {
            4
        } else {
            1
        }
    }

    /// The joints that it becomes, with what their names end in and their first coordinates; `pose` is that of the body
    /// in the file. MuJoCo's rotors of a free joint resist its velocity in the axes of the world, which those of a
    /// floating joint do not: with rotors it is three slides and a ball, whose coordinates and velocities are the same.
    pub fn elements(self, pose: &Pose) -> Vec<(&'static str, Joint, Vec<f64>)> {
        let start = self.start(pose);
        if self.parts() == 1 {
            return vec![("", self, start)];
        }
        let axes = [("_x", [1.0, 0.0, 0.0]), ("_y", [0.0, 1.0, 0.0]), ("_z", [0.0, 0.0, 1.0])];
        let slides = axes.into_iter().enumerate().map(|(k, (end, axis))| {
            let axis = Spanned::new(axis, self.span);
            let start = start.get(k).map(|x| vec![*x]).unwrap_or_default();
            (end, Joint { kind: Kind::Slide, axis, range: None, ..self }, start)
        });
        let turned = start.get(3..).map(<[f64]>::to_vec).unwrap_or_default();
        let mut all: Vec<_> = slides.collect();
        all.push(("", Joint { kind: Kind::Ball, axis: self.axis.clone(), range: None, ..self }, turned));
        all
    }

    /// The joint with everything but its ends and its placement.
    pub fn raw(&self, name: Spanned<String>, child: Spanned<String>, start: &[f64], rules: Rules) -> RawJoint {
        let number = |x: f64| RawNumber::constant(x, self.span);
        let some = |x: f64| (x != 0.0).then(|| RawFreedoms::All(number(x)));
        let mut joint = RawJoint::new(name, Some(Spanned::new(self.kind.spec(), self.span)), Some(child));
        joint.axis = self.kind.is_scalar().then(|| self.axis.clone());
        joint.damping = some(self.damping);
        joint.stiffness = some(self.stiffness);
        joint.rest = if self.stiffness != 0.0 { some(self.rest) } else { None };
        joint.armature = some(self.armature);
        joint.max_effort = self.max_effort.map(number);
        if let Some(Spanned { value: [lower, upper], span }) = self.range {
            let ends = |x: f64| Some(RawNumber::constant(x, span));
            let limits = RawLimits { span, lower: ends(lower), upper: ends(upper) };
            joint.limits = (rules.stops && rules.options.on("limit")).then(|| limits.clone());
            joint.range = Some(limits);
        }
        let start: Vec<RawNumber> = start.iter().map(|x| number(*x)).collect();
        joint.start = (!start.is_empty()).then(|| RawFreedoms::Each(Spanned::new(start, self.span)));
        joint
    }
}

//! Joints, and the one table of their kinds: readers, checks, plan, emission and documents take what they need from it.
//!
//! A new kind is a variant of [`JointKind`] with its [`JointSpec`] in this file. Unless it splits into elementary
//! joints that exist, it also needs its sweep ([`mbd_runtime::tree::Kind`]).

use mbd_runtime::layout::Form;
use mbd_runtime::system::LieGroup;
use mbd_runtime::tree::Kind;

use super::{Origin, Placement, Unit, Value, Words};

/// Kinds of joints by the motion that they allow. Axes are in the child frame, of any length but zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// One rotation.
    Revolute {
        /// Axis of rotation.
        axis: [f64; 3],
    },
    /// One translation.
    Prismatic {
        /// Direction of the translation.
        axis: [f64; 3],
    },
    /// A translation along and a rotation about the same axis, independent; coordinates in that order.
    Cylindrical {
        /// The axis.
        axis: [f64; 3],
    },
    /// A rotation with a proportional translation.
    Helical {
        /// The axis.
        axis: [f64; 3],
        /// Metres per radian.
        pitch: Value,
    },
    /// A rotation about `axes[0]`, then about `axes[1]`, which the first rotation carries.
    Universal {
        /// Both axes at zero coordinates.
        axes: [[f64; 3]; 2],
    },
    /// Two translations across a normal and a rotation about it.
    Planar {
        /// Normal of the plane.
        normal: [f64; 3],
    },
    /// Any rotation.
    Spherical,
    /// Any motion.
    Floating,
    /// No motion.
    Fixed,
}

/// One coordinate of a kind of joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinate {
    /// Name, appended to that of the joint; empty where the joint has one coordinate.
    pub name: &'static str,
    /// Unit.
    pub unit: Unit,
}

/// One velocity of a kind of joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Freedom {
    /// Name, appended to that of the joint; empty where the joint has one velocity.
    pub name: &'static str,
    /// Unit of its integral over time.
    pub unit: Unit,
    /// Direction in words, for messages: "about x", "along the axis".
    pub direction: &'static str,
}

/// The properties of a kind of joint.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct JointSpec {
    /// Its words.
    pub words: Words,
    /// Words in URDF files.
    pub urdf: &'static [&'static str],
    /// Default directions of the axes it takes.
    pub axes: &'static [[f64; 3]],
    /// Whether it takes a pitch.
    pub pitch: bool,
    /// Coordinates, in the order of the state.
    pub coordinates: &'static [Coordinate],
    /// Velocities, in the order of the state.
    pub freedoms: &'static [Freedom],
    /// Lie group, where the coordinates are more than numbers that displacements are added to.
    pub group: Option<LieGroup>,
    /// Layout in Pinocchio's state, where it is not that of [`JointSpec::form`].
    pub pinocchio: Option<Form>,
    /// Layout in Pinocchio's state if the joint is [`Joint::unbounded`].
    pub pinocchio_unbounded: Option<Form>,
    /// Layout in MuJoCo's state, where it is not that of [`JointSpec::form`].
    pub mujoco: Option<Form>,
    /// The kind with these directions (as many as `axes` are used) and this pitch.
    pub make: fn([[f64; 3]; 2], Value) -> JointKind,
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

const fn angle(name: &'static str) -> Coordinate {
    Coordinate { name, unit: Unit::Radian }
}

const fn length(name: &'static str) -> Coordinate {
    Coordinate { name, unit: Unit::Metre }
}

/// A component of a unit quaternion.
const fn component(name: &'static str) -> Coordinate {
    Coordinate { name, unit: Unit::One }
}

const fn rotation(name: &'static str, direction: &'static str) -> Freedom {
    Freedom { name, unit: Unit::Radian, direction }
}

const fn translation(name: &'static str, direction: &'static str) -> Freedom {
    Freedom { name, unit: Unit::Metre, direction }
}

pub(crate) const FIXED: JointSpec = JointSpec {
    words: Words::new("fixed", &[], &["weld", "rigid"]),
    urdf: &["fixed"],
    axes: &[],
    pitch: false,
    coordinates: &[],
    freedoms: &[],
    group: None,
    pinocchio: None,
    pinocchio_unbounded: None,
    mujoco: None,
    make: |_, _| JointKind::Fixed,
};

pub(crate) const REVOLUTE: JointSpec = JointSpec {
    words: Words::new("revolute", &["pin"], &["hinge", "continuous", "rotary", "rotational"]),
    urdf: &["revolute", "continuous"],
    axes: &[Z],
    coordinates: &[angle("")],
    freedoms: &[rotation("", "about the axis")],
    pinocchio_unbounded: Some(Form::CosSin),
    make: |[axis, _], _| JointKind::Revolute { axis },
    ..FIXED
};

pub(crate) const PRISMATIC: JointSpec = JointSpec {
    words: Words::new("prismatic", &["slider"], &["slide", "linear"]),
    urdf: &["prismatic"],
    axes: &[Z],
    coordinates: &[length("")],
    freedoms: &[translation("", "along the axis")],
    make: |[axis, _], _| JointKind::Prismatic { axis },
    ..FIXED
};

pub(crate) const CYLINDRICAL: JointSpec = JointSpec {
    words: Words::new("cylindrical", &[], &[]),
    urdf: &[],
    axes: &[Z],
    coordinates: &[length("slide"), angle("angle")],
    freedoms: &[translation("slide", "along the axis"), rotation("angle", "about the axis")],
    make: |[axis, _], _| JointKind::Cylindrical { axis },
    ..FIXED
};

pub(crate) const HELICAL: JointSpec = JointSpec {
    words: Words::new("helical", &[], &["screw"]),
    urdf: &[],
    axes: &[Z],
    pitch: true,
    coordinates: &[angle("")],
    freedoms: &[rotation("", "about the axis")],
    make: |[axis, _], pitch| JointKind::Helical { axis, pitch },
    ..FIXED
};

pub(crate) const UNIVERSAL: JointSpec = JointSpec {
    words: Words::new("universal", &[], &["cardan", "hooke"]),
    urdf: &[],
    axes: &[X, Y],
    coordinates: &[angle("angle1"), angle("angle2")],
    freedoms: &[rotation("angle1", "about the first axis"), rotation("angle2", "about the second axis")],
    make: |axes, _| JointKind::Universal { axes },
    ..FIXED
};

pub(crate) const PLANAR: JointSpec = JointSpec {
    words: Words::new("planar", &[], &[]),
    urdf: &["planar"],
    axes: &[Z],
    coordinates: &[length("x"), length("y"), angle("angle")],
    freedoms: &[
        translation("vx", "along x of the plane"),
        translation("vy", "along y of the plane"),
        rotation("wz", "about the normal"),
    ],
    group: Some(LieGroup::SE2),
    pinocchio: Some(Form::PlanarCosSin),
    make: |[normal, _], _| JointKind::Planar { normal },
    ..FIXED
};

pub(crate) const SPHERICAL: JointSpec = JointSpec {
    words: Words::new("spherical", &[], &["ball"]),
    urdf: &["spherical", "ball"],
    coordinates: &[component("qx"), component("qy"), component("qz"), component("qw")],
    freedoms: &[rotation("wx", "about x"), rotation("wy", "about y"), rotation("wz", "about z")],
    group: Some(LieGroup::SO3),
    mujoco: Some(Form::QuaternionWxyz),
    make: |_, _| JointKind::Spherical,
    ..FIXED
};

pub(crate) const FLOATING: JointSpec = JointSpec {
    words: Words::new("floating", &[], &["free", "6dof"]),
    urdf: &["floating"],
    coordinates: &[
        length("x"),
        length("y"),
        length("z"),
        component("qx"),
        component("qy"),
        component("qz"),
        component("qw"),
    ],
    freedoms: &[
        translation("vx", "along x"),
        translation("vy", "along y"),
        translation("vz", "along z"),
        rotation("wx", "about x"),
        rotation("wy", "about y"),
        rotation("wz", "about z"),
    ],
    group: Some(LieGroup::SE3),
    mujoco: Some(Form::FloatingWorld),
    make: |_, _| JointKind::Floating,
    ..FIXED
};

/// Every kind of joint, in the order of the documents.
pub static JOINTS: [JointSpec; 9] =
    [REVOLUTE, PRISMATIC, CYLINDRICAL, HELICAL, UNIVERSAL, PLANAR, SPHERICAL, FLOATING, FIXED];

/// Kinds of joints are equal if their words are.
impl PartialEq for JointSpec {
    fn eq(&self, other: &JointSpec) -> bool {
        self.words == other.words
    }
}

impl JointSpec {
    /// Its word in models, messages and generated code.
    pub fn word(&self) -> &'static str {
        self.words.word
    }

    /// Number of coordinates.
    pub fn nq(&self) -> usize {
        self.coordinates.len()
    }

    /// Number of velocities.
    pub fn nv(&self) -> usize {
        self.freedoms.len()
    }

    /// Place of a unit quaternion (x, y, z, w) among the coordinates: its first component.
    pub fn quaternion(&self) -> Option<usize> {
        self.coordinates.iter().position(|c| c.unit == Unit::One)
    }

    /// Coordinates at rest: zeros, and no rotation.
    pub fn neutral(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.nq()];
        if let Some(at) = self.quaternion() {
            q[at + 3] = 1.0;
        }
        q
    }

    /// Whether its coordinates can have linear springs.
    pub fn has_springs(&self) -> bool {
        self.nv() > 0 && self.quaternion().is_none()
    }

    /// Layout of its coordinates and velocities in this project's state.
    pub fn form(&self) -> Form {
        match self.group {
            Some(LieGroup::SO3) => Form::Quaternion,
            Some(LieGroup::SE3) => Form::Floating,
            _ => Form::Same { n: self.nv() },
        }
    }
}

impl JointKind {
    /// Properties of its kind.
    pub fn spec(&self) -> &'static JointSpec {
        match self {
            JointKind::Revolute { .. } => &REVOLUTE,
            JointKind::Prismatic { .. } => &PRISMATIC,
            JointKind::Cylindrical { .. } => &CYLINDRICAL,
            JointKind::Helical { .. } => &HELICAL,
            JointKind::Universal { .. } => &UNIVERSAL,
            JointKind::Planar { .. } => &PLANAR,
            JointKind::Spherical => &SPHERICAL,
            JointKind::Floating => &FLOATING,
            JointKind::Fixed => &FIXED,
        }
    }

    /// Its word in models and messages.
    pub fn word(&self) -> &'static str {
        self.spec().word()
    }

    /// Number of coordinates.
    pub fn nq(&self) -> usize {
        self.spec().nq()
    }

    /// Number of velocities.
    pub fn nv(&self) -> usize {
        self.spec().nv()
    }

    /// Its axes, as many as [`JointSpec::axes`].
    pub fn axes(&self) -> &[[f64; 3]] {
        match self {
            JointKind::Revolute { axis }
            | JointKind::Prismatic { axis }
            | JointKind::Cylindrical { axis }
            | JointKind::Helical { axis, .. }
            | JointKind::Planar { normal: axis } => std::slice::from_ref(axis),
            JointKind::Universal { axes } => axes,
            JointKind::Spherical | JointKind::Floating | JointKind::Fixed => &[],
        }
    }

    /// Its pitch, if it has one.
    pub fn pitch_mut(&mut self) -> Option<&mut Value> {
        match self {
            JointKind::Helical { pitch, .. } => Some(pitch),
            _ => None,
        }
    }

    /// The elementary joints it consists of, the one at the parent first, each with its axis where it has one.
    pub fn elements(&self) -> Vec<(Kind<Value>, Option<[f64; 3]>)> {
        match *self {
            JointKind::Revolute { axis } => vec![(Kind::Revolute, Some(axis))],
            JointKind::Prismatic { axis } => vec![(Kind::Prismatic, Some(axis))],
            JointKind::Cylindrical { axis } => vec![(Kind::Prismatic, Some(axis)), (Kind::Revolute, Some(axis))],
            JointKind::Helical { axis, pitch } => vec![(Kind::Helical { pitch }, Some(axis))],
            JointKind::Universal { axes: [a, b] } => vec![(Kind::Revolute, Some(a)), (Kind::Revolute, Some(b))],
            JointKind::Planar { normal } => vec![(Kind::Planar, Some(normal))],
            JointKind::Spherical => vec![(Kind::Spherical, None)],
            JointKind::Floating => vec![(Kind::Floating, None)],
            JointKind::Fixed => Vec::new(),
        }
    }
}

/// Source of a joint's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointMotion {
    /// From the state.
    Free,
    /// From inputs: position, rate and acceleration (a rheonomic drive).
    Prescribed,
    /// `q = ratio q_leader + offset`, both joints have one degree of freedom; `leader` is a joint index and may itself
    /// mimic.
    Mimic {
        /// Index of the leading joint.
        leader: usize,
        /// Factor.
        ratio: Value,
        /// Offset, rad or m.
        offset: Value,
    },
}

/// A joint and its passive elements; vectors have one entry for each degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name, unique among the joints.
    pub name: String,
    /// Kind and axes.
    pub kind: JointKind,
    /// Body index of the parent, `None` for the ground.
    pub parent: Option<usize>,
    /// Body index of the child.
    pub child: usize,
    /// Child frame in the parent frame at zero coordinates.
    pub placement: Placement,
    /// A revolute joint without limits, which other programs may store as cosine and sine; changes nothing here.
    pub unbounded: bool,
    /// Source of the coordinates.
    pub motion: JointMotion,
    /// Viscous damping for each degree of freedom, N m s/rad or N s/m.
    pub damping: Vec<Value>,
    /// Spring stiffness for each degree of freedom, N m/rad or N/m.
    pub stiffness: Vec<Value>,
    /// Rest position per freedom of the springs, rad or m.
    pub rest: Vec<Value>,
    /// Reflected rotor inertia for each degree of freedom, kg m² or kg.
    pub armature: Vec<Value>,
    /// What it is made for.
    pub bounds: JointBounds,
    /// Place of its description.
    pub origin: Origin,
}

/// What a joint is made for. It changes no equation: motion under control respects or reports it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct JointBounds {
    /// Least and greatest coordinate of a joint of one freedom, rad or m.
    pub range: Option<[f64; 2]>,
    /// Largest speed of each freedom, rad/s or m/s.
    pub velocity: Option<f64>,
    /// Largest effort of each freedom, N m or N.
    pub effort: Option<f64>,
}

impl Joint {
    /// Whether it has a translation among its freedoms; that of a helical joint belongs to a rotation.
    pub(crate) fn travels(&self) -> bool {
        self.kind.spec().freedoms.iter().any(|freedom| freedom.unit == Unit::Metre)
    }

    /// A free joint without passive elements that was not read from a text.
    pub fn new(
        name: impl Into<String>,
        kind: JointKind,
        parent: Option<usize>,
        child: usize,
        placement: Placement,
    ) -> Joint {
        let zero = || vec![Value::ZERO; kind.nv()];
        Joint {
            name: name.into(),
            kind,
            parent,
            child,
            placement,
            unbounded: false,
            motion: JointMotion::Free,
            damping: zero(),
            stiffness: zero(),
            rest: zero(),
            armature: zero(),
            bounds: JointBounds::default(),
            origin: Origin::default(),
        }
    }

    /// Whether its freedoms are axes, which motors could drive: free ones, whose coordinates are numbers with the velocities as
    /// their rates. Those of `spherical`, `planar` and `floating` joints are not.
    pub fn has_axes(&self) -> bool {
        self.motion == JointMotion::Free && self.kind.spec().group.is_none()
    }

    /// Adds a spring of `kp` N m/rad or N/m that pulls to zero, and a damper of `kd` N m s/rad or N s/m, to each freedom, as
    /// position control does: with the joint force `kp q*`, the joint is held at `q*` with the gains of a PD controller.
    /// `None`, and nothing is changed, where its springs or dampers are run-time parameters.
    pub fn add_gains(&mut self, kp: f64, kd: f64) -> Option<()> {
        let constants = |values: &[Value]| values.iter().map(|value| value.constant()).collect::<Option<Vec<f64>>>();
        let (stiffness, rest) = (constants(&self.stiffness)?, constants(&self.rest)?);
        let damping = constants(&self.damping)?;
        self.damping = damping.iter().map(|d| Value::Const(d + kd)).collect();
        self.stiffness = stiffness.iter().map(|k| Value::Const(k + kp)).collect();
        // A spring that is there goes on to pull to its own rest position.
        let both = stiffness.iter().zip(&rest).map(|(k, rest)| if k + kp > 0.0 { k * rest / (k + kp) } else { *rest });
        self.rest = both.map(Value::Const).collect();
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_add_to_springs_and_dampers() {
        let kind = JointKind::Revolute { axis: Z };
        let mut joint = Joint::new("hinge", kind, None, 0, Placement::IDENTITY);
        (joint.stiffness, joint.rest) = (vec![Value::Const(3.0)], vec![Value::Const(0.5)]);
        assert_eq!(joint.add_gains(1.0, 0.25), Some(()));
        // The torque 3 (0.5 - q) - q of both is 4 (0.375 - q).
        let [stiffness, rest, damping] = [&joint.stiffness, &joint.rest, &joint.damping].map(|all| all[0]);
        assert_eq!([stiffness, rest, damping], [4.0, 0.375, 0.25].map(Value::Const));
        joint.rest = vec![Value::Param(0)];
        let before = joint.clone();
        assert_eq!((joint.add_gains(1.0, 0.25), &joint), (None, &before));
    }

    /// Each kind once.
    fn kinds() -> impl Iterator<Item = JointKind> {
        JOINTS.iter().map(|spec| (spec.make)([X, Y], Value::ZERO))
    }

    #[test]
    fn every_kind_is_listed_once_and_found_again() {
        for (kind, spec) in kinds().zip(&JOINTS) {
            assert_eq!((kind.spec(), kind.axes().len()), (spec, spec.axes.len()), "{}", spec.word());
        }
        Words::assert_distinct(JOINTS.iter().map(|spec| &spec.words));
    }

    #[test]
    fn the_table_agrees_with_the_elementary_joints() {
        for kind in kinds() {
            let (spec, elements) = (kind.spec(), kind.elements());
            let sum = |count: fn(&Kind<Value>) -> usize| elements.iter().map(|(kind, _)| count(kind)).sum::<usize>();
            assert_eq!((spec.nq(), spec.nv()), (sum(Kind::nq), sum(Kind::nv)), "{}", spec.word());
            assert_eq!(if spec.has_springs() { spec.nv() } else { 0 }, sum(Kind::springs), "{}", spec.word());
            if let Some(group) = spec.group {
                assert_eq!(group.sizes(), (spec.nq(), spec.nv()), "{}", spec.word());
            }
            let forms = [Some(spec.form()), spec.pinocchio, spec.pinocchio_unbounded, spec.mujoco];
            for form in forms.into_iter().flatten() {
                let (nq, _, nv) = form.sizes();
                assert_eq!((nq, nv), (spec.nq(), spec.nv()), "{}", spec.word());
            }
        }
    }

    #[test]
    fn the_documents_have_the_same_table() {
        let document = include_str!("../../../book/src/model-format.md");
        let quoted = |words: &[&str]| words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
        for spec in &JOINTS {
            let keys = [&["axis", "axis2"][..spec.axes.len()], if spec.pitch { &["pitch"] } else { &[] }].concat();
            let named = |name: &str, unit: String| {
                let name = if name.is_empty() { String::new() } else { format!("`{name}`") };
                format!("{name} {unit}").trim().to_string()
            };
            let q: Vec<String> = spec.coordinates.iter().map(|c| named(c.name, c.unit.symbol().into())).collect();
            let v: Vec<String> =
                spec.freedoms.iter().map(|f| named(f.name, format!("{}/s", f.unit.symbol()))).collect();
            let cells = [quoted(&[spec.word()]), quoted(spec.words.aliases), quoted(&keys), q.join(", "), v.join(", ")];
            let row = cells.map(|cell| if cell.is_empty() { "|".into() } else { format!("| {cell} ") }).join("");
            let row = row.replace("||", "| |").replace("||", "| |");
            assert!(document.lines().any(|line| line.starts_with(&row)), "book/src/model-format.md has no row\n{row}");
        }
    }
}

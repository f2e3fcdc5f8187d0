//! Bodies: masses, inertias, sizes.

use super::numbers::{Numbers, Quantity};
use super::{is_zero, merged};
use crate::diag::Severity;
use crate::import::raw::{RawBody, RawModel};
use crate::import::source::Findings;
use crate::import::words::quote;
use crate::inertia::at_default;
use crate::model::{Body, Joint, Param, Rotation, Value};
use crate::rounded_once::norm;
use crate::symmetric::eigenvalues;

/// Slack of the triangle inequality and of positivity, relative to the largest moment: numbers written with seven
/// digits pass.
const ROUNDING: f64 = 1e-6;

/// Up to here a violation is laid to few digits (a flat plate written with three) and warned about.
const FEW_DIGITS: f64 = 1e-2;

pub(super) fn body(raw: &RawBody, numbers: &mut Numbers) -> Body {
    let what = format!("body {}", quote(&raw.name.value));
    let mass = numbers.or_zero(&raw.mass, Quantity::Mass, &format!("{what}: `mass`"));
    if let (Some(m), true) = (&raw.mass, numbers.at_default(mass) < 0.0) {
        let shown = match mass {
            Value::Const(x) => format!("{what}: mass {x} kg is negative"),
            Value::Param(_) => format!("{what}: mass is negative with the default of its parameter"),
        };
        numbers.findings.error(m.span, shown, "masses are positive, or 0 for a massless link between two joints");
    }
    let com = raw.com.as_ref().map(|c| numbers.vec3(c, Quantity::Length, &format!("{what}: `com`")));
    let inertia = raw.inertia.as_ref().map(|i| {
        let mut each = [Value::ZERO; 6];
        for (slot, x) in each.iter_mut().zip(&i.value) {
            *slot = numbers.value(x, Quantity::Plain, &format!("{what}: `inertia`"));
        }
        each
    });
    let inertia_axes = raw.inertia_axes.as_ref().map(|r| numbers.rotation(r, &format!("{what}: axes of the inertia")));
    if let (Some(i), true) = (&raw.inertia, is_zero(raw.mass.as_ref().map(|m| &m.value))) {
        if i.value.iter().any(|x| !is_zero(Some(&x.value))) {
            let message = format!("{what} has inertia but no mass");
            let help = "add its mass; for a rotor felt through a gear use `armature` on the joint";
            numbers.findings.warning(i.span, message, help);
        }
    }
    Body {
        name: raw.name.value.clone(),
        mass,
        com: com.unwrap_or([Value::ZERO; 3]),
        inertia: inertia.unwrap_or([Value::ZERO; 6]),
        inertia_axes: inertia_axes.unwrap_or(Rotation::NONE),
    }
}

/// Judges the inertia of every body, at the defaults of the parameters. What is fixed to other bodies moves with them as
/// one: where that one is sound, a part that is not is warned about. Joints stand depth first; without them, every body
/// is judged alone.
pub(super) fn inertias(raw: &RawModel, bodies: &[Body], joints: &[Joint], params: &[Param], findings: &mut Findings) {
    let together = merged::together(bodies, joints, params);
    for ((source, body), together) in raw.bodies.iter().zip(bodies).zip(together) {
        let Some(at) = &source.inertia else { continue };
        let entries = body.inertia.map(|v| at_default(v, params));
        let Some(moments) = eigenvalues(entries) else { continue };
        let mass = at_default(body.mass, params);
        let by_default = body.inertia.iter().any(|v| v.constant().is_none());
        let suffix = if by_default { ", with the defaults of its parameters" } else { "" };
        let Some((fault, severity)) = fault(&body.name, mass, entries, moments, raw.lenient, suffix) else { continue };
        let is_sound = match together {
            None => true,
            Some((mass, entries)) => eigenvalues(entries).is_some_and(|moments| is_sound(mass, moments)),
        };
        let severity = match severity {
            Severity::Error if is_sound => {
                let message = format!("{}; together with what is fixed to it, it is sound", fault.0);
                findings.add(Severity::Warning, at.span, message, fault.1);
                continue;
            }
            // What a parameter may still change is no error.
            Severity::Error if by_default => Severity::Warning,
            severity => severity,
        };
        findings.add(severity, at.span, fault.0, fault.1);
    }
}

/// Whether moments of inertia, in rising order, are those of a body, as far as few digits tell.
fn is_sound(mass: f64, [small, middle, large]: [f64; 3]) -> bool {
    mass > 0.0 && large > 0.0 && small >= -ROUNDING * large && large - middle - small <= FEW_DIGITS * large
}

/// What is wrong with an inertia, and what to do.
fn fault(
    name: &str,
    mass: f64,
    entries: [f64; 6],
    moments: [f64; 3],
    lenient: bool,
    suffix: &str,
) -> Option<((String, &'static str), Severity)> {
    let [small, middle, large] = moments;
    let scale = large.max(-small);
    let diagonal = entries[3..].iter().all(|x| *x == 0.0);
    // Below what a body of a millimetre has, and far below, the entries are some program's rounding errors.
    if small < -ROUNDING * scale.max(mass * 1e-6) {
        // In files of others, what a body of a centimetre has does not keep the robot from moving.
        let is_small = lenient && -small < mass * 1e-4;
        let severity = if is_small { Severity::Warning } else { Severity::Error };
        return Some((negative(name, entries, small, suffix), severity));
    }
    let excess = (large - middle - small) / scale;
    if excess.is_nan() || excess <= ROUNDING {
        return None;
    }
    let why = if diagonal {
        let axis = (0..3).max_by(|a, b| entries[*a].total_cmp(&entries[*b])).unwrap_or(2);
        ["Iyy + Izz < Ixx", "Ixx + Izz < Iyy", "Ixx + Iyy < Izz"][axis].to_string()
    } else {
        format!("principal moments {} + {} < {}", short(small), short(middle), short(large))
    };
    if excess <= FEW_DIGITS {
        let percent = short(100.0 * excess);
        let message =
            format!("inertia of {} violates the triangle inequality by {percent} % ({why}){suffix}", quote(name));
        return Some(((message, "write the moments with more digits"), Severity::Warning));
    }
    let message = format!("inertia of {} violates the triangle inequality ({why}){suffix}", quote(name));
    let help = "no body has such moments: check their units, and that they are about the centre of mass";
    Some(((message, help), if lenient { Severity::Warning } else { Severity::Error }))
}

/// The fault of an inertia that is not positive, and what to do.
fn negative(name: &str, entries: [f64; 6], small: f64, suffix: &str) -> (String, &'static str) {
    if entries[..3].iter().any(|x| *x < 0.0) {
        let message = format!("inertia of {} has a negative moment{suffix}", quote(name));
        return (message, "moments of inertia are sums of m r² and cannot be negative");
    }
    let message = format!(
        "inertia of {} is not positive: its smallest principal moment is {}{suffix}",
        quote(name),
        short(small)
    );
    let help = "the products are too large for the moments: check units and signs (products are entries of the matrix)";
    (message, help)
}

/// Four digits of a number.
fn short(x: f64) -> String {
    let digits = format!("{x:.3e}");
    digits
        .parse::<f64>()
        .map_or(digits, |y| if (1e-3..1e5).contains(&y.abs()) { format!("{y}") } else { format!("{y:e}") })
}

/// Suspicions from the size of each body: radius of gyration against the lengths of the model, and density.
pub(super) fn sizes(raw: &RawModel, bodies: &[Body], joints: &[Joint], numbers: &mut Numbers) {
    let lengths = bodies.iter().map(|b| b.com).chain(joints.iter().map(|j| j.placement.xyz));
    let longest = lengths.map(|v| norm(v.map(|x| numbers.at_default(x)))).fold(0.0, f64::max);
    for (source, body) in raw.bodies.iter().zip(bodies) {
        let (Some(at), Some(mass)) = (&source.inertia, body.mass.constant()) else { continue };
        let entries = body.inertia.map(|v| numbers.at_default(v));
        let Some([_, _, large]) = eigenvalues(entries) else { continue };
        if mass <= 0.0 || large <= 0.0 || large.is_infinite() {
            continue;
        }
        let radius = (large / mass).sqrt();
        // kg mm² for kg m² is a factor of 1000, g cm² of 3000; a flywheel on a short arm stays below 100.
        if longest > 0.0 && radius > 100.0 * longest {
            let message = format!(
                "inertia of {} is that of a body {} m across, while no length of the model exceeds {} m",
                quote(&body.name),
                short(2.0 * radius),
                short(longest)
            );
            numbers.findings.warning(at.span, message, "inertia is in kg m²: 1 kg mm² is 1e-6, 1 g cm² is 1e-7");
        }
        // The ball with this mass and moment: r² = 5/2 I/m. No body of that mass and largest moment is less dense in
        // its ball than this.
        let ball = (2.5 * large / mass).sqrt();
        let density = mass / (4.0 / 3.0 * std::f64::consts::PI * (ball * ball * ball));
        if density > 1e6 {
            let message = format!(
                "body {} has {} kg within {} m: {} times the density of lead",
                quote(&body.name),
                short(mass),
                short(ball),
                short((density / 11340.0).round())
            );
            numbers.findings.warning(at.span, message, "check the units of mass (kg) and inertia (kg m²)");
        }
    }
}

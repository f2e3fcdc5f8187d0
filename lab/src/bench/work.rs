//! Work for a given error.

use crate::generated::{visit_differentiable_f64, visit_f32, visit_f64, Visit, VisitDifferentiable};
use crate::scenes::{Dynamics, Expect, Scene};
use multibody::runtime::catalogue::{self, Entry};
use multibody::runtime::wide::Wide;
use multibody::runtime::{AccelerationForm, Differentiable, Energetic, Real};

use super::erased::Erased;
use super::sample::{end_error, measure, run, step, Maker, Sample, Start};
use mbd_cli::note;

/// Variant in which a scene is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// Generated code in canonical form, f64.
    Hamilton,
    /// Generated code in acceleration form, f64.
    Acceleration,
    /// The interpreter, f64.
    Interpreted,
    /// Generated code in canonical form, f32, sums compensated.
    Single,
}

impl Variant {
    /// All variants.
    pub const ALL: [Variant; 4] = [Variant::Hamilton, Variant::Acceleration, Variant::Interpreted, Variant::Single];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Variant::Hamilton => "generated",
            Variant::Acceleration => "generated, accelerations",
            Variant::Interpreted => "interpreted",
            Variant::Single => "generated, f32",
        }
    }

    /// Whether a method is run in this variant. All methods are run with generated code, or with the interpreter where
    /// there is no code; the other variants run a selection of the explicit methods.
    fn runs(self, method: &Entry, code: bool) -> bool {
        let few = ["rk4", "dop853", "verner9"];
        match self {
            Variant::Hamilton => code,
            Variant::Interpreted => !code || few.contains(&method.name) || ["tsit5", "adams"].contains(&method.name),
            Variant::Acceleration => code && few.contains(&method.name),
            Variant::Single => !method.implicit && method.name != "verner9",
        }
    }
}

/// Reference state at the end.
pub struct Reference {
    /// Coordinates.
    pub q: Vec<f64>,
    /// Difference between two computations of it.
    pub error: f64,
    /// Method by which it was computed.
    pub how: &'static str,
}

/// Makes the boxed system of a scene from its generated type.
struct Boxed<'a>(&'a Scene);

impl<S: Real + 'static> Visit<S> for Boxed<'_> {
    type Out = Erased<S>;
    fn visit<Y: Dynamics<Scalar = S> + 'static>(self, system: Y) -> Erased<S> {
        Erased::new(self.0, system)
    }
}

/// Adds generated derivatives to a boxed system.
struct Derived<S: Real>(Erased<S>);

impl<S: Real + 'static> VisitDifferentiable<S> for Derived<S> {
    type Out = Erased<S>;
    fn visit<Y: Dynamics<Scalar = S> + Differentiable + 'static>(self, system: Y) -> Erased<S> {
        self.0.with_derivatives(system)
    }
}

/// Generated code of a scene, or the interpreter where there is none.
pub fn generated(scene: &Scene) -> (Erased<f64>, bool) {
    let plain = || visit_f64(scene.name, Boxed(scene));
    let smooth = plain().and_then(|plain| visit_differentiable_f64(scene.name, Derived(plain)));
    match smooth.or_else(plain) {
        Some(system) => (system, true),
        None => (Erased::interpreted(scene), false),
    }
}

/// Generated code of a scene in f32, or the interpreter where there is none.
pub fn single(scene: &Scene) -> Erased<f32> {
    visit_f32(scene.name, Boxed(scene)).unwrap_or_else(|| Erased::interpreted(scene))
}

/// Largest number of degrees of freedom for which the reference is computed in double-double numbers.
const WIDE: usize = 14;

/// A state at the end with far more correct digits than the runs that are compared with it, where this takes seconds
/// only.
pub fn reference(scene: &Scene) -> Option<Reference> {
    // For the largest scenes a tighter tolerance would take minutes and give digits that are not needed.
    let (tight, other) = if scene.v.len() > HUGE { (1e-8, "adams") } else { (1e-14, "dop853") };
    let solve = |system: &mut Erased<f64>, method: &str| -> Option<Vec<f64>> {
        let (q, p) = scene.start(system);
        let start = Start { q: &q, p: &p, step: step(method, tight), compensated: true };
        let make: &Maker<Erased<f64>> = &|s, compensated| catalogue::explicit(method, s, compensated);
        let run = run(system, make, &start, scene.t_end)?.ok()?;
        run.failure.is_none().then_some(run.q)
    };
    let (mut system, _) = generated(scene);
    let quick = solve(&mut system, "verner9")?;
    if scene.v.len() <= WIDE && scene.name != "stiff_spring" {
        let mut system = scene.interpreter::<Wide>();
        let (q, p) = scene.start(&mut system);
        let end = |tolerance: f64, system: &mut multibody::runtime::Interpreter<Wide>| {
            let start = Start { q: &q, p: &p, step: step("verner9", tolerance), compensated: false };
            let make: &Maker<multibody::runtime::Interpreter<Wide>> =
                &|s, compensated| catalogue::explicit("verner9", s, compensated);
            let run = run(system, make, &start, scene.t_end)?.ok()?;
            run.failure.is_none().then(|| run.q.iter().map(|x| x.to_f64()).collect::<Vec<f64>>())
        };
        let (coarse, fine) = (end(1e-16, &mut system)?, end(1e-18, &mut system)?);
        return Some(Reference { error: end_error(&coarse, &fine), q: fine, how: "double-double, Verner 9, 1e-18" });
    }
    let other = solve(&mut system, other)?;
    let how = if tight > 1e-14 { "f64, Verner 9 and Adams, 1e-8" } else { "f64, Verner 9 and DOP853, 1e-14" };
    Some(Reference { error: end_error(&quick, &other), q: quick, how })
}

/// Time, s, after which a series of finer and finer runs ends.
const LONGEST: f64 = 0.15;
/// With more degrees of freedom than this, only some methods are run: implicit methods factor dense matrices, and
/// others take minutes.
const LARGE: usize = 20;
/// The methods that are run on such mechanisms.
const CHOICE: [&str; 6] = ["rk4", "tsit5", "dop853", "verner9", "ab6", "adams"];
/// With more degrees of freedom than this, a run takes seconds, and only two methods are run.
const HUGE: usize = 200;

/// Whether a method is run on a scene at all.
pub fn fits(scene: &Scene, method: &Entry) -> bool {
    match scene.v.len() {
        0..=LARGE => true,
        n if n <= HUGE => CHOICE.contains(&method.name),
        _ => ["verner9", "adams"].contains(&method.name),
    }
}

/// Runs one method at all its settings.
fn series<Y>(
    system: &mut Y,
    make: &Maker<'_, Y>,
    scene: &Scene,
    state: (&Y::Coordinates, &Y::Momenta),
    reference: &Reference,
    (variant, method): (Variant, &Entry),
) -> Vec<Sample>
where
    Y: Energetic,
    Y::Scalar: Real,
{
    let single = variant == Variant::Single;
    let settings: Vec<f64> = match (method.adaptive, single) {
        (true, false) => (3..=13).map(|k| 10.0_f64.powi(-k)).collect(),
        (true, true) => (2..=6).map(|k| 10.0_f64.powi(-k)).collect(),
        (false, _) => (0..22).map(|k| scene.rk4_step * 8.0 * 0.5_f64.powi(k)).collect(),
    };
    let mut samples: Vec<Sample> = Vec::new();
    for setting in settings {
        let start = Start { q: state.0, p: state.1, step: step(method.name, setting), compensated: single };
        let sample = Sample {
            tool: "multibody".into(),
            variant: variant.name().into(),
            scene: scene.name.into(),
            method: method.name.into(),
            setting: format!("{}{setting:.3e}", if method.adaptive { "tol=" } else { "h=" }),
            ..Sample::default()
        };
        let Some(mut sample) = measure(system, make, &start, scene.t_end, &reference.q, sample) else { break };
        if !scene.conservative {
            sample.energy_error = None;
        }
        let (slow, failed) = (sample.cpu_s > LONGEST, sample.failure.is_some());
        let error = sample.end_error.unwrap_or(f64::INFINITY);
        samples.push(sample);
        // On a stiff scene, finer steps of an explicit method can succeed where coarse ones fail.
        if slow || (failed && method.adaptive) || error < 1e-13 {
            break;
        }
    }
    samples
}

/// All runs of a scene.
pub fn scene(scene: &Scene, variants: &[Variant], methods: &[String]) -> (Option<Reference>, Vec<Sample>) {
    if scene.expect == Expect::Stops {
        return (None, Vec::new());
    }
    note(format_args!("{}: reference", scene.name));
    let Some(reference) = reference(scene) else { return (None, Vec::new()) };
    let mut samples = Vec::new();
    let (_, code) = generated(scene);
    for &variant in variants {
        let chosen = |e: &&'static Entry| {
            variant.runs(e, code) && fits(scene, e) && (methods.is_empty() || methods.iter().any(|m| m == e.name))
        };
        for entry in catalogue::entries().filter(chosen) {
            note(format_args!("{}: {}, {}", scene.name, variant.name(), entry.name));
            samples.extend(one(scene, &reference, variant, entry));
        }
    }
    (Some(reference), samples)
}

fn one(scene: &Scene, reference: &Reference, variant: Variant, entry: &Entry) -> Vec<Sample> {
    let with = (variant, entry);
    match variant {
        Variant::Hamilton | Variant::Interpreted => {
            let mut system = match variant {
                Variant::Hamilton => generated(scene).0,
                _ => Erased::interpreted(scene),
            };
            let (q, p) = scene.start(&mut system);
            let make: &Maker<Erased<f64>> = &|s, compensated| catalogue::any(entry.name, s, compensated);
            series(&mut system, make, scene, (&q, &p), reference, with)
        }
        Variant::Acceleration => {
            let mut system = AccelerationForm::new(generated(scene).0);
            let (q, v) = (scene.q.clone(), scene.v.clone());
            let make: &Maker<AccelerationForm<Erased<f64>>> =
                &|s, compensated| catalogue::explicit(entry.name, s, compensated);
            series(&mut system, make, scene, (&q, &v), reference, with)
        }
        Variant::Single => {
            let Some(mut system) = visit_f32(scene.name, Boxed(scene)) else { return Vec::new() };
            let (q, p) = scene.start(&mut system);
            let make: &Maker<Erased<f32>> = &|s, compensated| catalogue::explicit(entry.name, s, compensated);
            series(&mut system, make, scene, (&q, &p), reference, with)
        }
    }
}

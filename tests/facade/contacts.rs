//! Generated code for the modes of contacts moves as the interpreter does, bit for bit, whichever of its functions serves
//! a step: those for a set of modes, or those for all modes.

use multibody::codegen::options::PlanOptions;
use multibody::codegen::read::{self, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::constrained::{close, Closing};
use multibody::runtime::contact::{ContactEvent, ContactObserver, Hybrid, Touching, Way, WithContacts};
use multibody::runtime::integrate::{Dop853, Step, Tolerances};
use multibody::runtime::{Conjugate, Constrained, Energetic, System};

mod made {
    multibody::mbd_model! {
        path = "models/contacts/hopper.toml", name = Hopper, modes = all, arithmetic = exact
    }
    multibody::mbd_model! {
        path = "models/contacts/simplest_walker.toml", name = Walker, modes = masked, arithmetic = exact
    }
    multibody::mbd_model! {
        path = "models/contacts/simplest_walker.toml", name = Limbs, modes = factored, arithmetic = exact
    }
    multibody::mbd_model! {
        path = "models/contacts/hopper.toml", name = Pieces, modes = factored
    }
    multibody::mbd_model! {
        path = "models/contacts/bouncing_ball.toml", name = Ball, modes = ["open"], arithmetic = exact
    }
    multibody::mbd_model! {
        path = "models/contacts/fourbar_stop.toml", name = FourBar, modes = all, arithmetic = exact
    }
    multibody::mbd_model! {
        path = "models/contacts/ball_on_hills.toml", name = OnHills, modes = all, arithmetic = exact
    }
    multibody::mbd_model! {
        path = "models/contacts/ball_on_hills.toml", name = OnHillsSingle, modes = masked, scalar = f32
    }
    multibody::mbd_model! {
        path = "models/contacts/bouncing_ball.toml", name = Single, modes = all, scalar = f32
    }
}

#[derive(Default)]
struct Events(Vec<ContactEvent<f64>>);

impl<Y: Touching<Scalar = f64>> ContactObserver<Y> for Events {
    fn event(&mut self, _system: &mut WithContacts<Y>, event: &ContactEvent<f64>) {
        self.0.push(*event);
    }
}

/// A motion: its events, its end, and its steps by what computed them.
struct Motion {
    events: Vec<ContactEvent<f64>>,
    end: [Vec<f64>; 2],
    energy: f64,
    steps: [u64; 5],
}

fn follow<Y>(mut mechanism: Y, q: &[f64], v: &[f64], time: f64) -> Motion
where
    Y: Touching<Scalar = f64> + Conjugate + Energetic,
{
    let (mut given, mut velocities) = (mechanism.neutral(), mechanism.zero_momenta());
    given.as_mut().copy_from_slice(q);
    velocities.as_mut().copy_from_slice(v);
    let mut p = mechanism.zero_momenta();
    mechanism.conjugate_momenta(&given, &velocities, &mut p);
    let mut system = WithContacts::new(mechanism);
    let method = Dop853::new(&system);
    let step = Step::Adaptive(Tolerances::new(1e-10));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &given, &p).expect("a start");
    let mut events = Events::default();
    motion.run(&mut system, time, &mut events).expect("a motion");
    motion.state(&system, &mut given, &mut p);
    let (kinetic, potential) = system.energies(&given, &p);
    let end = [given.as_ref().to_vec(), p.as_ref().to_vec()];
    Motion { events: events.0, end, energy: kinetic + potential, steps: motion.contact_statistics().steps }
}

/// The motion of generated code, compared with that of the interpreter.
fn compared<Y>(generated: Y, file: &str, q: Option<&[f64]>, v: &[f64], time: f64) -> Motion
where
    Y: Touching<Scalar = f64> + Conjugate + Energetic,
{
    let path = format!("{}/models/contacts/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("a shipped model");
    let model = read::model(file, &text, &ImportOptions::default()).expect("a model").model;
    let plan = search::plan(&model, PlanOptions::default());
    let q = q.map_or_else(|| plan.start(), <[f64]>::to_vec);
    let interpreted = follow(plan.default_contact_interpreter::<f64>(), &q, v, time);
    let generated = follow(generated, &q, v, time);
    assert_eq!(generated.events, interpreted.events, "{file}");
    assert_eq!(generated.end, interpreted.end, "{file}");
    assert_eq!(generated.energy.to_bits(), interpreted.energy.to_bits(), "{file}");
    assert!(!generated.events.is_empty(), "{file}");
    assert_eq!(interpreted.steps[Way::Interpreted as usize], interpreted.steps.iter().sum::<u64>(), "{file}");
    assert_eq!(generated.steps.iter().sum::<u64>(), interpreted.steps.iter().sum::<u64>(), "{file}");
    generated
}

/// Steps by functions for sets of modes, and by functions for all modes.
fn ways(motion: &Motion) -> [bool; 2] {
    [Way::Generated, Way::Masked].map(|way| motion.steps[way as usize] > 0)
}

#[test]
fn all_sets_of_modes() {
    let hopper = compared(made::Hopper::new(), "hopper.toml", None, &[0.0, 0.0], 2.0);
    assert_eq!(ways(&hopper), [true, false], "{:?}", hopper.steps);
    assert_eq!(made::Hopper::CONTACTS, ["landing", "leg/lower", "leg/upper"]);
}

/// Cells of height fields are looked up in tables of the generated code.
#[test]
fn a_height_field() {
    let ball = compared(made::OnHills::new(), "ball_on_hills.toml", None, &[0.7, 0.4, 0.0, 0.0, 0.0, 0.0], 1.5);
    assert_eq!(ways(&ball), [true, false], "{:?}", ball.steps);
    // In single precision, and by the functions for all modes, the gap at the start is the same to rounding errors.
    let single = made::OnHillsSingle::new();
    let (mut gaps, mut rates) = (single.zero_rows(), single.zero_rows());
    let (mut entries, v) = (single.zero_entries(), single.zero_momenta());
    single.gaps(&made::OnHillsSingle::START, &v, &mut gaps, &mut rates, &mut entries);
    let double = made::OnHills::new();
    let (mut wanted, mut rates) = (double.zero_rows(), double.zero_rows());
    let (mut entries, v) = (double.zero_entries(), double.zero_momenta());
    double.gaps(&made::OnHills::START, &v, &mut wanted, &mut rates, &mut entries);
    // A few roundings of numbers below 10.
    assert!((f64::from(gaps[0]) - wanted[0]).abs() < 1e-5, "{gaps:?} {wanted:?}");
}

#[test]
fn one_function_for_all_modes() {
    // Both feet touch the slope; one of them lifts off.
    let walker = compared(made::Walker::new(), "simplest_walker.toml", None, &[0.0, 0.0, -0.3, 0.2], 1.0);
    assert_eq!(ways(&walker), [false, true], "{:?}", walker.steps);
}

#[test]
fn pieces_for_all_modes() {
    let walker = compared(made::Limbs::new(), "simplest_walker.toml", None, &[0.0, 0.0, -0.3, 0.2], 1.0);
    assert_eq!(walker.steps[Way::Factored as usize], walker.steps.iter().sum::<u64>(), "{:?}", walker.steps);
    // In fast arithmetic, other roundings.
    let [pieces, whole] = [
        follow(made::Pieces::new(), &made::Pieces::START, &[0.0; made::Pieces::NV], 1.0),
        follow(made::Hopper::new(), &made::Hopper::START, &[0.0; made::Hopper::NV], 1.0),
    ];
    assert_eq!(pieces.events.len(), whole.events.len());
    for (a, b) in pieces.end.iter().flatten().zip(whole.end.iter().flatten()) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn some_sets_of_modes() {
    let ball = compared(made::Ball::new(), "bouncing_ball.toml", None, &[0.0; made::Ball::NV], 12.0);
    assert_eq!(ways(&ball), [true, true], "{:?}", ball.steps);
}

#[test]
fn closed_loops_with_a_stop() {
    let path = format!("{}/models/contacts/fourbar_stop.toml", env!("CARGO_MANIFEST_DIR"));
    let model = multibody::codegen::model::Model::load(path).expect("a model");
    let plan = search::plan(&model, PlanOptions::default());
    let mut interpreter = plan.default_interpreter::<f64>();
    let mut q = plan.start();
    let mut closing = Closing::default();
    closing.held = &made::FourBar::HELD;
    close(&mut interpreter, &mut q, &closing).expect("a four-bar");
    let motion = compared(made::FourBar::new(), "fourbar_stop.toml", Some(&q), &[0.0; made::FourBar::NV], 2.0);
    assert_eq!(ways(&motion), [true, false], "{:?}", motion.steps);
}

/// The inputs that a motion needs exist in single precision too.
#[test]
fn single_precision_has_the_trait() {
    fn touches<Y: Touching<Scalar = f32>>(y: &Y) -> usize {
        y.contacts().len()
    }
    assert_eq!(touches(&made::Single::new()), 1);
}

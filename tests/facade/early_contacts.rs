//! Generated code whose feet are solved where their legs begin: it computes what the interpreter does, also where a leg is
//! straight and cannot follow its foot.

use multibody::codegen::model::Model;
use multibody::codegen::plan::Plan;
use multibody::runtime::contact::{rows_that_act, Hybrid, Mode, Touching, WithContacts};
use multibody::runtime::integrate::{Dop853, Step, Tolerances};
use multibody::runtime::{Conjugate, Constrained};

mod made {
    multibody::mbd_model! {
        path = "tests/facade/two_legs.toml", name = TwoLegs, modes = ["open open", "stick open", "stick stick"]
    }
    multibody::mbd_model! {
        path = "tests/facade/two_legs.toml", name = Pieces, modes = factored
    }
}

use made::{Pieces, TwoLegs};

fn model() -> Model {
    let path = format!("{}/tests/facade/two_legs.toml", env!("CARGO_MANIFEST_DIR"));
    Model::load(path).unwrap_or_else(|e| panic!("{e}"))
}

/// The largest difference, as a part of the largest number.
fn error(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    // Maxima pass over what is not a number.
    assert!(a.iter().chain(b).all(|x| x.is_finite()), "{a:?} {b:?}");
    let largest = b.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!(largest > 0.0);
    a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / largest
}

#[test]
fn legs_that_pass_through_their_straight_position() {
    let full = Plan::new(&model(), 1e-6).with_contacts();
    let (mut sets, mut pieces) = (TwoLegs::new(), Pieces::new());
    let knee = TwoLegs::COORDINATES.iter().position(|name| *name == "knee_l").expect("a knee");
    let (mut worst, mut q) = (0.0_f64, TwoLegs::START);
    let p: [f64; TwoLegs::NV] = std::array::from_fn(|k| (1.3 + k as f64).sin());
    for modes in [[Mode::Stick, Mode::Stick], [Mode::Stick, Mode::Open], [Mode::Slide, Mode::Stick]] {
        let acts = rows_that_act(full.dims.rows, &full.contacts::<f64>(), &modes);
        let mut interpreter = full.default_interpreter::<f64>().acting(&acts);
        sets.act(&modes);
        pieces.act(&modes);
        for k in -100..=100 {
            q[knee] = 2e-3 * f64::from(k);
            let (mut v, mut qd, mut pd) = (vec![0.0; TwoLegs::NV], vec![0.0; TwoLegs::NQ], vec![0.0; TwoLegs::NV]);
            interpreter.rates(&q, &p, &mut v, &mut qd, &mut pd);
            let rates = [qd, pd].concat();
            let (mut freed, mut sigma, mut lambda) = (p.to_vec(), vec![0.0; 6], vec![0.0; 6]);
            interpreter.project_momenta(0.0, &q.to_vec(), &mut freed, &mut v, &mut sigma);
            interpreter.multipliers(0.0, &q.to_vec(), &v, &mut lambda);
            let projected = [v.clone(), freed, sigma].concat();
            let v: [f64; TwoLegs::NV] = std::array::from_fn(|k| v[k]);
            macro_rules! compared {
                ($($system:expr)+) => {
                    $({
                        let (mut qd, mut pd) = ([0.0; TwoLegs::NQ], [0.0; TwoLegs::NV]);
                        $system.rates(&q, &p, &mut qd, &mut pd);
                        let (mut own, mut freed) = ([0.0; TwoLegs::NV], [0.0; TwoLegs::NV]);
                        let (mut sigma, mut forces) = ([0.0; 6], [0.0; 6]);
                        $system.project_momenta(&q, &p, &mut own, &mut freed, &mut sigma);
                        $system.multipliers(&q, &v, &mut forces);
                        worst = worst.max(error(&[&qd[..], &pd].concat(), &rates));
                        worst = worst.max(error(&[&own[..], &freed, &sigma].concat(), &projected));
                        worst = worst.max(error(&forces, &lambda));
                    })+
                };
            }
            compared!(sets pieces);
        }
    }
    // Early rows that act cost at most three digits; next to positions in which none can be followed, late ones act.
    assert!(worst < 1e-11, "{worst:e}");
    println!("largest error: {worst:e}");
}

fn dropped<Y: Touching<Scalar = f64> + Conjugate>(mechanism: Y) -> (usize, Vec<f64>) {
    let (mut q, p) = (mechanism.neutral(), mechanism.zero_momenta());
    q.as_mut().copy_from_slice(&TwoLegs::START);
    let mut system = WithContacts::new(mechanism);
    let method = Dop853::new(&system);
    let step = Step::Adaptive(Tolerances::new(1e-11));
    let mut motion = Hybrid::new(&mut system, method, step, 0.0, &q, &p).expect("a start");
    motion.run(&mut system, 0.15, &mut ()).expect("a motion");
    let mut p = p;
    motion.state(&system, &mut q, &mut p);
    (system.modes().iter().filter(|mode| **mode == Mode::Stick).count(), q.as_ref().to_vec())
}

#[test]
fn a_drop_on_two_legs_ends_as_that_of_the_interpreter_does() {
    let plan = Plan::new(&model(), 1e-6);
    let (feet, expected) = dropped(plan.default_contact_interpreter::<f64>());
    assert_eq!(feet, 2, "both feet stand");
    for (feet, q) in [dropped(TwoLegs::new()), dropped(Pieces::new())] {
        assert_eq!(feet, 2);
        assert!(error(&q, &expected) < 1e-8, "{q:?} {expected:?}");
    }
}

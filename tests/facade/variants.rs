//! States that generated code carries over, against the transfer with the interpreter.

use multibody::codegen::model::Model;
use multibody::codegen::plan::Plan;
use multibody::codegen::transfer::Transfer;
use multibody::runtime::{Interpreter, System, TransferFrom};

mod made {
    multibody::mbd_model! { path = "models/variants/chain.toml", name = Whole, outputs = [rates, momenta, frames] }
    multibody::mbd_model! {
        path = "models/variants/chain.toml", variant = "broken", name = Broken,
        from = [Whole, "held": Held, "both": Both], outputs = [rates, momenta, frames],
    }
    multibody::mbd_model! {
        path = "models/variants/chain.toml", variant = "held", name = Held, from = Whole,
        outputs = [rates, momenta, frames],
    }
    multibody::mbd_model! {
        path = "models/variants/chain.toml", variant = "both", name = Both, from = [Whole, "held": Held],
        outputs = [rates, momenta, frames],
    }
    multibody::mbd_model! {
        path = "models/variants/docking.toml", name = Apart, outputs = [rates, momenta, frames],
        elimination = single,
    }
    multibody::mbd_model! {
        path = "models/variants/docking.toml", variant = "docked", name = Docked, from = Apart,
        outputs = [rates, momenta, frames],
    }
    multibody::mbd_model! {
        path = "models/variants/docking.toml", name = Released, from = ["docked": Docked],
        outputs = [rates, momenta, frames],
    }
}
use made::{Apart, Both, Broken, Docked, Held, Released, Whole};

const CHAIN: &str = "models/variants/chain.toml";
const DOCKING: &str = "models/variants/docking.toml";

/// The variant of a file, or the model.
fn plan(path: &str, variant: Option<&str>) -> Plan {
    let model = match variant {
        Some(name) => Model::load_variant(path, name),
        None => Model::load(path),
    };
    Plan::new(&model.unwrap_or_else(|e| panic!("{e}")), 1e-6)
}

#[track_caller]
fn near(what: &str, a: &[f64], b: &[f64]) {
    // The momenta are sums of a hundred terms of the size of one.
    within(1e-13, what, a, b);
}

#[track_caller]
fn within(most: f64, what: &str, a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < most, "{what}[{k}]: {a} {b}");
    }
}

/// The state by the interpreter: coordinates and momenta.
#[track_caller]
fn carried(
    (from, to): (&Plan, &Plan),
    (q, v): (&[f64], &[f64]),
    prepare: impl FnOnce(&mut Interpreter<f64>, &mut Interpreter<f64>),
) -> (Vec<f64>, Vec<f64>) {
    let (mut old, mut new) = (from.default_interpreter(), to.default_interpreter());
    prepare(&mut old, &mut new);
    let mut transfer = Transfer::new(from, to).unwrap_or_else(|e| panic!("{e}"));
    let state = transfer.apply(&mut old, q, v, &mut new).unwrap_or_else(|e| panic!("{e}"));
    (state.q, state.p)
}

/// A state of the chain: a pin, a ball joint, a pin, a universal joint.
fn swinging() -> ([f64; Whole::NQ], [f64; Whole::NV]) {
    let s = 0.5_f64.sqrt();
    ([0.3, 0.5 * s, -0.5 * s, s, 0.5, 0.7, -0.4, 1.1], [2.0, -1.0, 0.5, 3.0, -2.0, 1.5, 0.7])
}

#[test]
fn a_joint_is_cut() {
    let (q, v) = swinging();
    let mut broken = Broken::new();
    let (new_q, new_p) = broken.transfer_from(&Whole::new(), &q, &v).expect("a state");
    let (a, b) = (plan(CHAIN, None), plan(CHAIN, Some("broken")));
    let (wanted_q, wanted_p) = carried((&a, &b), (&q, &v), |_, _| ());
    near("coordinates", &new_q, &wanted_q);
    near("momenta", &new_p, &wanted_p);
}

#[test]
fn joints_lock_with_an_impact_and_are_released() {
    let (q, v) = swinging();
    let (mut held, whole) = (Held::new(), Whole::new());
    let (new_q, new_p) = held.transfer_from(&whole, &q, &v).expect("a state");
    // The momenta of the joints that go on are what they were: the impulses of the impact act in the others.
    let mut p = whole.zero_momenta();
    whole.momenta(&q, &v, &mut p);
    near("momenta that stay", &new_p, &[p[0], p[4]]);
    near("held at", &held.drive_q, &[q[1], q[2], q[3], q[4], q[6], q[7]]);
    assert_eq!(held.drive_v, [0.0; 5]);
    let (a, b) = (plan(CHAIN, None), plan(CHAIN, Some("held")));
    let (wanted_q, wanted_p) = carried((&a, &b), (&q, &v), |_, new| new.drive_q.copy_from_slice(&held.drive_q));
    near("coordinates", &new_q, &wanted_q);
    near("momenta", &new_p, &wanted_p);

    // From the held chain on: one joint is released and another one cut.
    let rates = [0.8, -0.6];
    let mut broken = Broken::new();
    let (released_q, released_p) = broken.transfer_from(&held, &new_q, &rates).expect("a state");
    let c = plan(CHAIN, Some("broken"));
    let (wanted_q, wanted_p) = carried((&b, &c), (&new_q, &rates), |old, _| old.drive_q.copy_from_slice(&held.drive_q));
    near("coordinates", &released_q, &wanted_q);
    near("momenta", &released_p, &wanted_p);
}

#[test]
fn one_joint_is_cut_while_another_one_locks() {
    let (q, v) = swinging();
    let mut both = Both::new();
    let (new_q, new_p) = both.transfer_from(&Whole::new(), &q, &v).expect("a state");
    let (a, b) = (plan(CHAIN, None), plan(CHAIN, Some("both")));
    let (wanted_q, wanted_p) = carried((&a, &b), (&q, &v), |_, new| new.drive_q.copy_from_slice(&both.drive_q));
    near("coordinates", &new_q, &wanted_q);
    near("momenta", &new_p, &wanted_p);
    // Parameters go with the state, and nothing that is not a number goes unnoticed.
    let mut heavy = Whole::new();
    heavy.params[Whole::PARAM_TIP_MASS] = 0.9;
    both.transfer_from(&heavy, &q, &v).expect("a state");
    assert_eq!(both.params, heavy.params);
    let kept = both.clone();
    assert!(both.transfer_from(&Whole::new(), &q, &[f64::NAN; Whole::NV]).is_err());
    assert_eq!(both, kept);
}

#[test]
fn bodies_dock_wherever_they_are_and_part() {
    let s = 0.5_f64.sqrt();
    let mut q = Apart::new().neutral();
    q[..7].copy_from_slice(&[1.0, 2.0, 3.0, 0.5 * s, s, -0.5 * s, 0.5]);
    q[7] = 0.4;
    q[8..].copy_from_slice(&[2.0, 2.5, 2.0, 0.5, -0.5, 0.5, 0.5]);
    let v = [0.3, -0.1, 0.2, 0.05, 0.2, -0.1, 4.0, 0.9, 0.4, -0.6, 0.3, -0.5, 0.8];
    let mut docked = Docked::new();
    let (new_q, new_p) = docked.transfer_from(&Apart::new(), &q, &v).expect("a state");
    let (a, b) = (plan(DOCKING, None), plan(DOCKING, Some("docked")));
    let (wanted_q, wanted_p) = carried((&a, &b), (&q, &v), |_, new| new.drive_q.copy_from_slice(&docked.drive_q));
    near("coordinates", &new_q, &wanted_q);
    // Momenta of forty kilograms.
    within(1e-12, "momenta", &new_p, &wanted_p);

    let mut released = Released::new();
    let v = [0.1, 0.2, -0.3, 0.2, 0.1, -0.2, 5.0];
    let (new_q, new_p) = released.transfer_from(&docked, &new_q, &v).expect("a state");
    let (wanted_q, wanted_p) =
        carried((&b, &a), (&wanted_q, &v), |old, _| old.drive_q.copy_from_slice(&docked.drive_q));
    near("coordinates", &new_q, &wanted_q);
    within(1e-12, "momenta", &new_p, &wanted_p);
}

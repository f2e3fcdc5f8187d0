//! The committed code of `generated/` and of the tour against the interpreter: every function, bit for bit, in twenty
//! random states.
//!
//! With exact arithmetic, generated code and interpreter compute the same operations in the same order. Only the sign
//! of zeros may differ, which the comparison removes by adding `0.0`.

#[path = "../../generated/mod.rs"]
#[rustfmt::skip]
mod generated;
#[path = "../../cli/tour/mod.rs"]
#[rustfmt::skip]
mod tour;

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::sweep::FrameState;
use multibody::runtime::{Interpreter, System};

const STATES: u64 = 20;

/// A plan and its interpreter, with the default options of the generator.
fn interpreter(file: &str, base: Base) -> (Plan, Interpreter<f64>) {
    let text = std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))).expect("the model");
    let read = read::model(file, &text, &ImportOptions { base, ..ImportOptions::default() })
        .unwrap_or_else(|findings| panic!("{findings}"));
    let plan = search::plan(&read.model, PlanOptions::default());
    let params = plan.default_params();
    let interpreter = Interpreter::new(plan.tree(&params), plan.gravity(&params));
    (plan, interpreter)
}

/// Marsaglia's xorshift generator, which gives the same numbers on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn fill(&mut self, list: &mut [f64], size: f64) {
        list.iter_mut().for_each(|x| *x = size * self.next());
    }
}

fn unit(quaternion: &mut [f64]) {
    let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    quaternion.iter_mut().for_each(|x| *x /= norm);
}

/// Asserts that numbers are finite and have equal bits; zeros may differ in sign.
fn same(what: &str, state: u64, ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (k, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!(a.is_finite() && b.is_finite(), "{what}[{k}] in state {state}: {a} and {b}");
        assert_eq!((a + 0.0).to_bits(), (b + 0.0).to_bits(), "{what}[{k}] in state {state}: {a} and {b}");
    }
}

macro_rules! check {
    ($name:ident, $type:ty, $file:literal, $base:expr, inputs: [$($input:ident),*], outputs: [$($output:ident),*]) => {
        #[test]
        fn $name() {
            let (plan, mut interpreter) = interpreter($file, $base);
            let mut system = <$type>::new();
            const NQ: usize = <$type>::NQ;
            const NV: usize = <$type>::NV;
            assert_eq!((plan.dims.nq, plan.dims.nv), (NQ, NV));
            assert_eq!(plan.coordinate_names(), <$type>::COORDINATES);
            assert_eq!(plan.velocity_names(), <$type>::VELOCITIES);
            assert_eq!(System::lie_joints(&system), System::lie_joints(&interpreter));
            assert_eq!(System::neutral(&system).to_vec(), System::neutral(&interpreter));
            let mut random = Random(0x9e37_79b9_7f4a_7c15);
            for state in 0..STATES {
                let (mut q, mut v, mut p) = ([0.0; NQ], [0.0; NV], [0.0; NV]);
                random.fill(&mut q, 3.0);
                for at in interpreter.quaternions() {
                    unit(&mut q[at..at + 4]);
                }
                random.fill(&mut v, 2.0);
                random.fill(&mut p, 2.0);
                $(input!($input, system, interpreter, random);)*
                let given = Given { q, v, p, state };
                $(output!($output, $type, system, interpreter, given);)*
            }
        }
    };
}

/// The arguments of all outputs.
struct Given<const NQ: usize, const NV: usize> {
    q: [f64; NQ],
    v: [f64; NV],
    p: [f64; NV],
    state: u64,
}

macro_rules! input {
    (wrenches, $system:ident, $interpreter:ident, $random:ident) => {
        for (ours, theirs) in $system.wrenches.iter_mut().zip(&mut $interpreter.wrenches) {
            $random.fill(ours, 5.0);
            *theirs = *ours;
        }
    };
    ($list:ident, $system:ident, $interpreter:ident, $random:ident) => {
        $random.fill(&mut $system.$list, 3.0);
        $interpreter.$list.copy_from_slice(&$system.$list);
    };
}

macro_rules! output {
    (rates, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let Given { q, p, state, .. } = $given;
        let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
        $system.rates(&q, &p, &mut qd, &mut pd);
        let (mut v, mut qd2, mut pd2) = ([0.0; NV], [0.0; NQ], [0.0; NV]);
        $interpreter.rates(&q, &p, &mut v, &mut qd2, &mut pd2);
        same("qd", state, &qd, &qd2);
        same("pd", state, &pd, &pd2);
        $system.coordinate_rates(&q, &v, &mut qd);
        same("coordinate rates", state, &qd, &qd2);
    };
    (velocities, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (mut ours, mut theirs) = ([0.0; NV], [0.0; NV]);
        $system.velocities(&$given.q, &$given.p, &mut ours);
        $interpreter.velocities(&$given.q, &$given.p, &mut theirs);
        same("velocities", $given.state, &ours, &theirs);
    };
    (momenta, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (mut ours, mut theirs) = ([0.0; NV], [0.0; NV]);
        $system.momenta(&$given.q, &$given.v, &mut ours);
        $interpreter.momenta(&$given.q, &$given.v, &mut theirs);
        same("momenta", $given.state, &ours, &theirs);
    };
    (energy, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (kinetic, potential) = $interpreter.energy(&$given.q, &$given.p);
        same("energy", $given.state, &$system.energy(&$given.q, &$given.p), &[kinetic, potential]);
    };
    (accelerations, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (mut ours, mut theirs) = ([0.0; NV], [0.0; NV]);
        $system.accelerations(&$given.q, &$given.v, &mut ours);
        $interpreter.accelerations(&$given.q, &$given.v, &mut theirs);
        same("accelerations", $given.state, &ours, &theirs);
    };
    (reactions, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let joints = $interpreter.tree().joint_nodes.len();
        let mut ours = [[0.0; 6]; 3];
        let (mut theirs, mut a) = (vec![[0.0; 6]; joints], [0.0; NV]);
        $system.reactions(&$given.q, &$given.v, (&mut ours[..joints]).try_into().expect("at most three joints"));
        $interpreter.reactions(&$given.q, &$given.v, &mut a, &mut theirs);
        same("reactions", $given.state, &ours[..joints].concat(), &theirs.concat());
    };
    (mass_matrix, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (mut ours, mut theirs) = ([[0.0; NV]; NV], vec![0.0; NV * NV]);
        $system.mass_matrix(&$given.q, &mut ours);
        $interpreter.mass_matrix(&$given.q, &mut theirs);
        same("mass matrix", $given.state, &ours.concat(), &theirs);
    };
    (inverse_dynamics, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (mut ours, mut theirs) = ([0.0; NV], [0.0; NV]);
        $system.inverse_dynamics(&$given.q, &$given.v, &$given.p, &mut ours);
        $interpreter.inverse_dynamics(&$given.q, &$given.v, &$given.p, &mut theirs);
        same("inverse dynamics", $given.state, &ours, &theirs);
    };
    (bias, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let (mut ours, mut theirs) = ([0.0; NV], [0.0; NV]);
        $system.bias(&$given.q, &$given.v, &mut ours);
        $interpreter.bias(&$given.q, &$given.v, &mut theirs);
        same("bias", $given.state, &ours, &theirs);
    };
    (jacobians, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let count = $interpreter.tree().frames.len();
        let (mut ours, mut theirs) = ([[[0.0; NV]; 6]; 3], vec![0.0; 6 * NV * count]);
        $system.jacobians(&$given.q, (&mut ours[..count]).try_into().expect("at most three frames"));
        $interpreter.jacobians(&$given.q, &mut theirs);
        same("jacobians", $given.state, &ours[..count].concat().concat(), &theirs);
    };
    (bias_accelerations, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let count = $interpreter.tree().frames.len();
        let (mut ours, mut theirs) = ([[0.0; 6]; 3], vec![[0.0; 6]; count]);
        $system.bias_accelerations(
            &$given.q,
            &$given.v,
            (&mut ours[..count]).try_into().expect("at most three frames"),
        );
        $interpreter.bias_accelerations(&$given.q, &$given.v, &mut theirs);
        same("bias_accelerations", $given.state, &ours[..count].concat(), &theirs.concat());
    };
    (frames, $type:ty, $system:ident, $interpreter:ident, $given:ident) => {
        let count = $interpreter.tree().frames.len();
        let (mut rotation, mut position, mut velocity) = ([[[0.0; 3]; 3]; 3], [[0.0; 3]; 3], [[0.0; 6]; 3]);
        $system.frames(
            &$given.q,
            &$given.v,
            (&mut rotation[..count]).try_into().expect("at most three frames"),
            (&mut position[..count]).try_into().expect("at most three frames"),
            (&mut velocity[..count]).try_into().expect("at most three frames"),
        );
        let mut theirs = vec![FrameState::ground(); count];
        $interpreter.frames(&$given.q, &$given.v, &mut theirs);
        for (k, frame) in theirs.iter().enumerate() {
            same("rotation", $given.state, &rotation[k].concat(), &frame.rotation.concat());
            same("position", $given.state, &position[k], &frame.position);
            same("velocity", $given.state, &velocity[k], &[frame.velocity.lin, frame.velocity.ang].concat());
        }
    };
}

check!(
    double_pendulum,
    generated::double_pendulum::DoublePendulum,
    "models/double_pendulum.toml",
    Base::Fixed,
    inputs: [tau],
    outputs: [
        rates, velocities, momenta, energy, accelerations, reactions, mass_matrix, frames, inverse_dynamics, bias, jacobians,
        bias_accelerations
    ]
);
check!(
    spherical_pendulum,
    generated::spherical_pendulum::SphericalPendulum,
    "models/spherical_pendulum.toml",
    Base::Fixed,
    inputs: [tau],
    outputs: [
        rates, velocities, momenta, energy, accelerations, reactions, mass_matrix, frames, inverse_dynamics, bias, jacobians,
        bias_accelerations
    ]
);
check!(
    satellite,
    generated::satellite::Satellite,
    "models/satellite.toml",
    Base::Fixed,
    inputs: [tau, drive_q, drive_v, drive_a, wrenches],
    outputs: [
        rates, velocities, momenta, energy, accelerations, reactions, mass_matrix, frames, inverse_dynamics, bias, jacobians,
        bias_accelerations
    ]
);
check!(
    chain6,
    generated::chain6::Chain6,
    "models/chain6.toml",
    Base::Fixed,
    inputs: [tau],
    outputs: [rates, velocities, momenta, energy, accelerations]
);
check!(
    chain10_planar,
    generated::chain10_planar::Chain10Planar,
    "models/chain10_planar.toml",
    Base::Fixed,
    inputs: [tau],
    outputs: [rates, velocities, momenta, energy, accelerations, mass_matrix, inverse_dynamics, bias]
);
check!(
    chain100,
    generated::chain100::Chain100,
    "models/chain100.toml",
    Base::Fixed,
    inputs: [tau],
    outputs: [rates, velocities, momenta, energy]
);
check!(
    ur5,
    tour::ur5::Ur5,
    "models/ur5.urdf",
    Base::Fixed,
    inputs: [tau],
    outputs: [rates, velocities, momenta, energy, accelerations, mass_matrix, inverse_dynamics, bias]
);
check!(
    panda,
    generated::panda::Panda,
    "models/panda.urdf",
    Base::Fixed,
    inputs: [tau],
    outputs: [rates, velocities, momenta, energy, accelerations]
);
check!(
    solo12,
    generated::solo12::Solo12,
    "models/solo12.urdf",
    Base::Floating,
    inputs: [tau],
    outputs: [rates, velocities, momenta, energy, accelerations]
);

#[test]
fn the_documented_table_of_outputs_is_that_of_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/book/src/outputs.md");
    let (documented, table) = (std::fs::read_to_string(path).expect("the table"), multibody::codegen::output::table());
    assert!(documented.ends_with(&table), "book/src/outputs.md should end with\n{table}");
}

//! Types made by `mbd_model!` compile without warnings and give the results of the interpreter, bit for bit.
#![deny(warnings, missing_docs, unused, nonstandard_style, unreachable_pub)]

use multibody::codegen::options::PlanOptions;
use multibody::codegen::read::{self, Base, ImportOptions};
use multibody::codegen::search;
use multibody::runtime::integrate::{Gauss16, Rk4, Solver, Step, StepError, Stepper, Tolerances};
use multibody::runtime::system::Part;
use multibody::runtime::{Interpreter, System};

/// Types with names that generated code has for other things.
pub mod odd_names {
    multibody::mbd_model! { path = "models/double_pendulum.toml", name = P0, outputs = [rates] }
    multibody::mbd_model! { path = "models/double_pendulum.toml", name = Option, outputs = [rates] }
}

/// Types in a public module, as users have them.
pub mod made {
    // There are several types in one module, and the module imports nothing.
    multibody::mbd_model! { path = "models/double_pendulum.toml", name = DoublePendulum, arithmetic = exact }
    multibody::mbd_model! { path = "models/double_pendulum.toml", name = Bounded, arithmetic = exact, angles = bounded }
    multibody::mbd_model! { path = "models/double_pendulum.toml", name = Again, outputs = [velocities], efforts = false }
    multibody::mbd_model! { path = "models/ur5.urdf", name = pub(crate) Ur5, arithmetic = exact }
    multibody::mbd_model! { path = "models/solo12.urdf", name = Solo12, base = floating, arithmetic = exact }
    multibody::mbd_model! {
        path = r"models/double_pendulum.toml",
        name = #[doc = "With a fine copy."] #[derive(Copy)] pub Single,
        scalar = f32,
        outputs = [rates, velocities, momenta, energy, accelerations, reactions, mass_matrix, frames, inverse_dynamics, bias, jacobians, bias_accelerations],
        gravity = [0, -1.62, 0.0],
        frames = [tip, "upper"],
        snap = 0,
        runtime = multibody::runtime
    }
    multibody::mbd_model! {
        toml = r#"
            gravity = "input"
            [params]
            load = 1.5
            [[body]]
            name = "bob"
            mass = { param = "load" }
            com = [0, 0, -1]
            inertia = [0.1, 0.1, 0.1]
            [[joint]]
            name = "pivot"
            type = "spherical"
            child = "bob"
            [[wrench]]
            body = "bob"
        "#,
        name = Bob,
        outputs = [rates],
    }
    multibody::mbd_model! {
        urdf = "<robot name='slide'><link name='a'><inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' \
                iyy='1' iyz='0' izz='1'/></inertial></link></robot>",
        name = Sled,
        base = planar,
        outputs = [mass_matrix, frames, jacobians],
    }
    multibody::mbd_model! { path = "models/double_pendulum.toml", name = Bare, outputs = [] }

    macro_rules! named {
        ($path:literal, $name:ident, $outputs:tt, $runtime:path) => {
            multibody::mbd_model! { path = $path, name = $name, outputs = $outputs, runtime = $runtime }
        };
    }
    named!("models/double_pendulum.toml", Wrapped, [energy], ::multibody::runtime);
}

/// An attribute silences warnings about a model.
#[allow(deprecated)]
mod warned {
    // No body can have this inertia.
    multibody::mbd_model! {
        urdf = "<robot name='w'><link name='r'/><link name='a'><inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' \
                iyy='1' iyz='0' izz='3'/></inertial></link><joint name='j' type='continuous'><parent link='r'/>\
                <child link='a'/></joint></robot>",
        name = pub(super) Warned,
    }
}

fn interpreter(file: &str, base: Base) -> Interpreter<f64> {
    let text = std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))).expect("the model");
    let read = read::model(file, &text, &ImportOptions { base, ..ImportOptions::default() })
        .unwrap_or_else(|findings| panic!("{findings}"));
    let plan = search::plan(&read.model, PlanOptions::default());
    plan.interpreter(&plan.default_params())
}

/// Numbers in (-1, 1) without special values.
fn numbers(seed: usize, out: &mut [f64]) {
    for (k, x) in out.iter_mut().enumerate() {
        *x = ((1 + seed * 31 + k) as f64 * 0.618_033_988_749_895).fract() * 2.0 - 1.0;
    }
}

fn bits(x: &[f64]) -> Vec<u64> {
    x.iter().map(|x| x.to_bits()).collect()
}

/// Compares one type with the interpreter: rates, momenta and energies in a few states, then a step of the integrator.
macro_rules! compare {
    ($name:ident, $made:ident, $file:literal, $base:expr) => {
        #[test]
        fn $name() {
            const NQ: usize = made::$made::NQ;
            const NV: usize = made::$made::NV;
            let (mut made, mut interpreter) = (made::$made::new(), interpreter($file, $base));
            assert_eq!(made.neutral().as_slice(), interpreter.neutral());
            assert_eq!(made.lie_joints(), interpreter.lie_joints());
            for part in (0..=NV).flat_map(|k| [Part::Velocity(k), Part::Constraint(k)]) {
                assert_eq!(made.part_name(part), interpreter.part_name(part));
            }
            assert!(made.part_name(Part::Velocity(NV - 1)).is_some());
            for seed in 0..5 {
                let (mut q, mut p, mut v) = ([0.0; NQ], [0.0; NV], [0.0; NV]);
                numbers(seed, &mut q);
                numbers(seed + 50, &mut v);
                numbers(seed + 90, &mut made.tau);
                interpreter.tau.copy_from_slice(&made.tau);
                for k in made.quaternions() {
                    let norm = q[k..k + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
                    q[k..k + 4].iter_mut().for_each(|x| *x /= norm);
                }
                made.momenta(&q, &v, &mut p);
                let mut p2 = vec![0.0; NV];
                interpreter.momenta(&q, &v, &mut p2);
                assert_eq!(bits(&p), bits(&p2), "p, state {seed}");

                let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
                let (mut v2, mut qd2, mut pd2) = (vec![0.0; NV], vec![0.0; NQ], vec![0.0; NV]);
                made.rates(&q, &p, &mut qd, &mut pd);
                interpreter.rates(&q, &p, &mut v2, &mut qd2, &mut pd2);
                assert_eq!(bits(&qd), bits(&qd2), "qd, state {seed}");
                assert_eq!(bits(&pd), bits(&pd2), "pd, state {seed}");

                let energy = interpreter.energy(&q, &p);
                assert_eq!(bits(&made.energy(&q, &p)), bits(&[energy.0, energy.1]), "energies, state {seed}");

                let (mut q2, mut p2) = (q.to_vec(), p.to_vec());
                let start = q;
                Rk4::new(&made).step(&mut made, 0.0, 1e-3, &mut q, &mut p).expect("a small step");
                Rk4::new(&interpreter).step(&mut interpreter, 0.0, 1e-3, &mut q2, &mut p2).expect("a small step");
                assert_ne!(bits(&q), bits(&start));
                assert_eq!((bits(&q), bits(&p)), (bits(&q2), bits(&p2)), "step from state {seed}");
            }
        }
    };
}

compare!(double_pendulum, DoublePendulum, "models/double_pendulum.toml", Base::Fixed);
compare!(ur5, Ur5, "models/ur5.urdf", Base::Fixed);
compare!(solo12_floating, Solo12, "models/solo12.urdf", Base::Floating);

#[test]
fn arguments_take_effect() {
    // All numbers are `f32`, the gravity of the moon acts along -y, and the requested frames come in the order of the
    // request.
    let single = made::Single::new();
    let copy = single;
    assert_eq!((made::Single::FRAME_TIP, made::Single::FRAME_UPPER), (0, 1));
    let (mut rotation, mut position, mut velocity) = ([[[0.0; 3]; 3]; 2], [[0.0; 3]; 2], [[0.0; 6]; 2]);
    copy.frames(&[0.0, 0.0], &[1.0, 0.0], &mut rotation, &mut position, &mut velocity);
    assert_eq!(position, [[0.0, 0.0, -2.0_f32], [0.0; 3]]);
    assert_eq!(velocity[0], [-2.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let [_, potential] = single.energy(&[0.5, 0.5], &[0.0, 0.0]);
    assert_eq!(potential, 0.0, "no work along y");

    // With `efforts = false` the type has no field, and it has only functions of the requested outputs.
    let again = made::Again {};
    let mut v = [0.0; 2];
    again.velocities(&[0.0, 0.0], &[1.0, 0.0], &mut v);
    assert!(v[0] > 0.0);
    assert_eq!(made::Wrapped::new().energy(&[0.0, 0.0], &[0.0, 0.0])[0], 0.0);
    assert_eq!(made::Bare::NQ, 2);
}

/// Code for bounded angles is the same up to the bound; beyond it a step is an error.
#[test]
fn bounded_angles() {
    let (mut all, mut bounded) = (made::DoublePendulum::new(), made::Bounded::new());
    let p = [0.3, -0.2];
    for angle in [0.5, -40.0, 1e6] {
        let ((mut qd, mut pd), (mut qd_bounded, mut pd_bounded)) = (([0.0; 2], [0.0; 2]), ([0.0; 2], [0.0; 2]));
        all.rates(&[angle, -angle], &p, &mut qd, &mut pd);
        bounded.rates(&[angle, -angle], &p, &mut qd_bounded, &mut pd_bounded);
        assert_eq!((qd, pd), (qd_bounded, pd_bounded), "{angle}");
    }
    let state = ([1.0, 1.1e6], p);
    let (mut q, mut p) = state;
    assert!(Rk4::new(&all).step(&mut all, 0.0, 1e-3, &mut q, &mut p).is_ok());
    let (mut q, mut p) = state;
    let error = Rk4::new(&bounded).step(&mut bounded, 0.0, 1e-3, &mut q, &mut p);
    assert!(matches!(error, Err(StepError::NotFinite { .. })), "{error:?}");
    assert_eq!((q, p), state);
}

#[test]
fn inline_descriptions() {
    let mut bob = made::Bob::default();
    assert_eq!(bob.params, [1.5]);
    bob.params[made::Bob::PARAM_LOAD] = 2.0;
    bob.gravity = [0.0, 3.0, 0.0];
    bob.wrenches[made::Bob::WRENCH_BOB][3] = 0.5;
    assert_eq!(bob.neutral(), [0.0, 0.0, 0.0, 1.0]);
    // At rest, the moment about x is the sum of that of the weight, -m g y × (0, 0, -1), and the given one.
    let (mut qd, mut pd) = ([1.0; 4], [1.0; 3]);
    bob.rates(&[0.0, 0.0, 0.0, 1.0], &[0.0; 3], &mut qd, &mut pd);
    assert_eq!(qd, [0.0; 4]);
    assert_eq!(pd, [6.5, 0.0, 0.0]);

    let mut m = [[0.0; 3]; 3];
    made::Sled::new().mass_matrix(&[0.0; 3], &mut m);
    assert_eq!(m, [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(warned::Warned::NV, 1);
}

/// The rates of states side by side have the bits of those one by one, and so a method that evaluates its stages at once
/// gives the bits that the interpreter gives, which has no lanes.
#[test]
fn stages_at_once_have_the_same_bits() {
    fn check<const NQ: usize, const NV: usize, Y>(mut made: Y, (mut interpreter, q): (Interpreter<f64>, Vec<f64>))
    where
        Y: System<Scalar = f64, Coordinates = [f64; NQ], Momenta = [f64; NV]>,
    {
        let p: [f64; NV] = core::array::from_fn(|k| 0.1 + 0.05 * k as f64);
        let q: [f64; NQ] = q.try_into().expect("as many coordinates");
        let (rows_q, rows_p) = (q.map(|x| [0.0, 0.01, 0.02].map(|dx| x + dx)), p.map(|x| [x, x + 0.3, x - 0.7]));
        let (mut rows_qd, mut rows_pd) = ([[0.0; 3]; NQ], [[0.0; 3]; NV]);
        assert!(made.rates_in_lanes(&[0.0; 3], &rows_q, &rows_p, &mut rows_qd, &mut rows_pd));
        assert!(!made.rates_in_lanes(&[0.0; 3], &rows_q[1..], &rows_p, &mut rows_qd, &mut rows_pd), "a row is missing");
        for lane in 0..3 {
            let (q, p) = (rows_q.map(|row| row[lane]), rows_p.map(|row| row[lane]));
            let (mut qd, mut pd) = ([0.0; NQ], [0.0; NV]);
            made.rates_at(0.0, &q, &p, &mut qd, &mut pd);
            assert_eq!((qd, pd), (rows_qd.map(|row| row[lane]), rows_pd.map(|row| row[lane])));
        }
        let step = Step::Adaptive(Tolerances::new(1e-9));
        let method = Gauss16::new(&made);
        let mut solver = Solver::new(&mut made, method, step, 0.0, &q, &p).expect("a start");
        solver.run(&mut made, 0.3).expect("a motion");
        let (mut q1, mut p1) = (q, p);
        solver.state(&made, &mut q1, &mut p1);
        let method = Gauss16::new(&interpreter);
        let mut solver = Solver::new(&mut interpreter, method, step, 0.0, &q.to_vec(), &p.to_vec()).expect("a start");
        solver.run(&mut interpreter, 0.3).expect("a motion");
        let (mut q2, mut p2) = (q.to_vec(), p.to_vec());
        solver.state(&interpreter, &mut q2, &mut p2);
        assert_eq!((&q1[..], &p1[..]), (&q2[..], &p2[..]));
        assert_ne!(q1, q);
    }
    let start = |file, base| {
        let interpreter = interpreter(file, base);
        let q = interpreter.neutral();
        (interpreter, q)
    };
    check(made::Ur5::new(), start("models/ur5.urdf", Base::Fixed));
    check(made::Solo12::new(), start("models/solo12.urdf", Base::Floating));
}

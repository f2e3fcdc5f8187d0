//! The interpreter and the integrators allocate during construction, never afterwards.

use allocation_counter::measure;
use mbd_runtime::integrate::{
    Ab6, Abm8, Direction, EnergyProjection, Events, Gauss12FixedPoint, Gauss16, ImplicitMidpoint, Outcome, Radau5, Rk4,
    Rodas5P, Solver, Step, StepError, Stepper, Tolerances, Tsit5, VariableAdams, Verner9, Watch,
};
use mbd_runtime::sweep::{Derivatives, FrameState};
use mbd_runtime::Interpreter;
use mbd_testing::eliminations::random_plan;
use mbd_testing::random::{random_model, Distribution};
use mbd_testing::state::random_state;

#[test]
fn the_counter_counts() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![1_u8; 100]))).count_total, 1);
}

#[test]
fn nothing_is_allocated_after_construction() {
    for seed in 0..200 {
        let plan = random_plan(&random_model(seed, &Distribution::everything(seed, 8)), seed);
        let s = random_state(&plan, seed);
        let mut i = s.interpreter(&plan);
        let (nq, nv) = (plan.dims.nq, plan.dims.nv);
        let (mut p, mut v, mut qd, mut pd) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nq], vec![0.0; nv]);
        let (mut a, mut m) = (vec![0.0; nv], vec![0.0; nv * nv]);
        let mut reactions = vec![[0.0; 6]; plan.joint_nodes.len()];
        let mut frames = vec![FrameState::ground(); plan.frames.len()];
        let (mut tau, mut jacobians) = (vec![0.0; nv], vec![0.0; 6 * nv * plan.frames.len()]);
        let mut drifts = vec![[0.0; 6]; plan.frames.len()];
        let mut derivatives = Derivatives::new(i.tree());
        let mut energy = (0.0, 0.0);
        let (mut q, mut p_stepped) = (s.q.clone(), p.clone());
        let mut rk4 = Rk4::new(&i);
        let (mut rank, mut step) = (Ok(()), Ok(()));
        let all = measure(|| {
            i.momenta(&s.q, &s.v, &mut p);
            i.rates(&s.q, &p, &mut v, &mut qd, &mut pd);
            i.velocities(&s.q, &p, &mut v);
            energy = i.energy(&s.q, &p);
            i.accelerations(&s.q, &s.v, &mut a);
            i.reactions(&s.q, &s.v, &mut a, &mut reactions);
            i.mass_matrix(&s.q, &mut m);
            i.derivatives(&s.q, &p, &mut derivatives);
            i.frames(&s.q, &s.v, &mut frames);
            i.inverse_dynamics(&s.q, &s.v, &a, &mut tau);
            i.bias(&s.q, &s.v, &mut tau);
            i.jacobians(&s.q, &mut jacobians);
            i.bias_accelerations(&s.q, &s.v, &mut drifts);
            rank = i.check_rank(&s.q);
            p_stepped.copy_from_slice(&p);
            step = rk4.step(&mut i, 0.0, 1e-4, &mut q, &mut p_stepped);
        });
        assert_eq!(all.count_total, 0, "seed {seed}: {all:?}");
        assert_eq!((rank, step), (Ok(()), Ok(())), "seed {seed}");
        assert!(energy.0.is_finite() && energy.1.is_finite(), "seed {seed}");
    }
}

/// Two events: the first momentum returns to its value at the start, and a given time is reached. The second field
/// counts events.
struct Back(f64, u32);

impl Events<Interpreter<f64>, 2> for Back {
    fn watches(&self) -> [Watch; 2] {
        [false, true].map(|terminal| Watch { direction: Direction::Both, terminal })
    }
    fn values(&mut self, _: &mut Interpreter<f64>, t: f64, _: &Vec<f64>, p: &Vec<f64>) -> [f64; 2] {
        [p[0] - self.0, t - 0.02]
    }
    fn happened(&mut self, _: &mut Interpreter<f64>, _: usize, _: f64, _: &Vec<f64>, _: &Vec<f64>) {
        self.1 += 1;
    }
}

#[test]
fn runs_with_events_allocate_nothing() {
    fn run<M: Stepper<Interpreter<f64>>>(seed: u64, method: impl Fn(&Interpreter<f64>) -> M) {
        let distribution = Distribution { bodies: (3, 4), armature: 0.5, ..Distribution::default() };
        let plan = random_plan(&random_model(seed, &distribution), seed);
        let s = random_state(&plan, seed);
        let mut i = s.interpreter(&plan);
        let mut p = vec![0.0; s.v.len()];
        i.momenta(&s.q, &s.v, &mut p);
        let method = method(&i);
        let step = Step::Adaptive(Tolerances::new(1e-7));
        let mut solver = Solver::new(&mut i, method, step, 0.0, &s.q, &p).expect("a start");
        let mut back = Back(p[0], 0);
        let (mut first, mut second) = (Ok(Outcome::End), Ok(()));
        let all = measure(|| {
            first = solver.run_events(&mut i, 1.0, &mut back);
            second = solver.run(&mut i, 0.03);
        });
        assert_eq!(all.count_total, 0, "seed {seed}: {all:?}");
        assert!(
            matches!(first, Ok(Outcome::Event { index: 1, time }) if (time - 0.02).abs() < 1e-15),
            "{seed} {first:?}"
        );
        assert_eq!(second, Ok(()), "seed {seed}");
        assert!(back.1 > 0 && solver.time() == 0.03, "seed {seed}");
    }
    for seed in 0..20 {
        run(seed, Tsit5::new);
        run(seed, Verner9::new);
    }
}

/// Makes two steps and counts the allocations of the second. In the first, the interpreter allocates room for
/// derivatives.
fn second_step<M: Stepper<Interpreter<f64>>>(i: &mut Interpreter<f64>, mut method: M, q: &[f64], p: &[f64]) -> u64 {
    let (mut q, mut p) = (q.to_vec(), p.to_vec());
    let mut step = |result: &mut Result<(), StepError>| *result = method.step(i, 0.0, 1e-4, &mut q, &mut p);
    let (mut first, mut second) = (Ok(()), Ok(()));
    step(&mut first);
    let count = measure(|| step(&mut second)).count_total;
    assert_eq!((first, second), (Ok(()), Ok(())));
    count
}

#[test]
fn implicit_steps_allocate_nothing() {
    for seed in 0..40 {
        let plan = random_plan(&random_model(seed, &Distribution::everything(seed, 8)), seed);
        let s = random_state(&plan, seed);
        let mut i = s.interpreter(&plan);
        let mut p = vec![0.0; plan.dims.nv];
        i.momenta(&s.q, &s.v, &mut p);
        let counts = [
            second_step(&mut i.clone(), ImplicitMidpoint::new(&i).with_iterations(2), &s.q, &p),
            second_step(&mut i.clone(), Gauss12FixedPoint::compensated(&i), &s.q, &p),
            second_step(&mut i.clone(), Gauss16::new(&i), &s.q, &p),
            second_step(&mut i.clone(), Radau5::new(&i), &s.q, &p),
            second_step(&mut i.clone(), Rodas5P::new(&i), &s.q, &p),
        ];
        assert_eq!(counts, [0; 5], "seed {seed}");
    }
}

/// The start, steps with a history, and changes of the order do not allocate.
#[test]
fn multistep_methods_allocate_nothing() {
    for seed in 0..20 {
        let plan = random_plan(&random_model(seed, &Distribution::everything(seed, 8)), seed);
        let s = random_state(&plan, seed);
        let mut i = s.interpreter(&plan);
        let (mut q, mut p) = (s.q.clone(), vec![0.0; plan.dims.nv]);
        i.momenta(&s.q, &s.v, &mut p);
        let (mut ab, mut abm, variable) = (Ab6::compensated(&i), Abm8::new(&i), VariableAdams::new(&i));
        let mut projection = EnergyProjection::new(&mut i, &q, &p, 1);
        let step = Step::Adaptive(Tolerances::new(1e-4));
        let mut solver = Solver::new(&mut i, variable, step, 0.0, &q, &p).expect("a start");
        let mut results = Ok(());
        let all = measure(|| {
            for _ in 0..20 {
                let ab = projection.step(&mut ab, &mut i, 0.0, 1e-6, &mut q, &mut p);
                let abm = abm.step(&mut i, 0.0, 1e-6, &mut q, &mut p);
                results = results.and(ab).and(abm).and(solver.advance(&mut i, 1.0));
            }
            solver.dense(&mut i, 0.5, &mut q, &mut p);
        });
        assert_eq!(all.count_total, 0, "seed {seed}: {all:?}");
        assert_eq!(results, Ok(()), "seed {seed}");
    }
}

//! The scenes of the benchmarks: models that pass the checks or are refused, starts that fit the models, and (feature
//! `generated`) generated code that agrees with the interpreter.

use mbd_lab::scenes::{self, Expect, Scene};
use multibody::codegen::model::Value;
use multibody::runtime::integrate::{Rk4, Stepper};
use multibody::runtime::{Energetic, Interpreter, System};

#[test]
fn names_are_unique_and_find_their_scenes() {
    let names: Vec<&str> = scenes::names().collect();
    for (k, name) in names.iter().enumerate() {
        assert!(!names[..k].contains(name), "{name} is in the list twice");
        assert_eq!(scenes::by_name(name).map(|s| s.name), Some(*name));
    }
    assert!(scenes::by_name("no such scene").is_none());
}

/// Starts have the sizes of their models, unit quaternions and finite energies, and exactly the scenes that are not
/// conservative have friction. Where `expect` is `Runs`, the mass matrix is regular and RK4 conserves the energy in the
/// first steps; where it is `Stops`, a step fails.
#[test]
fn starts_fit_their_models_and_their_expectations() {
    for s in scenes::all() {
        let mut system = s.interpreter::<f64>();
        assert_eq!((s.q.len(), s.v.len()), (system.neutral().len(), system.zero_momenta().len()), "{}", s.name);
        for at in system.quaternions() {
            let norm: f64 = s.q[at..at + 4].iter().map(|x| x * x).sum();
            assert_eq!(norm, 1.0, "{}", s.name);
        }
        let friction = s.model.joints.iter().flat_map(|j| &j.damping).any(|d| *d != Value::ZERO);
        assert_eq!(friction, !s.conservative, "{}", s.name);
        let steps = s.t_end / s.rk4_step;
        assert!(steps >= 100.0 && (steps - steps.round()).abs() < 1e-6, "{}: {steps} steps", s.name);
        let rank = system.check_rank(&s.q);
        match (s.expect, first_steps(&s, &mut system)) {
            (Expect::Runs, Ok(change)) => {
                assert_eq!(rank, Ok(()), "{}", s.name);
                // The largest measured change is 4e-7; the steps of the scenes are chosen for visible errors.
                assert!(!s.conservative || change < 1e-5, "{}: energy changes by {change:e}", s.name);
            }
            (Expect::Stops, Err(_)) => assert!(rank.is_err(), "{}", s.name),
            (_, result) => panic!("{}: {result:?}", s.name),
        }
    }
}

/// Change of the energy in ten steps of RK4, relative to the largest kinetic energy.
fn first_steps(s: &Scene, system: &mut Interpreter<f64>) -> Result<f64, String> {
    let (mut q, mut p) = s.start(system);
    let start = system.energies(&q, &p);
    let finite = start.0.is_finite() && start.0 >= 0.0 && start.1.is_finite();
    assert!(finite || s.expect == Expect::Stops, "{}: {start:?}", s.name);
    let (mut change, mut largest) = (0.0_f64, start.0);
    let mut rk4 = Rk4::new(system);
    for k in 0..10 {
        let t = f64::from(k) * s.rk4_step;
        rk4.step(system, t, s.rk4_step, &mut q, &mut p).map_err(|e| e.to_string())?;
        let (kinetic, potential) = system.energies(&q, &p);
        change = change.max((kinetic + potential - start.0 - start.1).abs());
        largest = largest.max(kinetic);
    }
    Ok(change / largest)
}

#[test]
fn models_without_inertia_are_refused() {
    for r in scenes::refused() {
        let (model, findings) = r.read();
        assert!(model.is_none(), "{} is accepted", r.name);
        assert!(findings.to_string().contains(r.finding), "{}: {findings}", r.name);
    }
}

/// The tree forks as the thesis describes: links 11 and 21 are on the tip of link 10, links 31 and 41 on that of link
/// 20.
#[test]
fn the_tree_forks_where_the_thesis_says() {
    let s = scenes::by_name("tree150_friction").expect("the scene");
    assert_eq!(s.model.joints.len(), 150);
    let parent = |body: &str| {
        let body = s.model.bodies.iter().position(|b| b.name == body).expect("the body");
        let joint = s.model.joints.iter().find(|j| j.child == body).expect("its joint");
        joint.parent.map_or("ground", |p| s.model.bodies[p].name.as_str())
    };
    let wanted = [
        ("link1", "ground"),
        ("link10", "link9"),
        ("link11left", "link10"),
        ("link21right", "link10"),
        ("link31left", "link20"),
        ("link41right", "link20"),
        ("link61right", "link30"),
        ("link71left", "link40"),
        ("link141right", "link70"),
    ];
    for (body, its) in wanted {
        assert_eq!(parent(body), its, "{body}");
    }
    assert_eq!((s.q.iter().filter(|q| **q == 0.3).count(), s.q.iter().filter(|q| **q == -0.3).count()), (7, 7));
}

#[cfg(feature = "generated")]
mod generated {
    use std::fmt::Debug;

    use mbd_lab::generated::{
        visit_differentiable_f32, visit_differentiable_f64, visit_f32, visit_f64, Visit, VisitDifferentiable,
    };
    use mbd_lab::scenes::Dynamics;
    use multibody::codegen::search::Wide;
    use multibody::runtime::{Differentiable, Scalar};

    use super::*;

    /// The results of every function, by its name.
    type Results = Vec<(&'static str, Vec<f64>)>;

    /// Coordinates, velocities, momenta.
    type State = [Vec<f64>; 3];

    struct All<'a>(&'a [State]);
    struct Derivatives<'a>(&'a [State]);

    /// A scalar as a double.
    trait Double: Scalar + Debug {
        fn double(self) -> f64;
    }

    impl Double for f64 {
        fn double(self) -> f64 {
            self
        }
    }

    impl Double for f32 {
        fn double(self) -> f64 {
            self.into()
        }
    }

    impl Double for Wide {
        fn double(self) -> f64 {
            self.0.hi()
        }
    }

    fn doubles<S: Double>(list: &[S]) -> Vec<f64> {
        list.iter().map(|x| x.double()).collect()
    }

    fn fill<S: Scalar>(out: &mut [S], from: &[f64]) {
        assert_eq!(out.len(), from.len());
        out.iter_mut().zip(from).for_each(|(out, x)| *out = S::constant(*x));
    }

    /// The start, and a state near it in which all joints move. `round` has rounded all numbers to the precision of the
    /// test.
    fn states(s: &Scene, round: fn(f64) -> f64) -> Vec<State> {
        let mut system = s.interpreter::<f64>();
        let quaternions: Vec<usize> = system.quaternions().collect();
        let of = |size: f64| {
            let (mut q, mut v) = (s.q.clone(), s.v.clone());
            for (k, q) in q.iter_mut().enumerate() {
                let fixed = quaternions.iter().any(|at| (*at..at + 4).contains(&k));
                *q = round(if fixed { *q } else { *q + size * (k as f64 + 1.0).sin() });
            }
            for (k, v) in v.iter_mut().enumerate() {
                *v = round(*v + size * (k as f64 + 1.0).cos());
            }
            let mut p = vec![0.0; v.len()];
            system.momenta(&q, &v, &mut p);
            [q, v, p.into_iter().map(round).collect()]
        };
        [0.0, 0.2].map(of).into()
    }

    fn all<Y: Dynamics<Scalar: Double>>(states: &[State], mut system: Y) -> Results {
        let mut results = Vec::new();
        let (mut q, mut v, mut p) = (system.neutral(), system.zero_momenta(), system.zero_momenta());
        for state in states {
            fill(q.as_mut(), &state[0]);
            fill(v.as_mut(), &state[1]);
            let (mut qd, mut pd, mut a) = (system.neutral(), system.zero_momenta(), system.zero_momenta());
            system.conjugate_momenta(&q, &v, &mut p);
            system.generalized_accelerations(&q, &v, &mut a);
            results.push(("momenta", doubles(p.as_ref())));
            fill(p.as_mut(), &state[2]);
            system.rates_at(Y::Scalar::zero(), &q, &p, &mut qd, &mut pd);
            let (kinetic, potential) = system.energies(&q, &p);
            results.push(("qd", doubles(qd.as_ref())));
            results.push(("pd", doubles(pd.as_ref())));
            results.push(("energy", doubles(&[kinetic, potential])));
            results.push(("accelerations", doubles(a.as_ref())));
        }
        results
    }

    fn derivatives<Y: Dynamics<Scalar: Double> + Differentiable>(states: &[State], mut system: Y) -> Results {
        let mut results = Vec::new();
        let (mut q, mut p) = (system.neutral(), system.zero_momenta());
        for state in states {
            fill(q.as_mut(), &state[0]);
            fill(p.as_mut(), &state[2]);
            let mut d = system.zero_derivatives();
            system.rate_derivatives(Y::Scalar::zero(), &q, &p, &mut d);
            results.push(("v", doubles(d.v.as_ref())));
            results.push(("pd", doubles(d.pd.as_ref())));
            for (name, block) in ["dv/dq", "dv/dp", "dpd/dq", "dpd/dp"].iter().zip(d.blocks().into_iter().flatten()) {
                results.push((name, block.as_ref().iter().flat_map(|row| doubles(row.as_ref())).collect()));
            }
        }
        results
    }

    impl<S: Double> Visit<S> for All<'_> {
        type Out = Results;
        fn visit<Y: Dynamics<Scalar = S>>(self, system: Y) -> Results {
            all(self.0, system)
        }
    }

    impl<S: Double> VisitDifferentiable<S> for Derivatives<'_> {
        type Out = Results;
        fn visit<Y: Dynamics<Scalar = S> + Differentiable>(self, system: Y) -> Results {
            derivatives(self.0, system)
        }
    }

    /// Largest difference of two lists, relative to the largest of `exact`.
    fn error(list: &[f64], exact: &[f64]) -> f64 {
        assert_eq!(list.len(), exact.len());
        let size = exact.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        list.iter().zip(exact).fold(0.0, |worst, (a, b)| match (a - b).abs() / size {
            e if e >= worst => e,
            e if e.is_nan() => f64::INFINITY,
            _ => worst,
        })
    }

    /// Generated code is rewritten for speed, so its rounding differs from that of the interpreter. The error of the
    /// interpreter shows how much the mass matrix amplifies rounding. Generated code may have ten times this error,
    /// because single results scatter, plus ten roundings of the largest result.
    fn compare(what: &str, ours: Option<Results>, plain: Results, exact: &Results, epsilon: f64) -> usize {
        let Some(ours) = ours else { return 0 };
        assert_eq!((ours.len(), plain.len()), (exact.len(), exact.len()));
        for (((name, a), (_, b)), (_, exact)) in ours.iter().zip(&plain).zip(exact) {
            let (a, b) = (error(a, exact), error(b, exact));
            println!("{what}: {name}: {a:.1e}, interpreter {b:.1e}");
            assert!(a <= 10.0 * (b + epsilon), "{what}: {name} is {a:e} off, the interpreter {b:e}");
        }
        1
    }

    #[test]
    fn generated_code_is_as_accurate_as_the_interpreter() {
        let (mut double, mut single, mut smooth) = (0, 0, 0);
        for s in scenes::all() {
            if visit_f64(s.name, All(&[])).is_none() {
                continue;
            }
            let differentiable = visit_differentiable_f64(s.name, Derivatives(&[])).is_some();
            let (f64s, f32s) = (states(&s, |x| x), states(&s, |x| f64::from(x as f32)));
            for (states, epsilon) in [(&f64s, f64::EPSILON), (&f32s, f64::from(f32::EPSILON))] {
                let in_single = epsilon > f64::EPSILON;
                if in_single && visit_f32(s.name, All(&[])).is_none() {
                    continue;
                }
                let ours = || if in_single { visit_f32(s.name, All(states)) } else { visit_f64(s.name, All(states)) };
                let plain = || match in_single {
                    true => all(states, s.interpreter::<f32>()),
                    false => all(states, s.interpreter::<f64>()),
                };
                let what = format!("{}, {}", s.name, if in_single { "f32" } else { "f64" });
                let exact = all(states, s.interpreter::<Wide>());
                let count = compare(&what, ours(), plain(), &exact, epsilon);
                *if in_single { &mut single } else { &mut double } += count;
                if !differentiable {
                    continue;
                }
                let ours = || match in_single {
                    true => visit_differentiable_f32(s.name, Derivatives(states)),
                    false => visit_differentiable_f64(s.name, Derivatives(states)),
                };
                let plain = || match in_single {
                    true => derivatives(states, s.interpreter::<f32>()),
                    false => derivatives(states, s.interpreter::<f64>()),
                };
                let exact = derivatives(states, s.interpreter::<Wide>());
                smooth += compare(&what, ours(), plain(), &exact, epsilon);
            }
        }
        assert_eq!((double, single, smooth), (13, 7, 16));
    }
}

/// If the mass matrix is ill-conditioned, rounding ends the convergence of iterations before the last digits. Implicit
/// methods must not fail because of that.
#[test]
fn implicit_steps_converge_on_chains() {
    use multibody::runtime::catalogue::{any, entries};
    use multibody::runtime::integrate::{Solver, Step};
    for name in ["chain10", "chain10_friction"] {
        let scene = scenes::by_name(name).expect("a scene");
        for entry in entries().filter(|e| e.implicit) {
            let mut system = scene.interpreter::<f64>();
            let (q, p) = scene.start(&mut system);
            let method = any(entry.name, &system, false).expect("a method");
            let mut driver = Solver::new(&mut system, method, Step::Fixed(5e-4), 0.0, &q, &p).expect("a start");
            driver.run(&mut system, 0.02).unwrap_or_else(|e| panic!("{name}, {}: {e}", entry.name));
        }
    }
}

//! The scenes of the benchmarks: models that pass the checks or are refused as they should be, starts that fit them, and
//! (feature `bench`) generated code that agrees with the interpreter.
#![cfg(feature = "scenes")]

use multibody::codegen::model::Value;
use multibody::runtime::integrate::{Rk4, Stepper};
use multibody::runtime::{Energetic, Interpreter, System};
use multibody::scenes::{self, Expect, Scene};

#[test]
fn names_are_unique_and_find_their_scenes() {
    let names: Vec<&str> = scenes::names().collect();
    for (k, name) in names.iter().enumerate() {
        assert!(!names[..k].contains(name), "{name} stands twice");
        assert_eq!(scenes::by_name(name).map(|s| s.name), Some(*name));
    }
    assert!(scenes::by_name("no such scene").is_none());
}

/// Sizes, quaternions, and a friction that is there only where the energy is not kept.
#[test]
fn starts_fit_their_models() {
    for s in scenes::all() {
        let system = s.interpreter::<f64>();
        assert_eq!((s.q.len(), s.v.len()), (system.neutral().len(), system.rest().len()), "{}", s.name);
        for at in system.quaternions() {
            let norm: f64 = s.q[at..at + 4].iter().map(|x| x * x).sum();
            assert_eq!(norm, 1.0, "{}", s.name);
        }
        let friction = s.model.joints.iter().flat_map(|j| &j.damping).any(|d| *d != Value::ZERO);
        assert_eq!(friction, !s.conservative, "{}", s.name);
        let steps = s.t_end / s.rk4_step;
        assert!(steps >= 100.0 && (steps - steps.round()).abs() < 1e-6, "{}: {steps} steps", s.name);
    }
}

#[test]
fn initial_energies_are_finite() {
    for s in scenes::all().into_iter().filter(|s| s.expect == Expect::Runs) {
        let mut system = s.interpreter::<f64>();
        let (q, p) = s.start(&mut system);
        let (kinetic, potential) = system.energy(&q, &p);
        assert!(kinetic.is_finite() && kinetic >= 0.0 && potential.is_finite(), "{}: {kinetic}, {potential}", s.name);
    }
}

/// What `expect` says, seen at the mass matrix and in the first steps: energy is kept to what RK4 keeps of it, or a step fails.
#[test]
fn scenes_start_as_they_should() {
    for s in scenes::all() {
        let mut system = s.interpreter::<f64>();
        let rank = system.check_rank(&s.q);
        match (s.expect, first_steps(&s, &mut system)) {
            (Expect::Runs, Ok(change)) => {
                assert_eq!(rank, Ok(()), "{}", s.name);
                // Measured: 8e-6 at most (mass_ratio_heavy_tip), of steps chosen for errors that can be seen.
                assert!(!s.conservative || change < 1e-4, "{}: energy changes by {change:e}", s.name);
            }
            (Expect::Stops, Err(_)) => assert!(rank.is_err(), "{}", s.name),
            (_, result) => panic!("{}: {result:?}", s.name),
        }
    }
}

/// Change of the energy in ten steps of RK4, relative to the largest kinetic energy.
fn first_steps(s: &Scene, system: &mut Interpreter<f64>) -> Result<f64, String> {
    let (mut q, mut p) = s.start(system);
    let start = system.state_energy(&q, &p);
    let (mut change, mut largest) = (0.0_f64, start.0);
    let mut rk4 = Rk4::new(system);
    for k in 0..10 {
        let t = f64::from(k) * s.rk4_step;
        rk4.step(system, t, s.rk4_step, &mut q, &mut p).map_err(|e| e.to_string())?;
        let (kinetic, potential) = system.state_energy(&q, &p);
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

/// As the thesis describes it: link 11 and link 21 fork at the tip of link 10, links 31 and 41 at that of link 20.
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

#[cfg(feature = "bench")]
mod generated {
    use multibody::runtime::{Blocks, Differentiable, Real, Scalar};
    use multibody::scenes::generated::{
        visit_differentiable_f32, visit_differentiable_f64, visit_f32, visit_f64, Visit, VisitDifferentiable,
    };
    use multibody::scenes::Dynamics;

    use super::*;

    /// Every number a function gave, function by function.
    type Results = Vec<(&'static str, Vec<f64>)>;

    /// Scenes that are generated, in double and in single precision.
    const DOUBLE: usize = 12;
    const SINGLE: usize = 6;

    struct All<'a>(&'a Scene);
    struct Derivatives<'a>(&'a Scene);

    fn doubles<S: Real>(list: &[S]) -> Vec<f64> {
        list.iter().map(|x| x.to_f64()).collect()
    }

    /// The start, or a state near it with nothing at rest.
    fn states<Y: Dynamics<Scalar: Real>>(s: &Scene, system: &mut Y) -> [(Y::Coordinates, Y::Momenta, Y::Momenta); 2] {
        [0.0, 0.2].map(|size| {
            let mut stirred = s.clone();
            let numbers = (1..).map(|k| size * f64::from(k).sin());
            let quaternions: Vec<usize> = system.quaternions().collect();
            for ((k, q), x) in stirred.q.iter_mut().enumerate().zip(numbers.clone()) {
                if !quaternions.iter().any(|at| (*at..at + 4).contains(&k)) {
                    *q += x;
                }
            }
            stirred.v.iter_mut().zip(numbers).for_each(|(v, x)| *v += x);
            let (q, p) = stirred.start(system);
            let mut v = system.rest();
            for (v, x) in v.as_mut().iter_mut().zip(&stirred.v) {
                *v = Y::Scalar::constant(*x);
            }
            (q, v, p)
        })
    }

    fn all<Y: Dynamics<Scalar: Real>>(s: &Scene, mut system: Y) -> Results {
        let mut results = Vec::new();
        for (q, v, p) in states(s, &mut system) {
            let (mut qd, mut pd, mut a) = (system.neutral(), system.rest(), system.rest());
            system.state_rates(Y::Scalar::zero(), &q, &p, &mut qd, &mut pd);
            let (kinetic, potential) = system.state_energy(&q, &p);
            system.state_accelerations(&q, &v, &mut a);
            results.push(("momenta", doubles(p.as_ref())));
            results.push(("qd", doubles(qd.as_ref())));
            results.push(("pd", doubles(pd.as_ref())));
            results.push(("energy", doubles(&[kinetic, potential])));
            results.push(("accelerations", doubles(a.as_ref())));
        }
        results
    }

    fn derivatives<Y: Dynamics<Scalar: Real> + Differentiable>(s: &Scene, mut system: Y) -> Results {
        let mut results = Vec::new();
        for (q, _, p) in states(s, &mut system) {
            let (mut v, mut pd) = (system.rest(), system.rest());
            let [mut a, mut b, mut c, mut d] = [(); 4].map(|()| system.square());
            let blocks = Blocks { dv_dq: &mut a, dv_dp: &mut b, dpd_dq: &mut c, dpd_dp: &mut d };
            system.rate_derivatives(Y::Scalar::zero(), &q, &p, &mut v, &mut pd, blocks);
            results.push(("v", doubles(v.as_ref())));
            results.push(("pd", doubles(pd.as_ref())));
            for (name, block) in [("dv/dq", &a), ("dv/dp", &b), ("dpd/dq", &c), ("dpd/dp", &d)] {
                results.push((name, block.as_ref().iter().flat_map(|row| doubles(row.as_ref())).collect()));
            }
        }
        results
    }

    impl<S: Real> Visit<S> for All<'_> {
        type Out = Results;
        fn visit<Y: Dynamics<Scalar = S>>(self, system: Y) -> Results {
            all(self.0, system)
        }
    }

    impl<S: Real> VisitDifferentiable<S> for Derivatives<'_> {
        type Out = Results;
        fn visit<Y: Dynamics<Scalar = S> + Differentiable>(self, system: Y) -> Results {
            derivatives(self.0, system)
        }
    }

    /// Largest difference of a function's results, relative to the largest of them. The generated code is rewritten for
    /// speed, so rounding differs; it is amplified by the condition of the mass matrix.
    fn compare(what: &str, scene: &str, ours: &Results, theirs: &Results, bound: f64) -> f64 {
        assert_eq!(ours.len(), theirs.len());
        let mut worst = 0.0_f64;
        for ((name, a), (_, b)) in ours.iter().zip(theirs) {
            assert_eq!(a.len(), b.len());
            let size = b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (k, (a, b)) in a.iter().zip(b).enumerate() {
                assert!(a.is_finite() && b.is_finite(), "{scene}, {what}: {name}[{k}] is {a} and {b}");
                let error = if a == b { 0.0 } else { (a - b).abs() / size };
                assert!(error <= bound, "{scene}, {what}: {name}[{k}] is {a}, not {b}: {error:e}");
                worst = worst.max(error);
            }
        }
        worst
    }

    #[test]
    fn generated_code_agrees_with_the_interpreter() {
        let mut counts = [0; 4];
        for s in scenes::all() {
            let name = s.name;
            let wanted = || all(&s, s.interpreter::<f64>());
            let slopes = || derivatives(&s, s.interpreter::<f64>());
            let found = [visit_f64(name, All(&s)), visit_f32(name, All(&s))];
            let smooth =
                [visit_differentiable_f64(name, Derivatives(&s)), visit_differentiable_f32(name, Derivatives(&s))];
            for (k, (what, bound)) in [("f64", DOUBLE_ERROR), ("f32", SINGLE_ERROR)].into_iter().enumerate() {
                if let Some(found) = &found[k] {
                    counts[k] += 1;
                    let worst = compare(what, name, found, &wanted(), bound);
                    println!("{name}, {what}: {worst:.1e}");
                }
                if let Some(found) = &smooth[k] {
                    counts[2 + k] += 1;
                    let worst = compare(what, name, found, &slopes(), bound);
                    println!("{name}, derivatives, {what}: {worst:.1e}");
                }
            }
        }
        assert_eq!(counts, [DOUBLE, SINGLE, 8, 6]);
    }

    const DOUBLE_ERROR: f64 = 1e-11;
    const SINGLE_ERROR: f64 = 1e-2;
}

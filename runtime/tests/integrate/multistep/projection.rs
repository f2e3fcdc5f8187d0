//! Energy projection after steps of multistep methods.

use mbd_runtime::integrate::{Ab4, Ab6, Abm8, Chart, EnergyProjection, Field, Point, Rk4, Stepper};
use mbd_runtime::Energetic;

use super::systems::{body, pendulum, top, Sledge};
use crate::systems::largest;

/// Compares the gradient of the energy, which follows from the rates, with differences of the energy.
fn gradient<Y: Energetic<Scalar = f64> + Clone>((mut y, q, p): (Y, Y::Coordinates, Y::Momenta)) {
    let mut field = Field::new(&y, false);
    field.load(&y, 0.0, &q, &p).unwrap();
    let n = p.as_ref().len();
    let (mut at, mut rate) = (Point::zero(&y), Point::zero(&y));
    // The state is displaced from the start, as at the end of a step.
    for (k, x) in at.parts_mut().into_iter().flatten().enumerate() {
        *x = 0.05 * f64::cos(k as f64);
    }
    field.rates(&mut y, 0.0, &at, &mut rate);
    let chart: Chart<Y> = field.chart().clone();
    chart.gradient(&y, &at, &mut rate);
    let on_lie_group = |k: usize| y.lie_joints().iter().any(|g| (g.v..g.v + g.kind.sizes().1).contains(&k));
    let fixed: Vec<bool> = (0..2 * n).map(|k| k >= n && on_lie_group(k - n)).collect();
    let found: Vec<f64> = rate.parts().concat();
    let mut energy = |k: usize, e: f64| {
        let (mut moved, mut q, mut p) = (at.clone(), q.clone(), p.clone());
        moved.parts_mut()[k / n][k % n] += e;
        chart.state(&y, &moved, &mut q, &mut p);
        let (kinetic, potential) = y.energies(&q, &p);
        kinetic + potential
    };
    for k in 0..2 * n {
        let e = 1e-4;
        let difference =
            (8.0 * (energy(k, e) - energy(k, -e)) - (energy(k, 2.0 * e) - energy(k, -2.0 * e))) / (12.0 * e);
        let expected = if fixed[k] { 0.0 } else { difference };
        // The bound is rounding of energies of some 20 J in differences over 2e-4.
        assert!((found[k] - expected).abs() < 1e-10, "{k}: {} {expected}", found[k]);
    }
}

#[test]
fn the_gradient_of_the_energy_follows_from_the_rates() {
    gradient(pendulum());
    gradient(top(3.0));
    gradient(body());
    gradient((Sledge, [0.3, -0.2, 0.7], [1.0, -0.5, 0.8]));
}

/// Largest change of the energy relative to 10 J in 10 s, with projection and without.
fn energies<Y: Energetic<Scalar = f64> + Clone, M: Stepper<Y>>(
    make: fn(&Y) -> M,
    (mut y, q, p): (Y, Y::Coordinates, Y::Momenta),
    h: f64,
) -> [f64; 2] {
    [true, false].map(|projected| {
        let (mut method, mut projection) = (make(&y), EnergyProjection::new(&mut y, &q, &p, 2));
        let (mut q, mut p) = (q.clone(), p.clone());
        let mut worst = 0.0_f64;
        for _ in 0..(10.0 / h) as u32 {
            match projected {
                true => projection.step(&mut method, &mut y, 0.0, h, &mut q, &mut p).unwrap(),
                false => method.step(&mut y, 0.0, h, &mut q, &mut p).unwrap(),
            }
            let (kinetic, potential) = y.energies(&q, &p);
            worst = largest([worst, (kinetic + potential - projection.target()) / 10.0]);
        }
        worst
    })
}

#[test]
fn projection_keeps_the_energy() {
    let found = [
        energies(Rk4::new, pendulum::<f64>(), 0.01),
        energies(Ab6::new, pendulum::<f64>(), 0.005),
        energies(Abm8::new, pendulum::<f64>(), 0.005),
        energies(Rk4::new, top(3.0), 0.02),
        energies(Ab6::new, top(3.0), 0.02),
        energies(Ab4::new, (Sledge, [0.3, -0.2, 0.7], [1.0, -0.5, 0.8]), 0.001),
    ];
    println!("{found:?}");
    for [with, without] in found {
        assert!(with < 1e-12 && without > 100.0 * with, "{found:?}");
    }
}

/// A motion whose energy is below the rounding error of the potential energy is left as it is: what is off is that error.
#[test]
fn projection_leaves_small_motions_alone() {
    let run = |projected: bool| {
        let (mut y, mut q, mut p) = pendulum::<f64>();
        q.fill(0.0);
        p.fill(0.0);
        q[0] = 1e-9;
        let (mut method, mut projection) = (Rk4::new(&y), EnergyProjection::new(&mut y, &q, &p, 2));
        for _ in 0..1000 {
            match projected {
                true => projection.step(&mut method, &mut y, 0.0, 0.01, &mut q, &mut p).unwrap(),
                false => method.step(&mut y, 0.0, 0.01, &mut q, &mut p).unwrap(),
            }
        }
        q[0]
    };
    let [with, without] = [true, false].map(run);
    assert!(without.abs() > 1e-11 && (with - without).abs() < 1e-12, "{with:e} {without:e}");
}

#[test]
fn projection_costs_no_evaluation() {
    let (mut y, mut q, mut p) = pendulum::<f64>();
    let (mut method, mut projection) = (Ab4::new(&y), EnergyProjection::new(&mut y, &q, &p, 1));
    for _ in 0..100 {
        projection.step(&mut method, &mut y, 0.0, 0.005, &mut q, &mut p).unwrap();
    }
    // The last evaluation is that of the next step.
    assert_eq!(method.statistics().evaluations, 100 + 3 * 4 + 1);
}

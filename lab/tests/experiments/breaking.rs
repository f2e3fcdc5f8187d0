//! The chain of thesis 7.4 that breaks.

use mbd_lab::scenes::breaking::{Breaking, Part, State};
use multibody::runtime::integrate::{Dop853, Step, Tolerances, Verner9};
use multibody::runtime::wide::Wide;
use multibody::runtime::Interpreter;

use crate::run::{files, folder, good, out, run_in};
use crate::{cells, number};

const TIMES: [f64; 2] = [0.4, 1.0];
const GRAVITY: [f64; 2] = [0.0, -9.81];

fn accurate(tolerance: f64) -> Step {
    Step::Adaptive(Tolerances::new(tolerance))
}

fn near(what: &str, a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within, "{what}: {a:e} and {b:e} differ by {:e}", (a - b).abs());
}

/// Both parts before and after the break, and at every step after it.
fn moments(chain: &Breaking) -> Vec<(bool, f64, [Part; 2], f64)> {
    let mut moments = Vec::new();
    let seen = |after: bool, system: &mut Interpreter<f64>, state: &State<f64>| {
        let (kinetic, potential) = system.energy(&state.q, &state.p);
        moments.push((after, state.t, chain.parts(after, system, state), kinetic + potential));
    };
    let (_, broken) = chain.doubles(TIMES, accurate(1e-13), Dop853::new, seen).expect("a run");
    let broken = broken.expect("a break");
    assert!(broken.lost().abs() <= 1e-14 * broken.before[0], "{:e}", broken.lost());
    moments
}

#[test]
fn a_break_keeps_energy_and_momenta_and_the_free_part_falls() {
    let chain = Breaking::new(12, 5, 0.0).expect("a chain");
    let moments = moments(&chain);
    let at = moments.iter().position(|m| m.0).expect("after the break");
    let (before, after) = (&moments[at - 1], &moments[at]);
    assert_eq!(before.1, after.1);
    // Round-off of sums over 12 links whose velocities are those of the chain's kinematics.
    for k in 0..2 {
        let (a, b) = (&before.2[k], &after.2[k]);
        near("kinetic energy", a.energy[0], b.energy[0], 1e-14 * (1.0 + a.energy[0]));
        near("potential energy", a.energy[1], b.energy[1], 1e-14 * (1.0 + a.energy[1].abs()));
        (0..3).for_each(|c| near("momentum", a.momentum[c], b.momentum[c], 1e-14));
        near("spin", a.spin(), b.spin(), 1e-14);
    }
    // The energies by the links' own motion are those of the equations.
    for (_, _, parts, energy) in &moments {
        near("energy of the links", parts[0].total() + parts[1].total(), *energy, 1e-13);
    }
    let start = moments[0].3;
    for (after_break, t, parts, energy) in &moments {
        near("energy", *energy, start, 1e-11);
        if !after_break {
            continue;
        }
        // After the break each part keeps its own energy, and the free part falls.
        let (free, first, time) = (&parts[1], &after.2[1], t - TIMES[0]);
        (0..2).for_each(|k| near("energy of a part", parts[k].total(), after.2[k].total(), 1e-11));
        for (k, g) in GRAVITY.into_iter().enumerate() {
            near("momentum", free.momentum[k], first.momentum[k] + first.mass * g * time, 1e-11);
            let flight = first.momentum[k] / first.mass * time + 0.5 * g * time * time;
            near("centre of mass", free.center[k], first.center[k] + flight, 1e-10);
        }
        near("spin", free.spin(), first.spin(), 1e-11);
    }
}

#[test]
fn a_breaking_chain_agrees_with_double_double_numbers() {
    let chain = Breaking::new(8, 3, 0.001).expect("a chain");
    // Double-double numbers take a hundred times as long: a shorter motion, and both runs at once.
    let times = TIMES.map(|t| 0.3 * t);
    let precise = || chain.precise::<Wide, _>(times, accurate(1e-14), Dop853::new).expect("a run");
    let (reference, coarser) = std::thread::scope(|scope| {
        let coarser = scope.spawn(precise);
        let reference = chain.precise::<Wide, _>(times, accurate(1e-16), Verner9::new).expect("a run");
        (reference, coarser.join().expect("a run"))
    });
    let (doubles, _) = chain.doubles(times, accurate(1e-12), Dop853::new, |_, _, _| ()).expect("a run");
    let coarser: Vec<f64> = coarser.q.iter().map(|x| f64::from(x.0)).collect();
    let off = chain.apart(&coarser, &reference.q);
    assert!(off < 1e-12, "{off:e}");
    let off = chain.apart(&doubles.q, &reference.q);
    assert!(off < 1e-9, "{off:e}");
}

#[test]
fn the_command_breaks_a_chain() {
    let folder = folder("experiments_breaking");
    let output = good(run_in(&folder, &["experiments", "breaking", "--quick", "--end", "0", "--out", "figures"]));
    let text = out(&output);
    // Sums over 100 links.
    for quantity in ["kinetic", "potential", "momentum along x", "momentum along y", "angular", "spin"] {
        let row = cells(text, "Through the break", quantity);
        assert!(number(&row[4]).abs() < 1e-12, "{row:?}");
    }
    assert!(number(&cells(text, "Table 7.5", "of that the momenta")[3]) > 0.0);
    assert!(text.contains("not finite"), "{text}");
    assert_eq!(files(&folder.join("figures")), ["breaking_energy.svg", "figure_7_16.svg"]);
}

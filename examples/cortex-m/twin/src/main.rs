//! Prints what the scene named by the argument ends with, as the firmware does: bits, one number a line. Of the run of a minute
//! also the true error of the energy.

use mbd_runtime::Energetic;
use scenes::{Bits, Ur5F32, Ur5F64};

fn main() {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let mut known = Vec::new();
    macro_rules! scene {
        ($name:ident, $system:ty, $run:path) => {
            known.push(stringify!($name));
            if wanted == stringify!($name) {
                let end = $run(&mut <$system>::new()).unwrap_or_else(|error| fail(&format!("{wanted}: {error:?}")));
                end.q.iter().chain(&end.p).for_each(|x| println!("state {:016x}", x.bits()));
                end.energy.iter().flatten().for_each(|x| println!("energy {:016x}", x.bits()));
                if end.energy.is_some() {
                    println!("error {:016x}", (energy_error() * 1e8).ceil() as u64);
                }
                return;
            }
        };
    }
    scenes::each_scene!(scene);
    fail(&format!("no scene `{wanted}`; there are: {}", known.join(", ")));
}

/// Of all states that UR5 visits in single precision: the largest change of their energy, found in double precision, relative to
/// the largest kinetic energy, which is also what lies between the start and the lowest potential energy met.
fn energy_error() -> f64 {
    let mut exact = Ur5F64::new();
    let (mut start, mut change, mut largest) = (None, 0.0_f64, 0.0_f64);
    let run = scenes::watched_minute(&mut Ur5F32::new(), |q, p| {
        let (kinetic, potential) = exact.state_energy(&q.map(f64::from), &p.map(f64::from));
        let start = *start.get_or_insert(kinetic + potential);
        change = change.max((kinetic + potential - start).abs());
        largest = largest.max(kinetic);
    });
    run.unwrap_or_else(|error| fail(&format!("UR5, one minute: {error:?}")));
    eprintln!("UR5, one minute: energy off by {change:.2e} J at most, largest kinetic energy {largest:.2} J");
    change / largest
}

fn fail(message: &str) -> ! {
    eprintln!("twin: {message}");
    std::process::exit(1);
}

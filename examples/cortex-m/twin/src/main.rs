//! Prints the end of the run of a scene, as the firmware does: the bits of one number per line. For runs that evaluate
//! the energy it also prints the true energy error, and for the four-bar the largest residual of the loop.

use mbd_runtime::{Constrained, Energetic};
use scenes::{Bits, FourbarF32, FourbarF64, Ur5F32, Ur5F64};

fn main() {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let mut known = Vec::new();
    macro_rules! scene {
        ($name:ident, $system:ty, $run:expr) => {
            known.push(stringify!($name));
            if wanted == stringify!($name) {
                let end = ($run)(&mut <$system>::new()).unwrap_or_else(|error| fail(&format!("{wanted}: {error:?}")));
                end.q.iter().chain(&end.p).for_each(|x| println!("state {:016x}", x.bits()));
                end.energy.iter().flatten().for_each(|x| println!("energy {:016x}", x.bits()));
                let line = |name: &str, x: f64| println!("{name} {:016x}", (x * 1e8).ceil() as u64);
                match stringify!($name) {
                    "ur5_minute_f32" => line("error", minute()),
                    "fourbar_f32" => fourbar(FourbarF32::new()).into_iter().for_each(|(name, x)| line(name, x)),
                    "fourbar_f64" => fourbar(FourbarF64::new()).into_iter().for_each(|(name, x)| line(name, x)),
                    _ => (),
                }
                return;
            }
        };
    }
    scenes::each_scene!(scene);
    fail(&format!("no scene `{wanted}`; there are: {}", known.join(", ")));
}

/// The energies of the states of a run, computed in double precision.
#[derive(Default)]
struct Watch {
    start: Option<f64>,
    change: f64,
    largest: f64,
}

impl Watch {
    fn look(&mut self, (kinetic, potential): (f64, f64)) {
        let start = *self.start.get_or_insert(kinetic + potential);
        self.change = self.change.max((kinetic + potential - start).abs());
        self.largest = self.largest.max(kinetic);
    }

    /// The largest change relative to the largest kinetic energy, which is also the difference between the energy of
    /// the start and the lowest potential energy met.
    fn error(&self, what: &str) -> f64 {
        let Watch { change, largest, .. } = self;
        eprintln!("{what}: energy off by {change:.2e} J at most, largest kinetic energy {largest:.2} J");
        change / largest
    }
}

/// Energy error of the UR5's minute.
fn minute() -> f64 {
    let (mut exact, mut energy) = (Ur5F64::new(), Watch::default());
    let run = scenes::watched_minute(&mut Ur5F32::new(), |q, p| {
        energy.look(exact.energies(&q.map(f64::from), &p.map(f64::from)));
    });
    run.unwrap_or_else(|error| fail(&format!("UR5, one minute: {error:?}")));
    energy.error("UR5, one minute")
}

/// Energy error of the four-bar, and the largest residual of its loop, m and rad.
fn fourbar<Y>(mut system: Y) -> [(&'static str, f64); 2]
where
    Y: Constrained + Energetic,
    Y::Scalar: mbd_runtime::Real,
{
    let (mut exact, mut energy, mut gap) = (FourbarF64::new(), Watch::default(), 0.0_f64);
    let run = scenes::watched_closed(&mut system, |q, p| {
        let number = |x: &[Y::Scalar]| core::array::from_fn(|k| mbd_runtime::Real::to_f64(x[k]));
        let (q, p) = (number(q.as_ref()), number(p.as_ref()));
        energy.look(exact.energies(&q, &p));
        let (mut residual, mut entries) = (exact.zero_rows(), exact.zero_entries());
        Constrained::constraint_residuals(&mut exact, &q, &mut residual, &mut entries);
        gap = residual.iter().fold(gap, |gap, x| gap.max(x.abs()));
    });
    run.unwrap_or_else(|error| fail(&format!("four-bar: {error:?}")));
    eprintln!("four-bar: open by {gap:.1e} at most");
    [("error", energy.error("four-bar")), ("gap", gap)]
}

fn fail(message: &str) -> ! {
    eprintln!("twin: {message}");
    std::process::exit(1);
}

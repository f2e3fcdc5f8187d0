//! `mbd certify`: guaranteed bounds of outputs at a state, and over a box of states. `book/src/trust.md` says what exactly
//! is guaranteed.

mod bounds;
mod input;
mod outputs;

use std::io::Write;

use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::runtime::interval::Interval;
use multibody::runtime::wide::Wide;
use multibody::runtime::{Real, Scalar};
use serde_json::{json, Value};

use super::args::{CertifyArgs, Quantity};
use super::motion::interpreter;
use super::{source, Failure, Outcome};
use bounds::Enclosure;
use input::Region;

/// Outputs without --outputs: all that a tree has.
const DEFAULT: [Quantity; 9] = [
    Quantity::Momenta,
    Quantity::CoordinateRates,
    Quantity::MomentumRates,
    Quantity::Accelerations,
    Quantity::Kinetic,
    Quantity::Potential,
    Quantity::MassMatrix,
    Quantity::Bias,
    Quantity::InverseDynamics,
];

/// Runs `mbd certify`.
pub fn run(args: &CertifyArgs, out: &mut dyn Write) -> Outcome {
    let plan = source::plan(&args.model, PlanOptions { snap: args.snap, ..PlanOptions::default() })?;
    let of_loops = |what: &Quantity| matches!(what, Quantity::Residuals | Quantity::Multipliers);
    if plan.dims.rows == 0 && args.outputs.iter().any(of_loops) {
        return Err(Failure::new(
            format!("--outputs: `{}` has no loops or couplings, and so neither `phi` nor `lambda`", plan.model.name),
            "leave both out; without --outputs, all other outputs are bounded",
        ));
    }
    let region = input::read(&args.region, &plan)?;
    let wanted = match args.outputs.is_empty() {
        true => &DEFAULT[..],
        false => &args.outputs[..],
    };
    let names = outputs::names(&plan, wanted);
    let parts = if region.is_point() { 1 } else { args.split as usize };
    let enclosure = bounds::enclose(&plan, &region, wanted, parts);
    let loose = names.iter().zip(&enclosure.outputs).filter(|(_, x)| !x.is_bounded()).map(|(name, _)| name.as_str());
    let loose: Vec<&str> = loose.collect();
    let samples = (args.samples > 0).then(|| sample(&plan, &region, wanted, args.samples));
    if let Some(samples) = &samples {
        confirm(&names, &enclosure, samples)?;
    }
    let values = region
        .is_point()
        .then(|| outputs::evaluate(&mut interpreter::<f64>(&plan), &region.values(|x| x.middle()), wanted));
    if args.json {
        let value = as_json(&plan, &names, &enclosure, values.as_deref(), samples.as_deref());
        writeln!(out, "{value}")?;
    } else {
        write(&plan, args, (&names, &enclosure), values.as_deref(), samples.as_deref(), out)?;
    }
    if loose.is_empty() {
        return Ok(());
    }
    let shown = loose.iter().take(3).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let more = if loose.len() > 3 { format!(" and {} more", loose.len() - 3) } else { String::new() };
    let help = match region.is_point() {
        true => "the state is singular, or too large for doubles",
        false => "narrow the box, or raise --split; momenta, energies, `M`, `h` and `tau` need no division by pivots",
    };
    Err(Failure::new(format!("no bound was found for {shown}{more}: a divisor may be zero in the box"), help))
}

/// Outputs in double-double numbers at random states of a region.
fn sample(plan: &Plan, region: &Region, wanted: &[Quantity], count: u32) -> Vec<Vec<f64>> {
    let mut interpreter = interpreter::<Wide>(plan);
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut unit = move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 * 0.5_f64.powi(53)
    };
    (0..count)
        .map(|_| {
            let state =
                region.values(|x| Wide::constant((x.low() + unit() * (x.high() - x.low())).clamp(x.low(), x.high())));
            outputs::evaluate(&mut interpreter, &state, wanted).iter().map(|x| x.to_f64()).collect()
        })
        .collect()
}

/// Fails where a sample is outside of its enclosure, which would be an error of this program. Samples are rounded to
/// doubles: their neighbours count.
fn confirm(names: &[String], enclosure: &Enclosure, samples: &[Vec<f64>]) -> Outcome {
    for row in samples {
        for ((name, bounds), x) in names.iter().zip(&enclosure.outputs).zip(row) {
            let slack = x.abs() * f64::EPSILON;
            if bounds.low() - slack > *x || bounds.high() + slack < *x {
                let what = format!(
                    "`{name}` is {x:e} at a state of the box, outside of [{:e}, {:e}]",
                    bounds.low(),
                    bounds.high()
                );
                return Err(Failure::new(what, "this is an error of mbd: report the model and the box"));
            }
        }
    }
    Ok(())
}

/// Smallest and largest sample of every output.
fn span(samples: &[Vec<f64>], k: usize) -> [f64; 2] {
    samples.iter().map(|row| row[k]).fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x), high.max(x)])
}

fn as_json(
    plan: &Plan,
    names: &[String],
    enclosure: &Enclosure,
    values: Option<&[f64]>,
    samples: Option<&[Vec<f64>]>,
) -> Value {
    let list = names.iter().zip(&enclosure.outputs).enumerate().map(|(k, (name, bounds))| {
        // What has no bound is null: JSON has no infinity.
        let finite = |x: f64| x.is_finite().then_some(x);
        let mut entry = json!({ "output": name, "low": finite(bounds.low()), "high": finite(bounds.high()) });
        if let Some(values) = values {
            entry["value"] = json!(values[k]);
            entry["error"] = json!(finite(bounds.distance(values[k])));
        }
        if let Some(samples) = samples {
            entry["samples"] = json!(span(samples, k));
        }
        entry
    });
    json!({
        "model": plan.model.name, "parts": enclosure.parts, "evaluations": enclosure.evaluations,
        "outputs": list.collect::<Vec<_>>(),
    })
}

fn write(
    plan: &Plan,
    args: &CertifyArgs,
    (names, enclosure): (&[String], &Enclosure),
    values: Option<&[f64]>,
    samples: Option<&[Vec<f64>]>,
    out: &mut dyn Write,
) -> Outcome {
    let Enclosure { parts, evaluations, seconds, .. } = enclosure;
    let width = names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(6);
    match values {
        Some(_) => writeln!(out, "{}: outputs at a state, and what their errors are at most", plan.model.name)?,
        None => writeln!(out, "{}: bounds of outputs over a box of states, in {parts} parts", plan.model.name)?,
    }
    let mut filled = Vec::new();
    for (k, (name, bounds)) in names.iter().zip(&enclosure.outputs).enumerate() {
        write!(out, "  {name:width$}  ")?;
        match (values, bounds.is_bounded()) {
            (_, false) => write!(out, "no bound")?,
            (Some(values), true) => write!(out, "{:>23e}  ± {:.1e}", values[k], above(bounds.distance(values[k]), 1))?,
            (None, true) => write!(out, "{:>14.6e} .. {:.6e}", below(*bounds), above(bounds.high(), 6))?,
        }
        if let (Some(samples), true, None) = (samples, bounds.is_bounded(), values) {
            let [low, high] = span(samples, k);
            write!(out, "  samples {low:.6e} .. {high:.6e}")?;
            filled.extend((bounds.width() > 0.0).then(|| (high - low) / bounds.width()));
        }
        writeln!(out)?;
    }
    if let Some(samples) = samples {
        filled.sort_by(f64::total_cmp);
        let median =
            filled.get(filled.len() / 2).map_or(String::new(), |x| format!(", and fill {:.2} of them (median)", x));
        writeln!(out, "samples: all {} states in double-double numbers lie in the bounds{median}", samples.len())?;
    }
    let [plain, dual] = evaluations;
    writeln!(out, "work: {plain} evaluations in intervals, {dual} with derivatives; {seconds:.3} s")?;
    if args.split > 1 && *parts == 1 && values.is_some() {
        writeln!(out, "--split: a single state is not split")?;
    }
    Ok(())
}

/// A number that is printed with `digits` digits after the first, moved up where rounding to them would move it down.
fn above(x: f64, digits: usize) -> f64 {
    let printed: f64 = format!("{x:.digits$e}").parse().unwrap_or(x);
    if printed >= x || !x.is_finite() {
        return x;
    }
    let last = 10.0_f64.powf(x.abs().log10().floor() - digits as f64);
    // The next number of as many digits.
    printed + last
}

/// The lower bound of an interval for six digits, moved down where rounding would move it up.
fn below(bounds: Interval) -> f64 {
    // The sum with zero takes the sign off a zero.
    0.0 - above(-bounds.low(), 6)
}

//! `mbd simulate`: free motion as a table and a plot.

use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};

use multibody::codegen::model::Value;
use multibody::codegen::modes;
use multibody::codegen::options::PlanOptions;
use multibody::codegen::plan::Plan;
use multibody::codegen::words;
use multibody::runtime::catalogue;
use multibody::runtime::constrained::{SingularPosition, Stabilisation};
use multibody::runtime::contact::{ImpactOrder, RegimeChoice, RegimeRules};
use multibody::runtime::integrate::{Control, Statistics, Step, Tolerances};
use multibody::runtime::tree::Source;
use multibody::runtime::{Interpreter, System};

use super::args::{ContactRegime, Impacts, MotionArgs, SimulateArgs, Trust};
use super::control::{Controller, Table};
use super::motion::{simulate, Drift, Record, Settings, Spent};
use super::output::{note, same_file, writable, write_files};
use super::plot::{self, Panel};
use super::probe::Probe;
use super::start::{default_start, default_velocity};
use super::{
    columns, contacts, energy, interrupt, loops, picture, probe, source, tables, trust, verdict, Failure, Outcome,
};

/// Default method and tolerance. For the double pendulum, the spherical pendulum, the UR5 and the Panda, the error at
/// the end was 4 to 160 times below that of `dop853` at this tolerance, for at most a sixth more evaluations.
const METHOD: &str = "verner9";
const TOLERANCE: f64 = 1e-9;
/// Default time step of contacts, s; the help of `--contact-step` states it.
const CONTACT_STEP: f64 = 1e-3;
/// Default number of rows of the table.
const ROWS: u64 = 1000;
/// Limit of the number of steps.
const MOST_STEPS: f64 = 1e10;
/// Limit of the number of rows.
const MOST_ROWS: f64 = 1e7;

/// The plan of the model that is to move, and whether it has dampers.
pub fn planned(args: &MotionArgs) -> Outcome<(Plan, bool)> {
    let path = &args.model.model;
    let mut model = source::model_with(&args.model, &args.touch.of(args.model.import.import()))?;
    if args.no_damping {
        model.joints.iter_mut().for_each(|j| j.damping.fill(Value::ZERO));
    }
    let damped = model.joints.iter().any(|j| j.damping.iter().any(|d| *d != Value::ZERO));
    let plan = source::planned(&model, PlanOptions { snap: args.snap, ..PlanOptions::default() }).plan;
    source::tell_notices(path, &plan.notices);
    if plan.dims.drive_v > 0 {
        note(format_args!("{}: notice: prescribed joints are held at zero", path.display()));
    }
    Ok((plan, damped))
}

/// The state from which the motion starts, with closed loops: coordinates, velocities.
pub fn start_closed(plan: &Plan, args: &MotionArgs) -> Outcome<(Vec<f64>, Vec<f64>, Option<loops::Assembly>)> {
    let (path, (q, v)) = (&args.model.model, start(plan, args)?);
    if plan.model.constraints.is_empty() {
        return Ok((q, v, None));
    }
    let mut interpreter = plan.default_interpreter();
    let assembly = loops::assemble(path, plan, &mut interpreter, &q)?;
    loops::tell(path, plan, &assembly);
    let q = assembly.q.clone();
    let stated = args.v.is_some() || plan.start_velocity().is_some();
    let v = loops::velocities(plan, &mut interpreter, &q, &v, stated)?;
    Ok((q, v, Some(assembly)))
}

/// Runs `mbd simulate`.
pub fn run(args: &SimulateArgs, out: &mut dyn Write) -> Outcome {
    let path = &args.motion.model.model;
    let (plan, damped) = planned(&args.motion)?;
    let model = &plan.model;
    if args.project && damped {
        return Err(Failure::new(
            "--project keeps the energy, but the model has dampers, which take it out",
            "leave them out with --no-damping, or leave --project out",
        ));
    }
    if args.project && !model.constraints.is_empty() {
        return Err(Failure::new(
            "--project does not keep loops closed",
            "leave it out: loops are kept closed anyway, and the energy with them; --hold says how",
        ));
    }
    let settings = Settings { every: every(args)?, project: args.project, ..settings(&args.motion)? };
    let (q, v, assembly) = start_closed(&plan, &args.motion)?;
    refuse_with_control(args)?;
    let settings = controlled(&plan, &args.motion, settings, &q)?;
    let columns = columns::chosen(&plan, &args.columns, settings.control.is_some())?;
    let csv = args.csv.clone().unwrap_or_else(|| PathBuf::from(format!("{}.csv", model.name)));
    let svg = args.svg.clone().unwrap_or_else(|| PathBuf::from(format!("{}.svg", model.name)));
    if same_file(&csv, &svg) {
        return Err(Failure::new(
            format!("table and plot are both to be written to `{}`", csv.display()),
            "give --csv and --svg two names",
        ));
    }
    tables::known(&csv)?;
    writable(&csv)?;
    writable(&svg)?;
    is_svg("--svg", &svg)?;
    let drawing = picture::drawing(&plan, args)?;
    if let Some(file) = &args.picture {
        of_its_own(("--picture", file), "the table or plot", &[&csv, &svg])?;
        is_svg("--picture", file)?;
    }
    if let Some(file) = &args.record_modes {
        if settings.regimes.choice == RegimeChoice::TimeSteps {
            return Err(Failure::new(
                "--record-modes: time steps visit no modes",
                "leave `--contacts stepping` out: modes are those between events",
            ));
        }
        let others: Vec<&PathBuf> = [&csv, &svg].into_iter().chain(&args.picture).collect();
        of_its_own(("--record-modes", file), "another result", &others)?;
    }
    verdict::start(path, &plan, &q, settings.is_adaptive())?;
    let of_contacts = [
        ("--record-modes", args.record_modes.is_some()),
        ("--contacts", args.motion.contacts != ContactRegime::Events),
        ("--impacts", args.motion.impacts != Impacts::Together),
    ];
    if let (true, Some((name, _))) = (model.contacts.is_empty(), of_contacts.iter().find(|(_, given)| *given)) {
        return Err(Failure::new(
            format!("{name}: `{}` has no contacts", model.name),
            "leave it out, or add [[shape]] and [[contact]] to the model",
        ));
    }
    if !model.contacts.is_empty() {
        return with_contacts(args, &plan, (q, v), &settings, (&csv, &svg, &drawing, &columns), out);
    }
    interrupt::listen();
    let record = simulate(&plan, (q, v), &settings)?;
    let picture = plot::svg(&title(&plan, &settings), &panels(&plan, &record));
    let table = columns::table(&plan, &settings, &record, &columns)?.file(&csv)?;
    let mut files = vec![(csv.as_path(), table.as_slice()), (svg.as_path(), picture.as_bytes())];
    let motion = args.picture.as_deref().map(|file| (file, picture::svg(&plan, &record, &[], &drawing)));
    files.extend(motion.as_ref().map(|(file, text)| (*file, text.as_bytes())));
    write_files(&files)?;
    writeln!(out, "{}", title(&plan, &settings))?;
    about_control(args, &settings, &record, out)?;
    if let Some(assembly) = &assembly {
        writeln!(out, "loops: {}", assembly.summary())?;
    }
    let energy = energy::judge(&record, &settings);
    writeln!(out, "{}", energy.line)?;
    let probe = match settings.step {
        Step::Fixed(h) => Some(probe::probe(&plan, &settings, &record, h)?),
        Step::Adaptive(_) => None,
    };
    match probe {
        Some(Probe { error, places, .. }) if error.is_finite() => writeln!(
            out,
            "step error: at most {error:.1e} rad or m in a step (one step against two of half its size, at {places} states)"
        )?,
        Some(_) => writeln!(out, "step error: unknown, a step or its halves fail")?,
        None => {}
    }
    if assembly.is_some() {
        writeln!(out, "drift: {}", drift(&settings, &record.drift))?;
        if let Some(text) = singular(&plan, &record.drift) {
            writeln!(out, "singular positions: {text}")?;
        }
    }
    writeln!(out, "work: {}", work(&record.statistics))?;
    if let (Some(_), Some([what, help])) = (record.interrupted, &record.crawls) {
        writeln!(out, "hint: {what}; {help}")?;
    }
    writeln!(out, "time: {}", spent(record.interrupted.unwrap_or(args.motion.time), &record.spent))?;
    writeln!(out, "table: {} ({} rows)\nplot: {}", csv.display(), record.t.len(), svg.display())?;
    if let Some(file) = &args.picture {
        writeln!(out, "picture: {}", file.display())?;
    }
    let mut trusted = verdict::tell(path, &plan, &settings, &record, (energy, probe));
    interrupted(&record)?;
    if let Some(how) = args.trust {
        trusted &= verdict::digits(path, trust::run(&plan, &settings, &record, how, out)?);
    }
    if trusted {
        Ok(())
    } else {
        Err(Failure::Shown)
    }
}

/// Settings with the control of the arguments, if there is any, for a motion that starts at `q`.
pub fn controlled<'a>(plan: &Plan, args: &MotionArgs, settings: Settings<'a>, q: &[f64]) -> Outcome<Settings<'a>> {
    let control = Controller::new(plan, &args.control, q, &columns::all(plan))?;
    if control.as_ref().is_some_and(|control| !control.has_derivatives()) && !settings.is_explicit() {
        let names: Vec<&str> = catalogue::EXPLICIT.iter().map(|entry| entry.name).collect();
        return Err(Failure::new(
            format!("--method {}: the derivatives of --gravity-compensation are not known to it", settings.method),
            format!("take one of {}", names.join(", ")),
        ));
    }
    Ok(Settings { control, ..settings })
}

/// Refuses what a motion under control cannot be asked for.
fn refuse_with_control(args: &SimulateArgs) -> Outcome {
    if args.motion.control.any() && args.project {
        return Err(Failure::new("--project keeps the energy, which the control changes", "leave --project out"));
    }
    if args.motion.control.any() && args.trust == Some(Trust::Wide) {
        return Err(Failure::new("--trust wide does not know the control", "take --trust without `wide`"));
    }
    Ok(())
}

/// What the control was, and what it asked of the joints.
fn about_control(args: &SimulateArgs, settings: &Settings, record: &Record, out: &mut dyn Write) -> Outcome {
    if let Some(control) = &settings.control {
        writeln!(out, "control: {}", control.summary(&args.motion.control))?;
    }
    for line in record.loads.lines() {
        writeln!(out, "{line}")?;
    }
    Ok(())
}

/// Refuses the file of an option that cannot be written, or that holds one of the other results.
fn of_its_own((option, file): (&str, &Path), holds: &str, others: &[&PathBuf]) -> Outcome {
    if others.iter().any(|other| same_file(file, other)) {
        let what = format!("{option}: `{}` is to hold {holds} already", file.display());
        return Err(Failure::new(what, "give it a name of its own"));
    }
    writable(file)
}

/// Refuses the file of a drawing whose name ends as that of another format. A name without an ending, or with one that is no
/// format's, promises nothing.
fn is_svg(option: &str, file: &Path) -> Outcome {
    const OTHERS: [&str; 18] = [
        "bmp", "csv", "eps", "gif", "html", "jpeg", "jpg", "json", "mp4", "parquet", "pdf", "png", "ps", "svgz", "tif",
        "tiff", "toml", "webp",
    ];
    match file.extension() {
        Some(extension) if OTHERS.iter().any(|other| extension.eq_ignore_ascii_case(other)) => {
            let what = format!("{option} {}: drawings are SVG, and the name is that of another format", file.display());
            Err(Failure::new(what, "name a file that ends with `.svg`, and convert it with another program"))
        }
        _ => Ok(()),
    }
}

/// Ends a command whose run was interrupted, after its files were written.
fn interrupted(record: &Record) -> Outcome {
    let Some(time) = record.interrupted else { return Ok(()) };
    note(format_args!("interrupted at {time:.6} s: the files hold the motion up to there"));
    Err(Failure::Interrupted)
}

/// The run of a mechanism with contacts, and what is written and printed of it.
fn with_contacts(
    args: &SimulateArgs,
    plan: &Plan,
    start: (Vec<f64>, Vec<f64>),
    settings: &Settings,
    (csv, svg, drawing, columns): (&Path, &Path, &picture::Drawing, &columns::Columns),
    out: &mut dyn Write,
) -> Outcome {
    if args.trust.is_some() || args.project {
        return Err(Failure::new(
            "--trust and --project do not know contacts yet",
            "leave them out; a second run with a smaller --tolerance shows the error",
        ));
    }
    interrupt::listen();
    let touched = contacts::simulate(plan, start, settings, args.picture.is_some() || columns.forces())?;
    let record = &touched.record;
    let plot = plot::svg(&title(plan, settings), &panels(plan, record));
    let table = columns::table_with(plan, settings, record, columns, &touched.forces)?.file(csv)?;
    let ((events, count), beside) = (contacts::table(plan, &touched), contacts::beside(csv));
    let mut files = vec![(csv, table.as_slice()), (svg, plot.as_bytes()), (beside.as_path(), events.as_bytes())];
    let motion = args.picture.as_deref().map(|file| (file, picture::svg(plan, record, &touched.forces, drawing)));
    files.extend(motion.as_ref().map(|(file, text)| (*file, text.as_bytes())));
    let modes = args.record_modes.as_deref().map(|file| (file, modes::text(&plan.model, &touched.visits)));
    files.extend(modes.as_ref().map(|(file, text)| (*file, text.as_bytes())));
    write_files(&files)?;
    writeln!(out, "{}", title(plan, settings))?;
    about_control(args, settings, record, out)?;
    contacts::report(plan, &touched, settings.regimes.choice, out)?;
    if settings.regimes.choice != RegimeChoice::TimeSteps {
        writeln!(out, "work: {}", work(&record.statistics))?;
    }
    let seconds = touched.seconds;
    writeln!(
        out,
        "time: {seconds:.3} s, {}; {}",
        pace(record.interrupted.unwrap_or(args.motion.time) / seconds),
        contacts::ways(&touched, settings.regimes.choice)
    )?;
    let rows = record.t.len();
    writeln!(out, "table: {} ({rows} rows)\nevents: {} ({count} rows)", csv.display(), beside.display())?;
    writeln!(out, "plot: {}", svg.display())?;
    if let Some(file) = &args.picture {
        writeln!(out, "picture: {}", file.display())?;
    }
    if let Some(file) = &args.record_modes {
        writeln!(out, "modes: {} ({} sets)", file.display(), touched.visits.len())?;
    }
    interrupted(record)
}

/// Time from one row to the next, s.
fn every(args: &SimulateArgs) -> Outcome<f64> {
    let time = args.motion.time;
    let every = args.every.unwrap_or(time / args.rows.unwrap_or(ROWS) as f64);
    if time / every > MOST_ROWS {
        return Err(Failure::new(format!("{:.0} rows are too many", time / every), "raise --every or lower --rows"));
    }
    Ok(every)
}

/// Method and steps of the arguments, with a row at the end only.
pub fn settings(args: &MotionArgs) -> Outcome<Settings<'_>> {
    // With `--step`, the default method is the classical one.
    let fallback = if args.step.is_some() { "rk4" } else { METHOD };
    let method = args.method.as_deref().unwrap_or(fallback);
    let step = match args.step {
        Some(step) => {
            let steps = (args.time / step * (1.0 - 1e-12)).ceil().max(1.0);
            if steps > MOST_STEPS {
                return Err(Failure::new(format!("{steps:.0} steps are too many"), "raise --step or lower --time"));
            }
            Step::Fixed(args.time / steps)
        }
        None => {
            let tolerance = args.tolerance.unwrap_or(TOLERANCE);
            if tolerance >= verdict::MEANINGLESS {
                let what = format!(
                    "--tolerance {tolerance:e} means nothing: it allows an error of {tolerance:e} rad or m in every step, and of \
                     {tolerance:e} times the momenta"
                );
                return Err(Failure::new(
                    what,
                    format!("give one below {}; the default is {TOLERANCE:e}", verdict::MEANINGLESS),
                ));
            }
            let tolerances = Tolerances::new(tolerance);
            Step::Adaptive(if args.partial { tolerances.coordinates_only() } else { tolerances })
        }
    };
    Ok(Settings {
        method,
        step,
        time: args.time,
        every: args.time,
        project: false,
        hold: args.hold,
        interpreted: args.interpreted,
        regimes: regimes(args)?,
        impacts: match args.impacts {
            Impacts::Together => ImpactOrder::Simultaneous,
            Impacts::Sequential => ImpactOrder::Sequential,
        },
        control: None,
    })
}

/// How contacts are followed.
fn regimes(args: &MotionArgs) -> Outcome<RegimeRules> {
    let step = args.contact_step.unwrap_or(CONTACT_STEP);
    let choice = match args.contacts {
        ContactRegime::Events => RegimeChoice::Events,
        ContactRegime::Stepping => RegimeChoice::TimeSteps,
        ContactRegime::Auto => RegimeChoice::Automatic,
    };
    if choice == RegimeChoice::Events && args.contact_step.is_some() {
        return Err(Failure::new(
            "--contact-step: contacts are followed from event to event, without time steps",
            "leave it out, or add `--contacts stepping` or `--contacts auto`",
        ));
    }
    if choice == RegimeChoice::TimeSteps {
        let given = [("--method", args.method.is_some()), ("--tolerance", args.tolerance.is_some())];
        let given = given.into_iter().chain([("--step", args.step.is_some()), ("--partial", args.partial)]);
        let given = given.chain([("--impacts", args.impacts != Impacts::Together)]);
        let given: Vec<&str> = given.filter(|(_, given)| *given).map(|(name, _)| name).collect();
        if !given.is_empty() {
            return Err(Failure::new(
                format!("--contacts stepping has a method of its own, for which {} means nothing", given.join(", ")),
                "leave it out; --contact-step is the length of the steps",
            ));
        }
        let steps = args.time / step;
        if steps > MOST_STEPS {
            return Err(Failure::new(format!("{steps:.0} steps are too many"), "raise --contact-step or lower --time"));
        }
    }
    Ok(RegimeRules::new(choice, step))
}

/// The title of the plot, which is also the first line of the report.
pub fn title(plan: &Plan, settings: &Settings) -> String {
    let Settings { method, time, step, .. } = settings;
    let kind = if settings.control.is_some() { "motion under control" } else { "free motion" };
    if settings.regimes.choice == RegimeChoice::TimeSteps {
        let h = settings.regimes.step;
        return format!("{}: {time} s of {kind} by time steps of {h} s (Moreau's midpoint rule)", plan.model.name);
    }
    let title = catalogue::entry(method).map_or("", |e| e.title);
    let steps = match step {
        Step::Fixed(h) => format!("steps of {h} s"),
        Step::Adaptive(t) => {
            let partial = if t.control == Control::Coordinates { " of coordinates" } else { "" };
            format!("tolerance{partial} {:e}", t.rotations)
        }
    };
    format!("{}: {time} s of {kind} by {method} ({title}), {steps}", plan.model.name)
}

/// Report of the work done.
fn work(s: &Statistics) -> String {
    let mut text =
        format!("{} steps, {} more rejected, {} evaluations of the rates", s.steps, s.rejections, s.evaluations);
    if s.jacobians + s.factorisations + s.iterations > 0 {
        let _ = write!(
            text,
            ", {} of their derivatives, {} factorisations, {} iterations",
            s.jacobians, s.factorisations, s.iterations
        );
    }
    text
}

/// Report of the loops.
fn drift(settings: &Settings, drift: &Drift) -> String {
    let Drift { found, left, .. } = drift;
    let kept = matches!(settings.hold, Stabilisation::Mass | Stabilisation::Gradient | Stabilisation::Partition);
    match kept {
        true => format!("loops open by up to {found:.1e} in a step (m or rad), and are closed again to {left:.1e}"),
        false => format!("loops open by up to {left:.1e} (m or rad); --hold says how they are kept closed"),
    }
}

/// Report of the singular positions, if there were any.
fn singular(plan: &Plan, drift: &Drift) -> Option<String> {
    let (count, first) = &drift.singular;
    let one = |position: &SingularPosition| {
        let SingularPosition { time, constraint, ranks: [before, rank], .. } = position;
        let name = loops::title(plan, *constraint).unwrap_or_default();
        match before == rank {
            true => format!("t = {time:.4} s ({name})"),
            false => format!("t = {time:.4} s ({name}, {rank} independent rows in place of {before})"),
        }
    };
    let told: Vec<String> = first.iter().map(one).collect();
    let more = match *count as usize - told.len() {
        0 => String::new(),
        n => format!(", and {n} more"),
    };
    let text = "passed at {}{}, where the mechanism may go on in more ways than one";
    (*count > 0).then(|| text.replacen("{}", &told.join(", "), 1).replacen("{}", &more, 1))
}

/// How many times faster, or slower, than the motion it was computed.
fn pace(factor: f64) -> String {
    match factor < 1.0 {
        true => format!("{:.1} times slower than time itself", 1.0 / factor),
        false => format!("{factor:.0} times faster than time itself"),
    }
}

/// Report of the computing times.
fn spent(time: f64, spent: &Spent) -> String {
    let Spent { total, compiled, rates, derivatives, constraints, output, clock } = *spent;
    let share = |x: f64| format!("{:.0} %", 100.0 * (x / total).clamp(0.0, 1.0));
    let method = (total - rates - derivatives - constraints - output - clock).max(0.0);
    let derivatives = match derivatives > 0.0 {
        true => format!(", their derivatives {}", share(derivatives)),
        false => String::new(),
    };
    let constraints = match constraints > 0.0 {
        true => format!(", loops {}", share(constraints)),
        false => String::new(),
    };
    let by = match compiled {
        Some(seconds) => format!("machine code, made in {:.0} ms", 1e3 * seconds),
        None => "interpreter".to_string(),
    };
    format!(
        "{total:.3} s, {}; rates {} ({by}){derivatives}{constraints}, the method's own sums {}, \
         energies and rows {}",
        pace(time / total),
        share(rates),
        share(method),
        share(output)
    )
}

/// Initial coordinates and velocities: those of the arguments, or the defaults that the help states.
fn start(plan: &Plan, args: &MotionArgs) -> Outcome<(Vec<f64>, Vec<f64>)> {
    let list = |what: &str, given: &Option<Vec<f64>>, names: Vec<String>, default: Vec<f64>| match given {
        None => Ok(default),
        Some(list) if list.len() == names.len() => Ok(list.clone()),
        Some(list) => Err(Failure::new(
            format!("--{what} has {} numbers, expected {}", list.len(), names.len()),
            format!("in order: {}", names.join(", ")),
        )),
    };
    if let Some(file) = &args.start {
        return end_of_run(plan, file);
    }
    let names = plan.coordinate_names();
    let mut q = list("q", &args.q, names.clone(), default_start(plan))?;
    let default = match args.control.any() {
        true => plan.start_velocity().unwrap_or_else(|| vec![0.0; plan.dims.nv]),
        false => default_velocity(plan),
    };
    let v = list("v", &args.v, plan.velocity_names(), default)?;
    let interpreter: Interpreter<f64> = plan.default_interpreter();
    for at in interpreter.quaternions() {
        let norm = q[at..at + 4].iter().fold(0.0_f64, |n, x| n.hypot(*x));
        if (norm - 1.0).abs() > 1e-3 {
            return Err(Failure::new(
                format!("--q: {} have length {norm}, expected 1", names[at..at + 4].join(", ")),
                "give a unit quaternion x, y, z, w",
            ));
        }
        if (norm - 1.0).abs() > verdict::UNIT {
            let names = names[at..at + 4].join(", ");
            note(format_args!(
                "--q: warning: {names} have length {norm}; they are scaled to unit length\n  help: give more digits"
            ));
        }
        q[at..at + 4].iter_mut().for_each(|x| *x /= norm);
    }
    Ok((q, v))
}

/// The state at the end of the table of another run.
fn end_of_run(plan: &Plan, file: &Path) -> Outcome<(Vec<f64>, Vec<f64>)> {
    let (coordinates, velocities) = (plan.coordinate_names(), plan.velocity_names());
    let named = |letter: &str, names: &[String]| names.iter().map(|n| format!("{letter}.{n}")).collect::<Vec<_>>();
    let names: Vec<String> = [named("q", &coordinates), named("v", &velocities)].concat();
    let wanted: Vec<(String, usize)> = names.iter().cloned().zip(0..).collect();
    let table = Table::read(file, &wanted, &columns::all(plan))?;
    let mut state = vec![None; names.len()];
    table.columns.iter().for_each(|(what, values)| state[*what] = values.last().copied());
    let missing: Vec<&str> = state.iter().zip(&names).filter(|(x, _)| x.is_none()).map(|(_, n)| n.as_str()).collect();
    if !missing.is_empty() {
        return Err(Failure::new(
            format!("--start: `{}` has no columns {}", file.display(), words::list(missing)),
            "the table of a run has all coordinates and velocities of the model",
        ));
    }
    let mut state: Vec<f64> = state.into_iter().flatten().collect();
    let v = state.split_off(coordinates.len());
    Ok((state, v))
}

/// The plot: coordinates by unit, then the energy.
pub fn panels(plan: &Plan, record: &Record) -> Vec<Panel> {
    let names = plan.coordinate_names();
    let units = units(plan);
    let labels = [("rad", "angle [rad]"), ("m", "position [m]"), ("", "quaternion component")];
    let mut panels = Vec::new();
    for (unit, label) in labels {
        let chosen: Vec<usize> = (0..names.len()).filter(|&k| units[k] == unit).collect();
        if chosen.is_empty() {
            continue;
        }
        let line = |k: usize| (names[k].clone(), record.q.iter().map(|q| q[k]).collect());
        panels.push(Panel::new(label, record.t.clone(), chosen.into_iter().map(line).collect()).apart());
    }
    if !record.efforts.is_empty() {
        let names = plan.velocity_names();
        let moved = |k: &usize| record.efforts.iter().any(|tau| tau[*k] != 0.0);
        let line = |k: usize| (names[k].clone(), record.efforts.iter().map(|tau| tau[k]).collect());
        let lines: Vec<_> = (0..names.len()).filter(moved).map(line).collect();
        if !lines.is_empty() {
            panels.push(Panel::new("effort [N m, N]", record.t.clone(), lines).apart());
        }
    }
    let changes = vec![(String::new(), record.ends.changes())];
    let energy = Panel::new("change of the energy / largest kinetic energy", record.ends.t.clone(), changes);
    panels.push(match energy::in_words(record) {
        Some(words) => energy.in_words(words),
        None => energy,
    });
    panels
}

/// Unit of every coordinate.
fn units(plan: &Plan) -> Vec<&'static str> {
    let free = plan.slots.iter().filter(|s| matches!(s.at, Some(Source::State { .. })));
    free.flat_map(|slot| plan.model.joints[slot.joint].kind.spec().coordinates).map(|c| c.unit.symbol()).collect()
}

//! The table of a simulation: which columns it has, and their numbers.

use std::collections::BTreeSet;

use multibody::codegen::plan::Plan;
use multibody::codegen::words::{did_you_mean, list, quote};
use multibody::runtime::sweep::FrameState;
use multibody::runtime::Constrained;

use super::control::Driven;
use super::motion::{mechanism, Record, Settings};
use super::tables::{self, Table};
use super::{Failure, Outcome};

/// A group of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    Coordinates,
    Velocities,
    Momenta,
    Energy,
    Efforts,
    Frames,
    Multipliers,
    Reactions,
    Forces,
}

impl Group {
    const ALL: [(Group, &'static str); 9] = [
        (Group::Coordinates, "q"),
        (Group::Velocities, "v"),
        (Group::Momenta, "p"),
        (Group::Energy, "energy"),
        (Group::Efforts, "tau"),
        (Group::Frames, "frames"),
        (Group::Multipliers, "multipliers"),
        (Group::Reactions, "reactions"),
        (Group::Forces, "forces"),
    ];

    /// Its columns.
    fn columns(self, plan: &Plan) -> Vec<String> {
        let named = |letter: &str, names: &[String], parts: &[&str]| -> Vec<String> {
            let of = |name: &String| match parts {
                [] => vec![format!("{letter}.{name}")],
                parts => parts.iter().map(|part| format!("{letter}.{name}.{part}")).collect(),
            };
            names.iter().flat_map(of).collect()
        };
        let frames: Vec<String> = plan.frames.iter().map(|frame| frame.name.clone()).collect();
        match self {
            Group::Coordinates => named("q", &plan.coordinate_names(), &[]),
            Group::Velocities => named("v", &plan.velocity_names(), &[]),
            Group::Momenta => named("p", &plan.velocity_names(), &[]),
            Group::Energy => ["kinetic", "potential", "energy"].map(String::from).to_vec(),
            Group::Efforts => named("tau", &plan.velocity_names(), &[]),
            Group::Frames => named("frame", &frames, &["x", "y", "z"]),
            Group::Multipliers => {
                let rows = plan.default_interpreter::<f64>().rows().to_vec();
                let names = plan.constraint_names();
                let place = |k: usize| rows[..k].iter().filter(|row| row.constraint == rows[k].constraint).count() + 1;
                (0..rows.len()).map(|k| format!("lambda.{}.{}", names[rows[k].constraint], place(k))).collect()
            }
            Group::Reactions => {
                named("reaction", &frames[..plan.joint_nodes.len()], &["fx", "fy", "fz", "mx", "my", "mz"])
            }
            Group::Forces => {
                let names: Vec<String> = plan.model.contacts.iter().map(|contact| contact.name.clone()).collect();
                named("force", &names, &["n", "t1", "t2"])
            }
        }
    }
}

/// The columns of a table.
pub struct Columns {
    /// Groups that are computed, and which columns of each are written.
    groups: Vec<(Group, Vec<(usize, String)>)>,
}

impl Columns {
    /// Whether forces of contacts are among them.
    pub fn forces(&self) -> bool {
        self.groups.iter().any(|(group, _)| *group == Group::Forces)
    }
}

/// All columns that the table of a model may have.
pub fn all(plan: &Plan) -> Vec<String> {
    Group::ALL.iter().flat_map(|(group, _)| group.columns(plan)).collect()
}

/// The columns that the arguments name, in their order, or the default ones.
pub fn chosen(plan: &Plan, asked: &[String], controlled: bool) -> Outcome<Columns> {
    let whole = |group: Group| (group, (0..).zip(group.columns(plan)).collect::<Vec<_>>());
    if asked.is_empty() {
        let mut groups = vec![Group::Coordinates, Group::Velocities, Group::Momenta, Group::Energy];
        groups.extend(controlled.then_some(Group::Efforts));
        return Ok(Columns { groups: groups.into_iter().map(whole).collect() });
    }
    let mut groups: Vec<(Group, Vec<(usize, String)>)> = Vec::new();
    for name in asked {
        // `energy` is a group, and the name of one of its columns.
        if let Some((group, _)) = Group::ALL.iter().find(|(_, word)| word == name) {
            let group = whole(*group);
            if group.1.is_empty() {
                let what = format!("--columns: the model has no {name}");
                return Err(Failure::new(what, "leave them out"));
            }
            groups.push(group);
            continue;
        }
        let found = Group::ALL.iter().find_map(|(group, _)| {
            let columns = group.columns(plan);
            columns.iter().position(|column| column == name).map(|at| (*group, (at, name.clone())))
        });
        let Some((group, column)) = found else {
            let words = Group::ALL.iter().map(|(_, word)| *word);
            let columns = all(plan);
            let known = words.clone().chain(columns.iter().map(String::as_str));
            let help = did_you_mean(name, known, || format!("groups of columns are {}", list(words)));
            return Err(Failure::new(format!("--columns: no column is named {}", quote(name)), help));
        };
        match groups.last_mut().filter(|(last, _)| *last == group) {
            Some((_, columns)) => columns.push(column),
            None => groups.push((group, vec![column])),
        }
    }
    // A column that is asked for twice is written once.
    let mut seen = BTreeSet::new();
    groups.iter_mut().for_each(|(_, columns)| columns.retain(|(_, name)| seen.insert(name.clone())));
    groups.retain(|(_, columns)| !columns.is_empty());
    let has = |group| groups.iter().any(|(g, _)| *g == group);
    if has(Group::Efforts) && !controlled {
        return Err(Failure::new(
            "--columns: without control there are no joint forces to write",
            "leave `tau` out, or give --efforts, --kp, --kd or --gravity-compensation",
        ));
    }
    if (has(Group::Multipliers) || has(Group::Reactions)) && !plan.model.contacts.is_empty() {
        return Err(Failure::new(
            "--columns: multipliers and reactions of a mechanism with contacts are not computed",
            "`forces` are those of the contacts",
        ));
    }
    Ok(Columns { groups })
}

/// The table of a motion without contacts.
pub fn table(plan: &Plan, settings: &Settings, record: &Record, columns: &Columns) -> Outcome<Table> {
    table_with(plan, settings, record, columns, &[])
}

/// The table of a motion, whose contacts have these forces.
pub fn table_with(
    plan: &Plan,
    settings: &Settings,
    record: &Record,
    columns: &Columns,
    forces: &[Vec<[f64; 3]>],
) -> Outcome<Table> {
    let mut names = vec![String::from("t")];
    names.extend(columns.groups.iter().flat_map(|(_, names)| names).map(|(_, name)| name.clone()));
    let mut table = Table { names, numbers: Vec::new(), about: tables::about(plan, settings) };
    let mut state = State { driven: settings.driven(mechanism(plan, true)?), plan };
    for (row, t) in record.t.iter().enumerate() {
        table.numbers.push(*t);
        for (group, names) in &columns.groups {
            let numbers: Vec<f64> = match group {
                Group::Coordinates => record.q[row].clone(),
                Group::Velocities => record.v[row].clone(),
                Group::Momenta => record.p[row].clone(),
                Group::Energy => {
                    let (kinetic, potential) = record.energy[row];
                    vec![kinetic, potential, kinetic + potential]
                }
                Group::Efforts => record.efforts[row].clone(),
                Group::Forces => forces[row].iter().flatten().copied().collect(),
                Group::Frames => state.frames(&record.q[row], &record.v[row]),
                Group::Multipliers => state.multipliers(*t, &record.q[row], &record.v[row]),
                Group::Reactions => state.reactions(*t, (&record.q[row], &record.v[row], &record.p[row])),
            };
            table.numbers.extend(names.iter().map(|(at, _)| numbers[*at]));
        }
    }
    Ok(table)
}

/// What is computed of the state of a row.
struct State<'a> {
    driven: Driven,
    plan: &'a Plan,
}

impl State<'_> {
    fn frames(&mut self, q: &[f64], v: &[f64]) -> Vec<f64> {
        let mut out = vec![FrameState::ground(); self.plan.frames.len()];
        self.driven.inputs().frames(q, v, &mut out);
        out.iter().flat_map(|frame| frame.position).collect()
    }

    fn multipliers(&mut self, t: f64, q: &Vec<f64>, v: &Vec<f64>) -> Vec<f64> {
        let mut lambda = self.driven.zero_rows();
        let control = self.driven.control();
        let mut compute = || self.driven.multipliers(t, q, v, &mut lambda);
        match control {
            Some(control) => control.behind(t, compute),
            None => compute(),
        }
        lambda
    }

    fn reactions(&mut self, t: f64, (q, v, p): (&[f64], &[f64], &[f64])) -> Vec<f64> {
        if let Some(control) = self.driven.control() {
            control.behind(t, || self.driven.efforts(t, q, p));
        }
        let mut out = vec![[0.0; 6]; self.plan.joint_nodes.len()];
        let (inputs, mut a) = (self.driven.inputs(), vec![0.0; v.len()]);
        inputs.reactions(q, v, &mut a, &mut out);
        out.into_iter().flatten().collect()
    }
}

/// A field of a CSV file.
pub fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_string(),
    }
}

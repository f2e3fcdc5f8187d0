//! Code for the modes of contacts: functions for each set of modes behind one function for each output, and the trait
//! through which motions with contacts use the type.

use std::collections::HashSet;
use std::fmt::Write;

use mbd_runtime::contact::{work_len, Contact, Mode, Reach, RestitutionLaw};

use super::numbers::literal;
use super::signature::{nested, Signature};
use super::traits::{alias, method};
use crate::code::{Programs, SetPrograms};
use crate::factored::FactoredProgram;
use crate::modes::{words, OF_EACH_SET};
use crate::options::Options;
use crate::output::OutputProgram;
use crate::plan::Plan;

/// What generated code has to know of contacts.
pub struct Contacts<'a> {
    options: &'a Options,
    contacts: Vec<Contact<f64>>,
    /// Names of the contacts.
    names: Vec<&'a str>,
    rows: usize,
    sets: &'a [SetPrograms],
    factored: &'a [OutputProgram<FactoredProgram>],
}

impl<'a> Contacts<'a> {
    /// Of a plan whose rows act by numbers; `None` where the options ask for no modes.
    pub fn new(plan: &'a Plan, options: &'a Options, programs: &'a Programs) -> Option<Self> {
        options.modes.as_ref()?;
        let names = plan.model.contacts.iter().map(|c| c.name.as_str()).collect();
        Some(Contacts {
            options,
            contacts: plan.contacts(),
            names,
            rows: plan.dims.rows,
            sets: &programs.sets,
            factored: &programs.factored,
        })
    }

    /// Name of the function of an output for all modes, where others stand beside it.
    pub fn for_all_modes(&self, output: &str) -> Option<String> {
        let split = !self.sets.is_empty() && OF_EACH_SET.iter().any(|o| o.name() == output);
        split.then(|| format!("{output}_masked"))
    }

    /// Name of the function of an output for set `k`.
    pub fn for_set(output: &str, k: usize) -> String {
        format!("{output}_in_{k}")
    }

    /// The function that calls the one of the modes that were set.
    pub fn dispatch(&self, out: &mut String, signature: &Signature) {
        let name = &signature.name;
        let (arguments, entry) = (signature.names(), self.options.precision.name());
        let _ = write!(out, "\n{}    #[inline]\n", signature.documentation());
        let _ = writeln!(
            out,
            "    pub fn {} {{\n        match self.set {{",
            signature.declaration(&self.options.runtime, entry)
        );
        for (k, set) in self.sets.iter().enumerate() {
            let call = format!("self.{}({arguments})", Self::for_set(name, k));
            let _ = match set.plan.early_tolerance {
                None => writeln!(out, "            {k} => {call},"),
                // A leg cannot follow the rows of its foot: the function for all modes serves.
                Some(_) => {
                    writeln!(out, "            {k} => if {call} == [0.0] {{ self.{name}_masked({arguments}) }},")
                }
            };
        }
        let _ = writeln!(out, "            _ => self.{name}_masked({arguments}),\n        }}\n    }}");
    }

    /// Fields of the type beside its inputs.
    pub fn fields(&self, out: &mut String) {
        let (rt, t, n) = (&self.options.runtime, self.options.precision.name(), self.contacts.len());
        let _ = writeln!(
            out,
            "    /// The contacts, in the order of `CONTACTS`: friction and restitution may be set.\n    \
             pub contacts: [{rt}::contact::Contact<{t}>; {n}],\n    \
             /// The set of modes that acts, an index into `MODES`; any other number where numbers say which rows act.\n    \
             set: usize,"
        );
    }

    /// The set of modes in which all contacts are open.
    fn open(&self) -> usize {
        self.sets.iter().position(|set| set.modes.iter().all(|m| *m == Mode::Open)).unwrap_or(usize::MAX)
    }

    /// Values of the fields in the constructor.
    pub fn values(&self) -> Vec<String> {
        let contacts: Vec<String> = self.contacts.iter().map(|c| self.contact(c)).collect();
        let open = match self.open() {
            usize::MAX => "usize::MAX".to_string(),
            k => k.to_string(),
        };
        vec![format!("contacts: [{}]", contacts.join(", ")), format!("set: {open}")]
    }

    fn contact(&self, Contact { row, tangents, friction, restitution, law }: &Contact<f64>) -> String {
        let (rt, precision) = (&self.options.runtime, self.options.precision);
        let law = match law {
            RestitutionLaw::Poisson => "Poisson",
            RestitutionLaw::Stronge => "Stronge",
            RestitutionLaw::Newton => "Newton",
        };
        let [friction, restitution] = [friction, restitution].map(|x| literal(*x, precision));
        format!(
            "{rt}::contact::Contact {{ row: {row}, tangents: {tangents}, friction: {friction}, restitution: \
             {restitution}, law: {rt}::contact::RestitutionLaw::{law} }}"
        )
    }

    /// Constants: names of the contacts, sets of modes.
    pub fn constants(&self, out: &mut String, plan: &Plan) {
        let (rt, n) = (&self.options.runtime, self.contacts.len());
        self.reaches(out, plan);
        let _ = writeln!(
            out,
            "    /// Names of the contacts.\n    pub const CONTACTS: [&'static str; {n}] = {:?};",
            self.names
        );
        let sets = self.sets.iter().map(|set| {
            let modes: Vec<String> = set.modes.iter().map(|m| format!("{rt}::contact::Mode::{m:?}")).collect();
            format!("        [{}],\n", modes.join(", "))
        });
        let _ = writeln!(
            out,
            "    /// Sets of modes of the contacts that have functions of their own.\n    \
             pub const MODES: [[{rt}::contact::Mode; {n}]; {}] = [\n{}    ];",
            self.sets.len(),
            sets.collect::<String>()
        );
    }

    /// How fast velocities can close gaps, a line for each contact.
    fn reaches(&self, out: &mut String, plan: &Plan) {
        let (rt, precision) = (&self.options.runtime, self.options.precision);
        let number = |x: f64| match x.is_finite() {
            true => literal(x, precision),
            false => format!("{}::INFINITY", precision.name()),
        };
        let defaults = plan.default_params();
        let mut reaches = plan.tree(&defaults).reaches(&self.contacts);
        // What depends on parameters is not a number without them. It has no bound here.
        let without = plan.tree(&vec![f64::NAN; defaults.len()]).reaches(&self.contacts);
        let unknown = without.iter().filter(|x| !(x.rate + x.turn + x.slide).is_finite());
        let unknown: HashSet<usize> = unknown.map(|x| x.contact).collect();
        reaches.iter_mut().filter(|x| unknown.contains(&x.contact)).for_each(|x| x.rate = f64::INFINITY);
        let _ = writeln!(
            out,
            "    /// How fast velocities can close the gaps of contacts, contact by contact: the velocities that can.\n    \
             pub const REACHES: [{rt}::contact::Reach<{}>; {}] = [",
            precision.name(),
            reaches.len()
        );
        for row in reaches.chunk_by(|a, b| a.contact == b.contact) {
            let entry = |x: &Reach<f64>| {
                let [rate, turn, slide] = [x.rate, x.turn, x.slide].map(number);
                let Reach { contact, velocity, .. } = x;
                format!(
                    "{rt}::contact::Reach {{ contact: {contact}, velocity: {velocity}, rate: {rate}, turn: {turn}, slide: {slide} }}"
                )
            };
            let _ = writeln!(out, "        {},", row.iter().map(entry).collect::<Vec<_>>().join(", "));
        }
        let _ = writeln!(out, "    ];");
    }

    /// `impl Touching`.
    pub fn touching(&self, out: &mut String, plan: &Plan) {
        let (rt, t, n) = (&self.options.runtime, self.options.precision.name(), self.contacts.len());
        let rows: usize = self.contacts.iter().map(Contact::rows).sum();
        let room = work_len(rows).max(rows * rows).max(1);
        let [q, v, row, entry] =
            [plan.dims.nq, plan.dims.nv, self.rows, plan.entry_columns().len()].map(|n| nested(&[n], t));
        let of = "T: Copy + ::core::fmt::Debug";
        let items = [
            alias(&format!("PerContact<{of}>"), &format!("[T; {n}]")),
            alias("Delassus", &nested(&[room], t)),
            method(&format!("contacts(&self) -> &[{rt}::contact::Contact<{t}>]"), "&self.contacts"),
            method(&format!("per_contact<{of}>(&self, value: T) -> [T; {n}]"), &format!("[value; {n}]")),
            method(&format!("zero_delassus(&self, _len: usize) -> {}", nested(&[room], t)), &nested(&[room], "0.0")),
            method(&format!("reaches(&self) -> &[{rt}::contact::Reach<{t}>]"), "const { &Self::REACHES }"),
            method(
                &format!("way(&self) -> {rt}::contact::Way"),
                &match self.factored.is_empty() {
                    true => format!(
                        "match self.set < {} {{ true => {rt}::contact::Way::Generated, false => {rt}::contact::Way::Masked }}",
                        self.sets.len()
                    ),
                    false => format!("{rt}::contact::Way::Factored"),
                },
            ),
            method(
                "moves_at_rest(&self) -> bool",
                if plan.dims.drive_v > 0 || self.rows > rows { "true" } else { "false" },
            ),
            method(
                &format!("act(&mut self, modes: &[{rt}::contact::Mode])"),
                &format!(
                    "for (contact, mode) in self.contacts.iter().zip(modes) {{\n            for k in 0..contact.rows() \
                     {{\n                if let Some(acts) = self.acts.get_mut(contact.row + k) {{\n                    \
                     *acts = if mode.acts(k) {{ 1.0 }} else {{ 0.0 }};\n                }}\n            }}\n        }}\n        \
                     self.set = Self::MODES.iter().position(|set: &[{rt}::contact::Mode; {n}]| set[..] == \
                     *modes).unwrap_or(usize::MAX);"
                ),
            ),
            method(
                &format!(
                    "gaps(&mut self, _t: {t}, q: &{q}, v: &{v}, gaps: &mut {row}, velocities: &mut {row}, entries: &mut \
                     {entry})"
                ),
                "Self::gaps(self, q, v, gaps, velocities, entries);",
            ),
        ];
        let ty = &self.options.type_name;
        let _ = writeln!(out, "\n#[rustfmt::skip]\nimpl {rt}::contact::Touching for {ty} {{\n{}}}", items.concat());
    }

    /// Lines of the header.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![String::new(), "Contacts (rows; name):".to_string()];
        for (contact, name) in self.contacts.iter().zip(&self.names) {
            let rows = match contact.rows() {
                1 => contact.row.to_string(),
                n => format!("{}..{}", contact.row, contact.row + n),
            };
            lines.push(format!("  [{rows}] {name}"));
        }
        for program in self.factored {
            let (name, program) = (program.spec.name, &program.program);
            let (pieces, flight, stick) = (program.count(), program.in_flight(), program.sticking());
            lines.push(format!(
                "{name}: {pieces} pieces of {} operations; {flight} where nothing touches, {stick} where everything sticks",
                program.counts().total()
            ));
        }
        if !self.sets.is_empty() {
            lines.extend([String::new(), "Operations in sets of modes, contact by contact:".to_string()]);
        }
        lines.extend(self.sets.iter().map(|set| {
            let counts: Vec<String> =
                set.outputs.iter().map(|p| format!("{} {}", p.spec.name, p.program.counts().total())).collect();
            format!("  {}: {}", words(&set.modes), counts.join(", "))
        }));
        lines
    }
}

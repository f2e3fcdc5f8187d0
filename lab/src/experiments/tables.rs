//! Tables (Markdown) of the biped, each number next to that of the thesis.

use std::fmt::Write as _;

use super::study::{Adaptive, Ended, Fixed};
use super::thesis;

/// Names of the components of the minimal states, in both formulations.
const NAMES: [[&str; 6]; 2] = [["q1", "q2", "q3", "q̇1", "q̇2", "q̇3"], ["q1", "q2", "q3", "p1", "p2", "p3"]];

/// Our number, with that of the thesis in brackets.
fn pair(ours: f64, theirs: f64) -> String {
    format!("{ours:.1e} ({theirs:.1e})")
}

/// Head of a table under a title.
pub fn head(title: &str, columns: &[&str]) -> String {
    format!("### {title}\n\n| {} |\n|{}\n", columns.join(" | "), "---|".repeat(columns.len()))
}

/// One row.
pub fn row(text: &mut String, cells: &[String]) {
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

/// Coordinates at the end by every formulation.
pub fn agreement(ways: &[(&str, Ended)]) -> String {
    let mut text = head(
        "Coordinates at 0.85 s",
        &["equations", "q1", "q2", "q3", "q4", "q5", "farthest from the first", "energy strays by, J"],
    );
    for (name, ended) in ways {
        let apart = ended.q.iter().zip(&ways[0].1.q).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        let mut cells = vec![name.to_string()];
        cells.extend(ended.q.iter().map(|q| format!("{q:.12}")));
        cells.extend([format!("{apart:.1e}"), format!("{:.1e}", ended.energy)]);
        row(&mut text, &cells);
    }
    text + "\n"
}

/// Table 7.1, of steps, accelerations, momenta.
pub fn fixed(rows: &[(f64, [Fixed; 2])]) -> String {
    let mut text = head(
        "Table 7.1: steps of one size, Runge-Kutta-Fehlberg",
        &["step", "end error, accelerations", "Hamilton", "truncation error of q, accelerations", "Hamilton"],
    );
    for (h, [a, b]) in rows {
        let Some((_, end, truncation)) = thesis::FIXED.iter().find(|t| t.0 == *h) else { continue };
        let cells = [
            format!("{h} s"),
            pair(a.end, end[0]),
            pair(b.end, end[1]),
            pair(a.truncation[0], truncation[0]),
            pair(b.truncation[0], truncation[1]),
        ];
        row(&mut text, &cells);
    }
    if let Some((_, [a, b])) = rows.iter().find(|r| r.0 == 1e-3) {
        let [velocities, momenta] = thesis::SECOND_HALF;
        let (velocities, momenta) = (pair(a.truncation[1], velocities), pair(b.truncation[1], momenta));
        let _ = writeln!(
            text,
            "\nWith 1 ms the mean truncation error of the velocities is {velocities}, of the momenta {momenta}."
        );
    }
    text + "\n"
}

/// Runs of `ode45` with accelerations and with Hamilton's equations: mean end error and evaluations. `None` if the
/// steps became too small.
pub type Runs = [Option<(f64, u64)>; 2];

/// Table 7.2.
pub fn ode45(rows: &[(f64, Runs)]) -> String {
    let mut text = head(
        "Table 7.2: `ode45`, absolute and relative tolerance alike",
        &[
            "tolerance",
            "end error, accelerations",
            "Hamilton",
            "thesis",
            "evaluations, accelerations",
            "Hamilton",
            "saved",
        ],
    );
    for (tolerance, runs) in rows {
        let Some((_, end, counts)) = thesis::ODE45.iter().find(|t| t.0 == *tolerance) else { continue };
        let error = |k: usize| runs[k].map_or("–".into(), |r: (f64, u64)| format!("{:.1e}", r.0));
        let count = |k: usize| runs[k].map_or("–".into(), |r: (f64, u64)| format!("{} ({})", r.1, counts[k]));
        let saved = |a: u64, b: u64| 100.0 * (1.0 - b as f64 / a as f64);
        let ours = match runs {
            [Some(a), Some(b)] => format!("{:.0} %", saved(a.1, b.1)),
            _ => "–".into(),
        };
        let saved = format!("{ours} ({:.0} %)", saved(counts[0], counts[1]));
        row(
            &mut text,
            &[format!("{tolerance:.0e}"), error(0), error(1), format!("{end:.0e}"), count(0), count(1), saved],
        );
    }
    let counts: Vec<String> = thesis::ODE15S.iter().map(|(t, [a, b])| format!("{t:.0e} {a} / {b}")).collect();
    let _ = writeln!(
        text,
        "\nThe thesis's ODE15S ({}) is not repeated: no method here counts as it does.\n",
        counts.join("; ")
    );
    text
}

/// Table 7.3: first with control of all errors, then with control of the coordinates' errors; accelerations, then
/// Hamilton.
pub fn control(rows: &[[Adaptive; 2]; 2]) -> String {
    let mut text = head(
        "Table 7.3: Runge-Kutta-Fehlberg with error control, tolerance 1e-6",
        &[
            "control of",
            "truncation error of q, accelerations",
            "Hamilton",
            "end error, accelerations",
            "Hamilton",
            "evaluations, accelerations",
            "Hamilton",
        ],
    );
    for ((name, runs), (truncation, end, counts)) in ["all", "coordinates"].iter().zip(rows).zip(&thesis::CONTROL) {
        let mut cells = vec![name.to_string()];
        cells.extend((0..2).map(|k| pair(runs[k].truncation, truncation[k])));
        cells.extend((0..2).map(|k| pair(runs[k].end, end[k])));
        cells.extend((0..2).map(|k| format!("{} ({})", runs[k].evaluations, counts[k])));
        row(&mut text, &cells);
    }
    text + "\n"
}

/// Table 7.4, with control of all errors.
pub fn wins(runs: &[Adaptive; 2]) -> String {
    let mut text =
        String::from("### Table 7.4: intervals of 0.01 s in which a number of the state had the largest error\n\n");
    for (k, name) in ["accelerations", "Hamilton"].iter().enumerate() {
        let _ = writeln!(text, "| {name} | {} |\n|---|{}", NAMES[k].join(" | "), "---|".repeat(6));
        let cells: Vec<String> =
            runs[k].wins.iter().zip(&thesis::WINS[k]).map(|(ours, theirs)| format!("{ours} ({theirs})")).collect();
        let _ = writeln!(text, "| wins | {} |\n", cells.join(" | "));
    }
    text
}

/// Ranges of figures 7.9 to 7.13, and of the thesis's axes.
pub fn ranges(ours: &[[f64; 2]]) -> String {
    let mut text = head("Figures 7.9 to 7.13", &["figure", "shows", "from", "to", "thesis's axis"]);
    for ((figure, shows, [low, high]), ours) in thesis::AXES.iter().zip(ours) {
        let number = |x: f64| if x.abs() < 1e-3 && x != 0.0 { format!("{x:.1e}") } else { format!("{x:.2}") };
        let axis = format!("{} to {}", number(*low), number(*high));
        row(&mut text, &[figure.to_string(), shows.to_string(), number(ours[0]), number(ours[1]), axis]);
    }
    text + "\n"
}

/// Largest errors of the loop (m) and of the energy (J) with steps of 1 ms.
pub fn drift(rows: &[(&str, [[f64; 2]; 2])]) -> String {
    let mut text = head(
        "Drift with steps of 1 ms, no stabilisation",
        &["method", "loop, accelerations", "momenta", "ratio", "energy, accelerations", "momenta"],
    );
    for (method, [[loop_a, energy_a], [loop_h, energy_h]]) in rows {
        let cells = [loop_a, loop_h, &(loop_a / loop_h), energy_a, energy_h];
        let cells = cells.iter().enumerate().map(|(k, x)| if k == 2 { format!("{x:.0}") } else { format!("{x:.1e}") });
        row(&mut text, &std::iter::once(method.to_string()).chain(cells).collect::<Vec<_>>());
    }
    text + "\n"
}

//! `reports/accuracy.md`: written text with measured tables and figures.

use std::io::Write;

use super::{long, measured, read_rivals, stress, tables, write_figure, LONG};
use crate::args::bench::ReportArgs;
use crate::scenes;
use mbd_cli::write_file;
use mbd_cli::Outcome;

/// The text around the tables.
const TEXT: &str = include_str!("report.md");

/// Measures everything and writes the report.
pub fn write(args: &ReportArgs, out: &mut dyn Write) -> Outcome {
    let rivals = read_rivals(args.rivals.as_deref())?;
    let figures = args.directory.join("figures");
    let mut all = Vec::new();
    for scene in scenes::all() {
        let measured = measured(scene, &[], &rivals);
        write_figure(&measured, &figures)?;
        all.push(measured);
    }
    let work: String = all
        .iter()
        .map(|m| {
            let figure = tables::figure(m)
                .map_or(String::new(), |_| format!("![{}](figures/{}.svg)\n\n", m.scene.title, m.scene.name));
            tables::work(m) + &figure
        })
        .collect();
    let mut runs = String::new();
    for scene in LONG.iter().filter_map(|name| scenes::by_name(name)) {
        runs += &tables::long(&scene, &long::scene(&scene, &long::methods(&[]), args.steps));
    }
    let stress = tables::stress(&stress::rows(&scenes::all(), &[]));
    let text = TEXT
        .replace("{{ratios}}", &tables::ratios(&all))
        .replace("{{work}}", &work)
        .replace("{{long}}", &runs)
        .replace("{{steps}}", &args.steps.to_string())
        .replace("{{stress}}", &stress);
    let path = args.directory.join("accuracy.md");
    write_file(&path, &text)?;
    writeln!(out, "written: {}", path.display())?;
    Ok(())
}

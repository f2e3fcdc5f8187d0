//! The commands that README and docs show. Those in code blocks are run if their files exist, and must print what is
//! shown. The arguments of all others must be valid.
//!
//! A comment `<!-- prints: mbd check models/ur5.urdf -->` before a code block says that the block is the output of that
//! command. A line `[...]` in it stands for lines that are left out. Times and rates of work are not compared.

use std::path::Path;

use crate::run::{err, folder, out, run_in, HAS_SCENES, IS_LAB, ROOT};

/// Arguments of commands that take too long for a test.
const LONG: [&str; 1] = ["models/chain100.toml"];

/// The folder into which the commands of a page write its pictures.
const PICTURES: &str = "docs/pictures";

/// A command that a page shows.
struct Shown {
    /// File and line, or only the file for a command within a sentence.
    place: String,
    text: String,
    /// Whether the command is in a code block, and so complete.
    in_block: bool,
    /// The output of the command, if the page shows it.
    prints: Option<String>,
}

impl Shown {
    /// Arguments of the command, or `None` if it is not the program under test.
    fn arguments(&self) -> Option<Vec<&str>> {
        let mut words: Vec<&str> = self.text.trim().trim_start_matches("$ ").split_whitespace().collect();
        words.truncate(words.iter().position(|w| ["#", ">", "|"].contains(w)).unwrap_or(words.len()));
        if words.first() == Some(&"mbd") {
            return (!IS_LAB).then(|| words[1..].to_vec());
        }
        if !words.starts_with(&["cargo", "run", "--release"]) {
            return None;
        }
        let own = words.iter().position(|w| *w == "--").unwrap_or(words.len());
        let (cargo, arguments) = (&words[3..own], &words[(own + 1).min(words.len())..]);
        let is_lab = cargo.contains(&"mbd-lab");
        let other_package = cargo.contains(&"-p") && !is_lab;
        let generated = cargo.contains(&"generated");
        let built = !generated || HAS_SCENES;
        (is_lab == IS_LAB && !other_package && built).then(|| arguments.to_vec())
    }

    /// Whether the test can run the command: its files are in the repository, and it takes about a second (experiments
    /// take minutes).
    fn can_run(&self, arguments: &[&str]) -> bool {
        let is_file = |a: &&&str| [".toml", ".urdf", ".json"].iter().any(|end| a.ends_with(end));
        let there = arguments.iter().filter(is_file).all(|a| Path::new(ROOT).join(a).exists());
        there && !IS_LAB && !arguments.is_empty() && !LONG.iter().any(|long| self.text.contains(long))
    }
}

/// All commands of the pages.
fn shown() -> Vec<Shown> {
    let root = Path::new(ROOT);
    let docs = std::fs::read_dir(root.join("docs")).expect("the docs").map(|f| f.expect("a file").path());
    let mut pages: Vec<_> = docs.filter(|path| path.extension().is_some_and(|e| e == "md")).collect();
    pages.sort();
    pages.push(root.join("README.md"));
    let mut all = Vec::new();
    for page in pages {
        let name = page.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_string();
        of_page(&name, &std::fs::read_to_string(&page).expect("a page"), &mut all);
    }
    all
}

/// The commands of one page.
fn of_page(name: &str, text: &str, all: &mut Vec<Shown>) {
    let (mut prose, mut fenced, mut printing) = (String::new(), false, None);
    for (k, line) in text.lines().enumerate() {
        let place = format!("{name}:{}", k + 1);
        if let Some(command) = line.trim().strip_prefix("<!-- prints: ").and_then(|l| l.strip_suffix(" -->")) {
            all.push(Shown { place, text: command.to_string(), in_block: true, prints: Some(String::new()) });
            printing = Some(all.len() - 1);
        } else if line.starts_with("```") {
            fenced = !fenced;
            if !fenced {
                printing = None;
            }
        } else if let (true, Some(at)) = (fenced, printing) {
            all[at].prints.get_or_insert_default().extend([line, "\n"]);
        } else if fenced || line.starts_with("    ") {
            all.push(Shown { place, text: line.to_string(), in_block: true, prints: None });
        } else {
            prose += line;
            prose += "\n";
        }
    }
    let inline = prose.split('`').skip(1).step_by(2);
    all.extend(inline.map(|code| Shown { place: name.into(), text: code.into(), in_block: false, prints: None }));
    all.retain(|shown| shown.arguments().is_some());
}

/// The line with numbers replaced if it contains times or rates of work.
fn without_times(line: &str) -> String {
    if ![" ms", " million"].iter().any(|unit| line.contains(unit)) {
        return line.trim_end().to_string();
    }
    line.trim_end()
        .split(' ')
        .map(|w| if w.starts_with(|c: char| c.is_ascii_digit()) { "#" } else { w })
        .collect::<Vec<_>>()
        .join(" ")
}

/// Compares what a command printed with what a page shows.
#[track_caller]
fn agree(printed: &str, shown: &str, place: &str) {
    let mut printed_lines = printed.lines();
    let mut skipping = false;
    for line in shown.lines() {
        if line.starts_with("[...]") {
            skipping = true;
            continue;
        }
        let is_it = |l: &str| without_times(l) == without_times(line);
        let found = if skipping { printed_lines.any(is_it) } else { printed_lines.next().is_some_and(is_it) };
        assert!(found, "{place}: the command does not print `{line}` here, but\n{printed}");
        skipping = false;
    }
    assert!(skipping || printed_lines.all(|l| l.trim().is_empty()), "{place}: the command prints more:\n{printed}");
}

/// Compares the output of a command with every page that shows it. Returns the number of these pages.
#[track_caller]
pub fn agrees_with_pages(command: &[&str], printed: &str) -> usize {
    let all = shown();
    let pages = all.iter().filter(|s| s.arguments().is_some_and(|a| a == command));
    let pages = pages.filter_map(|s| s.prints.as_ref().map(|text| (&s.place, text)));
    pages.map(|(place, text)| agree(printed, text, place)).count()
}

#[cfg(unix)]
#[test]
fn commands_in_code_blocks_run_and_print_what_is_shown() {
    let folder = folder("documented");
    for name in ["models", "codegen", "examples"] {
        std::os::unix::fs::symlink(Path::new(ROOT).join(name), folder.join(name)).expect("a link");
    }
    std::fs::create_dir_all(folder.join(PICTURES)).expect("a directory");
    let mut runs = 0;
    for shown in shown().iter().filter(|s| s.in_block) {
        let Some(arguments) = shown.arguments().filter(|a| shown.can_run(a)) else { continue };
        let output = run_in(&folder, &arguments);
        let is_error = |line: &str| line.starts_with("error: ") || line.contains(": error: ");
        let refused = shown.prints.as_ref().is_some_and(|text| text.lines().any(is_error));
        let status = i32::from(refused);
        assert_eq!(output.status.code(), Some(status), "{}: {}\n{}", shown.place, shown.text, err(&output));
        if let Some(text) = &shown.prints {
            agree(if refused { err(&output) } else { out(&output) }, text, &shown.place);
        }
        runs += 1;
    }
    assert!(IS_LAB || runs > 10, "{runs} commands were found");
    for picture in std::fs::read_dir(folder.join(PICTURES)).expect("the pictures").map(|f| f.expect("a file").path()) {
        let shown = Path::new(ROOT).join(PICTURES).join(picture.file_name().expect("a name"));
        let [drawn, shown] = [&picture, &shown].map(|file| std::fs::read_to_string(file).expect("a picture"));
        assert!(drawn == shown, "{} is not what the page's command draws", picture.display());
    }
}

/// Commands run in an empty folder: they end early because their files are missing. An invalid argument would be
/// another error.
#[test]
fn other_commands_are_understood() {
    let folder = folder("understood");
    let mut met = 0;
    for shown in shown() {
        let Some(arguments) = shown.arguments().filter(|a| !a.is_empty()) else { continue };
        met += 1;
        let asked: Vec<&str> = if IS_LAB { [&arguments[..], &["--help"]].concat() } else { arguments.clone() };
        let output = run_in(&folder, &asked);
        // A sentence may name a command without all its arguments.
        let missing = ["required arguments were not provided", "a value is required"];
        let incomplete = !shown.in_block && missing.iter().any(|text| err(&output).contains(text));
        let understood = output.status.code() != Some(2) || incomplete;
        assert!(understood, "{}: {}\n{}", shown.place, shown.text, err(&output));
    }
    assert!(IS_LAB || met > 20, "{met} commands were found");
}

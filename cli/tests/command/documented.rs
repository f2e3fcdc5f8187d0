//! The commands that README and book show. Those in code blocks are run if their files exist, and must print what is
//! shown. The arguments of all others must be valid.
//!
//! A comment `<!-- prints: mbd check models/ur5.urdf -->` before a code block says that the block is the output of that
//! command. A line `[...]` in it stands for lines that are left out. Times and rates of work are not compared.
//! A comment `<!-- file: pendulum.toml -->` says that the block is a file that the reader of the page writes, for the
//! commands after it. Every page has a folder of its own.

use std::path::{Path, PathBuf};

use crate::run::{err, folder, out, run_in, HAS_SCENES, IS_LAB, ROOT};

/// Arguments of commands that take too long for a test.
const LONG: [&str; 1] = ["models/chain100.toml"];

/// Arguments of the command that ends when it is interrupted.
const ENDLESS: [&str; 1] = ["view"];

/// The folder into which the commands of a page write its pictures.
const PICTURES: &str = "book/src/pictures";

/// What a block or a sentence of a page is.
#[derive(PartialEq)]
enum Kind {
    /// A command in a code block, which is complete.
    Command,
    /// A command within a sentence, which may lack arguments.
    Mention,
    /// A command with what it prints; `Shown::text` is the command.
    Prints(String),
    /// A file with these contents; `Shown::text` is its name.
    File(String),
}

/// A command or a file that a page shows.
struct Shown {
    /// The page.
    page: String,
    /// Its line, of what is in a block.
    line: Option<usize>,
    text: String,
    kind: Kind,
}

impl Shown {
    /// Page and line.
    fn place(&self) -> String {
        self.line.map_or_else(|| self.page.clone(), |line| format!("{}:{line}", self.page))
    }

    /// Whether the command is in a block, and so complete.
    fn in_block(&self) -> bool {
        self.kind != Kind::Mention
    }

    /// Arguments of the command, or `None` if it is not the program under test.
    fn arguments(&self) -> Option<Vec<&str>> {
        if let Kind::File(_) = self.kind {
            return None;
        }
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

    /// Whether the test can run the command: its files are in this folder, and it takes about a second (experiments
    /// take minutes).
    fn can_run(&self, folder: &Path, arguments: &[&str]) -> bool {
        let is_output = |k: usize| k > 0 && ["-o", "--output"].contains(&arguments[k - 1]);
        let is_file = |a: &str| [".toml", ".urdf", ".xml", ".json"].iter().any(|end| a.ends_with(end));
        let there = (0..arguments.len()).filter(|k| is_file(arguments[*k]) && !is_output(*k));
        let there = there.into_iter().all(|k| folder.join(arguments[k]).exists());
        there
            && !IS_LAB
            && !arguments.is_empty()
            && *arguments != ENDLESS
            && !LONG.iter().any(|long| self.text.contains(long))
    }
}

/// All commands and files of the pages, in their order.
fn shown() -> Vec<Shown> {
    let root = Path::new(ROOT);
    let mut all = Vec::new();
    for page in pages() {
        let name = page.strip_prefix(root).expect("a page of the project").to_string_lossy().into_owned();
        of_page(&name, &std::fs::read_to_string(&page).expect("a page"), &mut all);
    }
    all
}

/// The files of the book, the README, and the front page of the crate.
pub fn pages() -> Vec<PathBuf> {
    let root = Path::new(ROOT);
    let book = std::fs::read_dir(root.join("book/src")).expect("the book").map(|f| f.expect("a file").path());
    let mut pages: Vec<_> = book.filter(|path| path.extension().is_some_and(|e| e == "md")).collect();
    pages.sort();
    pages.extend(["README.md", "src/guide.md"].map(|page| root.join(page)));
    pages
}

/// The commands and files of one page.
fn of_page(page: &str, text: &str, all: &mut Vec<Shown>) {
    let shown = |line, text: &str, kind| Shown { page: page.to_string(), line, text: text.to_string(), kind };
    let (mut prose, mut fenced, mut filling) = (String::new(), false, None);
    for (k, line) in text.lines().enumerate() {
        let here = Some(k + 1);
        let comment = line.trim().strip_prefix("<!-- ").and_then(|l| l.strip_suffix(" -->"));
        let kind = comment.and_then(|c| c.split_once(": ")).and_then(|(kind, text)| match kind {
            "prints" => Some((text, Kind::Prints(String::new()))),
            "file" => Some((text, Kind::File(String::new()))),
            _ => None,
        });
        if let Some((text, kind)) = kind {
            all.push(shown(here, text, kind));
            filling = Some(all.len() - 1);
        } else if line.starts_with("```") {
            fenced = !fenced;
            if !fenced {
                filling = None;
            }
        } else if let (true, Some(Kind::Prints(text) | Kind::File(text))) =
            (fenced, filling.map(|at: usize| &mut all[at].kind))
        {
            text.extend([line, "\n"]);
        } else if fenced || line.starts_with("    ") {
            all.push(shown(here, line, Kind::Command));
        } else {
            prose += line;
            prose += "\n";
        }
    }
    all.extend(prose.split('`').skip(1).step_by(2).map(|code| shown(None, code, Kind::Mention)));
    all.retain(|shown| matches!(shown.kind, Kind::File(_)) || shown.arguments().is_some());
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
    let of_command = all.iter().filter(|s| s.arguments().is_some_and(|a| a == command));
    let pages =
        of_command.filter_map(|s| if let Kind::Prints(text) = &s.kind { Some((s.place(), text)) } else { None });
    pages.map(|(place, text)| agree(printed, text, &place)).count()
}

/// A folder for the commands of a page, with the models and examples of the project.
#[cfg(unix)]
fn folder_of(page: &str) -> PathBuf {
    let folder = folder(&format!("documented_{}", page.replace(['/', '.'], "_")));
    for name in ["models", "codegen", "examples"] {
        std::os::unix::fs::symlink(Path::new(ROOT).join(name), folder.join(name)).expect("a link");
    }
    std::fs::create_dir_all(folder.join(PICTURES)).expect("a directory");
    folder
}

/// Runs a command that a page shows, and compares what it prints.
#[cfg(unix)]
#[track_caller]
fn run_shown(folder: &Path, shown: &Shown, arguments: &[&str]) {
    let output = run_in(folder, arguments);
    let printed = if let Kind::Prints(text) = &shown.kind { Some(text) } else { None };
    let is_error = |line: &str| line.starts_with("error: ") || line.contains(": error: ");
    let refused = printed.is_some_and(|text| text.lines().any(is_error));
    let status = i32::from(refused);
    assert_eq!(output.status.code(), Some(status), "{}: {}\n{}", shown.place(), shown.text, err(&output));
    if let Some(text) = printed {
        agree(if refused { err(&output) } else { out(&output) }, text, &shown.place());
    }
}

#[cfg(unix)]
#[test]
fn commands_in_code_blocks_run_and_print_what_is_shown() {
    let mut runs = 0;
    for of_page in shown().chunk_by(|a, b| a.page == b.page) {
        let folder = folder_of(&of_page[0].page);
        for shown in of_page.iter().filter(|s| s.in_block()) {
            if let Kind::File(text) = &shown.kind {
                std::fs::write(folder.join(&shown.text), text).expect("a file");
            } else if let Some(arguments) = shown.arguments().filter(|a| shown.can_run(&folder, a)) {
                run_shown(&folder, shown, &arguments);
                runs += 1;
            }
        }
        for picture in
            std::fs::read_dir(folder.join(PICTURES)).expect("the pictures").map(|f| f.expect("a file").path())
        {
            let shown = Path::new(ROOT).join(PICTURES).join(picture.file_name().expect("a name"));
            let [drawn, shown] = [&picture, &shown].map(|file| std::fs::read_to_string(file).expect("a picture"));
            assert!(drawn == shown, "{} is not what the page's command draws", picture.display());
        }
    }
    assert!(IS_LAB || runs > 10, "{runs} commands were found");
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
        let ends = !IS_LAB && arguments != ENDLESS;
        let asked: Vec<&str> = if !ends { [&arguments[..], &["--help"]].concat() } else { arguments.clone() };
        let output = run_in(&folder, &asked);
        // A sentence may name a command without all its arguments.
        let missing = ["required arguments were not provided", "a value is required"];
        let incomplete = !shown.in_block() && missing.iter().any(|text| err(&output).contains(text));
        let understood = output.status.code() != Some(2) || incomplete;
        assert!(understood, "{}: {}\n{}", shown.place(), shown.text, err(&output));
    }
    assert!(IS_LAB || met > 20, "{met} commands were found");
}

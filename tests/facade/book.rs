//! The book is complete: its list of pages has every page, and every link leads somewhere.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The project's folder.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The pages of the book.
fn pages() -> Vec<PathBuf> {
    let files = std::fs::read_dir(root().join("book/src")).expect("the book").map(|f| f.expect("a file").path());
    files.filter(|path| path.extension().is_some_and(|e| e == "md")).collect()
}

/// Targets of the links of a page that are no addresses in the net: file and place in it.
fn links(text: &str) -> impl Iterator<Item = (&str, Option<&str>)> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let own = targets.filter(|target| !target.contains("://") && !target.contains(' '));
    own.map(|target| target.split_once('#').map_or((target, None), |(file, place)| (file, Some(place))))
}

/// The places of a page: what its headings are called in links.
fn places(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let place = |heading: &str| -> String {
        let kept = heading.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
        kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
    };
    headings.map(place).collect()
}

#[test]
fn the_list_of_pages_has_every_page() {
    let summary = read(&root().join("book/src/SUMMARY.md"));
    let listed: BTreeSet<String> = links(&summary).map(|(file, _)| file.to_string()).collect();
    let names = pages().into_iter().filter_map(|path| Some(path.file_name()?.to_str()?.to_string()));
    let there: BTreeSet<String> = names.filter(|name| name != "SUMMARY.md").collect();
    assert_eq!(listed, there);
}

#[test]
fn links_lead_somewhere() {
    let mut checked = 0;
    let others = ["README.md", "CONTRIBUTING.md", "models/README.md"].map(|page| root().join(page));
    for page in pages().into_iter().chain(others) {
        let in_book = page.starts_with(root().join("book"));
        let text = read(&page);
        for (file, place) in links(&text) {
            let shown = format!("{}: {file}", page.display());
            let target = if file.is_empty() { page.clone() } else { page.with_file_name(file) };
            assert!(target.exists(), "{shown} is not there");
            // Other files of the project are no part of the built book.
            assert!(!in_book || !file.contains(".."), "{shown} is not in the book");
            let known = place.is_none_or(|place| places(&read(&target)).contains(place));
            assert!(known, "{shown} has no heading {place:?}");
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked} links were found");
}

#[test]
fn pictures_of_measurements_are_those_of_the_reports() {
    let pairs = [("speed", "benches/rivals/result/chart.svg"), ("work_precision_ur5", "reports/figures/ur5.svg")];
    for (copy, measured) in pairs {
        let copy = format!("book/src/pictures/{copy}.svg");
        assert!(read(&root().join(&copy)) == read(&root().join(measured)), "{copy} should be a copy of {measured}");
    }
}

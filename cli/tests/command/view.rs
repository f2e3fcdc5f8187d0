//! `mbd view`: the page that is written.

use crate::run::*;

/// Largest size of the page with a model of this project, bytes.
const LARGEST: usize = 900_000;

/// The text of an element `script` with an identifier.
fn script<'p>(page: &'p str, id: &str) -> &'p str {
    let (_, rest) = page.split_once(&format!("id=\"{id}\">")).expect("the element");
    rest.split_once("</script>").expect("its end").0
}

#[test]
fn one_small_file_without_requests() {
    let folder = folder("view");
    let output = good(run_in(&folder, &["view", &format!("{ROOT}/models/g1.urdf"), "--base", "floating"]));
    assert!(out(&output).starts_with("g1.html: "), "{}", out(&output));
    let page = std::fs::read_to_string(folder.join("g1.html")).expect("a page");
    // The model itself comes on top: this one has 100 kB.
    let model = script(&page, "given").len();
    assert!(page.len() - model <= LARGEST, "{} bytes", page.len() - model);
    for word in ["http://", "https://", "src=", "@import", "url(", "<link", "import("] {
        let texts = page.replace(script(&page, "given"), "").replace(script(&page, "wasm"), "");
        assert!(!texts.contains(word), "the page has `{word}`");
    }
    let given: serde_json::Value = serde_json::from_str(script(&page, "given")).expect("JSON");
    assert_eq!(given["name"], "g1.urdf");
    assert_eq!(given["options"]["floating"], true);
    assert!(page.contains("<title>g1 · mbd view</title>"));
    // Every place of the template is filled.
    for place in ["@TITLE@", "@STYLE@", "@GIVEN@", "@WASM@", "@SCRIPT@"] {
        assert!(!page.contains(place), "{place}");
    }
}

#[test]
fn an_empty_page_takes_what_is_dropped() {
    let folder = folder("view_empty");
    good(run_in(&folder, &["view"]));
    let page = std::fs::read_to_string(folder.join("mbd-view.html")).expect("a page");
    let given: serde_json::Value = serde_json::from_str(script(&page, "given")).expect("JSON");
    assert!(given["name"].is_null() && given["files"].as_array().is_some_and(Vec::is_empty));
    assert!(page.len() <= LARGEST, "{} bytes", page.len());
    let printed = good(run_in(&folder, &["view", "-o", "-"]));
    assert_eq!(out(&printed), page);
    assert_eq!(files(&folder), ["mbd-view.html"]);
}

#[test]
fn names_of_models_end_no_element() {
    let folder = folder("view_names");
    let text = std::fs::read_to_string(format!("{ROOT}/models/double_pendulum.toml")).expect("a model");
    let name = "a<b>&.toml";
    std::fs::write(folder.join(name), text).expect("a file");
    good(run_in(&folder, &["view", name, "-o", "page.html"]));
    let page = std::fs::read_to_string(folder.join("page.html")).expect("a page");
    let given: serde_json::Value = serde_json::from_str(script(&page, "given")).expect("JSON");
    assert_eq!(given["name"], name);
}

#[test]
fn what_cannot_be_written_is_told() {
    let folder = folder("view_bad");
    let model = folder.join("model.toml");
    std::fs::copy(format!("{ROOT}/models/double_pendulum.toml"), &model).expect("a copy");
    bad(run_in(&folder, &["view", "model.toml", "-o", "model.toml"]), &["it is the input of this command"]);
    bad(run_in(&folder, &["view", "model.tml"]), &["cannot read `model.tml`", "model.toml"]);
    bad(run_in(&folder, &["view", "model.toml", "-o", "none/page.html"]), &["cannot write `none/page.html`"]);
    std::fs::write(folder.join("broken.toml"), "[[body]]\nname = 'a'\n").expect("a file");
    bad(run_in(&folder, &["view", "broken.toml"]), &["broken.toml:1:"]);
    bad(run_in(&folder, &["view", "model.toml", "--gravity", "0,0,1"]), &["--gravity", "mbd convert"]);
    assert_eq!(files(&folder), ["broken.toml", "model.toml"]);
}

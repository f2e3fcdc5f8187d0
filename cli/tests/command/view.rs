//! `mbd view`: the page that is written.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

use crate::run::*;

/// Largest size of the page with a model of this project, bytes.
const LARGEST: usize = 940_000;

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
    assert!(page.contains("<title>g1_29dof_rev_1_0 · mbd view</title>"));
    // Every place of the template is filled.
    for place in ["@TITLE@", "@GIVEN@", "@WASM@", "@SCRIPTS@", "@UNPACK@", "@INKS@"] {
        assert!(!page.contains(place), "{place}");
    }
}

#[test]
fn an_empty_page_takes_what_is_dropped() {
    let folder = folder("view_empty");
    good(run_in(&folder, &["view", "-o", "mbd-view.html"]));
    let page = std::fs::read_to_string(folder.join("mbd-view.html")).expect("a page");
    let given: serde_json::Value = serde_json::from_str(script(&page, "given")).expect("JSON");
    assert!(given["name"].is_null() && given["files"].as_array().is_some_and(Vec::is_empty));
    assert!(page.len() <= LARGEST, "{} bytes", page.len());
    let printed = good(run_in(&folder, &["view", "-o", "-"]));
    assert_eq!(out(&printed), page);
    // Options of the readers mean nothing for it.
    for (option, value) in [("--base", "floating"), ("--floor", "0"), ("--gravity", "0,0,-9.81")] {
        let output = run_in(&folder, &["view", option, value, "-o", "other.html"]);
        assert_eq!(output.status.code(), Some(2), "{option}");
        let told = err(&output);
        assert!(told.contains("arguments were not provided") && told.contains("MODEL"), "{option}: {told}");
    }
    assert_eq!(files(&folder), ["mbd-view.html"]);
}

/// A command that runs until it is dropped, with the first line that it writes.
struct Running(Child, String);

impl Running {
    fn new(arguments: &[&str]) -> Running {
        let mut command = Command::new(PROGRAM);
        let mut child = command.args(arguments).stdout(Stdio::piped()).spawn().expect("the program");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        Running(child, line)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What a server answers to some bytes.
fn asked(address: &str, request: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("a connection");
    stream.write_all(request.as_bytes()).expect("a request");
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("an answer");
    text
}

#[test]
fn without_a_model_an_empty_page_is_served() {
    let server = Running::new(&["view"]);
    let address = server.1.strip_prefix("http://").and_then(|line| line.split_once('/')).expect("an address").0;
    assert!(address.starts_with("127.0.0.1:"), "{}", server.1);
    // One that goes away and one that says nothing sensible do not end it.
    drop(TcpStream::connect(address).expect("a connection"));
    assert!(asked(address, "nonsense\r\n\r\n").starts_with("HTTP/1.1 405 "));
    let page = asked(address, "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    let (head, body) = page.split_once("\r\n\r\n").expect("a head");
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n") && head.contains(&format!("Content-Length: {}\r\n", body.len())));
    assert_eq!(body, out(&good(run_in(&folder("view_served"), &["view", "-o", "-"]))));
    assert!(asked(address, "GET /../Cargo.toml HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404 "));
    let head = asked(address, "HEAD /?q HTTP/1.1\r\n\r\n");
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n") && head.ends_with("\r\n\r\n"));
    let port = address.split_once(':').expect("a port").1;
    bad(run_in(&folder("view_port"), &["view", "--port", port]), &[&format!("cannot serve at port {port}")]);
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
    bad(run_in(&folder, &["view", "broken.toml"]), &["broken.toml:2:8: error"]);
    bad(run_in(&folder, &["view", "model.toml", "--gravity", "0,0,1"]), &["--gravity", "mbd convert"]);
    assert_eq!(files(&folder), ["broken.toml", "model.toml"]);
}

/// The JSON of a document of glTF, and its buffer.
fn glb(bytes: &[u8]) -> (serde_json::Value, &[u8]) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json = serde_json::from_slice(&bytes[20..20 + word(12)]).expect("JSON");
    (json, &bytes[20 + word(12) + 8..])
}

#[test]
fn motions_for_other_viewers() {
    let folder = folder("view_gltf");
    let model = format!("{ROOT}/models/mechanisms/fourbar.toml");
    good(run_in(&folder, &["view", &model, "--gltf", "fourbar.glb", "--time", "0.5"]));
    good(run_in(&folder, &["view", &model, "--gltf", "fourbar.gltf", "--time", "0.5"]));
    let bytes = std::fs::read(folder.join("fourbar.glb")).expect("a file");
    let (json, buffer) = glb(&bytes);
    let text = std::fs::read_to_string(folder.join("fourbar.gltf")).expect("a file");
    let other: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["nodes"], other["nodes"]);
    assert_eq!(json["buffers"][0]["byteLength"], buffer.len());
    let list = |name: &str| json[name].as_array().expect("a list").clone();
    for accessor in list("accessors") {
        let view = &list("bufferViews")[accessor["bufferView"].as_u64().expect("an index") as usize];
        let width = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            other => panic!("{other:?}"),
        };
        assert_eq!(view["byteLength"].as_u64(), accessor["count"].as_u64().map(|n| 4 * width * n));
        assert!(view["byteOffset"].as_u64() < Some(buffer.len() as u64));
    }
    // Three bodies turn; each has places and rotations at sixteen instants.
    let animation = &list("animations")[0];
    let samplers = animation["samplers"].as_array().expect("samplers");
    assert!(samplers.len() >= 6, "{samplers:?}");
    let input = samplers[0]["input"].as_u64().expect("an index") as usize;
    assert_eq!(list("accessors")[input]["count"], 16);
    assert_eq!(list("accessors")[input]["max"][0], 0.5);
    bad(run_in(&folder, &["view", &model, "--gltf", "fourbar.obj"]), &["neither `.gltf` nor `.glb`"]);
}

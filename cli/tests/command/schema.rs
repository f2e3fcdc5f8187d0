//! The JSON Schema of the model format against the files that the reader takes and refuses.

use std::path::{Path, PathBuf};

use serde_json::{json, Value};

use crate::run::*;

/// Why a value does not agree with a schema, if it does not: the part of draft 4 that the schema uses. A keyword that is
/// not known here is a failure.
fn fault(schema: &Value, root: &Value, value: &Value) -> Option<String> {
    let part = |schema: &Value, value: &Value, key: &str| fault(schema, root, value).map(|why| format!("{key}: {why}"));
    schema.as_object().expect("a schema").iter().find_map(|(keyword, stated)| match keyword.as_str() {
        "$schema" | "title" | "definitions" => None,
        "$ref" => {
            let path = stated.as_str().expect("a path").trim_start_matches('#');
            fault(root.pointer(path).expect("a definition"), root, value)
        }
        "type" => {
            let agrees = match stated.as_str().expect("a type") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "number" => value.is_number(),
                "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
                "boolean" => value.is_boolean(),
                other => panic!("type {other}"),
            };
            (!agrees).then(|| format!("{value} is no {stated}"))
        }
        "enum" => (!stated.as_array().expect("a list").contains(value)).then(|| format!("{value} is none of {stated}")),
        "anyOf" => {
            let faults: Option<Vec<String>> =
                stated.as_array().expect("a list").iter().map(|schema| fault(schema, root, value)).collect();
            faults.map(|faults| faults.join(", and "))
        }
        "items" => value.as_array()?.iter().find_map(|item| part(stated, item, "item")),
        "minItems" => (value.as_array()?.len() < stated.as_u64()? as usize).then(|| "too short".into()),
        "maxItems" => (value.as_array()?.len() > stated.as_u64()? as usize).then(|| "too long".into()),
        "minimum" => (value.as_f64()? < stated.as_f64()?).then(|| "too small".into()),
        "maximum" => (value.as_f64()? > stated.as_f64()?).then(|| "too large".into()),
        "minLength" => (value.as_str()?.len() < stated.as_u64()? as usize).then(|| "empty".into()),
        "required" => {
            let missing = |key: &&Value| value.get(key.as_str().expect("a key")).is_none();
            value.as_object().and(stated.as_array()?.iter().find(missing)).map(|key| format!("{key} is missing"))
        }
        "properties" => {
            let entries = value.as_object()?.iter();
            entries.filter_map(|(key, value)| Some((key, stated.get(key)?, value))).find_map(|(k, s, v)| part(s, v, k))
        }
        "additionalProperties" => {
            let known = |key: &str| schema.get("properties").is_some_and(|p| p.get(key).is_some());
            let others = value.as_object()?.iter().filter(|(key, _)| !known(key));
            others
                .map(
                    |(k, v)| {
                        if *stated == json!(false) {
                            Some(format!("unknown key {k}"))
                        } else {
                            part(stated, v, k)
                        }
                    },
                )
                .find_map(|why| why)
        }
        other => panic!("keyword {other}"),
    })
}

/// A TOML file as JSON; `None` where it is no TOML.
fn document(path: &Path) -> Option<Value> {
    let text = std::fs::read_to_string(path).expect("a file");
    let table: toml::Table = text.parse().ok()?;
    serde_json::to_value(table).ok()
}

/// TOML files below a folder of the repository.
fn files(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, all);
        } else if path.extension().is_some_and(|e| e == "toml") {
            all.push(path);
        }
    }
}

#[test]
fn the_schema_takes_what_the_reader_takes() {
    let printed = good(run(&["completions", "schema"]));
    let committed =
        std::fs::read_to_string(format!("{ROOT}/book/src/model.schema.json")).expect("the committed schema");
    assert_eq!(out(&printed), committed, "`mbd completions schema > book/src/model.schema.json` writes it anew");
    let schema = json_of(&printed);
    let mut sound = Vec::new();
    files(&Path::new(ROOT).join("models"), &mut sound);
    files(&Path::new(ROOT).join("codegen/tests/readers"), &mut sound);
    assert!(sound.len() > 40);
    for path in &sound {
        let why = fault(&schema, &schema, &document(path).expect("TOML"));
        assert_eq!(why, None, "{}", path.display());
    }
}

#[test]
fn the_schema_refuses_keys_that_the_reader_does_not_know() {
    let schema = json_of(&good(run(&["completions", "schema"])));
    let mut broken = Vec::new();
    files(&Path::new(ROOT).join("codegen/tests/broken/toml"), &mut broken);
    let mut refused = 0;
    for path in &broken {
        let findings = std::fs::read_to_string(path.with_extension("txt")).expect("the findings");
        if let (true, Some(document)) = (findings.contains("unknown key"), document(path)) {
            refused += 1;
            assert!(fault(&schema, &schema, &document).is_some(), "{}", path.display());
        }
    }
    assert!(refused > 3, "{refused} files with unknown keys");
}

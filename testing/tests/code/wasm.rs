//! WebAssembly run by Node against the programs that it was made of: all bits are the same, in exact and in fast
//! arithmetic, except for the signs of zeros.

use std::fs;
use std::process::Command;

use mbd_codegen::generate::InputArray;
use mbd_codegen::options::PlanOptions;
use mbd_codegen::plan::Plan;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{search, wasm, Options, Output, Precision};
use mbd_testing::conformance::{angles, chain, closed, far, fast, sampled, sine_and_cosine, tree, Case, Run};
use mbd_testing::toml::to_toml;

use crate::external::{folder, is_there, write};

/// Reads `runs.json` and the inputs of all runs, calls the functions of all modules by their wrappers, and writes the
/// results one after the other.
const SCRIPT: &str = r#"
import { readFileSync, writeFileSync } from "node:fs";
const given = new Float64Array(new Uint8Array(readFileSync("given.bin")).buffer);
const found = [];
let at = 0;
for (const { name, runs } of JSON.parse(readFileSync("runs.json", "utf8"))) {
  const { Model, load } = await import(`./${name}.js`);
  const model = await load(readFileSync(`${name}.wasm`));
  for (const { output, inputs } of runs) {
    for (const [array, length] of inputs) {
      model[array]?.set(given.subarray(at, at + length));
      at += length;
    }
    const before = inputs.map(([array]) => model[array]?.slice());
    const results = model[output]();
    for (const array of ArrayBuffer.isView(results) ? [results] : Object.values(results)) {
      found.push(...array);
    }
    for (const [k, [array]] of inputs.entries()) {
      if (before[k]?.some((x, i) => !Object.is(x, model[array][i]))) {
        throw new Error(`${name}: ${output} changes its input ${array}`);
      }
    }
  }
}
writeFileSync("found.bin", new Uint8Array(new Float64Array(found).buffer));
"#;

/// Evaluations of the outputs of a plan.
struct Job<'a> {
    name: String,
    plan: &'a Plan,
    options: &'a Options,
    /// Number of states in each run.
    lanes: usize,
    runs: Vec<Run>,
}

impl Job<'_> {
    fn of(case: &Case) -> Job<'_> {
        Job { name: case.name.clone(), plan: &case.plan, options: &case.options, lanes: 1, runs: case.runs() }
    }

    /// The same mechanism in several states at once, which come from different cases.
    fn lanes<'a>(cases: &[&'a Case]) -> Job<'a> {
        let (case, lanes) = (cases[0], cases.len());
        let runs: Vec<Vec<Run>> = cases.iter().map(|case| case.runs()).collect();
        let joined = (0..runs[0].len()).map(|k| {
            let all: Vec<&Run> = runs.iter().map(|runs| &runs[k]).collect();
            let interleaved = |entries: fn(&Run) -> &[f64]| {
                let entries: Vec<&[f64]> = all.iter().map(|run| entries(run)).collect();
                (0..entries[0].len()).flat_map(|at| entries.iter().map(move |x| x[at]).collect::<Vec<_>>()).collect()
            };
            let with_lanes =
                |array: &InputArray| InputArray { dims: [&array.dims[..], &[lanes]].concat(), ..array.clone() };
            Run {
                inputs: all[0].inputs.iter().map(with_lanes).collect(),
                given: interleaved(|run| &run.given),
                lengths: all[0].lengths.iter().map(|len| len * lanes).collect(),
                expected: interleaved(|run| &run.expected),
                ..all[0].clone()
            }
        });
        Job {
            name: format!("{}_lanes", case.name),
            plan: &case.plan,
            options: &case.options,
            lanes,
            runs: joined.collect(),
        }
    }
}

/// Runs jobs. Gives the results of each run, one array after the other.
fn evaluate(test: &str, jobs: &[Job]) -> Vec<Vec<Vec<f64>>> {
    let folder = &folder(&format!("wasm_{test}"));
    let (mut list, mut given) = (Vec::new(), Vec::new());
    for Job { name, plan, options, lanes, runs } in jobs {
        let mut outputs: Vec<Output> = runs.iter().map(|run| run.output).collect();
        outputs.dedup();
        let options = Options { outputs, ..(*options).clone() };
        let generate = if *lanes > 1 { wasm::generate_lanes_from } else { wasm::generate_from };
        let code = generate(plan, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        write(folder, &format!("{name}.wasm"), code.module);
        write(folder, &format!("{name}.js"), code.wrapper);
        let runs_as_text: Vec<String> = runs.iter().map(text).collect();
        list.push(format!("{{\"name\": \"{name}\", \"runs\": [{}]}}", runs_as_text.join(", ")));
        given.extend(runs.iter().flat_map(|run| &run.given).flat_map(|x| x.to_le_bytes()));
    }
    write(folder, "package.json", "{\"type\": \"module\"}");
    write(folder, "runs.json", format!("[{}]", list.join(", ")));
    write(folder, "given.bin", given);
    write(folder, "script.js", SCRIPT);
    let output = Command::new("node").arg("script.js").current_dir(folder).output().expect("there is Node");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = fs::read(folder.join("found.bin")).expect("the script writes results");
    let mut found = found.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("eight bytes")));
    let mut results = |run: &Run| found.by_ref().take(run.lengths.iter().sum()).collect();
    let results = jobs.iter().map(|job| job.runs.iter().map(&mut results).collect()).collect();
    assert_eq!(found.next(), None, "results that nothing was expected for");
    results
}

/// A run for the script.
fn text(run: &Run) -> String {
    let inputs: Vec<String> = run.inputs.iter().map(|array| format!("[\"{}\", {}]", array.name, array.len())).collect();
    format!("{{\"output\": \"{}\", \"inputs\": [{}]}}", run.output.name(), inputs.join(", "))
}

/// Compares the cases of some seeds, and at every eighth also several states at once. Returns the number of outputs that
/// are rolled, the largest number without Node.
fn compare(test: &str, case: fn(u64) -> Case, seeds: u64) -> usize {
    let lanes = (3..seeds).step_by(8).flat_map(|seed| {
        let (case, far) = (case(seed), far(case(seed)));
        let single = [&case, &far, &case, &case].map(|case| case.clone().single()).to_vec();
        [vec![case, far], single]
    });
    compare_cases(test, &sampled(case, seeds), &lanes.collect::<Vec<_>>())
}

/// Compares cases, and some of several states at once.
fn compare_cases(test: &str, cases: &[Case], lanes: &[Vec<Case>]) -> usize {
    if !is_there("node") {
        return usize::MAX;
    }
    let mut jobs: Vec<Job> = cases.iter().map(Job::of).collect();
    jobs.extend(lanes.iter().map(|cases| Job::lanes(&cases.iter().collect::<Vec<_>>())));
    for (job, found) in jobs.iter().zip(evaluate(test, &jobs)) {
        for (run, found) in job.runs.iter().zip(found) {
            run.check(&format!("{}\n{}", job.name, to_toml(&job.plan.model)), &found);
        }
    }
    jobs.iter().flat_map(|job| &job.runs).filter(|run| run.rolled).count()
}

#[test]
fn trees() {
    compare("trees", tree, 40);
}

#[test]
fn loops() {
    compare("loops", closed, 20);
}

#[test]
fn rolled_code() {
    let rolled = compare("rolled", chain, 12);
    assert!(rolled > 60, "{rolled} outputs are rolled");
}

#[test]
fn fast_arithmetic() {
    let case = tree(5).fast();
    compare_cases("fast", &fast(), &[vec![case.clone(), far(case)]]);
}

/// The rotation matrix of a revolute joint about z consists of the sine and the cosine. Five joints have their angles
/// partly in vectors, partly alone.
#[test]
fn sines_of_all_angles() {
    if !is_there("node") {
        return;
    }
    const JOINTS: usize = 5;
    let joints = (0..JOINTS).map(|k| {
        format!("[[body]]\nname = \"b{k}\"\nmass = 1.0\ninertia = [1, 1, 1]\n[[joint]]\nname = \"j{k}\"\ntype = \"revolute\"\nchild = \"b{k}\"\naxis = [0, 0, 1]\n")
    });
    let text = joints.collect::<String>();
    let model = read::model("joints.toml", &text, &ImportOptions::default()).expect("a model").model;
    let plan = search::plan(&model, PlanOptions::default());
    for precision in [Precision::F64, Precision::F32] {
        let array = |name| InputArray { name, field: false, dims: vec![JOINTS] };
        let run = |given: &[f64]| Run {
            output: Output::Frames,
            inputs: vec![array("q")],
            given: given.to_vec(),
            lengths: vec![9 * JOINTS, 3 * JOINTS, 6 * JOINTS],
            expected: given.iter().flat_map(|x| sine_and_cosine(precision, *x)).collect(),
            rolled: false,
        };
        let options = Options { precision, ..Options::default() };
        let runs = angles(precision).chunks_exact(JOINTS).map(run).collect();
        let jobs = [Job { name: "sines".to_string(), plan: &plan, options: &options, lanes: 1, runs }];
        for (run, found) in jobs[0].runs.iter().zip(&evaluate("sines", &jobs)[0]) {
            let found: Vec<f64> = found[..9 * JOINTS].chunks_exact(9).flat_map(|r| [r[3], r[0]]).collect();
            run.check(&format!("{:?}", run.given), &found);
        }
    }
}

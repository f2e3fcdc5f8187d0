//! Generated C, compiled by GCC and by Clang where they are there, against the programs that it was made of.
//!
//! Both give the same bits, except for the signs of zeros: straight-line and rolled code, trees and loops, both
//! precisions, exact and fast arithmetic (products are not fused here), sines and cosines of any angle.

mod compiler;

use std::fmt::Write;

use compiler::{build, compilers, run};
use mbd_codegen::generate::InputArray;
use mbd_codegen::options::AngleRange;
use mbd_codegen::read::{self, ImportOptions};
use mbd_codegen::{c, Arithmetic, Options, Output, Precision};
use mbd_testing::conformance::{angles, chain, closed, far, sine_and_cosine, tree, Case, Run};

use crate::external::{folder, write};

/// What the programs of the tests have in common: numbers come from standard input and go to standard output.
const READ_AND_WRITE: &str = "#include <stdio.h>
static void take_double(double *x, int n) { while (n-- > 0) if (fread(x++, sizeof *x, 1, stdin) != 1) *(x - 1) = 0.0; }
static void give_double(const double *x, int n) { while (n-- > 0) fwrite(x++, sizeof *x, 1, stdout); }
static void take_float(float *x, int n) { double d; while (n-- > 0) { take_double(&d, 1); *x++ = (float)d; } }
static void give_float(const float *x, int n) { double d; while (n-- > 0) { d = (double)*x++; give_double(&d, 1); } }
/* Each program uses those of its precisions. */
void (*const used[])(void) = { (void (*)(void))take_float, (void (*)(void))give_float, (void (*)(void))take_double, (void (*)(void))give_double };
";

fn number(precision: Precision) -> &'static str {
    match precision {
        Precision::F64 => "double",
        Precision::F32 => "float",
    }
}

/// Statements that call a function with inputs that are read and write its results.
fn call(prefix: &str, number: &str, run: &Run) -> String {
    let spec = run.output.spec();
    let mut text = format!("{{\n    {prefix}_inputs in;\n    {prefix}_inputs_init(&in);\n");
    let field = |array: &&InputArray| array.field && !array.is_empty();
    let (fields, arguments) = (run.inputs.iter().filter(field), run.inputs.iter().filter(|array| !array.field));
    let mut parameters = vec!["&in".to_string()];
    for array in arguments {
        let (name, n) = (array.name, array.len());
        let _ = writeln!(text, "    {number} {name}[{}];\n    take_{number}({name}, {n});", n.max(1));
        parameters.push(name.to_string());
    }
    for array in fields {
        let _ = writeln!(text, "    take_{number}(in.{}, {});", array.name, array.len());
    }
    let results: Vec<(String, usize)> =
        spec.results.iter().zip(&run.lengths).map(|(array, n)| (format!("{}_result", array.name), *n)).collect();
    for (name, n) in &results {
        let _ = writeln!(text, "    {number} {name}[{}];", n.max(&1));
        parameters.push(name.clone());
    }
    let _ = writeln!(text, "    {prefix}_{}({});", spec.name, parameters.join(", "));
    for (name, n) in &results {
        let _ = writeln!(text, "    give_{number}({name}, {n});");
    }
    text + "}\n"
}

/// Compares cases, which one program runs that is optimised at a level.
fn compare(test: &str, level: &str, cases: &[Case]) {
    let folder = folder(test);
    let (mut includes, mut body) = (String::new(), String::new());
    let (mut sources, mut given) = (vec!["main.c".to_string()], Vec::new());
    let runs: Vec<(&Case, Vec<Run>)> = cases.iter().map(|case| (case, case.runs())).collect();
    for (case, runs) in &runs {
        let prefix = &case.name;
        let options = Options {
            type_name: prefix.clone(),
            outputs: runs.iter().map(|run| run.output).collect(),
            ..case.options.clone()
        };
        let code = c::generate_from(&case.plan, &options, prefix).unwrap_or_else(|e| panic!("{prefix}: {e}"));
        assert_eq!(c::prefix(prefix), *prefix);
        write(&folder, &format!("{prefix}.h"), code.header);
        write(&folder, &format!("{prefix}.c"), code.source);
        let _ = writeln!(includes, "#include \"{prefix}.h\"");
        sources.push(format!("{prefix}.c"));
        for run in runs {
            body += &call(prefix, number(options.precision), run);
            given.extend_from_slice(&run.given);
        }
    }
    let main = format!("{READ_AND_WRITE}{includes}int main(void)\n{{\n{body}return 0;\n}}\n");
    write(&folder, "main.c", main);
    for compiler in compilers() {
        let program = build(compiler, &folder, &sources, &[level, "-ffp-contract=off"]);
        let found = &mut &self::run(&program, &given)[..];
        for (case, runs) in &runs {
            for run in runs {
                let part = found.split_off(..run.expected.len()).expect("as many numbers as results");
                run.check(&format!("{compiler}: {}", case.name), part);
            }
        }
        assert!(found.is_empty());
    }
}

#[test]
fn trees() {
    let mut cases: Vec<Case> = (0..5).map(tree).collect();
    cases[0].derivatives = true;
    cases.extend([tree(5).fast(), tree(7).single(), far(tree(8)), far(tree(20)).single().fast()]);
    compare("c_trees", "-O1", &cases);
}

#[test]
fn loops_and_rolled_code() {
    let mut cases = vec![closed(1), closed(12).fast(), chain(0), chain(7).fast()];
    cases.extend([closed(2).single(), chain(3).single(), far(chain(5))]);
    compare("c_loops", "-O0", &cases);
}

/// Two bodies that turn about fixed axes: entries of their rotations are the sines and cosines of the angles.
const TWO_ANGLES: &str = r#"
name = "two_angles"
gravity = [0, 0, -9.81]
body = [
    { name = "a", mass = 1.0, inertia = [1.0, 1.0, 1.0] },
    { name = "b", mass = 1.0, inertia = [1.0, 1.0, 1.0] },
]
joint = [
    { name = "a", type = "revolute", child = "a", axis = [0, 0, 1] },
    { name = "b", type = "revolute", child = "b", axis = [0, 0, 1] },
]
"#;

/// Sines and cosines, one after the other, of two angles in each call, by C.
fn sines(test: &str, precision: Precision, range: AngleRange, angles: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let folder = folder(test);
    let model = read::model("two_angles.toml", TWO_ANGLES, &ImportOptions::default()).expect("a model").model;
    let options = Options {
        type_name: "Two".to_string(),
        outputs: vec![Output::Frames],
        frames: ["a", "b"].map(str::to_string).to_vec(),
        precision,
        angles: range,
        arithmetic: Arithmetic::Exact,
        ..Options::default()
    };
    let code = c::generate(&model, &options, "two").expect("code");
    write(&folder, "two.h", code.header);
    write(&folder, "two.c", code.source);
    let (number, calls) = (number(precision), angles.len() / 2);
    let main = format!(
        "{READ_AND_WRITE}#include \"two.h\"
int main(void)
{{
    two_inputs in;
    two_inputs_init(&in);
    for (int k = 0; k < {calls}; k++) {{
        const {number} v[2] = {{ 0, 0 }};
        {number} q[2];
        {number} rotation[18];
        {number} position[6];
        {number} velocity[12];
        take_{number}(q, 2);
        two_frames(&in, q, v, rotation, position, velocity);
        give_{number}(rotation + 3, 1);
        give_{number}(rotation, 1);
        give_{number}(rotation + 12, 1);
        give_{number}(rotation + 9, 1);
    }}
    return 0;
}}
"
    );
    write(&folder, "main.c", main);
    let sources = ["main.c", "two.c"].map(str::to_string);
    let build = |compiler| build(compiler, &folder, &sources, &["-O3", "-ffp-contract=off"]);
    compilers().into_iter().map(|compiler| (compiler, run(&build(compiler), angles))).collect()
}

#[test]
fn sines_have_the_bits_of_the_runtime() {
    for (test, precision, range) in [
        ("c_sines_f64", Precision::F64, AngleRange::Any),
        ("c_sines_f32", Precision::F32, AngleRange::Any),
        ("c_bounded_sines_f64", Precision::F64, AngleRange::Bounded),
        ("c_bounded_sines_f32", Precision::F32, AngleRange::Bounded),
    ] {
        let limit = match (range, precision) {
            (AngleRange::Any, _) => f64::INFINITY,
            (AngleRange::Bounded, Precision::F64) => 1e6,
            (AngleRange::Bounded, Precision::F32) => 1600.0,
        };
        let mut angles = angles(precision);
        // Calls take two.
        angles.truncate(angles.len() / 2 * 2);
        for (compiler, found) in sines(test, precision, range, &angles) {
            assert_eq!(found.len(), 2 * angles.len());
            for (angle, pair) in angles.iter().zip(found.as_chunks::<2>().0) {
                let within = angle.abs() <= limit;
                let expected = if within { sine_and_cosine(precision, *angle) } else { [f64::NAN; 2] };
                let mut both = pair.iter().zip(&expected);
                let same = both.all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()));
                assert!(same, "{compiler}: {angle:e}: {pair:?}, by the runtime {expected:?}");
            }
        }
    }
}

//! Sizes of code, which do not depend on the processor.

use super::*;
use crate::options::Options;
use crate::output::Output;
use crate::read::{model, ImportOptions};
use crate::rolled::together;
use crate::trace::sizes;

/// A humanoid's rates fit into the first cache of instructions, which has 32 KiB on most processors: code that is larger waits for
/// its bytes in every call. What calls it has 3 to 4 kB.
#[test]
fn the_code_of_a_humanoid_fits_into_the_first_cache() {
    let text = include_str!("../../../../models/g1.urdf");
    let model = model("g1.urdf", text, &ImportOptions::default()).expect("a sound model").model;
    let options = Options { efforts: true, ..Options::default() };
    let plan = crate::search::plan(&model, options.plan);
    let program = together(&plan, Output::Rates, &options).expect("two legs and two arms are alike");
    let program = program.map(|both| Code::Rolled(both.program));
    let sizes = sizes(&plan, &options, 0);
    let results: Vec<usize> = program.spec.results.iter().map(|array| array.len(&sizes)).collect();
    for (wide, most) in [(true, 28_000), (false, 32_000)] {
        let width = Width { states: Lanes::One, wide };
        let bytes = compile(&program, &results, true, width, 0).expect("short enough").bytes.len();
        assert!(bytes <= most, "AVX-512: {wide}; {bytes} bytes");
    }
}

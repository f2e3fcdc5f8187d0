//! Generated code: the bits of the interpreter, operation counts, rounding errors, vector instructions.

mod assembly;
mod bitwise;
mod c;
mod constrained;
mod counts;
mod early_contacts;
mod eliminations;
mod emitted;
mod external;
mod factored;
mod fuzzed;
mod machine_code;
mod rewriting;
mod rolled;
mod row_numbers;
mod together;
mod wasm;
mod wide;

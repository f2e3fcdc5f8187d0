//! Generates code for random trees; `tests/compiled.rs` compiles it.

fn main() {}

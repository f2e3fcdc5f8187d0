//! `mbd`.
fn main() {}

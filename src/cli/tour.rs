//! placeholder
use std::io::Write;
use super::Outcome;
/// x
pub fn run(_out: &mut dyn Write) -> Outcome { Ok(()) }

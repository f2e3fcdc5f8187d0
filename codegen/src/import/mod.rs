//! Readers of file formats. Nothing outside this module knows them.

pub mod raw;
pub mod source;
pub mod toml;
pub mod words;

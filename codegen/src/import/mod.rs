//! Readers of file formats. Nothing outside this module knows them.

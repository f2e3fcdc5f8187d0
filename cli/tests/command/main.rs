//! Tests of the command `mbd`, run as a program.

mod c;
mod certify;
mod commands;
mod contacts;
mod control;
mod documented;
mod drawings;
mod eval;
mod loops;
mod parquet;
mod run;
mod schema;
mod trust;
mod view;
mod webassembly;

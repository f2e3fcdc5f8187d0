#!/usr/bin/env bash
# Runs a command of cargo, or one that calls it, and lets Clippy read the crates of the workspace as they are compiled, with
# warnings denied, as `cargo clippy -- -D warnings` does. That command alone would compile the generator, and all that build
# scripts and macros need of it, once more: four minutes.
export RUSTC_WORKSPACE_WRAPPER=clippy-driver CLIPPY_ARGS=-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__
exec "$@"

#!/usr/bin/env bash
# Miri looks for undefined behaviour in the runtime's unit tests that are short enough for it, those of the module with unsafe
# code (`kernel`) among them. Not part of `.ci/run`.
# usage: miri.sh [NAMES OF TESTS]     MIRI_TOOLCHAIN: a nightly toolchain (default: nightly)
set -euo pipefail
cd "$(dirname "$0")/.."
toolchain=${MIRI_TOOLCHAIN:-nightly}
if ! rustup component list --toolchain "$toolchain" 2> /dev/null | grep -q '^miri.*(installed)'; then
    rustup toolchain install "$toolchain" --profile minimal --component miri,rust-src
fi
[ $# -gt 0 ] || set -- kernel:: constant:: dense:: contact::solver::tests::a_ball wide::tests::arithmetic \
    integrate::tableau::tests::coefficients
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/miri CARGO_INCREMENTAL=0
# Miri knows no assembly, by which libm takes roots.
cargo "+$toolchain" miri test --locked -p mbd-runtime --features libm/force-soft-floats --lib -- "$@"

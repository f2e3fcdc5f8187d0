#!/usr/bin/env bash
# Miri runs tests of the runtime without its features for processors, and finds undefined behaviour and leaks. Not part of
# `.ci/run`: it takes some minutes. usage: miri.sh [ARGUMENTS OF THE TESTS]
set -euo pipefail
cd "$(dirname "$0")/.."
toolchain=${MIRI_TOOLCHAIN:-nightly}
if ! rustup component list --toolchain "$toolchain" 2> /dev/null | grep -q '^miri.*(installed)'; then
    rustup toolchain install "$toolchain" --profile minimal --component miri,rust-src
fi
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/miri CARGO_INCREMENTAL=0
cargo "+$toolchain" miri test --locked -p mbd-runtime "$@"

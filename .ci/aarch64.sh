#!/usr/bin/env bash
# Tests on an emulated aarch64: the runtime, and the conformance suite of generated code, machine code at run time
# included. Debian's compiler is used, whose standard library for aarch64 is a package. Not part of `.ci/run`: compiling
# and an emulated processor take half an hour.
#
#     .ci/aarch64.sh [ARGUMENTS OF cargo test]
set -euo pipefail
cd "$(dirname "$0")/.."
if ! command -v qemu-aarch64 > /dev/null || ! command -v aarch64-linux-gnu-gcc > /dev/null; then
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
        qemu-user gcc-aarch64-linux-gnu libc6-dev-arm64-cross
fi
. .ci/aarch64-std.sh
export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=false
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
if [ $# -eq 0 ]; then
    set -- -p mbd-runtime -p mbd-testing --lib --test code
fi
cargo test --target aarch64-unknown-linux-gnu "$@"

#!/usr/bin/env bash
# Tests on an emulated aarch64: the runtime, and the conformance suite of generated code, machine code at run time
# included. Debian's compiler is used, whose standard library for aarch64 is a package. Not part of `.ci/run`: an
# emulated processor takes a quarter of an hour.
#
#     .ci/aarch64.sh [ARGUMENTS OF cargo test]
set -euo pipefail
cd "$(dirname "$0")/.."
if ! command -v qemu-aarch64 > /dev/null || ! /usr/bin/rustc --version > /dev/null 2>&1; then
    dpkg --add-architecture arm64
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
        qemu-user gcc-aarch64-linux-gnu libc6-dev-arm64-cross rustc-web
fi
if [ ! -d /usr/lib/rustlib/aarch64-unknown-linux-gnu ]; then
    # The package would need the rest of an aarch64 system; its files do not.
    packages=$(mktemp -d)
    (cd "$packages" && apt-get download -q libstd-rust-web-dev:arm64 && dpkg -x ./*.deb .)
    cp -r "$packages/usr/lib/rustlib/aarch64-unknown-linux-gnu" /usr/lib/rustlib/
    rm -r "$packages"
fi
export RUSTC=/usr/bin/rustc CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=false
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu"
if [ $# -eq 0 ]; then
    set -- -p mbd-runtime -p mbd-testing --lib --test code
fi
cargo test --target aarch64-unknown-linux-gnu "$@"

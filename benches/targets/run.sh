#!/usr/bin/env bash
# Times of generated C and of WebAssembly beside generated Rust, `rates` of one state. Rust and C are compiled for the
# processor of the machine; beside WebAssembly, which has no fused operations, Rust is compiled for any x86-64.
#
#     benches/targets/run.sh
#
# TARGETS_CC names the compilers of C, between spaces ("gcc clang"); by default it is `cc`. Needs Node 20 or later.
set -euo pipefail
cd "$(dirname "$0")"
host=$(rustc -vV | sed -n 's/^host: //p')
# With a target, flags are not those of the generator.
run=(cargo run --release --quiet --target "$host" --target-dir target)
RUSTFLAGS="-C target-cpu=native" "${run[@]}"
echo
RUSTFLAGS="" "${run[@]}" -- wasm

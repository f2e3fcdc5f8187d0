#!/usr/bin/env bash
# Times of evaluations that depend on one another, of independent ones, and of steps of integration.
#
#   benches/latency/run.sh [ROUNDS [MODEL ...]]     (defaults: 201 rounds, all models)
#
# One table for each build: a plain `--release`, `-C target-cpu=native`, and this with vectors of 64 bytes.
set -euo pipefail
cd "$(dirname "$0")/../.."
generated=$PWD/target/latency
mkdir -p "$generated"
cargo build --release --quiet --bin mbd
for file in double_pendulum.toml ur5.urdf panda_arm.urdf; do
    [[ $file == *.toml ]] && base=() || base=(--base fixed)
    target/release/mbd generate "models/$file" "${base[@]}" --outputs rates --name Robot --runtime ::mbd_runtime \
        -o "$generated/${file%.*}.rs" 2> "$generated/log" || { cat "$generated/log" >&2; exit 1; }
done
for flags in "" "-C target-cpu=native" "-C target-cpu=native -C target-feature=-prefer-256-bit"; do
    build=$generated/build$(tr -dc 'a-z0-9' <<< "$flags")
    RUSTFLAGS=$flags LATENCY=$generated cargo build --release --quiet --manifest-path benches/latency/Cargo.toml --target-dir "$build"
    printf '\ncargo build --release%s\n' "${flags:+, RUSTFLAGS=\"$flags\"}"
    "$build/release/latency" "$@"
done

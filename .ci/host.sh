#!/usr/bin/env bash
# The generator writes the same code on every machine: all models, by a native build and by a WebAssembly build that Node
# runs. Debian's compiler is used, which has the source of its library. Not part of `.ci/run`: the builds take minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
missing=()
for package in rustc-web rust-web-src lld; do
    dpkg-query -W -f '${Status}' "$package" 2> /dev/null | grep -q 'install ok installed' || missing+=("$package")
done
command -v node > /dev/null || missing+=(nodejs)
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
fi
manifest=testing/host/Cargo.toml target=${CARGO_TARGET_DIR:-$PWD/target}/host
cargo build --release --manifest-path "$manifest" --target-dir "$target" --bin native
RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld cargo build --release \
    --manifest-path "$manifest" --target-dir "$target/wasm" --lib -Zbuild-std=std,panic_abort \
    --target wasm32-unknown-unknown
mapfile -t models < <(git ls-files 'models/*.toml' 'models/*.urdf' 'models/*.xml')
rm -rf "$target/texts"
mkdir -p "$target/texts/native" "$target/texts/wasm"
"$target/release/native" "$target/texts/native" "${models[@]}"
node testing/host/wasm.mjs "$target/wasm/wasm32-unknown-unknown/release/host.wasm" "$target/texts/wasm" "${models[@]}"
diff -r "$target/texts/native" "$target/texts/wasm"
refused=$(grep -rLE '^impl' "$target/texts/native" | wc -l)
echo "${#models[@]} models: the same code by a native build and by WebAssembly, and the same findings for $refused that have none"

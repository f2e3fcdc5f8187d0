#!/usr/bin/env bash
# Builds what runs in the page of `mbd view`: `cli/src/view/page.wasm.lzma` of `page/`, `cli/src/view/page.js.lzma` of the
# scripts beside it, and `page/states.txt`, the states that a native build reaches. With `--scripts`, the scripts only.
# Debian's compiler is used, which has the source of its library. Not part of `.ci/run`: the builds take minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
missing=()
for package in rustc-web rust-web-src lld binaryen xz-utils; do
    dpkg-query -W -f '${Status}' "$package" 2> /dev/null | grep -q 'install ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
fi
squeeze() { xz --format=lzma --lzma1=preset=9e,lc=4,pb=0 -c "$@"; }
node page/scripts.mjs | squeeze > cli/src/view/page.js.lzma
[ "${1:-}" != --scripts ] || exit 0
manifest=page/Cargo.toml target=${CARGO_TARGET_DIR:-$PWD/target}/page
# The functions of assembled modules go into the table, and paths of this machine into nothing.
flags="-C link-arg=--export-table -C link-arg=--growable-table -C target-feature=+bulk-memory,+sign-ext,+nontrapping-fptoint"
flags+=" -Zunstable-options -Cpanic=immediate-abort -Zlocation-detail=none --remap-path-prefix=$PWD=."
RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 RUSTFLAGS=$flags CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld cargo build --release \
    --manifest-path "$manifest" --target-dir "$target/wasm" --lib -Zbuild-std=std,panic_abort \
    --target wasm32-unknown-unknown
wasm=$target/wasm/wasm32-unknown-unknown/release/page.wasm
# What a run finds depends on those before.
strip="--strip-debug --strip-producers"
for passes in "-Oz --converge $strip" "--local-cse -Oz $strip" "-Oz --converge"; do
    wasm-opt $passes --enable-bulk-memory --enable-sign-ext --enable-nontrapping-float-to-int "$wasm" -o "$target/page.wasm"
    wasm=$target/page.wasm
done
squeeze "$target/page.wasm" > cli/src/view/page.wasm.lzma
ls -l "$target/page.wasm" cli/src/view/page.*.lzma
cargo build --release --manifest-path "$manifest" --target-dir "$target" --bin states
mapfile -t models < <(git ls-files 'models/*.toml' 'models/*.urdf' 'models/*.xml')
# A model whose motion takes the interpreter minutes has no line.
for model in "${models[@]}"; do
    status=0
    timeout 120 "$target/release/states" 10000 "$model" || status=$?
    case $status in 0) ;; 124) echo "$model: no state within two minutes" >&2 ;; *) exit "$status" ;; esac
done > page/states.txt

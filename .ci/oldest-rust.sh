#!/usr/bin/env bash
# The runtime, the generator without machine code and WebAssembly, the macro and the facade build with the oldest Rust that their
# manifests state: checked by building with it, where it can be had. It is rustup's, if that is installed, or that of Debian 12,
# whose packages are unpacked under target/ and not installed. Not part of `.ci/run`; `.ci/release.sh --full` runs it.
set -euo pipefail
cd "$(dirname "$0")/.."
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' runtime/Cargo.toml)
folder=$PWD/target/rust-$oldest
rustc=$(rustup which rustc --toolchain "$oldest" 2> /dev/null) || rustc=$folder/rustc
if [ ! -x "$rustc" ]; then
    command -v apt-get > /dev/null || { echo "Rust $oldest: rustup toolchain install $oldest" >&2; exit 1; }
    mkdir -p "$folder/packages"
    # The newest of Debian's packages of that version.
    newest() { apt-cache madison "$1" | sed 's/ //g' | cut -d'|' -f2 | grep "^$oldest\." | head -n 1; }
    packages=(libllvm19)
    for package in rustc-web libstd-rust-web-dev "libstd-rust-web-$oldest"; do
        found=$(newest "$package")
        [ -n "$found" ] || { echo "Rust $oldest: no package $package; rustup toolchain install $oldest" >&2; exit 1; }
        packages+=("$package=$found")
    done
    (cd "$folder/packages" && apt-get download -q "${packages[@]}" && for file in *.deb; do dpkg -x "$file" "$folder"; done)
    libraries=$(dirname "$(find "$folder" -name 'librustc_driver*.so' -print -quit)"):$(dirname "$(find "$folder" -name 'libLLVM*.so*' -print -quit)")
    printf '#!/bin/sh\nLD_LIBRARY_PATH=%q exec %q "$@"\n' "$libraries" "$folder/usr/bin/rustc" > "$rustc"
    chmod +x "$rustc"
fi
"$rustc" --version
export RUSTC=$rustc CARGO_TARGET_DIR=$folder/build
for features in --no-default-features "--no-default-features --features alloc" "--features std,wide,rayon"; do
    # shellcheck disable=SC2086 # several words
    cargo check --quiet --locked -p mbd-runtime $features
    echo "mbd-runtime $features: builds"
done
for crate in "mbd-codegen --no-default-features" mbd-codegen mbd-macros "multibody --features codegen,rayon"; do
    # shellcheck disable=SC2086
    cargo check --quiet --locked -p $crate
    echo "$crate: builds"
done

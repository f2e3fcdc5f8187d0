#!/usr/bin/env bash
# Wheels for Linux on x86-64 and aarch64 into python/dist. Needs maturin; wheels that run on older distributions need Zig
# (`pip install maturin[zig]`), which is also the linker for the other architecture.
set -euo pipefail
cd "$(dirname "$0")"
command -v maturin >/dev/null || { echo "no maturin: pip install 'maturin[zig]'" >&2; exit 1; }
host=$(rustc -vV | sed -n 's/^host: //p')
zig=()
if python3 -c 'import ziglang' 2>/dev/null || command -v zig >/dev/null; then
    zig=(--zig --compatibility manylinux2014)
else
    echo "no Zig: wheels are for systems as new as this one, and for this architecture only" >&2
fi
missing=0
for target in x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu; do
    # The standard library for the target: rustup's, or that of the distribution.
    if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
        echo "$target: no standard library; install it with: rustup target add $target" >&2
        missing=1
        continue
    fi
    if [ "$target" != "$host" ] && [ ${#zig[@]} = 0 ]; then
        echo "$target: no linker; install Zig" >&2
        missing=1
        continue
    fi
    other=()
    [ "$target" = "$host" ] || other=(--target "$target")
    maturin build --profile wheel --locked --compression-level 9 --out dist "${other[@]}" "${zig[@]}"
done
ls -l dist/*.whl
exit $missing

#!/usr/bin/env bash
# Wheels for Linux on x86-64 and aarch64 into python/dist. Needs maturin; wheels that run on older distributions need Zig
# (`pip install maturin[zig]`), which is also the linker for the other architecture.
#
#     python/build_wheels.sh [TARGET ...]
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
[ $# -gt 0 ] || set -- x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu

# standard_library TARGET: whether the compiler has the standard library for the target: rustup's; for aarch64 also that of
# Debian's compiler, which becomes the compiler then.
standard_library() {
    [ ! -d "$(rustc --print sysroot)/lib/rustlib/$1/lib" ] || return 0
    [ "$1" = aarch64-unknown-linux-gnu ] && command -v apt-get >/dev/null || return 1
    . ../.ci/aarch64-std.sh
}

missing=0
for target in "$@"; do
    if [ "$target" != "$host" ] && [ ${#zig[@]} = 0 ]; then
        echo "$target: no linker; install Zig" >&2
        missing=1
        continue
    fi
    other=()
    [ "$target" = "$host" ] || other=(--target "$target")
    # In a shell of its own, because the compiler may be another one.
    (
        standard_library "$target" || {
            echo "$target: no standard library; install it with: rustup target add $target" >&2
            exit 1
        }
        # Tables for unwinding the stack, of which nothing makes use where a panic ends the program.
        export RUSTFLAGS="${RUSTFLAGS:-} -C force-unwind-tables=no"
        maturin build --profile wheel --locked --compression-level 9 --out dist "${other[@]}" "${zig[@]}"
    ) || missing=1
done
ls -l dist/*.whl
for wheel in dist/*.whl; do
    [ "$(wc -c < "$wheel")" -le 4000000 ] || { echo "$wheel is larger than 4 MB" >&2; missing=1; }
done
exit $missing

#!/bin/sh
# Mechanisms with loops against Pinocchio's constrained forward dynamics, in one run.
# usage: run.sh VENV [WORK [ROUNDS [MECHANISM ...]]]     (VENV and WORK as ../run.sh; mechanisms: those of the report)
# The results go to WORK/loops/loops.jsonl and .md; `KEEP=1` also puts them into benches/rivals/result.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?where setup.sh made the Python environment}
work=${2:-${TMPDIR:-/tmp}/rivals-work}
rounds=${3:-31}
[ $# -gt 3 ] && shift 3 || set -- fourbar biped closed20 closed100 stewart delta_rods delta
build=$work/loops
mkdir -p "$build/models"

cc=$(ls /usr/bin/clang-[0-9]* 2>/dev/null | sort -t- -k2 -n | tail -n 1)
cc=${CC:-${cc:-clang}}
cxx=${CXX:-$(echo "$cc" | sed 's/clang/clang++/')}
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
if [ ! -e "$build/race" ] || [ "$here/race.cpp" -nt "$build/race" ]; then
    "$cxx" -O3 -march=native -std=c++17 -w -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
        -DBOOST_FUSION_INVOKE_MAX_ARITY=10 \
        -isystem "$site/cmeel.prefix/include" -isystem /usr/include/eigen3 "$here/race.cpp" -o "$build/race" -ldl
fi
# With a target the flags are not those of the generator, which is built once.
host=$(rustc -vV | sed -n 's/^host: //p')
mechanisms="$*"
case " $mechanisms " in *" delta "*) mechanisms="$mechanisms delta_rods" ;; esac
ours() { # name, RUSTFLAGS
    RIVALS_ONLY="$mechanisms" RIVALS_MODELS=$build/models RUSTFLAGS=$2 cargo build --release --quiet --target "$host" \
        --manifest-path "$here/ours/Cargo.toml" --target-dir "$build/target"
    cp "$build/target/$host/release/librivals_ours_loops.so" "$build/ours_$1.so"
}
ours plain ""
ours native "-C target-cpu=native"

"$build/race" "$build/models" "$build" "$rounds" "$@" >"$build/loops.jsonl"
python3 "$here/report.py" "$build/loops.jsonl" >"$build/loops.md"
cat "$build/loops.md"
if [ -n "${KEEP:-}" ]; then cp "$build"/loops.jsonl "$build"/loops.md "$here/../result/"; fi

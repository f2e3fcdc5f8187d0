#!/bin/sh
# Derivatives against Pinocchio's computeABADerivatives and C that CasADi makes of it, in one run.
# usage: run.sh VENV [WORK [ROUNDS [ROBOT ...]]]     (as ../run.sh; robots: those of the report)
# The results go to WORK/derivatives/derivatives.jsonl and .md; `KEEP=1` also puts them into benches/rivals/result.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?where setup.sh made the Python environment}
work=${2:-${TMPDIR:-/tmp}/rivals-work}
rounds=${3:-21}
[ $# -gt 3 ] && shift 3 || set -- double_pendulum ur5 panda_arm iiwa14 chain6 solo12
models=$work/models build=$work/derivatives
mkdir -p "$build"

cc=$(ls /usr/bin/clang-[0-9]* 2>/dev/null | sort -t- -k2 -n | tail -n 1)
cc=${CC:-${cc:-clang}}
cxx=${CXX:-$(echo "$cc" | sed 's/clang/clang++/')}
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
pinocchio="-std=c++17 -w -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
    -isystem $site/cmeel.prefix/include -isystem /usr/include/eigen3"
fast="-O3 -march=native -ffast-math -fPIC -w -I$here/../theirs"
newer() { # target, sources: whether it has to be made
    target=$1; shift
    [ ! -e "$target" ] || [ -n "$(find "$@" -newer "$target")" ]
}

"$venv/bin/python" "$here/../models.py" "$models"
if newer "$build/race" "$here/race.cpp" "$here/../theirs/model.hpp"; then
    "$cxx" -O3 -march=native $pinocchio "$here/race.cpp" -o "$build/race" -ldl
fi
if newer "$build/casadi" "$here/casadi.cpp" "$here/../theirs/model.hpp"; then
    "$cxx" -O0 $pinocchio -I"$site/casadi/include" "$here/casadi.cpp" -o "$build/casadi" \
        -L"$site/casadi" -lcasadi -Wl,-rpath,"$site/casadi"
fi
objects=""
for robot in "$@"; do
    for how in algorithm jacobian; do
        # CasADi's own jacobian is by the entries of q, of which a floating base has one too many.
        if [ $how = jacobian ] && grep -q "^$robot floating" "$models/robots.txt"; then continue; fi
        name=${robot}_casadi_$how
        if newer "$build/$name.o" "$build/casadi" || ! cmp -s "$models/$robot.model" "$build/$name.model"; then
            "$build/casadi" "$models/$robot.model" "$name" "$build/$name.c" $how >"$build/$name.ops"
            "$cc" $fast -c "$build/$name.c" -o "$build/$name.o"
            cp "$models/$robot.model" "$build/$name.model"
        fi
        objects="$objects $build/$name.o"
    done
done
"$cc" -shared $objects -o "$build/theirs_derivatives.so" -lm
ours() { # name, RUSTFLAGS
    RIVALS_ONLY="$robots" RIVALS_ROBOTS=$models/robots.txt RUSTFLAGS=$2 cargo build --release --quiet \
        --manifest-path "$here/ours/Cargo.toml" --target-dir "$build/$1"
    cp "$build/$1/release/librivals_ours_derivatives.so" "$build/ours_$1_derivatives.so"
}
robots="$*"
ours plain ""
ours native "-C target-cpu=native"

"$build/race" "$models" "$build" "$rounds" "$@" >"$build/derivatives.jsonl"
"$venv/bin/python" "$here/report.py" "$build/derivatives.jsonl" >"$build/derivatives.md"
cat "$build/derivatives.md"
if [ -n "${KEEP:-}" ]; then cp "$build"/derivatives.jsonl "$build"/derivatives.md "$here/../result/"; fi

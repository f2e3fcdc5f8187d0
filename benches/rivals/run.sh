#!/bin/sh
# Builds every contestant, checks them against each other, times them in one run.
# usage: run.sh VENV [WORK [ROUNDS [ROBOT ...]]]     (defaults: $TMPDIR/rivals-work, 41 rounds, all robots)
# The results go to WORK/result; `KEEP=1` also puts them into benches/rivals/result. `REUSE=1` times what was built before.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?where setup.sh made the Python environment}
work=${2:-${TMPDIR:-/tmp}/rivals-work}
rounds=${3:-41}
[ $# -gt 3 ] && shift 3 || set --
models=$work/models build=$work/build c=$work/c
mkdir -p "$build" "$c" "$work/result"

cc=$(ls /usr/bin/clang-[0-9]* 2>/dev/null | sort -t- -k2 -n | tail -n 1)
cc=${CC:-${cc:-clang}}
cxx=${CXX:-$(echo "$cc" | sed 's/clang/clang++/')}
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
# As Pinocchio's own build sets them.
pinocchio="-std=c++17 -w -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
    -isystem $site/cmeel.prefix/include -isystem /usr/include/eigen3"
# What the rivals' code is fastest with.
fast="-O3 -march=native -ffast-math -fPIC -w -I$here/theirs"

newer() { # target, sources: whether it has to be made
    target=$1; shift
    [ ! -e "$target" ] || [ -n "$(find "$@" -newer "$target")" ]
}

if [ -z "${REUSE:-}" ]; then
    "$venv/bin/python" "$here/models.py" "$models"
    robots=$(cut -d' ' -f1 "$models/robots.txt")

    echo "rivals' generators"
    if newer "$build/casadi" "$here/theirs/casadi.cpp" "$here/theirs/model.hpp"; then
        "$cxx" -O0 $pinocchio -I"$site/casadi/include" "$here/theirs/casadi.cpp" -o "$build/casadi" \
            -L"$site/casadi" -lcasadi -Wl,-rpath,"$site/casadi"
    fi
    if newer "$build/cppadcg" "$here/theirs/cppadcg.cpp" "$here/theirs/model.hpp"; then
        "$cxx" -O0 $pinocchio "$here/theirs/cppadcg.cpp" -o "$build/cppadcg" -ldl
    fi

    echo "ours"
    ours() { # name, RUSTFLAGS
        RIVALS_ROBOTS=$models/robots.txt RUSTFLAGS=$2 cargo build --release --quiet \
            --manifest-path "$here/ours/Cargo.toml" --target-dir "$work/$1"
        cp "$work/$1/release/librivals_ours.so" "$build/ours_$1.so"
    }
    ours plain ""
    ours native "-C target-cpu=native"
    generated=$(ls -td "$work"/plain/release/build/rivals-ours-*/out | head -n 1)

    echo "C of both"
    for robot in $robots; do
        for tool in casadi cppadcg; do
            file=$c/${robot}_$tool.c
            if newer "$file" "$build/$tool" || ! cmp -s "$models/$robot.model" "$c/$robot.$tool.model"; then
                "$build/$tool" "$models/$robot.model" "${robot}_$tool" "$file" >"$build/${robot}_$tool.ops"
                cp "$models/$robot.model" "$c/$robot.$tool.model"
            fi
        done
        "$venv/bin/python" "$here/ours_c.py" "$robot" "$generated/$robot.rs" "$c/${robot}_ours.c.new"
        cmp -s "$c/${robot}_ours.c.new" "$c/${robot}_ours.c" || mv "$c/${robot}_ours.c.new" "$c/${robot}_ours.c"
        for tool in casadi cppadcg ours; do
            file=$c/${robot}_$tool
            if newer "$file.o" "$file.c" "$here/theirs/lanes.h"; then "$cc" $fast -c "$file.c" -o "$file.o"; fi
            if newer "$file.lanes.o" "$file.c" "$here/theirs/lanes.h"; then
                "$cc" $fast -DLANES=8 -c "$file.c" -o "$file.lanes.o"
            fi
        done
    done
    # Linked without -ffast-math, which would make the whole process flush small numbers to zero.
    link() { out=$1; shift; "$cc" -shared "$@" -o "$build/$out" -lmvec -lm; }
    link theirs.so $(for r in $robots; do echo "$c/${r}_casadi.o" "$c/${r}_cppadcg.o"; done)
    link theirs_lanes.so $(for r in $robots; do echo "$c/${r}_casadi.lanes.o" "$c/${r}_cppadcg.lanes.o"; done)
    link ours_clang.so $(for r in $robots; do echo "$c/${r}_ours.o"; done)
    link ours_clang_lanes.so $(for r in $robots; do echo "$c/${r}_ours.lanes.o"; done)

    if newer "$build/driver" "$here/theirs/driver.cpp" "$here/theirs/model.hpp"; then
        "$cxx" -O3 -march=native $pinocchio "$here/theirs/driver.cpp" -o "$build/driver" -ldl
    fi
fi

echo "the race"
"$build/driver" "$models" "$build" "$rounds" "$@" >"$work/result/times.jsonl"
"$venv/bin/python" "$here/report.py" "$work/result" \
    "$("$cc" --version | head -n 1)" "$(rustc --version)" "$("$venv/bin/pip" freeze | grep -E '^(pin|casadi|cmeel-cppadcodegen)==' | tr '\n' ' ')" "$rounds"
if [ -n "${KEEP:-}" ]; then
    mkdir -p "$here/result"
    cp "$work"/result/* "$here/result/"
fi

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

# The compiler may take this long for one file, processor seconds; what is not done by then does not run.
limit=${LIMIT:-600}
object() { # source, object, flags
    source=$1 object=$2; shift 2
    newer "$object" "$source" "$here/theirs/lanes.h" || return 0
    rm -f "$object"
    (ulimit -t "$limit"; exec "$cc" $fast "$@" -c "$source" -o "$object") || {
        rm -f "$object"
        echo "$(basename "$object"): not compiled within $limit s" | tee -a "$work/result/late.txt" >&2
    }
}

if [ -z "${REUSE:-}" ]; then
    rm -f "$work/result/late.txt"
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
    # As users build it: which instructions to use is found out at run time. A library for each.
    while read -r robot rest; do
        echo "$robot $rest" >"$models/$robot.txt"
        RIVALS_ROBOTS=$models/$robot.txt cargo build --release --quiet --manifest-path "$here/ours/Cargo.toml" --target-dir "$work/ours"
        cp "$work/ours/release/librivals_ours.so" "$build/ours_$robot.so"
    done <"$models/robots.txt"

    echo "C of the rivals"
    for robot in $robots; do
        for tool in casadi cppadcg; do
            file=$c/${robot}_$tool.c
            if newer "$file" "$build/$tool" || ! cmp -s "$models/$robot.model" "$c/$robot.$tool.model"; then
                "$build/$tool" "$models/$robot.model" "${robot}_$tool" "$file" >"$build/${robot}_$tool.ops"
                cp "$models/$robot.model" "$c/$robot.$tool.model"
            fi
        done
        for tool in casadi cppadcg; do
            file=$c/${robot}_$tool
            object "$file.c" "$file.o"
            object "$file.c" "$file.lanes.o" -DLANES=8
        done
    done
    # Linked without -ffast-math, which would make the whole process flush small numbers to zero.
    link() { out=$1; shift; "$cc" -shared "$@" -o "$build/$out" -lmvec -lm; }
    link theirs.so $(for r in $robots; do ls "$c/${r}_casadi.o" "$c/${r}_cppadcg.o" 2>/dev/null || true; done)
    link theirs_lanes.so $(for r in $robots; do ls "$c/${r}_casadi.lanes.o" "$c/${r}_cppadcg.lanes.o" 2>/dev/null || true; done)

    if newer "$build/driver" "$here/theirs/driver.cpp" "$here/theirs/model.hpp"; then
        "$cxx" -O3 -march=native $pinocchio "$here/theirs/driver.cpp" -o "$build/driver" -ldl
    fi
fi

echo "the race"
# A contestant who disagrees is told of, and makes the script fail, after the report.
sound=0
"$build/driver" "$models" "$build" "$rounds" "$@" >"$work/result/times.jsonl" || sound=1
"$venv/bin/python" "$here/report.py" "$work/result" \
    "$("$cc" --version | head -n 1)" "$(rustc --version)" "$("$venv/bin/pip" freeze | grep -E '^(pin|casadi|cmeel-cppadcodegen)==' | tr '\n' ' ')" "$rounds"
if [ -n "${KEEP:-}" ]; then
    mkdir -p "$here/result"
    cp "$work"/result/* "$here/result/"
fi
exit $sound

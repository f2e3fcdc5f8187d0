#!/bin/sh
# Builds the rivals, checks them against one another, times them.
# usage: run.sh VENV WORK [ROUNDS]     (default: 5 rounds, fewer where they take more than 4 s)
# Writes WORK/rivals.jsonl; beside it reference.jsonl, evaluation.jsonl, runaway.jsonl, check.txt. With MBD set to the
# project's program, its accelerations are compared too.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?where setup.sh made the Python environment}
work=${2:?a folder for what is built and measured}
rounds=${3:-5}
mkdir -p "$work"
work=$(cd "$work" && pwd)
python=$(cd "$venv/bin" && pwd)/python

cc=$(ls /usr/bin/clang++-[0-9]* 2>/dev/null | sort -t- -k2 -n | tail -n 1)
cxx=${CXX:-${cc:-clang++}}
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
fast="-O3 -march=native -std=c++17"
# As Pinocchio's own build sets them.
pinocchio="-w -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
    -isystem $site/cmeel.prefix/include -isystem /usr/include/eigen3"
mujoco=$(ls "$site"/mujoco/libmujoco.so.*)

newer() { # target, sources: whether it has to be made
    target=$1; shift
    [ ! -e "$target" ] || [ -n "$(find "$@" -newer "$target")" ]
}
common="$here/scenes.hpp $here/dop853.hpp $here/../rivals/theirs/model.hpp"
if newer "$work/pinocchio" "$here/pinocchio.cpp" $common; then
    "$cxx" $fast $pinocchio "$here/pinocchio.cpp" -o "$work/pinocchio"
fi
if newer "$work/mujoco" "$here/mujoco.cpp" $common; then
    "$cxx" $fast -I"$site/mujoco/include" "$here/mujoco.cpp" -o "$work/mujoco" "$mujoco" -Wl,-rpath,"$site/mujoco"
fi
drake() { "$python" "$here/drake_run.py" "$@"; }

# MuJoCo leaves a log where it runs.
cd "$work"
"$python" "$here/scenes.py" "$work"
{ ./pinocchio "$work" start; ./mujoco "$work" start; drake "$work" start; } >start.jsonl
./pinocchio "$work" reference >reference.jsonl
./pinocchio "$work" evaluation >evaluation.jsonl
{ ./pinocchio "$work" "$rounds"; ./mujoco "$work" "$rounds"; drake "$work" "$rounds"; } >rivals.jsonl
if [ "${MBD:-}" ]; then
    # heyoka takes the operations that the project's program generates.
    "$python" "$here/heyoka_run.py" "$MBD" "$rounds" "$work" >>rivals.jsonl
fi
"$python" "$here/runaway.py" ${MBD:+"$MBD"} >runaway.jsonl
# After all is written, so that what disagrees can be looked at.
"$python" "$here/check.py" "$work" ${MBD:+"$MBD"} >check.txt || { cat check.txt; exit 1; }
cat check.txt
echo "written: $work/rivals.jsonl"

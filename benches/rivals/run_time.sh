#!/bin/sh
# Models loaded at run time against Pinocchio's articulated-body algorithm, in turns.
# usage: run_time.sh VENV MODELS      (made by setup.sh, and by models.py: run.sh leaves them in WORK/models)
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?where setup.sh made the Python environment} models=${2:?where run.sh put the models}
work=$(mktemp -d)
cxx=${CXX:-$(ls /usr/bin/clang++-[0-9]* 2>/dev/null | sort -t- -k2 -n | tail -n 1)}
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
"$cxx" -O3 -march=native -std=c++17 -w -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
    -isystem "$site/cmeel.prefix/include" -isystem /usr/include/eigen3 "$here/theirs/aba.cpp" -o "$work/aba"
cargo build --release --quiet --manifest-path "$here/../machine_code/Cargo.toml" --target-dir "$work/ours"
for _ in 1 2 3; do
    "$work/aba" "$models/ur5.model" "$models/panda_arm.model" "$models/solo12.model" "$models/g1.model"
    "$work/ours/release/machine-code" ur5 panda solo12 g1
done
rm -r "$work"

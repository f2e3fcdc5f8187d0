#!/bin/sh
# Compares the solver of the example `mpc` with Crocoddyl's, in one run.
# usage: run.sh VENV [WORK [ROUNDS]]     (VENV: a Python 3.11 environment with requirements.txt; WORK: $TMPDIR/control-work)
# The table goes to WORK/result.md; `KEEP=1` also puts it beside this script. CXX is the C++ compiler, by default g++.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?a Python environment in which requirements.txt is installed}
work=${2:-${TMPDIR:-/tmp}/control-work}
rounds=${3:-11}
python=$(cd "$venv/bin" && pwd)/python
mkdir -p "$work"
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/cmeel.prefix
cxx=${CXX:-g++}

# The definitions of the wheels' own CMake files; NDEBUG, because the layout of the library's classes depends on it.
"$cxx" -w -O3 -DNDEBUG -std=c++17 -DPINOCCHIO_ENABLE_COMPATIBILITY_WITH_VERSION_2 -DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION \
    -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_LIMIT_VECTOR_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
    -DBOOST_FUSION_INVOKE_MAX_ARITY=12 -isystem "$site/include" -isystem "$site/include/pinocchio/deprecated" \
    -isystem "$site/include/eigen3" "$here/crocoddyl.cpp" -o "$work/crocoddyl" -L"$site/lib" -lcrocoddyl -lpinocchio_default \
    -lboost_serialization -lboost_filesystem -Wl,--disable-new-dtags -Wl,-rpath,"$site/lib"
ours="cargo build --release --quiet --locked --manifest-path $here/ours/Cargo.toml"
$ours --target-dir "$work/ours"
$ours --target-dir "$work/ours-baseline" --no-default-features
"$python" "$here/scenes.py" "$work"
"$python" "$here/compare.py" "$work" "$rounds" "$("$cxx" --version | head -n 1)" "$(rustc --version)"
if [ -n "${KEEP:-}" ]; then cp "$work/result.md" "$here/result.md"; fi

#!/usr/bin/env bash
# The Python package: builds and installs it in a virtual environment under target/, and runs its tests. It shares the runtime,
# the generator and their dependencies with `cargo build --release`. Needs Python 3.9 or later and, on the first run, a package
# index.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_INCREMENTAL=0 CARGO_TARGET_DIR=$PWD/target
venv=target/python-venv
# A virtual environment does not work at another path than its own.
$venv/bin/dask --version > /dev/null 2>&1 || {
    rm -rf $venv
    python3 -m venv $venv
    $venv/bin/pip install --quiet 'maturin>=1.16,<2' 'numpy>=1.22' pytest 'gymnasium>=1.1' dask distributed
}
cargo fmt --check -p multibody-python
# The package's build finds maturin on the path.
export PATH=$PWD/$venv/bin:$PATH
# Clippy reads this crate alone, because what it has read is not shared with other builds. The compiler's option makes cargo
# compile the crate again if it has been compiled without Clippy.
RUSTC_WRAPPER=$PWD/.ci/clippy-for-python.sh bash .ci/with-clippy.sh env -u RUSTC_WORKSPACE_WRAPPER \
    pip install --quiet --no-build-isolation --no-deps --force-reinstall \
    --config-settings=build-args="--locked -- -Dwarnings" ./python
pytest -q python "$@"

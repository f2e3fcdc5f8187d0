#!/usr/bin/env bash
# The Python package: builds and installs it in a virtual environment under target/, and runs its tests. It shares compiled
# dependencies with `cargo build --release`. Needs Python 3.9 or later and, on the first run, a package index.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_INCREMENTAL=0 CARGO_TARGET_DIR=$PWD/target
venv=target/python-venv
[ -x $venv/bin/dask ] || {
    python3 -m venv $venv
    $venv/bin/pip install --quiet 'maturin>=1.16,<2' 'numpy>=1.22' pytest 'gymnasium>=1.0' dask distributed
}
cargo fmt --check --manifest-path python/Cargo.toml
# The package's build finds maturin on the path.
export PATH=$PWD/$venv/bin:$PATH
bash .ci/with-clippy.sh pip install --quiet --no-build-isolation --no-deps --force-reinstall ./python
pytest -q python "$@"

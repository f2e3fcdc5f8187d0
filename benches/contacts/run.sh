#!/bin/sh
# Compares motions with contacts with MuJoCo and Drake, in one run.
# usage: run.sh VENV [WORK [SCENE ...]]     (VENV: a Python 3.11 environment with requirements.txt; WORK: $TMPDIR/contacts-work)
# Report, chart and numbers go to WORK; `KEEP=1` also puts report and chart into reports/.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:?a Python environment in which requirements.txt is installed}
work=${2:-${TMPDIR:-/tmp}/contacts-work}
[ $# -gt 2 ] && shift 2 || set --
mkdir -p "$work"
cargo build --release --quiet --manifest-path "$here/ours/Cargo.toml" --target-dir "$work/ours"
# From within the work folder, and without caches of Python beside the scripts.
venv=$(cd "$venv" && pwd)
cd "$work" && work=$(pwd)
PYTHONDONTWRITEBYTECODE=1 "$venv/bin/python" "$here/compare.py" "$work/ours/release/contacts-ours" "$work" "$@"
if [ -n "${KEEP:-}" ]; then
    cp "$work/contacts.md" "$here/../../reports/contacts.md"
    cp "$work/contacts.svg" "$here/../../reports/figures/contacts.svg"
fi

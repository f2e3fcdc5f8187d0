#!/bin/sh
# What the rivals' side needs beside the project: a Python environment outside the repository, clang, Eigen.
# usage: setup.sh [VENV]     (default: $TMPDIR/integrators-venv); Debian packages only if run as root.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${1:-${TMPDIR:-/tmp}/integrators-venv}

# The newest clang there is: gcc makes Pinocchio twice as slow, old clangs a little.
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    clang=$(apt-cache search --names-only '^clang-[0-9]+$' | sed 's/ .*//' | sort -t- -k2 -n | tail -n 1)
    apt-get install -y --no-install-recommends "$clang" libeigen3-dev
else
    echo "not root: install by hand the newest clang and Eigen 3.4 (libeigen3-dev)"
fi

# Drake's wheels want CPython 3.11 or newer and glibc 2.34 or newer.
[ -x "$venv/bin/python" ] || python3 -m venv "$venv"
"$venv/bin/pip" install --quiet -r "$here/requirements.txt"
echo "ready: $here/run.sh $venv WORK"

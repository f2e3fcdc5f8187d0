#!/usr/bin/env bash
# Tests the page of `mbd view` as it is committed: bits of the shipped models and broken files in Node; and as the program
# `target/release/mbd` writes it, in Chromium where there is one. With `--quick`, which is part of `.ci/run`, a few of them, in
# Node only. `.ci/page.sh` makes the files.
set -euo pipefail
cd "$(dirname "$0")/.."
if ! command -v node > /dev/null; then
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends nodejs
fi
few=(models/ur5.urdf models/mechanisms/fourbar.toml models/contacts/bouncing_ball.toml)
if [ "${1:-}" = --quick ]; then
    node page/tests/states.mjs "${few[@]}"
    node page/tests/malformed.mjs 200
    exit 0
fi
node page/tests/states.mjs
node page/tests/malformed.mjs 1000
node page/tests/speed.mjs
if command -v chromium > /dev/null; then
    node page/tests/browser.mjs "$PWD/target/release/mbd" --broken 1000
else
    echo "no chromium: the page was tested in Node only"
fi

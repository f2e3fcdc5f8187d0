#!/usr/bin/env bash
# Tests the page of `mbd view` as it is committed: in Node the bits of all shipped models and broken files; in Chromium, where there
# is one, the page that the program in the first argument writes. `.ci/page.sh` makes the files.
set -euo pipefail
cd "$(dirname "$0")/.."
node page/tests/states.mjs
node page/tests/malformed.mjs 1000
if command -v chromium > /dev/null; then
    node page/tests/browser.mjs "$(realpath "${1:-target/release/mbd}")" --broken "${BROKEN:-1000}"
else
    echo "no chromium: the page was tested in Node only"
fi

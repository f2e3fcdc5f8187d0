#!/usr/bin/env bash
# Tests the page of `mbd view` as it is committed: bits of the shipped models and broken files in Node; and as the program
# `target/release/mbd` writes it, with all its controls, in Chromium, which is installed if that takes no longer than half a
# minute. With `--quick`, which is part of `.ci/run`, a few of them. `.ci/page.sh` makes the files.
set -euo pipefail
cd "$(dirname "$0")/.."
bash .ci/node.sh
# An installation that is interrupted would leave a mess, a download does not.
if ! command -v chromium > /dev/null && [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
    install=(apt-get install -y -q --no-install-recommends chromium)
    export DEBIAN_FRONTEND=noninteractive
    if timeout 30 "${install[@]}" --download-only > /dev/null 2>&1; then "${install[@]}" > /dev/null || true; fi
fi
browser() {
    if command -v chromium > /dev/null; then
        node page/tests/browser.mjs "$PWD/target/release/mbd" "$@"
        node page/tests/controls.mjs "$PWD/target/release/mbd"
    else
        echo "no chromium: the page was tested in Node only"
    fi
}
few=(models/ur5.urdf models/mechanisms/fourbar.toml models/contacts/bouncing_ball.toml)
if [ "${1:-}" = --quick ]; then
    # Node does a few models where Chromium does all.
    command -v chromium > /dev/null || few=()
    node page/tests/states.mjs "${few[@]}"
    node page/tests/malformed.mjs 200
    browser --quick --broken 20
    exit 0
fi
node page/tests/states.mjs
node page/tests/malformed.mjs 1000
node page/tests/speed.mjs
browser --broken 1000

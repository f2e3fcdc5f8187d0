#!/usr/bin/env bash
# Installs Node where it is missing: tests of WebAssembly run in it, and pass over without it.
set -euo pipefail
command -v node > /dev/null && exit 0
apt-get update -q
DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends nodejs

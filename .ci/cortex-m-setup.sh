#!/usr/bin/env bash
# Installs what examples/cortex-m/run.sh needs on Debian, where it is not there: the emulator, and a compiler that has the
# source of its library (rustup cannot fetch targets everywhere). Run as root.
set -euo pipefail

packages=(qemu-system-arm rustc-web rust-web-src binutils-arm-none-eabi)
missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f '${Status}' "$package" 2> /dev/null | grep -q 'install ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
fi

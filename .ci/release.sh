#!/usr/bin/env bash
# The published set: the crates and the Python package of one version. Nothing is uploaded.
#
#   .ci/release.sh           compares versions, dry run of `cargo publish` without builds: seconds
#   .ci/release.sh --full    the same with builds of what would be published, wheels, and the oldest Rust: half an hour
#
# To release: set the version in Cargo.toml and python/multibody/__init__.py, name it in CHANGELOG.md, run `.ci/run` and
# `.ci/release.sh --full` on a clean checkout, and do what this script prints at the end.
set -euo pipefail
cd "$(dirname "$0")/.."
full="" wrong=0
[ "${1:-}" != --full ] || full=1
crates=(mbd-runtime mbd-codegen mbd-macros multibody mbd-cli)

# same WHAT FOUND: complains about a version that is not that of the workspace.
same() { [ "$2" = "$version" ] || { echo "$1 has the version ${2:-none}, the workspace $version" >&2; wrong=1; }; }
first() { sed -n "s/^$1 *= *\"\([^\"]*\)\".*/\1/p" "$2" | head -n 1; }

version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
same "the Python package" "$(first __version__ python/multibody/__init__.py)"
for crate in mbd-runtime mbd-codegen mbd-macros multibody; do
    for found in $(sed -n "s/^$crate = .*version = \"\([^\"]*\)\".*/\1/p" Cargo.toml runtime/Cargo.toml codegen/Cargo.toml \
        macros/Cargo.toml cli/Cargo.toml); do
        same "a dependency on $crate" "$found"
    done
done
installed=target/python-venv/bin/python
if [ -x $installed ] && found=$(cd / && "$OLDPWD/$installed" -c 'from importlib.metadata import version as v; print(v("multibody"))' 2> /dev/null); then
    same "the wheel that is installed in target/python-venv" "$found"
fi
if ! grep -q "^## \[$version\]" CHANGELOG.md; then
    if [ -n "$full" ]; then
        echo "CHANGELOG.md has no section [$version]" >&2
        wrong=1
    else
        grep -q '^## \[Unreleased\]' CHANGELOG.md || { echo "CHANGELOG.md has no section [$version] or [Unreleased]" >&2; wrong=1; }
    fi
fi
[ $wrong = 0 ] || exit 1

options=(--dry-run --locked)
# A checkout that is being worked on is no reason to look at nothing.
[ -n "$full" ] || options+=(--no-verify --allow-dirty)
names=()
for crate in "${crates[@]}"; do names+=(-p "$crate"); done
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if cargo publish "${options[@]}" "${names[@]}" > "$log" 2>&1; then
    grep -E 'Packag(ed|ing)' "$log"
elif [ -z "$full" ] && grep -qiE 'HTTP request|could not resolve|network|timed out' "$log"; then
    echo "the registry cannot be reached: files of the packages only"
    for crate in "${crates[@]}"; do
        files=$(cargo package --list --allow-dirty --locked -p "$crate")
        echo "$crate: $(wc -l <<< "$files") files"
    done
else
    cat "$log" >&2
    exit 1
fi
echo "crates and Python package: $version"
[ -n "$full" ] || exit 0

bash .ci/oldest-rust.sh
rm -rf python/dist
bash python/build_wheels.sh
cat << END

Ready. What is left to do, from this commit:
  git tag -s v$version && git push --tags
  cargo publish --locked ${names[*]}
  twine upload python/dist/*
END

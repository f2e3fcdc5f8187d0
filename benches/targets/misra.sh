#!/usr/bin/env bash
# Deviations of generated C from MISRA C:2012 that Cppcheck's add-on reports, how often for each model and precision. A rule
# that the table of book/src/c.md does not have is an error.
#
#     benches/targets/misra.sh
#
# Needs cppcheck (Debian: cppcheck).
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release --quiet --bin mbd
work=$PWD/target/targets-misra
mkdir -p "$work"
cppcheck --version
known=$(sed -n '/^## MISRA/,/^## Units/s/^| \([0-9., ]*\) |.*/\1/p' book/src/c.md | tr -d ' ' | tr ',' '\n')
for model in double_pendulum.toml ur5.urdf; do
    for precision in f64 f32; do
        name=${model%.*}_$precision
        target/release/mbd generate "models/$model" --lang c --outputs all --scalar $precision -o "$work/$name.c" \
            2> "$work/log" || { cat "$work/log" >&2; exit 1; }
        (cd "$work" && cppcheck --quiet --std=c99 --enable=all --addon=misra --suppress=missingIncludeSystem "$name.c") \
            2> "$work/$name.log"
        found=$(grep -o 'misra-c2012-[0-9.]*' "$work/$name.log" | sed 's/.*-//' | sort -V | uniq -c | awk '{ print $2, $1 }')
        echo "$name: $(awk '{ printf "%s%s (%d)", separator, $1, $2; separator = ", " }' <<< "$found")"
        new=$(cut -d ' ' -f 1 <<< "$found" | grep -vxF "$known" || true)
        [ -z "$new" ] || { echo "not in book/src/c.md: rule $new" >&2; exit 1; }
    done
done

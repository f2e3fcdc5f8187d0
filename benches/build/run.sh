#!/usr/bin/env bash
# How long generated code takes to make and to compile, robot by robot, output `rates`.
# usage: run.sh [REPEATS [FILE ...]]     (default: 3; FILE: further URDF files, base floating)
#
# A crate with one `mbd_model!`, and one with the file that `mbd generate` writes, are built again and again with what they
# depend on built before; the least processor time of the repeats counts. The table goes to result.md beside this script.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(realpath "$here/../..")
repeats=${1:-3}
[ $# -eq 0 ] || shift
work=$root/target/build-times
mkdir -p "$work/file/src" "$work/macro/src" "$work/quick/src"
(cd "$root" && cargo build --release --quiet --bin mbd)
mbd=$root/target/release/mbd

# crate NAME DEPENDENCY [PROFILES]
crate() {
    printf '[package]\nname = "%s"\nversion = "0.0.0"\nedition = "2021"\n[workspace]\n[dependencies]\n%s\n%s\n' \
        "$1" "$2" "${3:-}" > "$work/$1/Cargo.toml"
    # The versions that the project itself is locked to.
    cp "$root/Cargo.lock" "$work/$1/Cargo.lock"
}
facade="multibody = { path = \"$root\" }"
crate file "mbd-runtime = { path = \"$root/runtime\", features = [\"std\"] }"
crate macro "$facade"
crate quick "$facade" $'[profile.dev.build-override]\nopt-level = 3\n[profile.release.build-override]\nopt-level = 3'

# source CRATE FILE BASE: src/lib.rs, with a function that is compiled whether anybody calls it or not.
source_of() {
    if [ "$1" = file ]; then
        echo "include!(\"robot.rs\");"
    else
        local base=""
        [ "$3" = none ] || base="base = $3, "
        echo "multibody::mbd_model! { path = \"$2\", name = Robot, ${base}outputs = [rates] }"
    fi
    echo "#[inline(never)]"
    echo "pub fn rates(s: &Robot, q: &[f64; Robot::NQ], p: &[f64; Robot::NV], qd: &mut [f64; Robot::NQ], pd: &mut [f64; Robot::NV]) {"
    echo "    s.rates(q, p, qd, pd);"
    echo "}"
}

# shortest COMMAND ...: processor seconds, the least of the repeats.
shortest() {
    local best="" k time TIMEFORMAT="%U %S"
    for ((k = 0; k < repeats; k++)); do
        [ -z "${touched:-}" ] || touch "$touched"
        time=$({ time "$@" > "$work/log" 2>&1; } 2>&1) || { cat "$work/log" >&2; return 1; }
        best=$(awk "BEGIN { split(\"$time\", t, \" \"); s = t[1] + t[2]; best = \"$best\"; print best == \"\" || s < best + 0 ? s : best }")
    done
    printf %.2f "$best"
}

rows=""
measure() { # file, base
    local name generate cells="" which nv
    name=$(basename "${1%.*}")
    local base=()
    [ "$2" = none ] || base=(--base "$2")
    touched=""
    generate=$(shortest "$mbd" generate "$1" "${base[@]}" --outputs rates --name Robot --runtime ::mbd_runtime -o "$work/file/src/robot.rs")
    nv=$(sed -n 's/.*const NV: usize = \([0-9]*\);.*/\1/p' "$work/file/src/robot.rs" | head -1)
    for which in file macro quick; do
        source_of "$which" "$1" "$2" > "$work/$which/src/lib.rs"
        for how in check "build --release"; do
            # Dependencies first, and a first time without counting.
            cargo $how --quiet --manifest-path "$work/$which/Cargo.toml" --target-dir "$work/target-$which" 2> /dev/null
            touched=$work/$which/src/lib.rs
            cells+=" $(shortest cargo $how --quiet --manifest-path "$work/$which/Cargo.toml" --target-dir "$work/target-$which") |"
        done
    done
    rows+="| $name ($nv) | $(wc -c < "$work/file/src/robot.rs" | awk '{ printf "%d", $1 / 1000 }') | $generate |$cells"$'\n'
    printf '%s: %s |%s\n' "$name" "$generate" "$cells"
}

for file in double_pendulum.toml chain6.toml chain10_planar.toml; do measure "$root/models/$file" none; done
for file in ur5 panda_arm iiwa14; do measure "$root/models/$file.urdf" fixed; done
for file in solo12 g1; do measure "$root/models/$file.urdf" floating; done
for file in "$@"; do measure "$(realpath "$file")" floating; done

cat > "$here/result.md" <<END
# Build times

Seconds of processor time (all threads), the least of $repeats runs; $(rustc --version | cut -d' ' -f1,2); $(nproc) cores of $(sed -n 's/^model name\s*: //p' /proc/cpuinfo | head -1). Dependencies are built before. Output: rates.

- *file*: a crate with the file that \`mbd generate\` writes.
- *macro*: a crate with one \`mbd_model!\` and cargo's default profiles, in which macros are compiled without optimisation.
- *macro, optimised*: the same with \`opt-level = 3\` in \`[profile.dev.build-override]\` and \`[profile.release.build-override]\`.

| robot (velocities) | source, kB | mbd generate | file: check | file: release | macro: check | macro: release | macro, optimised: check | macro, optimised: release |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
$rows
END
sed -i '$ d' "$here/result.md"

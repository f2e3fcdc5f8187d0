#!/usr/bin/env bash
# Instructions of generated functions, counted by valgrind, against the limits in .ci/instructions.txt.
#
#   .ci/instructions.sh            counts and compares
#   .ci/instructions.sh --update   counts and writes the limits anew, 4 % above what was counted
#
# Needs valgrind, installed on Debian where it is not there and may be (run as root). What is counted is code for any x86-64,
# so it does not depend on the processor; fused multiplications and long vectors are left out.
set -euo pipefail
cd "$(dirname "$0")/.."
limits=.ci/instructions.txt
update=""
[ "${1:-}" != --update ] || update=1

if ! command -v valgrind > /dev/null; then
    if ! command -v apt-get > /dev/null || [ "$(id -u)" != 0 ]; then
        echo "instructions.sh: valgrind is not installed, and only root on Debian can change that here" >&2
        exit 1
    fi
    apt-get update -q
    DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends valgrind
fi
if [ "$(uname -m)" != x86_64 ]; then
    echo "the limits are those of x86-64: nothing is compared"
    exit 0
fi

# The code that the generator makes unless told otherwise.
generated=$PWD/target/instructions
mkdir -p "$generated"
cargo build --release --quiet --bin mbd
for file in double_pendulum.toml chain6.toml chain10_planar.toml ur5.urdf panda_arm.urdf iiwa14.urdf solo12.urdf g1.urdf; do
    base=fixed
    case $file in solo12* | g1*) base=floating ;; esac
    [[ $file == *.toml ]] && base=() || base=(--base "$base")
    target/release/mbd generate "models/$file" "${base[@]}" --outputs rates,accelerations --name Robot \
        --runtime ::mbd_runtime -o "$generated/${file%.*}.rs" 2> "$generated/log" || { cat "$generated/log" >&2; exit 1; }
done
# Motions with contacts: springs keep the knees of the quadruped off their stops.
sed -E 's/^start = (-?1\.4)$/start = \1\nstiffness = 1\nrest = \1\ndamping = 0.005/' models/contacts/quadruped.toml \
    > "$generated/quadruped.toml"
cp benches/instructions/leg.toml "$generated"
echo open open open open open open open open open open open open > "$generated/quadruped.modes"
echo open > "$generated/leg.modes"
for name in quadruped leg; do
    for modes in "" "$generated/$name.modes"; do
        target/release/mbd generate "$generated/$name.toml" --outputs rates,momenta,energy --name Robot ${modes:+--modes "$modes"} \
            --runtime ::mbd_runtime -o "$generated/$name${modes:+_touching}.rs" 2> "$generated/log" \
            || { cat "$generated/log" >&2; exit 1; }
    done
done
INSTRUCTIONS=$generated cargo build --release --quiet --locked --manifest-path benches/instructions/Cargo.toml \
    --target-dir target/instructions/build
program=$generated/build/release/instructions

# collected MODEL FUNCTION CALLS: instructions of a whole run.
collected() {
    local out
    out=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$@" 2>&1) || { echo "$out" >&2; return 1; }
    sed -n 's/.*Collected : *//p' <<< "$out"
}

over="" new=$(grep '^#' "$limits")
printf '%-16s %-14s %12s %8s\n' model function instructions limit
while read -r model function limit; do
    # What start-up takes is in both runs.
    case $function in free | far) calls=10 ;; *) calls=1000 ;; esac
    few=$(collected "$model" "$function" $((calls / 10)))
    many=$(collected "$model" "$function" $((calls + calls / 10)))
    [ "${few:-0}" -gt 0 ] && [ "${many:-0}" -gt "$few" ] || { echo "$model $function: nothing was counted" >&2; exit 1; }
    count=$(((many - few) / calls))
    [ "$function" != free ] || free=$count
    # Contacts that are far away may cost a twentieth of a motion.
    [ "$function" != far ] || [ $((100 * count)) -le $((105 * free)) ] \
        || over+="$model: $count instructions with contacts that are far, $free without contacts"$'\n'
    printf '%-16s %-14s %12d %8d\n' "$model" "$function" "$count" "$limit"
    [ "$count" -le "$limit" ] || over+="$model $function: $count instructions, limit $limit"$'\n'
    new+=$'\n'"$model $function $((count + count / 25 + 1))"
done < <(grep -v '^#' "$limits")

if [ -n "$update" ]; then
    printf '%s\n' "$new" > "$limits"
    echo "written: $limits"
elif [ -n "$over" ]; then
    printf '\n%s' "$over" >&2
    echo "rustc $(rustc --version | cut -d' ' -f2). If another compiler made the difference, or it is worth it: .ci/instructions.sh --update" >&2
    exit 1
fi

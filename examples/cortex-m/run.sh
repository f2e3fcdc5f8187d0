#!/usr/bin/env bash
# Builds every scene for a Cortex-M, runs it in QEMU, runs its twin on the host, and compares final states and energies bit
# for bit. Looks in each image for panics, allocation and (single precision) double-precision arithmetic in software.
#
#   ./run.sh            all scenes
#   ./run.sh SCENE ...  some of them
#
# Needs qemu-system-arm and one of:
# - a rustup toolchain with the target (rustup target add thumbv7em-none-eabihf): nothing else;
# - Debian's rustc-web with rust-web-src and arm-none-eabi-ld, for machines that cannot fetch rustup targets
#   (.ci/cortex-m-setup.sh installs them): core is then built from source.
#
# Single precision is built for the FPU of a Cortex-M4F and runs on an M4 and on an M7; double precision is built for
# the FPU of a Cortex-M7 and runs there. The emulator counts instructions; it knows no pipeline, so these are not cycles.
set -euo pipefail
cd "$(dirname "$0")"

target=thumbv7em-none-eabihf
scenes=("$@")
if [ ${#scenes[@]} -eq 0 ]; then
    scenes=()
    for file in firmware/src/bin/*.rs; do scenes+=("$(basename "$file" .rs)"); done
fi

fail() {
    echo "run.sh: $*" >&2
    exit 1
}

command -v qemu-system-arm > /dev/null || fail "qemu-system-arm is not installed (.ci/cortex-m-setup.sh)"
nm=$(command -v arm-none-eabi-nm || command -v llvm-nm || command -v nm) || fail "no nm is installed (binutils)"

# How to build: sets the array `cross`, run before cargo.
flags=""
build_args=(--release --locked --quiet --target "$target" --package firmware)
if rustup target list --installed 2> /dev/null | grep -qx "$target"; then
    cross=(env)
else
    # rustup's rustc may come first on PATH: ask the package where its own is. The library source must be of the same
    # version as the compiler, and is: both packages come from one source.
    rustc=$(dpkg -L rustc-web 2> /dev/null | grep 'bin/rustc$' | head -1) || true
    [ -n "$rustc" ] || fail "neither the rustup target $target nor Debian's rustc-web is installed (.ci/cortex-m-setup.sh)"
    cross=(env "RUSTC=$rustc" RUSTC_BOOTSTRAP=1)
    flags="-C linker=arm-none-eabi-ld -C linker-flavor=ld"
    build_args+=(-Zbuild-std=core)
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT

# build SCENE: prints the path of the image; the compiler's messages only if it fails (it warns of +fp64 every time).
build() {
    # One folder for both boards: the generator in it is that of the host, and is compiled once.
    local scene=$1 directory=target/boards extra
    case $scene in
        *_f32) extra="-C target-cpu=cortex-m4" ;;
        *_f64) extra="-C target-cpu=cortex-m7 -C target-feature=+fp64" ;;
        *) fail "$scene: the name of a scene ends in _f32 or _f64" ;;
    esac
    "${cross[@]}" RUSTFLAGS="$flags $extra" cargo build "${build_args[@]}" --bin "$scene" --target-dir "$directory" \
        > "$log" 2>&1 || fail "$scene does not build:"$'\n'"$(cat "$log")"
    echo "$directory/$target/release/$scene"
}

# forbid IMAGE PATTERN WHAT: no symbol of the image matches.
forbid() {
    local found
    found=$("$nm" "$1" | grep -E "$2" || true)
    [ -z "$found" ] || fail "$1 holds $3:"$'\n'"$found"
}

# emulate BOARD IMAGE: what the image prints.
emulate() {
    timeout 120 qemu-system-arm -M "$1" -nographic -monitor none -serial none \
        -semihosting-config enable=on,target=native -icount shift=0 -kernel "$2" 2>&1 < /dev/null
}

# value NAME: the hexadecimal number on the line of that name, in decimal.
value() {
    echo $((16#$(sed -n "s/^$1 //p")))
}

# within_limits SCENE BYTES STACK INSTRUCTIONS EVALUATIONS [COSTLIEST [EVENT]] [ERROR [GAP]]: adds to `over` what is above the limits of limits.txt.
over=""
within_limits() {
    local limits what value at=0
    local names=("image bytes" "stack bytes" "instructions/step" evaluations)
    # Scenes with contacts have a number for the costliest step there, and no true energy error.
    [ "$costliest" = - ] || names+=("instructions of the costliest step")
    [ "$event" = - ] || names+=("instructions of the costliest step with an event")
    names+=("hundred millionths of energy error"
        "hundred millionths of m or rad the loop is open")
    read -ra limits <<< "$(sed -n "s/^$1 //p" limits.txt)"
    [ ${#limits[@]} -eq $(($# - 1)) ] || fail "limits.txt has no line for $1 with $(($# - 1)) numbers"
    for what in "${names[@]:0:$(($# - 1))}"; do
        value=${*:$((at + 2)):1}
        [ "$value" -le "${limits[$at]}" ] || over+="$1: $value $what, limit ${limits[$at]}"$'\n'
        at=$((at + 1))
    done
}

# The twin is built by the firmware's compiler, in a profile in which the generator is that of the firmware. Its own code is
# not optimised, and checks its arithmetic: any profile of the host must give the same bits.
host_target=$("${cross[@]}" bash -c '"${RUSTC:-rustc}" -vV' | sed -n 's/^host: //p')
"${cross[@]}" RUSTFLAGS="-C opt-level=0 -C lto=off -C linker-plugin-lto=no -C debug-assertions=yes -C overflow-checks=yes" \
    cargo build --release --locked --quiet --target "$host_target" --package twin --target-dir target/boards > "$log" 2>&1 ||
    fail "the twin does not build:"$'\n'"$(cat "$log")"

table=""
for scene in "${scenes[@]}"; do
    [ -f "firmware/src/bin/$scene.rs" ] || fail "no scene $scene"
    image=$(build "$scene")
    "$nm" "$image" | grep -q ' T main$' || fail "$image has no symbol table: nothing can be checked"
    forbid "$image" 'panic|unwind' 'a panic path'
    forbid "$image" 'alloc' 'an allocator'
    boards="mps2-an500"
    if [[ $scene == *_f32 ]]; then
        forbid "$image" '__aeabi_(c?d|[a-z]+2d)' 'double-precision arithmetic in software'
        boards="mps2-an386 mps2-an500"
    fi
    host=$("target/boards/$host_target/release/twin" "$scene" 2> "$log") || fail "$scene on the host: $(cat "$log")"
    for board in $boards; do
        out=$(emulate "$board" "$image") || fail "$scene on $board: the run failed: $out"
        state=$(grep -E '^(state|energy) ' <<< "$out") || fail "$scene on $board: no state was printed: $out"
        twin=$(grep -E '^(state|energy) ' <<< "$host") || fail "$scene: the host printed no state: $host"
        [ "$state" = "$twin" ] ||
            fail "$scene on $board: not the host's bits:"$'\n'"$(diff <(echo "$state") <(echo "$twin"))"
        # At 25 MHz and one instruction a nanosecond a tick is 40 instructions.
        bytes=$(value image <<< "$out") stack=$(value stack <<< "$out")
        instructions=$(($(value ticks <<< "$out") * 40 / $(value steps <<< "$out")))
        evaluations=$(value evaluations <<< "$out")
        most=() costliest=- event=- error=() shown=""
        # Two readings of the counter are up to a tick off.
        if grep -q '^costliest ' <<< "$out"; then
            costliest=$((($(value costliest <<< "$out") + 1) * 40)) most=("$costliest")
        fi
        # Time steps have no events.
        if grep -q '^event .*[1-9a-f]' <<< "$out"; then
            event=$((($(value event <<< "$out") + 1) * 40)) most+=("$event")
        fi
        for what in error gap; do
            if grep -q "^$what " <<< "$host"; then
                error+=("$(value $what <<< "$host")") shown+="$(printf '%13s' "$(value $what <<< "$host")e-8")"
            fi
        done
        table+=$(printf '%-28s %-10s %11d %11d %17d %11d %14s %13s%s' "$scene" "$board" "$bytes" "$stack" "$instructions" \
            "$evaluations" "$costliest" "$event" "$shown")$'\n'
        within_limits "$scene" "$bytes" "$stack" "$instructions" "$evaluations" "${most[@]}" "${error[@]}"
    done
done

printf '%-28s %-10s %11s %11s %17s %11s %14s %13s %12s %12s\n' scene board 'image bytes' 'stack bytes' instructions/step \
    evaluations 'costliest step' 'with an event' 'energy error' 'open by'
printf '%s' "$table"
echo "every final state and energy has the host's bits; no panic, no allocator"
[ -z "$over" ] || fail "over the limits of limits.txt:"$'\n'"$over"

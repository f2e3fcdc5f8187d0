#!/usr/bin/env bash
# Instructions of one evaluation of the UR5 on an emulated Cortex-M7, ours and CasADi's, in one image.
# usage: run.sh CASADI.c [RESULT]     CASADI.c: WORK/c/ur5_casadi.c of ../run.sh; RESULT: where the table goes (default: result.md here)
#
# Needs arm-none-eabi-gcc with newlib (Debian: gcc-arm-none-eabi, libnewlib-arm-none-eabi) beside what examples/cortex-m
# needs. Both have double precision in hardware (-mfpu=fpv5-d16). The emulator counts instructions, not cycles.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source=$(realpath "${1:?CasADi\'s C of the UR5, from ../run.sh: WORK/c/ur5_casadi.c}")
result=$(realpath -m "${2:-$here/result.md}")
cd "$here"

target=thumbv7em-none-eabihf
core="-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard"
fast="$core -O3 -ffast-math -w -I$here/../theirs"
work=$(realpath -m "$here/../../../target/cortex-m")
mkdir -p "$work"
rival() { # name, flags: only the one function stays visible
    arm-none-eabi-gcc $fast "${@:2}" -c "$source" -o "$work/$1.o"
    arm-none-eabi-objcopy --keep-global-symbol="ur5_$1" "$work/$1.o"
}
rival casadi
rival casadi_own -Dsin=own_sin -Dcos=own_cos -Dur5_casadi=ur5_casadi_own
RIVALS_OBJECTS="$work/casadi.o $work/casadi_own.o $(arm-none-eabi-gcc $core -print-file-name=libm.a)"
RIVALS_OBJECTS+=" $(arm-none-eabi-gcc $core -print-libgcc-file-name)"
export RIVALS_OBJECTS

# As examples/cortex-m/run.sh.
flags="-C target-cpu=cortex-m7 -C target-feature=+fp64"
arguments=(--target-dir "$work" --release --locked --quiet --target "$target")
if rustup target list --installed 2> /dev/null | grep -qx "$target"; then
    cross=(env) compiler=rustc
else
    compiler=$(dpkg -L rustc-web | grep 'bin/rustc$' | head -1)
    cross=(env "RUSTC=$compiler" RUSTC_BOOTSTRAP=1)
    flags+=" -C linker=arm-none-eabi-ld -C linker-flavor=ld"
    arguments+=(-Zbuild-std=core)
fi
RUSTFLAGS=$flags "${cross[@]}" cargo build "${arguments[@]}" > "$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
image=$work/$target/release/ur5
out=$(timeout 120 qemu-system-arm -M mps2-an500 -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native -icount shift=0 -kernel "$image" 2>&1 < /dev/null) ||
    { echo "the run failed: $out" >&2; exit 1; }

value() { echo $((16#$(sed -n "s/^$1 //p" <<< "$out"))); }
for which in difference difference_own; do
    [ "$(value $which)" -lt 1000000000 ] || { echo "accelerations differ by more than 1e-9, relative: $out" >&2; exit 1; }
done
loop=$(value empty)
net() { echo $(($(value "$1") - loop)); }
theirs=$(net casadi)
row() { # what, instructions
    printf '| %s | %d | %s |\n' "$1" "$2" "$(awk "BEGIN { printf \"%.2f\", $2 / $theirs }")"
}
{
    echo "# UR5 on a Cortex-M7"
    echo
    echo "Instructions of one evaluation, mean over 64 states; counted by QEMU (mps2-an500), which knows no pipeline: not cycles."
    echo "$(arm-none-eabi-gcc --version | head -1): \`-O3 -ffast-math $core\`; $("$compiler" --version)."
    echo "Largest relative difference of the accelerations: $(awk "BEGIN { printf \"%.1e\", $(value difference) / 1e18 }")."
    echo
    echo "| code | instructions | of CasADi's |"
    echo "| --- | ---: | ---: |"
    row "CasADi's C of Pinocchio's ABA, newlib's sine and cosine" "$theirs"
    row "the same with our sine and cosine" "$(net casadi_own)"
    row "ours, (q, v, τ) → q̈" "$(net accelerations)"
    row "ours, (q, p, τ) → (q̇, ṗ)" "$(net rates)"
} | tee "$result"

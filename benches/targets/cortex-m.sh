#!/usr/bin/env bash
# Instructions of one evaluation of `rates` of the UR5 in generated C on an emulated Cortex-M7, in single and in double
# precision: the mean over 64 states, without the loop around the calls. The emulator counts instructions, not cycles.
#
#     benches/targets/cortex-m.sh
#
# Needs qemu-system-arm and arm-none-eabi-gcc with newlib (Debian: gcc-arm-none-eabi, libnewlib-arm-none-eabi).
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release --quiet --bin mbd
work=$PWD/target/targets-cortex-m
mkdir -p "$work"
core=(-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard)
echo "$(arm-none-eabi-gcc --version | head -1), -O3 -ffp-contract=fast ${core[*]}"
for precision in f32 f64; do
    [ $precision = f32 ] && number=float || number=double
    target/release/mbd generate models/ur5.urdf --base fixed --lang c --name Robot --outputs rates --scalar $precision \
        -o "$work/robot.c" 2> "$work/log" || { cat "$work/log" >&2; exit 1; }
    # At 25 MHz and one instruction a nanosecond a tick of the counter is 40 instructions.
    arm-none-eabi-gcc -std=gnu99 -Wall -O3 -ffp-contract=fast "${core[@]}" -DNUMBER=$number -DCLOCK_INSTRUCTIONS=40U \
        -nostartfiles -T examples/cortex-m/firmware/link.x -I "$work" benches/targets/cortex-m.c "$work/robot.c" \
        -o "$work/ur5_$precision"
    count=$(timeout 120 qemu-system-arm -M mps2-an500 -nographic -monitor none -serial none \
        -semihosting-config enable=on,target=native -icount shift=0 -kernel "$work/ur5_$precision" 2>&1 < /dev/null) ||
        { echo "the run failed: $count" >&2; exit 1; }
    echo "$precision: $count instructions"
done

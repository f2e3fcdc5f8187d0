//! Start-up, semihosting output and measurement: everything in the firmware except the run itself.
//!
//! All `unsafe` of the example is in this file: registers of the core, the stack's memory, and the debugger's call.
#![no_std]

use core::arch::{asm, global_asm};
use scenes::{Bits, End, Unusable};

// The vector table (stack top, then handlers; every fault goes to one) and the reset handler. They are in assembly
// because they must run before the first instruction that uses a float register, and before anything is on the stack
// that they paint.
global_asm!(
    "
    .section .vector_table, \"a\"
    .word _stack_top
    .word reset
    .rept 14
    .word fault
    .endr

    .section .text.start, \"ax\"
    .syntax unified
    .thumb
    .global reset
    .type reset, %function
    .thumb_func
reset:
    ldr  r0, =0xE000ED88            // CPACR: full access to coprocessors 10 and 11, the FPU
    ldr  r1, [r0]
    orr  r1, r1, #0x00F00000
    str  r1, [r0]
    dsb
    isb
    ldr  r0, =_stack_limit
    ldr  r1, ={paint}
    mov  r2, sp
1:  cmp  r0, r2
    beq  2f
    str  r1, [r0], #4
    b    1b
2:  bl   main

    .type fault, %function
    .thumb_func
fault:
    movs r0, #0x18                  // SYS_EXIT
    ldr  r1, =0x20024               // internal error: the emulator exits with 1
    bkpt 0xab
    b    .
    .ltorg
    ",
    paint = const PAINT,
);

const PAINT: u32 = 0x5AA5_5AA5;

extern "C" {
    static _stack_top: u32;
    static _stack_limit: u32;
    static _image_end: u32;
}

/// One call to the debugger or emulator.
fn semihosting(operation: u32, argument: u32) {
    // SAFETY: `bkpt 0xab` with an operation in r0 and its argument in r1 is the semihosting call; r0 is the result.
    unsafe { asm!("bkpt 0xab", inout("r0") operation => _, in("r1") argument, options(nostack)) }
}

fn print(text: &str) {
    for byte in text.as_bytes() {
        semihosting(0x03, core::ptr::from_ref(byte) as u32); // SYS_WRITEC
    }
}

/// `name`, then sixteen hexadecimal digits, then the end of the line.
pub fn print_line(name: &str, value: u64) {
    print(name);
    print(" ");
    for place in (0..16).rev() {
        let digit = (value >> (4 * place)) as u8 & 15;
        let byte = if digit < 10 { b'0' + digit } else { b'a' - 10 + digit };
        semihosting(0x03, core::ptr::from_ref(&byte) as u32);
    }
    print("\n");
}

/// Ends the emulation, with exit status 0 or 1.
pub fn exit(good: bool) -> ! {
    loop {
        semihosting(0x18, if good { 0x20026 } else { 0x20024 });
    }
}

const SYSTICK: *mut u32 = 0xE000_E010 as *mut u32; // CSR, RVR, CVR

/// Starts the 24-bit down counter at processor clock.
pub fn start_counter() {
    // SAFETY: registers of the core, used by nobody else.
    unsafe {
        SYSTICK.add(1).write_volatile(0x00FF_FFFF);
        SYSTICK.add(2).write_volatile(0);
        SYSTICK.write_volatile(5);
    }
}

/// Ticks since the start, and whether the counter has wrapped.
pub fn read_counter() -> (u32, bool) {
    // SAFETY: as above. The wrap flag clears on reading, so this is called once.
    unsafe { (0x00FF_FFFF - SYSTICK.add(2).read_volatile(), SYSTICK.read_volatile() & (1 << 16) != 0) }
}

/// Ticks since the start, if the counter has not wrapped.
pub fn now() -> u32 {
    // SAFETY: as above.
    unsafe { 0x00FF_FFFF - SYSTICK.add(2).read_volatile() }
}

/// Number of bytes of stack that the run has used: from the top down to the deepest one without the paint.
fn stack_used() -> u32 {
    let (mut at, top) = (&raw const _stack_limit, &raw const _stack_top);
    // SAFETY: between these two addresses is the painted stack and nothing else.
    unsafe {
        while at < top && at.read_volatile() == PAINT {
            at = at.add(1);
        }
    }
    top as u32 - at as u32
}

/// Defines `main` for one system and run.
#[macro_export]
macro_rules! firmware {
    ($system:ty, $run:expr) => {
        /// Called by the reset handler.
        #[no_mangle]
        pub extern "C" fn main() -> ! {
            $crate::measure(<$system>::new(), $run)
        }
    };
}

/// Runs the scene between two readings of the counter, then prints where it ended and the measurements.
pub fn measure<Y>(mut system: Y, run: impl Fn(&mut Y) -> Result<End<Y>, Unusable>) -> !
where
    Y: mbd_runtime::System,
    Y::Scalar: mbd_runtime::Real + Bits,
{
    start_counter();
    let result = run(&mut system);
    let (ticks, wrapped) = read_counter();
    let stack = stack_used();
    let Ok(end) = result else { exit(false) };
    for x in end.q.as_ref().iter().chain(end.p.as_ref()) {
        print_line("state", x.bits());
    }
    for x in end.energy.iter().flatten() {
        print_line("energy", x.bits());
    }
    print_line("image", (&raw const _image_end) as u32 as u64);
    print_line("stack", stack.into());
    print_line("ticks", ticks.into());
    print_line("steps", end.steps.into());
    print_line("evaluations", end.evaluations);
    for (name, x) in ["costliest", "touched", "event"].into_iter().zip(end.contacts.into_iter().flatten()) {
        print_line(name, x);
    }
    exit(!wrapped)
}

/// The panic handler that the compiler requires. It calls a function that is not defined, so that an image in which
/// anything can panic does not link.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    extern "C" {
        fn this_image_can_panic() -> !;
    }
    // SAFETY: the function is never linked and therefore never called.
    unsafe { this_image_can_panic() }
}

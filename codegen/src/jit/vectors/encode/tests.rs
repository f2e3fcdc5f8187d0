//! Bytes beside those of an assembler.

use super::*;

const FOUR: Lanes = Lanes::Four;
const EIGHT: Lanes = Lanes::Eight;

fn at(base: General, offset: i32) -> Last {
    Last::Memory(Address { base, index: None, offset, broadcast: false })
}

fn moving(base: General, offset: i32) -> Last {
    Last::Memory(Address { base, index: Some(General::R10), offset, broadcast: false })
}

/// Bytes, and what writes them.
type Case<'a> = (&'a str, &'a dyn Fn(&mut Assembler));

/// Bytes of some instructions, those of GNU as 2.40.
fn compare(wide: bool, cases: &[Case]) {
    for (bytes, write) in cases {
        let mut assembler = Assembler::new(wide);
        write(&mut assembler);
        let found: Vec<String> = assembler.bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(found.join(" "), *bytes);
    }
}

#[test]
fn vectors_of_32_bytes() {
    let register = Last::Register;
    compare(
        false,
        &[
            ("c5 9d 58 df", &|a| a.vector(FOUR, ADD, 3, Some(12), register(7))),
            ("c4 41 6d 58 e9", &|a| a.vector(FOUR, ADD, 13, Some(2), register(9))),
            ("c5 ed 5c 49 40", &|a| a.vector(FOUR, SUB, 1, Some(2), at(General::Rcx, 0x40))),
            ("c4 01 75 59 8c 10 00 10 00 00", &|a| a.vector(FOUR, MUL, 9, Some(1), moving(General::R8, 0x1000))),
            ("c5 7d 11 7a 20", &|a| a.vector(FOUR, STORE, 15, None, at(General::Rdx, 0x20))),
            ("c5 fd 51 e5", &|a| a.vector(FOUR, SQRT, 4, None, register(5))),
            ("c4 c2 e5 bc 51 08", &|a| {
                a.vector(FOUR, fused(Order::Product231, true, false), 2, Some(3), at(General::R9, 8));
            }),
            ("c4 42 a5 aa d4", &|a| a.vector(FOUR, fused(Order::Product213, false, true), 10, Some(11), register(12))),
            ("c5 a5 73 f3 3e", &|a| a.shift_left(FOUR, 11, 3, 62)),
            ("c4 e3 6d 4b cb c0", &|a| a.select(FOUR, 1, 12, 3, 2)),
            ("c4 22 7d 19 44 10 10", &|a| {
                let address = Address { base: General::Rax, index: Some(General::R10), offset: 16, broadcast: true };
                a.broadcast(FOUR, 8, Last::Memory(address));
            }),
            ("c5 cd c2 ef 12 c4 c1 55 df e8", &|a| a.zero_below(FOUR, 5, [6, 7, 8])),
            ("c4 42 7d 0f c9 0f 85 00 00 00 00", &|a| a.exit_if_signs(FOUR, 9)),
        ],
    );
}

#[test]
fn vectors_of_64_bytes() {
    let register = Last::Register;
    compare(
        true,
        &[
            ("62 91 9d 48 58 db", &|a| a.vector(EIGHT, ADD, 3, Some(12), register(27))),
            ("62 61 ed 40 5e 6a 01", &|a| a.vector(EIGHT, DIV, 29, Some(18), at(General::Rdx, 0x40))),
            ("62 11 f5 48 59 8c 10 08 10 00 00", &|a| a.vector(EIGHT, MUL, 9, Some(1), moving(General::R8, 0x1008))),
            ("62 f1 f5 50 5c 49 03", &|a| {
                let address = Address { base: General::Rcx, index: None, offset: 0x18, broadcast: true };
                a.vector(EIGHT, SUB, 1, Some(17), Last::Memory(address));
            }),
            ("62 61 fd 48 11 ba 00 20 00 00", &|a| a.vector(EIGHT, STORE, 31, None, at(General::Rdx, 0x2000))),
            ("62 a2 d5 40 98 e6", &|a| {
                a.vector(EIGHT, fused(Order::Product132, false, false), 20, Some(21), register(22))
            }),
            ("62 f1 8d 40 73 f3 3f", &|a| a.shift_left(EIGHT, 30, 3, 63)),
            ("62 92 fe 48 39 c9 62 f2 e5 41 65 d4", &|a| a.select(EIGHT, 2, 25, 4, 19)),
            // Where the registers have names in shorter instructions, these do it.
            ("c4 e3 6d 4b cb c0", &|a| a.select(FOUR, 1, 12, 3, 2)),
            ("62 b1 cd 48 c2 c9 16 62 91 fd c9 28 ec", &|a| a.zero_below(EIGHT, 5, [6, 17, 28])),
            ("62 42 fd 48 19 41 02", &|a| {
                let address = Address { base: General::R9, index: None, offset: 16, broadcast: true };
                a.broadcast(EIGHT, 24, Last::Memory(address));
            }),
            ("62 92 fe 48 39 c9 c5 78 93 d1 41 f6 c2 ff 0f 85 00 00 00 00", &|a| a.exit_if_signs(EIGHT, 25)),
        ],
    );
}

#[test]
fn addresses_and_counters() {
    compare(
        true,
        &[
            ("4c 8b 4f 58", &|a| a.read_address(General::R9, General::Rdi, 0x58)),
            ("48 8b 06", &|a| a.read_address(General::Rax, General::Rsi, 0)),
            ("49 b8 f0 de bc 9a 78 56 34 12", &|a| a.set(General::R8, 0x1234_5678_9abc_def0)),
            ("4d 69 d3 00 02 00 00", &|a| a.multiply(General::R10, General::R11, 0x200)),
            ("49 81 c3 ff ff ff ff", &|a| a.add(General::R11, -1)),
            ("49 81 fb 11 00 00 00", &|a| a.compare(General::R11, 17)),
        ],
    );
}

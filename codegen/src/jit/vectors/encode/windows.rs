//! Short distances into the working memory.
//!
//! A distance of one byte reaches 128 bytes to both sides of a register, or as many units with the prefix of AVX-512; longer
//! ones take four. Long code waits for its bytes: that of a humanoid is larger than the first cache. Two registers therefore
//! move along the working memory. A first run of the writer tells which places are read and written, one after the other;
//! from these the moves are chosen, and a second run writes them.

use super::{Address, Assembler, General, Instruction, Last};

/// An access to the working memory as the instruction has to express it.
#[derive(Clone, Copy, Debug)]
pub struct Access {
    /// Distance from the beginning, bytes.
    offset: i32,
    /// In what short distances are counted with the prefix of AVX-512; `None` where the processor does not have it.
    unit: Option<i32>,
    /// By how many bytes that prefix is longer; `None` where the instruction has it anyway.
    longer: Option<i32>,
}

impl Access {
    /// Bytes for a distance, and for a longer prefix if it needs that.
    fn cost(&self, distance: i32) -> i32 {
        let short = |unit: i32| distance % unit == 0 && i8::try_from(distance / unit).is_ok();
        let in_units = self.unit.is_some_and(short);
        match self.longer {
            None if in_units => 1,
            Some(_) if short(1) => 1,
            Some(longer) if in_units => 1 + longer,
            _ => LONG,
        }
    }
}

/// Bytes of a long distance, and of the instruction that moves a register.
const LONG: i32 = 4;
const MOVE: i32 = 7;

/// A move is not looked for where an access costs no more.
const CHEAP: i32 = 2;

/// Accesses for which a move is judged.
const AHEAD: usize = 16;

/// The registers that move. They belong to the caller, and are given back.
const MOVING: [General; 2] = [General::Rbx, General::Rbp];

/// From where an access counts its distance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Step {
    /// Which of the registers moves before it, and to which distance from the beginning.
    moves: Option<(usize, i32)>,
    /// The register; `None` for the beginning of the working memory.
    from: Option<usize>,
}

/// What happens to accesses to the working memory.
#[derive(Debug, Default)]
pub enum Windows {
    /// They stay as they are.
    #[default]
    Off,
    /// They are noted.
    Noting(Vec<Access>),
    /// They are written as they were planned; where the registers are.
    Planned(std::vec::IntoIter<Step>, [i32; MOVING.len()]),
}

/// The moves for accesses that come one after the other. `None` if there are none.
pub fn plan(accesses: &[Access]) -> Option<Vec<Step>> {
    let mut places: [Option<i32>; MOVING.len()] = [None; MOVING.len()];
    let cost = |access: &Access, place: Option<i32>| place.map_or(LONG, |place| access.cost(access.offset - place));
    let mut steps = Vec::with_capacity(accesses.len());
    for (k, access) in accesses.iter().enumerate() {
        let mut step = Step::default();
        let all = |access: &Access, places: &[Option<i32>]| {
            places.iter().map(|place| cost(access, *place)).fold(access.cost(access.offset), i32::min)
        };
        if all(access, &places) > CHEAP {
            let ahead = &accesses[k..accesses.len().min(k + AHEAD)];
            let now: i32 = ahead.iter().map(|access| all(access, &places)).sum();
            let mut most = 0;
            for moving in 0..MOVING.len() {
                let others = |access: &Access| all(access, &places[1 - moving..2 - moving]);
                let others: Vec<i32> = ahead.iter().map(others).collect();
                // An access at one end of what the register reaches, without and with the longer prefix, or in its middle.
                for place in ahead.iter().flat_map(|a| [128, 128 * a.unit.unwrap_or(1), 0].map(|by| a.offset + by)) {
                    let then = ahead.iter().zip(&others).map(|(access, other)| cost(access, Some(place)).min(*other));
                    let gain = now - then.sum::<i32>() - MOVE;
                    if gain > most {
                        (most, step.moves) = (gain, Some((moving, place)));
                    }
                }
            }
            if let Some((moving, place)) = step.moves {
                places[moving] = Some(place);
            }
        }
        let from = (0..MOVING.len()).min_by_key(|moving| cost(access, places[*moving]));
        step.from = from.filter(|moving| cost(access, places[*moving]) < access.cost(access.offset));
        steps.push(step);
    }
    steps.iter().any(|step| step.moves.is_some()).then_some(steps)
}

impl Assembler {
    /// An assembler that notes accesses to the working memory.
    pub fn noting(wide: bool) -> Assembler {
        Assembler { windows: Windows::Noting(Vec::new()), ..Assembler::new(wide) }
    }

    /// An assembler that writes them as it is planned.
    pub fn planned(wide: bool, plan: Vec<Step>) -> Assembler {
        let mut assembler = Assembler::new(wide);
        assembler.windows = Windows::Planned(plan.into_iter(), [0; MOVING.len()]);
        assembler.moving = true;
        // push
        MOVING.into_iter().for_each(|register| assembler.extended(register, 0x50));
        assembler
    }

    /// What follows is not part of the plan. Returns the accesses that were noted.
    pub fn end_windows(&mut self) -> Vec<Access> {
        match std::mem::take(&mut self.windows) {
            Windows::Noting(accesses) => accesses,
            _ => Vec::new(),
        }
    }

    /// Gives the caller its registers back.
    pub(super) fn restore(&mut self) {
        if self.moving {
            MOVING.into_iter().rev().for_each(|register| self.extended(register, 0x58));
        }
    }

    /// The instruction with its place in the working memory as it is planned; writes the move before it.
    pub(super) fn near(&mut self, mut i: Instruction) -> Instruction {
        let Last::Memory(address) = i.last else { return i };
        if address.base != General::Rdx || address.index.is_some() {
            return i;
        }
        let access = Access {
            offset: address.offset,
            unit: self.wide.then_some(i.bytes),
            longer: (!self.needs_evex(&i)).then(|| if Assembler::has_short_vex(&i) { 2 } else { 1 }),
        };
        let step = match &mut self.windows {
            Windows::Off => return i,
            Windows::Noting(accesses) => {
                accesses.push(access);
                return i;
            }
            Windows::Planned(steps, places) => {
                let step = steps.next().unwrap_or_default();
                if let Some((moving, place)) = step.moves {
                    places[moving] = place;
                }
                let at = step.from.map(|from| (MOVING[from], places[from]));
                i.last = match at {
                    Some((base, place)) => Last::Memory(Address { base, offset: address.offset - place, ..address }),
                    None => i.last,
                };
                step
            }
        };
        if let Some((moving, place)) = step.moves {
            self.distance_into(MOVING[moving], place);
        }
        i
    }

    /// `to = rdx + distance`
    fn distance_into(&mut self, to: General, distance: i32) {
        self.of_address(0x8d, to, General::Rdx, distance);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jit::vectors::encode::LOAD;
    use crate::jit::vectors::Lanes;

    fn accesses(offsets: &[i32], wide: bool) -> Vec<Access> {
        let access = |offset: &i32| Access { offset: *offset, unit: wide.then_some(8), longer: Some(2) };
        offsets.iter().map(access).collect()
    }

    /// Places that come in groups get registers beside them; each access is short then, but for one that is alone.
    #[test]
    fn registers_move_to_groups_of_places() {
        let near = |at: i32| (0..12).map(move |k| at + 16 * k);
        let offsets: Vec<i32> =
            near(5000).chain([90_000]).chain(near(20_000)).chain(near(5000)).chain([0, 64]).collect();
        for wide in [false, true] {
            let all = accesses(&offsets, wide);
            let steps = plan(&all).expect("moves are worth their bytes");
            assert_eq!(steps.len(), all.len());
            let (mut places, mut moves, mut bytes) = ([None; MOVING.len()], 0, 0);
            for (access, step) in all.iter().zip(&steps) {
                if let Some((moving, place)) = step.moves {
                    places[moving] = Some(place);
                    moves += 1;
                }
                let from =
                    step.from.map_or(0, |moving| places[moving].expect("a register has moved before it is used"));
                bytes += access.cost(access.offset - from);
            }
            assert_eq!((moves, bytes), (2, LONG + 36 + 2), "wide: {wide}");
        }
        assert!(plan(&accesses(&[5000, 90_000, 20_000], true)).is_none(), "three places far from each other");
    }

    /// Bytes of the instructions, by another assembler: `objdump -D -b binary -m i386:x86-64`.
    #[test]
    fn moves_are_written_before_what_needs_them() {
        let load = |assembler: &mut Assembler, offset: i32| {
            let address = Address { base: General::Rdx, index: None, offset, broadcast: false };
            assembler.vector(Lanes::One, LOAD, 1, None, Last::Memory(address));
        };
        let steps = vec![
            Step { moves: Some((0, 0x1000)), from: Some(0) },
            Step { moves: Some((1, 0x2000)), from: Some(1) },
            Step { moves: None, from: None },
        ];
        let mut assembler = Assembler::planned(false, steps);
        [0xff8, 0x2000, 0x10].into_iter().for_each(|offset| load(&mut assembler, offset));
        assembler.end_windows();
        load(&mut assembler, 0x1000);
        assembler.return_0();
        let text: Vec<String> = assembler.finish().iter().map(|byte| format!("{byte:02x}")).collect();
        // push rbx; push rbp; lea rbx, [rdx + 0x1000]; vmovsd xmm1, [rbx - 8]; lea rbp, [rdx + 0x2000]; vmovsd xmm1, [rbp + 0];
        // vmovsd xmm1, [rdx + 0x10]; vmovsd xmm1, [rdx + 0x1000]; xor eax, eax; pop rbp; pop rbx; ret
        let expected = "53 55 48 8d 9a 00 10 00 00 c5 fb 10 4b f8 48 8d aa 00 20 00 00 c5 fb 10 4d 00 c5 fb 10 4a 10 \
                        c5 fb 10 8a 00 10 00 00 31 c0 5d 5b c3";
        assert_eq!(text.join(" "), expected);
    }
}

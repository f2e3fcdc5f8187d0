//! Short distances into the working memory and the numbers of the function.
//!
//! A distance of one byte reaches 128 bytes to both sides of a register, or as many units with the prefix of AVX-512; longer
//! ones take four. Long code waits for its bytes: that of a humanoid has the size of the first cache. Four registers therefore
//! move along both arrays. A first run of the writer tells which places are read and written, one after the other; from these
//! the moves are chosen, and a second run writes them.

use super::{Address, Assembler, General, Instruction, Last};

/// The arrays along which registers move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Along {
    WorkingMemory,
    Numbers,
}

/// A place in an array: distance from its beginning, bytes.
type At = (Along, i32);

/// An access to one of the arrays as the instruction has to express it.
#[derive(Clone, Copy, Debug)]
pub struct Access {
    at: At,
    /// In what short distances are counted with the prefix of AVX-512; `None` where the processor does not have it.
    unit: Option<i32>,
    /// By how many bytes that prefix is longer; `None` where the instruction has it anyway.
    longer: Option<i32>,
}

impl Access {
    /// Bytes for a distance, and for a longer prefix if it needs that. One of the registers from 8 on is `high`.
    fn cost(&self, distance: i32, high: bool) -> i32 {
        let short = |unit: i32| distance % unit == 0 && i8::try_from(distance / unit).is_ok();
        let in_units = self.unit.is_some_and(short);
        match self.longer {
            None if in_units => 1,
            // High registers do not go with the shortest prefix.
            Some(longer) if short(1) => 1 + i32::from(high && longer == SHORT_VEX),
            Some(longer) if in_units => 1 + longer,
            _ => LONG,
        }
    }

    /// The same from the beginning of the array.
    fn cost_from_beginning(&self) -> i32 {
        self.cost(self.at.1, false)
    }

    /// The same from a moving register that is at a place.
    fn cost_from(&self, moving: usize, place: Option<At>) -> i32 {
        match place {
            Some((along, at)) if along == self.at.0 => self.cost(self.at.1 - at, MOVING[moving] as u8 >= 8),
            _ => LONG,
        }
    }

    /// The least of all moving registers but one, and from the beginning.
    fn least_cost(&self, places: &Places, without: Option<usize>) -> i32 {
        let others = places.iter().enumerate().filter(|(moving, _)| Some(*moving) != without);
        others.map(|(moving, place)| self.cost_from(moving, *place)).fold(self.cost_from_beginning(), i32::min)
    }
}

/// Bytes of a long distance, and of the instruction that moves a register.
const LONG: i32 = 4;
const MOVE: i32 = 7;

/// By how many bytes the prefix of AVX-512 is longer than the shortest one.
const SHORT_VEX: i32 = 2;

/// A move is not looked for where an access costs no more.
const CHEAP: i32 = 2;

/// Accesses for which a move is judged.
const AHEAD: usize = 16;

/// The registers that move. They belong to the caller, and are given back.
const MOVING: [General; 4] = [General::Rbx, General::Rbp, General::R14, General::R15];

/// Where these are.
type Places = [Option<At>; MOVING.len()];

/// From where an access counts its distance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Step {
    /// Which of the registers moves before it, and to which distance from the beginning of the array that is accessed.
    moves: Option<(usize, i32)>,
    /// The register; `None` for the beginning of the array.
    from: Option<usize>,
}

/// The moves of a body.
#[derive(Debug)]
pub struct Plan {
    steps: Vec<Step>,
    /// How many of the registers move: an even number, so that calls find the stack aligned.
    moving: usize,
}

/// What happens to accesses to the arrays.
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
pub fn plan(accesses: &[Access]) -> Option<Plan> {
    let mut places: Places = Default::default();
    let mut used = 0;
    let mut steps = Vec::with_capacity(accesses.len());
    for (k, access) in accesses.iter().enumerate() {
        let mut step = Step::default();
        if access.least_cost(&places, None) > CHEAP {
            step.moves = best_move(&accesses[k..accesses.len().min(k + AHEAD)], &places);
            if let Some((moving, place)) = step.moves {
                places[moving] = Some((access.at.0, place));
                used = used.max(moving + 1);
            }
        }
        let cost = |moving: &usize| access.cost_from(*moving, places[*moving]);
        let from = (0..MOVING.len()).min_by_key(cost);
        step.from = from.filter(|moving| cost(moving) < access.cost_from_beginning());
        steps.push(step);
    }
    (used > 0).then(|| Plan { steps, moving: used.next_multiple_of(2) })
}

/// The register whose move before the first of these accesses saves most bytes, and its place in the array of that one. `None`
/// if no move saves any.
fn best_move(accesses: &[Access], places: &Places) -> Option<(usize, i32)> {
    let along = accesses.first()?.at.0;
    let now: i32 = accesses.iter().map(|access| access.least_cost(places, None)).sum();
    // An access at one end of what the register reaches, without and with the longer prefix, or in its middle.
    let near = |access: &Access| [128, 128 * access.unit.unwrap_or(1), 0].map(|by| access.at.1 + by);
    let candidates: Vec<i32> = accesses.iter().filter(|access| access.at.0 == along).flat_map(near).collect();
    let (mut most, mut best) = (0, None);
    for moving in 0..MOVING.len() {
        let others: Vec<i32> = accesses.iter().map(|access| access.least_cost(places, Some(moving))).collect();
        for place in &candidates {
            let from_there = |access: &Access| access.cost_from(moving, Some((along, *place)));
            let then: i32 = accesses.iter().zip(&others).map(|(access, other)| from_there(access).min(*other)).sum();
            if now - then - MOVE > most {
                (most, best) = (now - then - MOVE, Some((moving, *place)));
            }
        }
    }
    best
}

impl Assembler {
    /// An assembler that notes accesses to the working memory and to the function's numbers.
    pub fn noting(wide: bool) -> Assembler {
        Assembler { windows: Windows::Noting(Vec::new()), ..Assembler::new(wide) }
    }

    /// An assembler that writes them as it is planned.
    pub fn planned(wide: bool, plan: Plan) -> Assembler {
        let mut assembler = Assembler::new(wide);
        assembler.windows = Windows::Planned(plan.steps.into_iter(), [0; MOVING.len()]);
        assembler.moving = plan.moving;
        // push
        MOVING[..plan.moving].iter().for_each(|register| assembler.extended(*register, 0x50));
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
        MOVING[..self.moving].iter().rev().for_each(|register| self.extended(*register, 0x58));
    }

    /// The instruction with its place in memory as it is planned; writes the move before it.
    pub(super) fn near(&mut self, mut i: Instruction) -> Instruction {
        let Last::Memory(address) = i.last else { return i };
        let along = match address {
            Address { index: Some(_), .. } => return i,
            Address { base: General::Rdx, .. } => Along::WorkingMemory,
            Address { base, .. } if self.numbers == Some(base) => Along::Numbers,
            _ => return i,
        };
        let access = Access {
            at: (along, address.offset),
            unit: self.wide.then_some(i.bytes),
            longer: (!self.needs_evex(&i)).then(|| if Assembler::has_short_vex(&i) { SHORT_VEX } else { 1 }),
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
            // lea
            self.of_address(0x8d, MOVING[moving], address.base, place);
        }
        i
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jit::vectors::encode::LOAD;
    use crate::jit::vectors::Lanes;

    fn accesses(places: &[At], wide: bool) -> Vec<Access> {
        let access = |at: &At| Access { at: *at, unit: wide.then_some(8), longer: Some(SHORT_VEX) };
        places.iter().map(access).collect()
    }

    /// Places that come in groups get registers beside them, of which two are enough; each access is short then, but for one
    /// that is alone.
    #[test]
    fn registers_move_to_groups_of_places() {
        use Along::{Numbers, WorkingMemory};
        let near = |along: Along, at: i32| (0..12).map(move |k| (along, at + 16 * k));
        let places: Vec<At> = near(WorkingMemory, 5000)
            .chain([(WorkingMemory, 90_000)])
            .chain(near(Numbers, 5000))
            .chain(near(WorkingMemory, 5000))
            .chain([(WorkingMemory, 0), (Numbers, 64)])
            .collect();
        for wide in [false, true] {
            let all = accesses(&places, wide);
            let plan = plan(&all).expect("moves are worth their bytes");
            assert_eq!((plan.steps.len(), plan.moving), (all.len(), 2));
            let (mut places, mut moves, mut bytes) = (Places::default(), 0, 0);
            for (access, step) in all.iter().zip(&plan.steps) {
                if let Some((moving, place)) = step.moves {
                    places[moving] = Some((access.at.0, place));
                    moves += 1;
                }
                bytes += step.from.map_or(access.cost_from_beginning(), |moving| {
                    let (along, _) = places[moving].expect("a register has moved before it is used");
                    assert_eq!(along, access.at.0, "the register is in another array");
                    access.cost_from(moving, places[moving])
                });
            }
            assert_eq!((moves, bytes), (2, LONG + 36 + 2), "wide: {wide}");
        }
        let alone = [(WorkingMemory, 5000), (Numbers, 90_000), (WorkingMemory, 20_000)];
        assert!(plan(&accesses(&alone, true)).is_none(), "three places far from each other");
    }

    /// Bytes of the instructions, by another assembler: `objdump -D -b binary -m i386:x86-64`.
    #[test]
    fn moves_are_written_before_what_needs_them() {
        let load = |assembler: &mut Assembler, base: General, offset: i32| {
            let address = Address { base, index: None, offset, broadcast: false };
            assembler.vector(Lanes::One, LOAD, 1, None, Last::Memory(address));
        };
        let steps = vec![
            Step { moves: Some((0, 0x1000)), from: Some(0) },
            Step { moves: Some((1, 0x2000)), from: Some(1) },
            Step { moves: None, from: None },
            Step { moves: Some((2, 0x800)), from: Some(2) },
        ];
        let mut assembler = Assembler::planned(false, Plan { steps, moving: 4 });
        assembler.numbers = Some(General::Rcx);
        [0xff8, 0x2000, 0x10].into_iter().for_each(|offset| load(&mut assembler, General::Rdx, offset));
        load(&mut assembler, General::Rcx, 0x7f8);
        assembler.end_windows();
        load(&mut assembler, General::Rdx, 0x1000);
        assembler.return_0();
        let text: Vec<String> = assembler.finish().iter().map(|byte| format!("{byte:02x}")).collect();
        // push rbx; push rbp; push r14; push r15; lea rbx, [rdx + 0x1000]; vmovsd xmm1, [rbx - 8]; lea rbp, [rdx + 0x2000];
        // vmovsd xmm1, [rbp + 0]; vmovsd xmm1, [rdx + 0x10]; lea r14, [rcx + 0x800]; vmovsd xmm1, [r14 - 8];
        // vmovsd xmm1, [rdx + 0x1000]; xor eax, eax; pop r15; pop r14; pop rbp; pop rbx; ret
        let expected = "53 55 41 56 41 57 48 8d 9a 00 10 00 00 c5 fb 10 4b f8 48 8d aa 00 20 00 00 c5 fb 10 4d 00 \
                        c5 fb 10 4a 10 4c 8d b1 00 08 00 00 c4 c1 7b 10 4e f8 c5 fb 10 8a 00 10 00 00 31 c0 41 5f \
                        41 5e 5d 5b c3";
        assert_eq!(text.join(" "), expected);
    }
}

//! Loop programs run on numbers: what tests compare.

use mbd_runtime::Scalar;

use super::{Place, RolledProgram, Start, SweepDirection, Target};

impl RolledProgram {
    /// Results for given inputs; `fused(a, b, c)` is `a · b + c`.
    ///
    /// # Panics
    /// If an input is missing.
    pub fn evaluate<S: Scalar>(&self, inputs: &[S], fused: impl Fn(S, S, S) -> S + Copy) -> Vec<S> {
        let zero = S::zero();
        let (mut results, mut kept) = (vec![zero; self.results], vec![zero; self.kept]);
        let mut rows: Vec<Vec<Vec<S>>> = self.loops.iter().map(|l| vec![vec![zero; l.row]; l.table.len()]).collect();
        for block in &self.blocks {
            let run = block.repeat.as_ref().map(|r| r.run);
            let count = run.map_or(1, |run| self.loops[run].table.len());
            let signed = |x: S, neg: bool| if neg { -x } else { x };
            let starts = block.repeat.iter().flat_map(|r| &r.carried).map(|(start, _)| match *start {
                Start::Const(x) => S::constant(x),
                Start::Kept(k, neg) => signed(kept[k], neg),
                Start::Given(k, neg) => signed(inputs[k], neg),
            });
            let mut carried: Vec<S> = starts.collect();
            for k in 0..count {
                let back = block.repeat.as_ref().is_some_and(|r| r.way == Some(SweepDirection::TipToBase));
                let turn = if back { count - 1 - k } else { k };
                let values = block.inputs.iter().map(|place| match *place {
                    Place::Given(k) => inputs[k],
                    Place::GivenOfTurn { first, stride } => inputs[first + stride * turn],
                    Place::Kept(k) => kept[k],
                    Place::Column(c) => S::constant(self.loops[run.unwrap_or(0)].table[turn][c]),
                    Place::Row(k) => rows[run.unwrap_or(0)][turn][k],
                    Place::Carried(k) => carried[k],
                    Place::RowOfBranch { run, turn, row } => rows[run][turn][row],
                });
                let values: Vec<S> = values.collect();
                let outputs = block.program.evaluate(&values, fused);
                for (target, value) in block.outputs.iter().zip(outputs) {
                    match *target {
                        Target::Result(k) => results[k] = value,
                        Target::ResultOfTurn { first, stride } => results[first + stride * turn] = value,
                        Target::Kept(k) => kept[k] = value,
                        Target::Row(k) => rows[run.unwrap_or(0)][turn][k] = value,
                        Target::Carried(k) => carried[k] = value,
                    }
                }
            }
            for ((_, end), value) in block.repeat.iter().flat_map(|r| &r.carried).zip(carried) {
                if let Some(slot) = end {
                    kept[*slot] = value;
                }
            }
        }
        results
    }
}

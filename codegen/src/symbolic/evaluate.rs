//! Evaluation of programs on numbers, for tests.

use mbd_runtime::Scalar;

use super::{Op, Operand, Program, ProgramResult};

impl Program {
    /// Results for given inputs, operation by operation in the program's order; `fused(a, b, c)` is `a · b + c`.
    ///
    /// # Panics
    /// If an input is missing from `inputs`.
    pub fn evaluate<S: Scalar>(&self, inputs: &[S], fused: impl Fn(S, S, S) -> S) -> Vec<S> {
        let mut values = vec![S::zero(); self.width()];
        for (id, op, _) in &self.steps {
            let get = |o: Operand| match o {
                Operand::Const(bits) => S::constant(f64::from_bits(bits)),
                Operand::Node(k) => values[k as usize],
            };
            let signed = |x: S, minus: bool| if minus { -x } else { x };
            let value = match *op {
                Op::Input(k) => inputs[k as usize],
                Op::Add(a, b) => get(a) + get(b),
                Op::Sub(a, b) => get(a) - get(b),
                Op::Mul(a, b) => get(a) * get(b),
                Op::Div(a, b) => get(a) / get(b),
                Op::Fma(f) => fused(signed(get(f.a), f.minus_product), get(f.b), signed(get(f.c), f.minus_addend)),
                Op::ReciprocalAbove(p) => {
                    signed(get(p.value), p.minus_value).reciprocal_above(signed(get(p.floor), p.minus_floor))
                }
                #[cfg(feature = "height_fields")]
                Op::LookUp(look) => {
                    signed(values[look.at as usize], look.minus).look_up(look.table.0, look.offset as usize)
                }
                Op::Sqrt(a) => values[a as usize].sqrt(),
                Op::Sin(a) => values[a as usize].sin_cos().0,
                Op::Cos(a) => values[a as usize].sin_cos().1,
            };
            values[*id as usize] = value;
        }
        let result = |output: &ProgramResult| match *output {
            ProgramResult::Const(x) => S::constant(x),
            ProgramResult::Node(id, true) => -values[id as usize],
            ProgramResult::Node(id, false) => values[id as usize],
        };
        self.outputs.iter().map(result).collect()
    }
}

//! The head of every function, and the writer of statements for every body.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::numbers::{literal, minus, signed};
use super::signature::{Port, Signature};
use crate::options::{AngleRange, Arithmetic, Options};
use crate::output::{locate, InputArray};
use crate::symbolic::{FlooredReciprocal, Fma, Op, Operand, ProgramResult};

/// Largest number of statements of a function that is inlined, so that small kernels become part of the caller's loop.
const INLINED: usize = 300;

/// Number of statements from which on a function for one state is compiled for AVX-512 as well. Measured on AMD (Zen 4) and Intel
/// (Sapphire Rapids): a humanoid takes 0.79 and 0.72 of its time without, a rolled chain of 100 0.79 and 0.83, a Stewart platform 0.94
/// and 0.98; a quadruped 0.93 and 1.33, an arm of 7 joints 0.97 and 1.37.
const LONG: usize = 3000;

/// A function and its kernel before their bodies are written.
pub struct Head<'a> {
    /// Options of the generator.
    pub options: &'a Options,
    /// Number of the kernel.
    pub id: usize,
    /// The function.
    pub signature: &'a Signature,
    /// Arrays that the kernel reads and writes.
    pub ports: &'a [Port],
    /// Arrays of the program's inputs.
    pub inputs: &'a [InputArray],
}

impl<'a> Head<'a> {
    /// Whether the kernel uses the best arithmetic of the target; otherwise it gives the same bits everywhere.
    fn chooses(&self) -> bool {
        self.options.arithmetic == Arithmetic::Fast
    }

    /// Arithmetic of sines and cosines.
    pub fn arithmetic(&self) -> String {
        match self.chooses() {
            true => "A".to_string(),
            false => format!("{}::kernel::Plain", self.options.runtime),
        }
    }

    /// Writes the function, and the first line of its kernel.
    pub fn write(&self, out: &mut String, statements: usize) {
        let (rt, id, name) = (&self.options.runtime, self.id, &self.signature.name);
        let public = if self.signature.public { "pub " } else { "" };
        if statements <= INLINED {
            let _ = writeln!(out, "    #[inline]");
        }
        let _ = writeln!(out, "    {public}fn {} {{", self.signature.declaration(rt, self.options.precision.name()));
        let arguments: Vec<String> = self.ports.iter().map(Port::argument).collect();
        let (way, long) = match (self.chooses(), statements >= LONG) {
            (true, true) => ("call_long", ""),
            (true, false) => ("call", ""),
            (false, true) => ("call_exact", ", true"),
            (false, false) => ("call_exact", ", false"),
        };
        let call = match self.chooses() || statements > INLINED {
            true => format!("{rt}::kernel::{way}::<Self, {id}{long}, _>({})", tuple(&arguments)),
            false => format!("Self::{name}_kernel::<{rt}::kernel::Plain, 1>({})", arguments.join(", ")),
        };
        let _ = writeln!(out, "{}    }}", self.signature.body(rt, "0.0", &call));
        let parameters = self.parameters();
        let _ = writeln!(out, "\n    #[inline(always)]");
        let _ = writeln!(out, "    fn {name}_kernel<A: {rt}::kernel::Arithmetic, const LANES: usize>({parameters}) {{");
    }

    /// Parameters of the kernel.
    pub fn parameters(&self) -> String {
        let (rt, number) = (&self.options.runtime, self.options.precision.name());
        self.ports.iter().map(|p| p.parameter(rt, number)).collect::<Vec<_>>().join(", ")
    }

    /// Local arrays of the kernel, one for each of `n` numbers: the compiler does not take a large array apart after it has made
    /// vectors of lanes or branches, but keeps the numbers of small ones in registers. (Of rolled code for one state the
    /// opposite was measured.)
    pub fn locals(&self, out: &mut String, indent: &str, name: &str, n: usize) {
        for k in 0..n {
            let _ = writeln!(out, "{indent}let mut {name}_{k} = [0.0; LANES];");
        }
    }

    /// A local array of the kernel with a row for each of `n` numbers.
    pub fn rows(&self, n: usize) -> String {
        format!("{}::kernel::Rows([[0.0; LANES]; {n}])", self.options.runtime)
    }

    /// Places of the results in order: port and number in it.
    pub fn places(&self) -> Vec<(&'a str, usize)> {
        let places = self.ports.iter().filter(|p| p.written());
        places.flat_map(|p| (0..p.dims.iter().product()).map(move |k: usize| (p.name, k))).collect()
    }

    /// An input as the kernel reads it, in lane `lane`; the number may be a term to be added.
    pub fn input(&self, k: usize, more: &str, lane: &str) -> String {
        let (array, k) = locate(self.inputs, k);
        format!("{}.get({k}{more}, {lane})", array.name)
    }

    /// `let` of a sine and a cosine of one angle.
    pub fn sine_and_cosine(&self, [sine, cosine]: [&str; 2], angle: &str) -> String {
        format!("let ({sine}, {cosine}) = {}<{}>({angle});", self.trigonometry("pair"), self.arithmetic())
    }

    /// Sines and cosines of `n` angles in every lane.
    pub fn sines_and_cosines(&self, angles: &str, n: usize) -> String {
        format!("{}<{}, LANES, {n}>(&{angles})", self.trigonometry("pairs"), self.arithmetic())
    }

    /// Path of the function for sines and cosines of one angle or several, for the angles that the code is for.
    fn trigonometry(&self, name: &str) -> String {
        let bounded = match self.options.angles {
            AngleRange::Any => "",
            AngleRange::Bounded => "bounded_",
        };
        format!("{}::trig::{bounded}{name}_{}::", self.options.runtime, self.options.precision.name())
    }

    /// Right-hand side of an operation; inputs, sines and cosines are written by the caller.
    pub fn expression(&self, op: &Op, names: &BTreeMap<u32, String>) -> String {
        let text = |o: &Operand| match o {
            Operand::Const(bits) => literal(f64::from_bits(*bits), self.options.precision),
            Operand::Node(id) => names[id].clone(),
        };
        match op {
            Op::Add(a, b) => format!("{} + {}", text(a), text(b)),
            Op::Sub(a, b) => format!("{} - {}", text(a), text(b)),
            Op::Mul(a, b) => format!("{} * {}", text(a), text(b)),
            Op::Div(a, b) => format!("{} / {}", text(a), text(b)),
            Op::Fma(Fma { a, b, c, minus_product, minus_addend }) => {
                let (a, b, c) = (text(a), text(b), text(c));
                let number = self.options.precision.name();
                format!("A::fma_{number}({}{a}, {b}, {}{c})", minus(*minus_product), minus(*minus_addend))
            }
            Op::ReciprocalAbove(FlooredReciprocal { value, floor, minus_value, minus_floor }) => {
                let (value, floor) = (text(value), text(floor));
                let (rt, v, f) = (&self.options.runtime, minus(*minus_value), minus(*minus_floor));
                format!("{rt}::Scalar::reciprocal_above({v}{value}, {f}{floor})")
            }
            #[cfg(feature = "height_fields")]
            Op::LookUp(crate::symbolic::LookUp { at, minus: negative, table, offset }) => {
                let (rt, sign, name) = (&self.options.runtime, minus(*negative), super::constants::table(table.0));
                format!("{rt}::Scalar::look_up({sign}{}, Self::{name}, {offset})", names[at])
            }
            Op::Sqrt(a) => format!("{}::Scalar::sqrt({})", self.options.runtime, names[a]),
            Op::Input(_) | Op::Sin(_) | Op::Cos(_) => unreachable!("written by the caller"),
        }
    }

    /// A result of a program as it is written.
    pub fn value(&self, result: &ProgramResult, names: &BTreeMap<u32, String>) -> String {
        match result {
            ProgramResult::Const(x) => signed(*x, self.options.precision),
            ProgramResult::Node(id, neg) => format!("{}{}", minus(*neg), names[id]),
        }
    }
}

/// A tuple of any length.
pub fn tuple(items: &[String]) -> String {
    items.iter().fold("(".to_string(), |all, item| format!("{all}{item}, ")).trim_end().to_string() + ")"
}

/// `operations: additions, multiplications, divisions`, and the operations that are counted separately.
pub fn count_line(c: &crate::symbolic::Counts) -> Option<String> {
    (c.total() + c.sincos + c.roots > 0).then(|| {
        format!(
            "{} operations: {} additions, {} multiplications, {} divisions; apart: {} square roots, {} sine-cosine pairs.",
            c.total(),
            c.additions,
            c.multiplications,
            c.divisions,
            c.roots,
            c.sincos
        )
    })
}

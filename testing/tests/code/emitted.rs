//! Runs emitted Rust without compiling it: the source text is read, lowered, and run.
//!
//! Only the kernels run here, for one lane and in exact arithmetic; `testing/compiled` tests the functions around them, and
//! lanes. The emitted language is small:
//!
//! - `let` of a sum, a difference, a product, a quotient, a root, a guarded reciprocal, or of one number with its sign;
//!   the numbers are names, literals, and items of arrays at constant places;
//! - `let` of a sine and a cosine, of all sines and all cosines, of an array, of the names that a block defines;
//! - assignments to items of arrays, results that are given away, loops over lanes.
//!
//! Anything else panics, and so does a name that is visible already where it is defined, although Rust would allow
//! that.

mod lower;
mod trees;

use std::collections::HashMap;

use mbd_runtime::trig::sincos_f64;

/// A number, and whether its sign is changed. Locals and arrays are given by their indices in the function.
struct Operand {
    negative: bool,
    number: Number,
}

enum Number {
    Literal(f64),
    Local(usize),
    /// An item of an array: indices of the array and of the item.
    Item(usize, usize),
}

enum Expression {
    One(Operand),
    Sum([Operand; 2]),
    Difference([Operand; 2]),
    Product([Operand; 2]),
    Quotient([Operand; 2]),
    Root(Operand),
    /// The reciprocal `1 / a` if `a` is above `b`, else zero.
    ReciprocalAbove([Operand; 2]),
}

enum Step {
    Let(usize, Expression),
    SinCos([Option<usize>; 2], Expression),
    Set(usize, usize, Expression),
    /// The next result of an argument: an item of an array.
    Give(usize, usize, usize),
    /// Arrays of sines and cosines of an array of angles.
    AllSines([usize; 2], usize),
}

/// Role of an array in a kernel.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Read,
    Written,
    /// A local array that is filled item by item, of this length.
    Filled(usize),
    /// Sines or cosines of that many angles.
    Computed(usize),
}

/// A lowered kernel.
#[derive(Default)]
struct Function {
    arrays: Vec<(String, Role)>,
    locals: usize,
    steps: Vec<Step>,
}

/// The functions of an emitted `impl`.
pub struct Emitted {
    functions: HashMap<String, Function>,
}

impl Emitted {
    /// Reads the source.
    pub fn parse(source: &str) -> Emitted {
        let mut functions = HashMap::new();
        for (name, function) in lower::kernels(&trees::trees(source)) {
            assert!(functions.insert(name.to_string(), function).is_none(), "{name} is emitted twice");
        }
        Emitted { functions }
    }

    /// Runs a kernel. Inputs are flat arrays by the names of the arguments (`q`, `tau`); outputs are arrays by the
    /// names of the `&mut` arguments.
    pub fn run(&self, name: &str, inputs: &HashMap<&'static str, &[f64]>) -> HashMap<String, Vec<f64>> {
        let f = &self.functions[name];
        // Local arrays and locals start with NaN, so that a read before the write shows. Results are written in order:
        // their arrays grow, because the text does not contain their lengths.
        let array = |(array, role): &(String, Role)| match *role {
            Role::Read => inputs.get(array.as_str()).unwrap_or_else(|| panic!("{name} reads {array}")).to_vec(),
            Role::Filled(n) | Role::Computed(n) => vec![f64::NAN; n],
            Role::Written => Vec::new(),
        };
        let mut arrays: Vec<Vec<f64>> = f.arrays.iter().map(array).collect();
        let mut locals = vec![f64::NAN; f.locals];
        for step in &f.steps {
            match step {
                Step::Let(to, x) => locals[*to] = x.value(&locals, &arrays),
                Step::SinCos(to, x) => {
                    let (s, c) = sincos_f64(x.value(&locals, &arrays));
                    for (to, x) in to.iter().zip([s, c]) {
                        to.iter().for_each(|to| locals[*to] = x);
                    }
                }
                Step::Set(to, k, x) => arrays[*to][*k] = x.value(&locals, &arrays),
                Step::Give(to, from, k) => {
                    let x = arrays[*from][*k];
                    arrays[*to].push(x);
                }
                Step::AllSines(to, from) => {
                    let pairs: Vec<(f64, f64)> = arrays[*from].iter().map(|x| sincos_f64(*x)).collect();
                    arrays[to[0]] = pairs.iter().map(|p| p.0).collect();
                    arrays[to[1]] = pairs.iter().map(|p| p.1).collect();
                }
            }
        }
        let results = f.arrays.iter().zip(arrays).filter(|((_, role), _)| *role == Role::Written);
        results.map(|((name, _), array)| (name.clone(), array)).collect()
    }
}

impl Expression {
    fn value(&self, locals: &[f64], arrays: &[Vec<f64>]) -> f64 {
        let of = |x: &Operand| {
            let number = match x.number {
                Number::Literal(x) => x,
                Number::Local(k) => locals[k],
                Number::Item(array, k) => arrays[array][k],
            };
            if x.negative {
                -number
            } else {
                number
            }
        };
        match self {
            Expression::One(a) => of(a),
            Expression::Sum([a, b]) => of(a) + of(b),
            Expression::Difference([a, b]) => of(a) - of(b),
            Expression::Product([a, b]) => of(a) * of(b),
            Expression::Quotient([a, b]) => of(a) / of(b),
            Expression::Root(a) => mbd_runtime::Scalar::sqrt(of(a)),
            Expression::ReciprocalAbove([a, b]) => mbd_runtime::Scalar::reciprocal_above(of(a), of(b)),
        }
    }
}

//! Machine code in memory, and its calls.
//!
//! The only `unsafe` code of the generator is in this file. It is sound for these reasons:
//! - A function is called only through [`MachineCode::call`] and [`MachineCode::call_lean`], which compare the length of every
//!   slice with that of the array of which the code was made, times the number of states that it computes at once. The code
//!   reads and writes at constant places inside these arrays, in tables that the function owns, and in working memory whose length is
//!   compared too. Tables and working memory begin at multiples of 64 bytes, as aligned loads and stores of vectors want.
//! - Tables of height fields are read too, at places that the code bounds by their lengths. They stay where they are until the
//!   program ends.
//! - Input slices are shared and result slices are exclusive references, so that the code's loads and stores do not
//!   meet those of others.
//! - The memory of the code lives as long as the function and is never changed after it was made, so that any number of
//!   threads may call it.
//! - The functions for sines and cosines are called by this code alone, with parts of the working memory.
//! - Code that is not Cranelift's is made only where the processor has its instructions. It gives the registers that belong
//!   to its caller back as they were.
//! - The tables of addresses may have places that are not written: the code reads only those of arrays with entries.
#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::mem::MaybeUninit;

use cranelift::codegen::ir::{Function, UserFuncName};
use cranelift::codegen::Context;
use cranelift::jit::{JITBuilder, JITModule};
use cranelift::module::{default_libcall_names, Linkage, Module};
use cranelift::prelude::*;

use super::instructions::{input_places, width, write, Shape, ARGUMENTS, BLOCK, INPUTS, PARAMETERS};
use super::vectors::{self, Width};
use super::{CompileError, Compiled};
use crate::code::Code;
use crate::lower::{is_together, table, Memory, Spills};
use crate::options::{Arithmetic, Precision};
use crate::output::OutputProgram;
use crate::rolled::RolledProgram;
use mbd_runtime::contact::ColumnsOf;
use mbd_runtime::kernel::{level, Level};
use mbd_runtime::system::Real;
use mbd_runtime::{trig, Packed};

/// The most result arrays that a function has.
pub const RESULTS: usize = 6;

/// Values of straight-line code that are in registers at a time. The processors have 16 or 32 for numbers, of which an
/// instruction needs one or two more.
const REGISTERS: usize = 13;

/// Computes sines and cosines of `n` angles, a multiple of [`BLOCK`].
type Sines<S> = unsafe extern "C" fn(*const S, usize, *mut S, *mut S);

/// Code of a function: addresses of the input arrays, of the result arrays, and of the working memory. It returns 0, or
/// another number if it gave up.
type Entry<S> = unsafe extern "C" fn(*const *const S, *const *mut S, *mut S) -> u32;

/// A number type that machine code can compute with: `f64` or `f32`.
pub trait Number: Real + Default + Send + Sync + 'static + sealed::Sealed {
    /// The option that stands for it.
    const PRECISION: Precision;
}

mod sealed {
    use super::*;

    pub trait Sealed: Sized {
        /// With plain products and sums, and with the best arithmetic of the processor.
        const SINES: [Sines<Self>; 2];

        /// Velocities of several momenta at one state: `Reducible::project_several`.
        fn project_several(of: &mut Compiled<Self>, q: &[Self], columns: &mut ColumnsOf<Self>) -> bool
        where
            Self: Number;
    }
}

macro_rules! number {
    ($float:ident, $precision:ident, $lanes:path, $slice:path, $several:expr) => {
        impl Number for $float {
            const PRECISION: Precision = Precision::$precision;
        }

        impl sealed::Sealed for $float {
            const SINES: [Sines<$float>; 2] = {
                unsafe extern "C" fn plain(angles: *const $float, n: usize, sin: *mut $float, cos: *mut $float) {
                    // SAFETY: the code calls with three parts of its working memory that do not overlap.
                    let (angles, sin, cos) = unsafe { parts(angles, n, sin, cos) };
                    let (sin, cos) = (sin.as_chunks_mut().0, cos.as_chunks_mut().0);
                    for ((angles, sin), cos) in angles.as_chunks::<BLOCK>().0.iter().zip(sin).zip(cos) {
                        (*sin, *cos) = $lanes(*angles);
                    }
                }
                unsafe extern "C" fn best(angles: *const $float, n: usize, sin: *mut $float, cos: *mut $float) {
                    // SAFETY: as above.
                    let (angles, sin, cos) = unsafe { parts(angles, n, sin, cos) };
                    $slice(angles, sin, cos);
                }
                [plain, best]
            };

            fn project_several(of: &mut Compiled<$float>, q: &[$float], columns: &mut ColumnsOf<$float>) -> bool {
                $several(of, q, columns)
            }
        }
    };
}

/// The slices behind the addresses.
///
/// # Safety
/// Each address is that of `n` numbers, and they do not overlap.
unsafe fn parts<'a, S>(x: *const S, n: usize, sin: *mut S, cos: *mut S) -> (&'a [S], &'a mut [S], &'a mut [S]) {
    use std::slice::{from_raw_parts, from_raw_parts_mut};
    // SAFETY: as the caller promises.
    unsafe { (from_raw_parts(x, n), from_raw_parts_mut(sin, n), from_raw_parts_mut(cos, n)) }
}

number!(f64, F64, trig::sincos_lanes_f64, trig::sincos_slice_f64, Compiled::columns_in_lanes);
number!(f32, F32, trig::sincos_lanes_f32, trig::sincos_slice_f32, |_, _, _| false);

/// The machine code of one output.
pub struct MachineCode<S> {
    /// Owns the code; `None` only while it is dropped.
    module: Option<JITModule>,
    entry: Entry<S>,
    /// Lengths of the input arrays; those that it does not have are empty.
    inputs: [usize; INPUTS],
    /// Whether fields other than the first one are among them.
    more: bool,
    /// Whether fields other than the first one and the parameters are among them.
    others: bool,
    /// Number and lengths of the result arrays; those that it does not have are empty.
    results: (usize, [usize; RESULTS]),
    /// Length of the working memory.
    scratch: usize,
    /// Length of the code, bytes.
    size: usize,
    /// Owns the constants and tables that the code reads.
    _constants: Box<[S]>,
    /// The first of them, at an address that vectors may have.
    numbers: *const S,
}

/// The input arrays of a call.
pub trait Inputs<S> {
    /// The arguments, and the first field.
    fn first(&self) -> [&[S]; ARGUMENTS + 1];

    /// The other fields.
    fn more(&self) -> [&[S]; INPUTS - ARGUMENTS - 1];
}

impl<S> Inputs<S> for [&[S]; INPUTS] {
    #[inline]
    fn first(&self) -> [&[S]; ARGUMENTS + 1] {
        std::array::from_fn(|k| self[k])
    }

    #[inline]
    fn more(&self) -> [&[S]; INPUTS - ARGUMENTS - 1] {
        std::array::from_fn(|k| self[ARGUMENTS + 1 + k])
    }
}

/// Tables and working memory begin where lines of the cache do, so that no vector lies in two of them.
const LINE: usize = 64;

/// The most entries before such an address, and one more.
const fn padding<S>() -> usize {
    LINE / size_of::<S>()
}

/// Entries before the first such address.
#[inline]
fn before_aligned<S>(at: *const S) -> usize {
    // Numbers are aligned to their own size, which divides that of a line.
    (at as usize).wrapping_neg() % LINE / size_of::<S>()
}

/// The first address of the working memory that vectors may have; its length includes what is skipped.
#[inline(always)]
fn aligned<S>(scratch: &mut [S]) -> *mut S {
    scratch.as_mut_ptr().wrapping_add(before_aligned(scratch.as_ptr()))
}

// SAFETY: the module is not touched before it is dropped, the code has no state of its own, and its constants do not change.
unsafe impl<S> Send for MachineCode<S> {}
// SAFETY: the same.
unsafe impl<S> Sync for MachineCode<S> {}

impl<S: Number> MachineCode<S> {
    /// Compiles a program whose results fill arrays of the lengths `results`, for one state or for `lanes` states at once:
    /// two, or as many as [`Width::of_lanes`] knows. All arrays then have that many numbers side by side for each entry.
    ///
    /// # Errors
    /// [`CompileError::Machine`] with Cranelift's words.
    pub fn new(
        program: &OutputProgram<Code>,
        results: Vec<usize>,
        arithmetic: Arithmetic,
        lanes: usize,
    ) -> Result<Self, CompileError> {
        let fast = arithmetic == Arithmetic::Fast;
        let fused = fast && level() > Level::Plain;
        let mut module = compiler(&program.program)?;
        let mut signature = of_addresses(&module, 3);
        signature.returns.push(AbiParam::new(types::I32));
        let id = module.declare_function(program.spec.name, Linkage::Local, &signature);
        let id = id.map_err(CompileError::machine)?;
        let own = Width::of_lanes(lanes).filter(|_| S::PRECISION == Precision::F64);
        // Cranelift has the instructions that find an entry of a table.
        #[cfg(feature = "height_fields")]
        let own = own.filter(|_| lanes > 1 || !program.program.looks_up());
        let body = match own {
            Some(width) => {
                let sines = S::SINES[usize::from(fast)] as usize as u64;
                let written = vectors::compile(program, &results, fused, width, sines)
                    .ok_or_else(|| CompileError::machine("the code is too long for vectors, or looks numbers up"))?;
                module.define_function_bytes(id, 64, &written.bytes, &[]).map_err(CompileError::machine)?;
                Body { scratch: written.scratch, size: written.bytes.len(), numbers: written.numbers }
            }
            None => {
                let constants: BTreeMap<u64, usize> =
                    program.program.constants().into_iter().enumerate().map(|(at, bits)| (bits, at)).collect();
                let width = width(S::PRECISION, lanes);
                let mut numbers: Vec<f64> = constants.keys().map(|bits| f64::from_bits(*bits)).collect();
                let mut tables = Vec::new();
                let lanes_of_vector = 16 / S::PRECISION.bytes();
                let align =
                    |numbers: &mut Vec<f64>| numbers.resize(numbers.len().next_multiple_of(lanes_of_vector), 0.0);
                align(&mut numbers);
                if let Code::Rolled(rolled) = &program.program {
                    let together = is_together(rolled, width).then_some(width);
                    for run in &rolled.loops {
                        tables.push(numbers.len());
                        numbers.extend(table(run, together));
                    }
                }
                align(&mut numbers);
                let spills = Spills::of(&program.program, REGISTERS, width);
                let memory = Memory::new(&program.program, &spills, BLOCK, width);
                let shape = Shape {
                    precision: S::PRECISION,
                    lanes,
                    address: module.target_config().pointer_type(),
                    fused,
                    results: &results,
                    memory: &memory,
                    spills: &spills,
                    constants: &constants,
                    tables: &tables,
                    vectors: numbers.len(),
                    sines: (of_addresses(&module, 4), S::SINES[usize::from(fast)] as usize),
                };
                let mut function = Function::with_name_signature(UserFuncName::user(0, id.as_u32()), signature);
                let vectors = write(&mut function, program, &shape);
                numbers.extend(vectors.iter().flat_map(|bits| vec![f64::from_bits(*bits); lanes_of_vector]));
                let mut context = Context::for_function(function);
                module.define_function(id, &mut context).map_err(CompileError::machine)?;
                let size = context.compiled_code().map_or(0, |code| code.code_info().total_size as usize);
                Body { scratch: memory.len(), size, numbers }
            }
        };
        let mut constants = vec![S::zero(); padding::<S>() + body.numbers.len()].into_boxed_slice();
        let first = before_aligned(constants.as_ptr());
        for (to, from) in constants[first..].iter_mut().zip(body.numbers) {
            *to = S::constant(from);
        }
        module.finalize_definitions().map_err(CompileError::machine)?;
        let code = module.get_finalized_function(id);
        // SAFETY: the function was made with this signature, for the calling convention of the host.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry<S>>(code) };
        let mut inputs = [0; INPUTS];
        for (array, place) in program.inputs.iter().zip(input_places(&program.inputs)) {
            inputs[place] = lanes * array.len();
        }
        let mut read = (ARGUMENTS + 1..INPUTS).filter(|place| inputs[*place] > 0);
        let more = read.clone().next().is_some();
        let others = read.any(|place| place != PARAMETERS);
        let mut lengths = [0; RESULTS];
        lengths.iter_mut().zip(&results).for_each(|(to, len)| *to = lanes * len);
        let results = (results.len(), lengths);
        Ok(MachineCode {
            module: Some(module),
            entry,
            inputs,
            more,
            others,
            results,
            scratch: lanes * body.scratch + padding::<S>(),
            size: body.size,
            numbers: constants[first..].as_ptr(),
            _constants: constants,
        })
    }

    /// Length of the code, bytes.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of results.
    pub fn results(&self) -> usize {
        self.results.0
    }

    /// Length of the working memory that a call needs.
    pub fn scratch(&self) -> usize {
        self.scratch
    }

    /// Whether the code reads fields other than the first one.
    #[inline]
    pub fn reads_more(&self) -> bool {
        self.more
    }

    /// Whether gravity, the last of the fields, is an input.
    #[inline]
    pub fn reads_gravity(&self) -> bool {
        self.inputs[INPUTS - 1] > 0
    }

    /// Runs the code. Returns whether it computed the results: code for several states gives up where an angle is beyond the
    /// range of the main path of sine and cosine.
    ///
    /// # Panics
    /// If a slice has another length than its array, or the working memory is too short.
    #[inline(always)]
    pub fn call(&self, inputs: &impl Inputs<S>, results: &mut [&mut [S]], scratch: &mut [S]) -> bool {
        assert!(scratch.len() >= self.scratch, "the working memory is too short");
        // Nothing is read from the places that are not written.
        let mut read = [const { MaybeUninit::uninit() }; INPUTS + 1];
        read[INPUTS].write(self.numbers);
        let mut set = |first: usize, arrays: &[&[S]]| {
            for (k, array) in arrays.iter().enumerate() {
                let expected = self.inputs[first + k];
                assert!(array.len() == expected, "an input has {} entries, expected {expected}", array.len());
                read[first + k].write(array.as_ptr());
            }
        };
        set(0, &inputs.first());
        if self.more {
            set(ARGUMENTS + 1, &inputs.more());
        }
        let (count, lengths) = &self.results;
        assert!(results.len() == *count, "there are {} results, expected {count}", results.len());
        let mut written = [const { MaybeUninit::uninit() }; RESULTS];
        for ((to, result), len) in written.iter_mut().zip(results.iter_mut()).zip(lengths) {
            assert!(result.len() == *len, "a result has {} entries, expected {len}", result.len());
            to.write(result.as_mut_ptr());
        }
        // SAFETY: see the head of this file.
        unsafe { (self.entry)(read.as_ptr().cast(), written.as_ptr().cast(), aligned(scratch)) == 0 }
    }

    /// Runs code for one state that reads no other field than joint forces and parameters. Returns whether it did: not if it
    /// reads others, or a slice or the working memory has another length; [`call`](Self::call) tells which. A call of a small
    /// function takes as long as its code, so that there is one way out, and nothing is in memory before it but what the code
    /// reads.
    #[inline(always)]
    pub fn call_lean<const N: usize>(
        &self,
        arguments: [&[S]; ARGUMENTS],
        (tau, params): (&[S], &[S]),
        results: [&mut [S]; N],
        scratch: &mut [S],
    ) -> bool {
        let [a, b, c] = arguments;
        let inputs = [a, b, c, tau];
        let (count, lengths) = &self.results;
        let mut wrong = usize::from(self.others) | (N ^ count);
        if self.more {
            wrong |= params.len() ^ self.inputs[PARAMETERS];
        }
        for (array, len) in inputs.iter().zip(&self.inputs) {
            wrong |= array.len() ^ len;
        }
        for (result, len) in results.iter().zip(lengths) {
            wrong |= result.len() ^ len;
        }
        if wrong != 0 || scratch.len() < self.scratch {
            return false;
        }
        let mut read = [const { MaybeUninit::uninit() }; INPUTS + 1];
        for (to, array) in read.iter_mut().zip(inputs) {
            to.write(array.as_ptr());
        }
        if self.more {
            read[PARAMETERS].write(params.as_ptr());
        }
        read[INPUTS].write(self.numbers);
        let written = results.map(<[S]>::as_mut_ptr);
        let scratch = aligned(scratch);
        // SAFETY: see the head of this file. Code for one state never gives up.
        unsafe { (self.entry)(read.as_ptr().cast(), written.as_ptr(), scratch) };
        true
    }
}

/// Numbers of several states as they are in memory.
pub fn numbers<const L: usize>(x: &[Packed<L>]) -> &[f64] {
    // SAFETY: `Packed<L>` is `[f64; L]` in memory (`repr(transparent)`).
    unsafe { std::slice::from_raw_parts(x.as_ptr().cast(), L * x.len()) }
}

/// The same, to be written.
pub fn numbers_mut<const L: usize>(x: &mut [Packed<L>]) -> &mut [f64] {
    // SAFETY: the same.
    unsafe { std::slice::from_raw_parts_mut(x.as_mut_ptr().cast(), L * x.len()) }
}

/// What the body of a function needs: entries of working memory, constants and tables; and its length, bytes.
struct Body {
    scratch: usize,
    size: usize,
    numbers: Vec<f64>,
}

/// The signature of a function of so many addresses.
fn of_addresses(module: &JITModule, parameters: usize) -> Signature {
    let target = module.target_config();
    let mut signature = Signature::new(target.default_call_conv);
    signature.params = vec![AbiParam::new(target.pointer_type()); parameters];
    signature
}

/// A compiler for some code on this processor.
fn compiler(code: &Code) -> Result<JITModule, CompileError> {
    let mut flags = settings::builder();
    // Straight-line code is optimised already, and its order decides what stays in registers.
    let loops = |program: &RolledProgram| program.loops.iter().any(|run| run.branches.is_empty());
    let optimisation = if matches!(code, Code::Rolled(program) if loops(program)) { "speed" } else { "none" };
    for (name, value) in [("opt_level", optimisation), ("enable_verifier", "false"), ("is_pic", "false")] {
        flags.set(name, value).map_err(CompileError::machine)?;
    }
    let isa = cranelift::native::builder().map_err(CompileError::machine)?;
    let isa = isa.finish(settings::Flags::new(flags)).map_err(CompileError::machine)?;
    Ok(JITModule::new(JITBuilder::with_isa(isa, default_libcall_names())))
}

impl<S> Drop for MachineCode<S> {
    fn drop(&mut self) {
        if let Some(module) = self.module.take() {
            // SAFETY: nobody can call the code any more, because the function is being dropped.
            unsafe { module.free_memory() };
        }
    }
}

impl<S> std::fmt::Debug for MachineCode<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MachineCode")
            .field("inputs", &self.inputs)
            .field("results", &self.results)
            .finish_non_exhaustive()
    }
}

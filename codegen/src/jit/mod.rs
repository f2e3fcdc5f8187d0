//! Machine code at run time, for models that are known at run time only (feature `jit`).
//!
//! The programs are those of generated Rust. Machine code of them is made in milliseconds, without a compiler on the
//! machine: on x86-64 processors with AVX2 and FMA and in double precision by this crate itself, elsewhere by Cranelift. With
//! [`Arithmetic::Exact`](crate::options::Arithmetic::Exact) the code gives the bits of the interpreter in double precision, up
//! to the sign of zero.
//!
//! ```
//! use mbd_codegen::jit::Compiled;
//! use mbd_codegen::options::Options;
//! use mbd_codegen::read::{self, ImportOptions};
//! use mbd_runtime::system::{Conjugate, Energetic, System};
//!
//! let text = include_str!("../../../models/double_pendulum.toml");
//! let model = read::model("double_pendulum.toml", text, &ImportOptions::default())?.model;
//! let mut pendulum = Compiled::<f64>::new(&model, &Options::default())?;
//! let (mut q, mut p) = (pendulum.neutral(), pendulum.zero_momenta());
//! q[0] = 0.5;
//! pendulum.conjugate_momenta(&q, &vec![1.0, 0.0], &mut p);
//! let (kinetic, potential) = pendulum.energies(&q, &p);
//! assert!(kinetic > 0.0 && potential != 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod columns;
mod compiled;
mod drives;
mod error;
mod functions;
mod given;
mod instructions;
mod interpreted;
mod lanes;
mod memory;
mod traits;
mod vectors;

pub use compiled::Compiled;
pub use drives::{Drives, SampledDrives};
pub use error::CompileError;
pub use lanes::{best_lanes, CompiledLanes};
pub use memory::Number;

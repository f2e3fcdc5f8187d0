//! Symbolic code generator for multibody dynamics in Hamilton's canonical form.
//!
#![doc = include_str!("guide.md")]
//!
//! # Features
//! | feature | default | adds |
//! | --- | --- | --- |
//! | `macros` | yes | the macro [`mbd_model!`]; the generator runs in the compiler and is no part of the program |
//! | `std` | yes | generated code uses what the processor turns out to have (AVX2, FMA, AVX-512) |
//! | `codegen` | no | the module `codegen`: readers, checks and generator as a library, for build scripts and the interpreter |
//! | `jit` | no | `codegen::jit`: machine code made at run time of models that are known at run time only |
//! | `wasm` | no | `codegen::wasm`: WebAssembly with a JavaScript wrapper |
//! | `rayon` | no | batches of states on several threads |
//! | `diffsol` | no | the module `diffsol`: the stiff methods of the crate of that name |

#[cfg(feature = "diffsol")]
pub mod diffsol;
pub mod prelude;

#[cfg(feature = "codegen")]
pub use mbd_codegen as codegen;
#[cfg(feature = "macros")]
#[doc(hidden)]
pub use mbd_macros as macros;
pub use mbd_runtime as runtime;

/// Makes a type from the description of a mechanism.
///
/// ```
/// use multibody::runtime::integrate::{Rk4, Stepper};
/// use multibody::runtime::System;
///
/// multibody::mbd_model! {
///     path = "models/ur5.urdf",
///     name = Ur5,
/// }
///
/// // The arm stretched out level, at rest, falling for a tenth of a second.
/// let mut arm = Ur5::new();
/// let (mut q, mut p) = (arm.neutral(), arm.zero_momenta());
/// let [kinetic, potential] = arm.energy(&q, &p);
/// let before = kinetic + potential;
/// let mut rk4 = Rk4::new(&arm);
/// for k in 0..100 {
///     rk4.step(&mut arm, f64::from(k) * 1e-3, 1e-3, &mut q, &mut p)?;
/// }
/// assert!(q[Ur5::Q_SHOULDER_LIFT_JOINT] > 0.04);
/// let [kinetic, potential] = arm.energy(&q, &p);
/// assert!(kinetic > 1.0);
/// assert!((kinetic + potential - before).abs() < 1e-6);
/// # Ok::<(), multibody::runtime::integrate::StepError>(())
/// ```
///
#[doc = include_str!("../book/src/macro.md")]
///
#[doc = include_str!("../book/src/outputs.md")]
#[cfg(feature = "macros")]
#[macro_export]
macro_rules! mbd_model {
    ($($argument:tt)*) => {
        $crate::macros::mbd_model! { runtime = $crate::runtime, $($argument)* }
    };
}

/// The programs of the book compile and run.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../book/src/first-mechanism.md")]
    struct FirstMechanism;
    #[doc = include_str!("../book/src/robot.md")]
    struct Robot;
    #[doc = include_str!("../book/src/first-loop.md")]
    struct FirstLoop;
    #[doc = include_str!("../book/src/integrators.md")]
    struct Integrators;
    #[doc = include_str!("../book/src/constraints.md")]
    struct Constraints;
    #[doc = include_str!("../book/src/contacts.md")]
    struct Contacts;
    #[doc = include_str!("../book/src/derivatives.md")]
    struct Derivatives;
    #[doc = include_str!("../book/src/variants.md")]
    struct Variants;
    #[doc = include_str!("../book/src/lanes.md")]
    struct Lanes;
}

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
/// # Arguments
/// `path` and `name` have to be given, the others have defaults.
///
/// | argument | meaning | default |
/// | --- | --- | --- |
/// | `path = "models/arm.urdf"` | the description, a `.toml`, `.urdf` or `.xml` (MJCF) file; relative to the folder of `Cargo.toml` | |
/// | `toml = r#"..."#`, `urdf = r#"..."#`, `mjcf = r#"..."#` | instead of `path`: the description itself | |
/// | `name = Arm` | the type; attributes and a narrower visibility may stand before it: `pub(crate) Arm` | `pub` |
/// | `outputs = [rates, energy]` | what to compute, of the outputs below | `[rates, momenta, energy]`, and what only mechanisms with loops or couplings have where there are some |
/// | `scalar = f32` | numbers: `f64` or `f32` | `f64` |
/// | `arithmetic = exact` | `exact`: the interpreter's operations, bit for bit; `fast`: rewritten for speed | `fast` |
/// | `elimination = fewest` | how joints are eliminated: `fastest` by the cost model, with the `fewest` operations, or each joint by itself, `single` | `fastest` |
/// | `rolled = never` | loops over like links: where they gain (`auto`), wherever links repeat (`always`), or `never` | `auto` |
/// | `branches = apart` | like branches (legs, arms) at the same time for one state: where that is faster (`auto`), wherever there are any (`together`), or nowhere (`apart`) | `auto` |
/// | `rows = passes` | rows of loops and couplings are eliminated in passes, so that their order does not matter wherever they become nearly dependent | `once` |
/// | `variant = "docked"` | a `[[variant]]` of the description in place of the model itself | |
/// | `from = Arm` | types of the same description from which states are carried over ([`TransferFrom`](runtime::TransferFrom)); a list names variants: `[Arm, "held": Held]` | none |
/// | `base = floating` | how the root of a URDF is attached to the ground: `fixed`, `floating` or `planar` | `fixed` |
/// | `gravity = [0.0, 0.0, -1.62]` | in ground axes, m/s², instead of that of the file | the file's; of URDF `[0, 0, -9.81]` |
/// | `efforts = false` | whether joint forces `tau` are inputs | `true` |
/// | `frames = [tool0, "left-foot"]` | frames and bodies of the outputs that have a result for each frame; asks for `frames` where none of them is named | all |
/// | `snap = 0.0` | angles this close to right angles become exact, rad | `1e-6` |
/// | `modes = recorded("robot.modes")` | code for the modes of contacts (`book/src/contacts.md`): `masked` for functions in which numbers say which contacts act; beside them functions for `all` sets of modes, for those of a file that `mbd simulate --record-modes` writes, or for those of a list, `["open open", "stick open"]` | contacts are no part of the code |
/// | `runtime = path::to::mbd_runtime` | the runtime crate | that of this crate |
///
#[doc = include_str!("../book/src/outputs.md")]
///
/// # What is made
/// A type `Arm` with `new()`, a function for each output, the constants `NQ` and `NV` (numbers of coordinates and of
/// velocities), names and indices of the coordinates (`Arm::Q_ELBOW`), and fields for what is given beside the state:
/// joint forces `tau`, prescribed motions, wrenches, parameters. With `rates` among the outputs it is a
/// [`System`](runtime::System) for the integrators. States are described in `book/src/model-format.md`.
///
/// The expansion needs no standard library. A crate without one depends on `mbd-macros` and on `mbd-runtime` with
/// `default-features = false` and calls `mbd_macros::mbd_model!`.
///
/// # Errors
/// Everything wrong with the file is reported at the path, with its place in the file; what is wrong with the
/// arguments, at the arguments. Warnings about the file are shown as uses of something deprecated, so
/// `#[allow(deprecated)]` on a module around the call silences them. The file is watched: a change compiles the type
/// anew.
///
/// Compile time grows with the model, in `cargo check` too. Large ones, more than some twenty velocities, are better
/// generated once into a file.
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
}

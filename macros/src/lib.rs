//! The `mbd_model!` macro.
//!
//! Depend on `multibody` and call `multibody::mbd_model!`, which is documented there, or, without the standard library,
//! on this crate and on `mbd-runtime` with `default-features = false`.

mod args;
mod expand;
mod literal;
mod message;
mod stub;

/// Makes a type from the description of a mechanism; `multibody::mbd_model!` says how.
///
/// The expansion names the runtime `::mbd_runtime` unless the argument `runtime` gives another path.
#[proc_macro]
pub fn mbd_model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    expand::expand(input.into()).into()
}

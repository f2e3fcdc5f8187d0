//! The `mbd_model!` macro.

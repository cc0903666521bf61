//! The interpreter as a library for C: `include/canter_interpreter.h` says how to link to it.

pub use plan::interp::ffi::*;

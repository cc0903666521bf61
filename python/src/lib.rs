//! The extension module `canter._canter` of the Python package `canter`.
//!
//! It hands arrays to the libraries and back, and is a client of engines that run by themselves. It
//! plans nothing by itself, moves nothing by itself, and never runs a servo period: the process that
//! moves an arm loads no interpreter. The package in `canter/` makes of it what its users see.
//!
//! Rust works without the interpreter's lock. Long calls look for Ctrl-C; no panic gets through.

mod arrays;
mod error;
mod kinematic;
mod link;
mod otg;
mod planning;
mod problem;
mod program;
mod robot;
mod smooth;
mod timing;
mod verify;
mod wait;

/// What the Python package uses.
#[pyo3::pymodule]
mod _canter {
    #[pymodule_export]
    use crate::link::{Link, engines};
    #[pymodule_export]
    use crate::otg::{Motion, otg, otg_batch, otg_of};
    #[pymodule_export]
    use crate::planning::{Plan, plan};
    #[pymodule_export]
    use crate::program::check;
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::smooth::{Smooth, smooth};
    #[pymodule_export]
    use crate::timing::{Timed, time_path};
    #[pymodule_export]
    use crate::verify::verify;

    /// Version of the crates that this module was built from.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}

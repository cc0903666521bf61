//! Fixtures of the system tests; the tests themselves are in `suite/`.
//!
//! These tests use Canter from outside: whole programs, real processes, rules of the repository.
//! Properties of one crate are tested in that crate.

pub mod arm;
pub mod domain;
pub mod driver_thread;
pub mod killed;
pub mod long_move;
pub mod motion;
pub mod peer;
pub mod pipe;
pub mod python;
pub mod repository;
pub mod servo_arm;
pub mod signal;
pub mod witness;

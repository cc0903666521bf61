//! Fixtures of the system tests; the tests themselves are in `suite/`.
//!
//! A test here sees Canter from outside: whole programs, real processes, the repository's own
//! rules. The laws of one crate are tested in that crate.

pub mod arm;
pub mod domain;
pub mod motion;
pub mod repository;
pub mod servo_arm;
pub mod signal;
pub mod witness;

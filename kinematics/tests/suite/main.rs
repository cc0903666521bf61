//! Property tests and oracle tests of the crate `kinematics`, one binary.
#![allow(clippy::unwrap_used, reason = "a test may fail this way")]

mod arms;
mod chain;
mod follow;
mod fuzz;
mod hard;
mod ik;
mod no_alloc;
mod strangers;
mod urdf;

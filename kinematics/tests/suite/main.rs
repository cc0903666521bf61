//! Laws and oracles of the crate `kinematics`, one binary.

mod arms;
mod chain;
mod follow;
mod fuzz;
mod hard;
mod ik;
mod urdf;

//! Laws and oracles of the crate `kinematics`, one binary.

mod arms;
mod chain;
mod follow;
mod ik;
mod urdf;

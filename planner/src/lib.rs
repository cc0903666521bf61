//! Plans, for a canonical command, a trajectory that is certified to keep all limits.
//!
//! [`modal`] applies the modes to a command, [`motion`] plans it as a whole. The [`controller`]
//! uses both and knows where the arm is after each command; the [`dry_run`] and a real run both use
//! it. [`way`] plans the commands of a plan, which leave the way open; [`timed`] is a joint trajectory
//! whose times others give. [`recorded`] checks a recorded motion against its program.
//!
//! This crate is a pure function of robot, program and start: it never starts a thread, reads a
//! clock, touches shared memory, prints, or reads an environment variable. Only [`robot`] reads
//! files: the folder of a robot.
#![forbid(unsafe_code)]

pub mod command_error;
pub mod controller;
mod dof;
pub mod dry_run;
pub mod end_effector;
pub mod kernels;
pub mod modal;
pub mod motion;
pub mod recorded;
pub mod robot;
pub mod task;
pub mod timed;
pub mod tooling;
pub mod way;

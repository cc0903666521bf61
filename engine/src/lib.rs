//! A running arm: the queue of commands, the session that plans them ahead of the servo thread,
//! and the host that serves clients.
//!
//! The planner's thread of the [`session`] takes a command from the [`queue`], plans it and sends
//! the pieces to the servo thread. The [`host`] answers the requests of other processes, and the
//! [`run_loop`] has commands executed while an operator watches. With [`arm_motion`] a kitting plan
//! moves an arm; [`equipment`] gives the robot the end effectors of the plan's world.
//! [`repetition`] compares a recorded run with the same program executed again, and [`off_path`]
//! measures how far an arm left its path. [`doctor`] checks the machine.
//!
//! This crate has no planning of its own, never names iceoryx2, prints nothing and reads no
//! environment variable.
#![forbid(unsafe_code)]

pub mod arm_motion;
mod asked;
pub mod control;
pub mod doctor;
pub mod equipment;
pub mod flight;
pub mod host;
pub mod off_path;
mod once;
pub mod queue;
mod recent;
pub mod recorded_arm;
pub mod repetition;
pub mod run_loop;
pub mod session;
mod texts;

//! A running arm: the queue of commands, the session that plans them ahead of the servo thread,
//! and the host that serves clients.
//!
//! A command leaves the [`queue`] and is planned by the planner's thread of the [`session`], which
//! hands the pieces to the servo thread. The [`host`] answers the requests of other processes.
//! [`arm_motion`] lets a kitting plan move an arm. [`doctor`] looks at what all this needs of the machine.
//!
//! This crate never plans by itself, never names iceoryx2, prints nothing and reads no environment
//! variable.
#![forbid(unsafe_code)]

pub mod arm_motion;
pub mod control;
pub mod doctor;
pub mod flight;
pub mod host;
pub mod queue;
mod recent;
pub mod session;
mod texts;

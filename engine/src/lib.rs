//! Queue, planner and real-time executor of canonical robot commands.
//!
//! A command leaves the [`queue`], loses its modes in [`modal`], is planned
//! whole by the [`planner`] and becomes setpoints in [`executor`]. The
//! [`controller`] holds the first three together; the [`dry_run`] and the real
//! run both stand on it.
//!
//! This crate never names iceoryx2, prints nothing and reads no environment
//! variable.

pub mod command_error;
pub mod conformance;
pub mod control;
pub mod controller;
pub mod doctor;
mod dof;
pub mod dry_run;
pub mod executor;
pub mod modal;
pub mod planner;
pub mod queue;
pub mod recorded;
pub mod robot;
pub mod session;
pub mod task;
pub mod tooling;
pub mod trial;

use dof::with_dof;

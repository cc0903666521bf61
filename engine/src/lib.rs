//! Queue, planner and real-time executor of canonical robot commands.

pub mod command_error;
pub mod executor;
pub mod robot;
pub mod task;
pub mod tooling;

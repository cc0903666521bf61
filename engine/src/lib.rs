//! Queue, planner and real-time executor of canonical robot commands.

pub mod robot;

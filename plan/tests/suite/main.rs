//! Tests of plans and the world model, one binary.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(clippy::unwrap_used, reason = "tests")]

mod bad_plans;
mod c_caller;
mod fixtures;
mod fuzz;
mod killed;
mod ordering;
mod pddl;
mod reading;
mod running;
mod statements;
mod world;
mod writers;

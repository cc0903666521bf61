//! Plan interpreters (PDDL, kitting process plans) and the world model.

pub mod error;
pub mod finding;
pub mod interp;
pub mod kitting;
pub mod pddl;
pub mod run;
pub mod world;

pub use error::PlanError;

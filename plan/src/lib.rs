//! Plan interpreters (PDDL, kitting process plans) and the world model.
//!
//! ```text
//! plan text -> kitting::read -> kitting::check -> run::Program
//!                                                     |  state, world
//!                                                     v
//!              run::Controller <- step: commands, changes, state afterwards
//!               |        |
//!    run::Motion (the arm)   world::Writer (the database)
//! ```
//!
//! - [`world`]: what is where. [`world::Model`] is plain data; only [`world::Writer`] writes.
//! - [`kitting`]: the kitting process plan language.
//! - [`run`]: executing kitting plans; [`run::Motion`] and [`run::Factotum`] are the interfaces to
//!   arm and factotum.
//! - [`pddl`]: PDDL plans, domains and problems, and the table of actions.
//! - [`interp`]: the five-function interface by which a controller pulls a plan.
//!
//! This crate never moves an arm itself, has no threads and no shared memory, knows no robot, and
//! writes to the database only through a controller. Inside the crate, lengths are in metres and
//! angles in radians.

pub mod error;
pub mod finding;
pub mod interp;
pub mod kitting;
pub mod pddl;
pub mod run;
pub mod world;

pub use error::PlanError;

//! What `canter bench` and the benches measure: problems from a seed, their planning times and how
//! good the motions are.
//!
//! [`otg`] plans random state-to-state problems, [`timing`] times random paths, [`smooth`] plans
//! lists of poses in pure tool space, and a [`Trial`] plans one for a robot.
//!
//! This crate never decides anything: it calls what the library crates show to everybody.
#![forbid(unsafe_code)]

pub mod otg;
mod paths;
mod problems;
pub mod smooth;
pub mod timing;
mod trial;

pub use paths::RandomPaths;
pub use problems::{Ends, Problems};
pub use trial::Trial;

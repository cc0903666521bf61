//! Measurements for `canter bench` and the benchmarks: random problems from a seed, their planning
//! times and the quality of the motions.
//!
//! [`otg`] plans random state-to-state problems, [`timing`] computes time laws of random paths,
//! [`smooth`] plans lists of poses for a tool without an arm, a [`Trial`] plans a list for a robot,
//! its motion is drawn as it was [`Traced`], and [`RandomMoves`] plans random moves of a robot.
//!
//! This crate only calls the public functions of the library crates.
#![forbid(unsafe_code)]

mod moves;
pub mod otg;
mod paths;
mod problems;
mod random;
pub mod smooth;
pub mod timing;
mod traced;
mod trial;

pub use moves::{PlanningTime, RandomMoves};
pub use paths::RandomPaths;
pub use problems::{Ends, Problems};
pub use random::Random;
pub use traced::{Traced, TracedLimit, TracedPass};
pub use trial::Trial;

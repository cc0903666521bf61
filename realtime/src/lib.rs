//! The computation of every control period: no heap, no lock, no failure.
//!
//! A [`Piece`] is one polynomial piece of a joint motion, a [`Segment`] is a piece that the planner
//! sends to the cycle, a [`Sample`] is the value of a motion at one time. A [`Cycle`] turns
//! segments into one setpoint per period: it evaluates the piece, scales time along the path for
//! pause, resume, override, stop and starvation, and checks each setpoint against the one before
//! ([`check`]). [`brake`] stops the joints when the path cannot be followed any more.
//!
//! This crate never allocates, locks, logs, reads a clock, does input or output, returns a `Result`
//! or loops without a bound. What goes wrong is returned as a value.
#![no_std]
#![forbid(unsafe_code)]
#![deny(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable,
    clippy::disallowed_types
)]

mod approach;
mod brake;
mod buffer;
mod cycle;
mod governor;
mod guard;
mod limits;
mod piece;

pub use approach::{Bounds, next_rate, ramp_periods};
pub use brake::{at_rest, brake};
pub use buffer::Pushed;
pub use cycle::{Cycle, Demand, Step};
pub use governor::StopCategory;
pub use guard::{Following, Quantity, Trip, check};
pub use limits::{EndSpeeds, JointLimits};
pub use piece::{Piece, Sample, Segment};

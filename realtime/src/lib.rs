//! What runs once in every control period: no heap, no lock, no failure.
//!
//! A [`Piece`] is one polynomial piece of a joint motion, a [`Segment`] is a piece on its way from
//! the planner to the cycle, a [`Sample`] is what a motion says at one instant. A [`Cycle`] turns
//! segments into one setpoint a period: it evaluates the piece, scales time along the path for
//! pause, resume, override, stop and starvation, and checks each setpoint against the one before
//! ([`check`]). [`brake`] is the last resort when there is no path any more.
//!
//! This crate never allocates, locks, logs, reads a clock, does input or output, returns a
//! `Result` or loops without a bound. A bad moment is a value.
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
pub use guard::{Following, Quantity, Trip, check, check_following};
pub use limits::Limits;
pub use piece::{Piece, Sample, Segment};

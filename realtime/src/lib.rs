//! What runs once in every control period: no heap, no lock, no failure.
//!
//! A [`Piece`] is one polynomial piece of a joint motion, a [`Segment`] is a piece on its way from
//! the planner to the cycle, a [`Sample`] is what a piece says at one instant.
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

mod piece;

pub use piece::{Piece, Sample, Segment};

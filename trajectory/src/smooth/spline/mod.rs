//! The time-optimal spline: uniform quartic, continuous up to the jerk.
//!
//! # Source
//! Limits as hulls of differences: C. de Boor, "A Practical Guide to Splines",
//! 1978. The substitution `z = (h / scale)^3`, under which minimum time over
//! uniform splines is convex, and its barrier method are this project's own;
//! see docs/decisions/0050-smooth-spline.md.

mod ahead;
mod aimed;
mod aims;
mod anchor;
mod arm;
mod ball;
mod balls;
mod band;
mod barrier;
mod basis;
mod begin;
mod bounds;
mod build;
mod coordinates;
#[cfg(test)]
mod corners;
mod effort;
mod ends;
mod first_pass;
mod forward;
mod frame;
mod further;
mod iterate;
mod joint;
mod joints;
mod known;
mod led;
mod legs;
mod line_search;
mod meet;
mod newton;
mod norms;
mod nudge;
mod orientations;
mod pace;
mod passes;
mod problem;
mod project;
mod request;
mod solve;
mod start;
mod stretch;
mod turns;

pub(crate) use band::Band;
pub(crate) use basis::{START, power};
pub(crate) use build::{Found, plan, plan_for_arm};
pub(crate) use effort::Effort;
pub(crate) use further::{Ahead, further};
pub(crate) use meet::meet_spans;
pub(crate) use request::{Moving, Request};
pub(crate) use start::KNOTS_PER_RAMP;
pub(crate) use turns::turns;

//! Smooth motion through a list of poses: intermediate poses are passed within
//! a tolerance, without stopping, under limits of speed, acceleration and jerk.
//!
//! [`plan`] returns the fastest motion that it can certify. It always returns one: where blending
//! is not possible, there is an exact stop, which needs no tolerance. The [`Certificate`] of a
//! [`SmoothPlan`] holds for all times of the motion; deviation, tolerance and time are reported for
//! each intermediate pose.
//!
//! This module knows no robot: positions are of the controlled point, limits are norms of its
//! velocity, acceleration and jerk and of the angular ones. A plan is a
//! [`ToolCurve`](crate::ToolCurve) whose parameter is time; if joints need more time, the path
//! timing stretches time, which does not change the geometry.

mod angular_bounds;
mod approach;
mod arm;
mod bridge;
mod certificate;
mod choose;
mod crossing;
mod dense;
mod exact_stop;
mod fade;
mod for_arm;
mod found;
mod judged;
mod later;
mod list;
mod lower_bound;
mod method;
mod missed;
mod motion;
mod narrower;
mod narrowing;
mod normal_form;
mod options;
mod overlap;
mod plan;
mod ramp;
mod rest;
mod retimed;
mod seed;
mod shares;
mod span;
mod spline;
mod tool_law;
mod turning_back;
mod windows;

use crate::poly;
pub use arm::{ArmMotion, ArmState, JointBounds, JointState};
pub use certificate::{Certificate, Peak, off_segment};
pub use crossing::{Crossing, RESOLUTION};
pub use dense::{FittedCurve, FittedPart};
pub use exact_stop::corners;
pub use for_arm::{ArmPlan, SpareSpline, plan_for_arm};
pub use list::plan;
pub use lower_bound::{least_time, least_turning_time};
pub use method::Method;
pub use options::{SmoothError, SmoothOptions, angular_tolerance};
pub use plan::SmoothPlan;
pub use rest::{Rest, RestCause};
pub use seed::Seed;
pub use windows::Windows;

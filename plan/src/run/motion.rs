//! The interface to what moves the arm.

use nalgebra::Isometry3;

use super::batch::{Batch, Tool};

/// Why a motion was not (or not wholly) executed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotionFailure {
    /// Position of the command in its batch.
    pub command: usize,
    /// What happened.
    pub reason: String,
    /// The operator stopped it: the run can be resumed.
    pub stopped: bool,
}

impl MotionFailure {
    /// A failure of the command at this position of its batch.
    pub fn new(command: usize, reason: impl Into<String>) -> Self {
        let (reason, stopped) = (reason.into(), false);
        Self {
            command,
            reason,
            stopped,
        }
    }

    /// The operator stopped the arm.
    #[must_use]
    pub fn stopped() -> Self {
        Self {
            stopped: true,
            ..Self::new(0, "the operator stopped the arm")
        }
    }
}

impl std::fmt::Display for MotionFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.stopped {
            return f.write_str(&self.reason);
        }
        write!(f, "command {}: {}", self.command + 1, self.reason)
    }
}

/// Where the arm is before a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Situation {
    /// `workstation_from_arm`: the end of the arm (m).
    pub arm: Isometry3<f64>,
    /// The tool on it.
    pub tool: Option<Tool>,
}

/// What moves the arm: the engine, or a simulation.
pub trait Motion {
    /// Pose of the end of the arm now, in the frame of the workstation (m); `None` if only the
    /// model knows it.
    fn arm(&mut self) -> Option<Isometry3<f64>>;

    /// Executes all commands of the batch and returns the time it took (s) when all have ended.
    ///
    /// # Errors
    /// [`MotionFailure`]; then nothing is committed.
    fn execute(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure>;

    /// How long the batch will take (s), without moving.
    ///
    /// # Errors
    /// [`MotionFailure`] when it cannot be executed, for example because a pose is out of reach.
    fn predict(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure>;

    /// Clears a failure so that commands can be executed again. Returns whether it could.
    fn recover(&mut self) -> bool {
        false
    }
}

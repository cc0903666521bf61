//! Events that the real-time thread reports.

use core::fmt;

use ipc::{FaultCode, MessageError};
use realtime::{Sample, Trip};

/// Why the arm was stopped. It latches until [`super::Remote::recover`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// A setpoint would have broken a limit of a joint, or the arm did not follow.
    Limit(Trip),
    /// A planned segment was not made of finite numbers.
    BrokenSegment,
    /// No state of the session came for too long.
    DriverLost {
        /// How long (ms).
        silent_ms: u64,
    },
    /// The driver stopped by itself.
    DriverFault {
        /// Why.
        code: FaultCode,
        /// Which joint, from 0, if the fault is about one.
        joint: Option<u32>,
    },
    /// An invalid state.
    BadState(MessageError),
    /// The real-time thread did not run for longer than the watchdog.
    Stalled {
        /// How long (ms).
        late_ms: u64,
    },
    /// A gripper or tool changer failed or took too long.
    Tool {
        /// [`ipc::GRIPPER`] or [`ipc::TOOL_CHANGER`].
        tool: usize,
        /// Whether it took too long.
        timeout: bool,
    },
    /// A new session could not be opened.
    NoSession,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Limit(trip) => {
                let (name, unit) = (trip.quantity.name(), trip.quantity.unit());
                let joint = trip.joint + 1;
                write!(
                    f,
                    "joint {joint}: {name} {:.6} {unit}, limit {:.6}",
                    trip.value, trip.limit
                )
            }
            Self::BrokenSegment => f.write_str("a planned segment is not finite"),
            Self::DriverLost { silent_ms } => {
                write!(f, "driver lost: no state for {silent_ms} ms")
            }
            Self::DriverFault {
                code,
                joint: Some(joint),
            } => {
                write!(f, "driver fault at joint {}: {}", joint + 1, code.reason())
            }
            Self::DriverFault { code, joint: None } => write!(f, "driver fault: {}", code.reason()),
            Self::BadState(cause) => write!(f, "invalid state of the driver: {cause}"),
            Self::Stalled { late_ms } => write!(f, "the real-time thread was {late_ms} ms late"),
            Self::Tool { tool, timeout } => {
                let name = if *tool == ipc::GRIPPER {
                    "gripper"
                } else {
                    "tool changer"
                };
                f.write_str(name)?;
                f.write_str(if *timeout {
                    " gave no answer in time"
                } else {
                    " failed"
                })
            }
            Self::NoSession => f.write_str("the driver opened no session"),
        }
    }
}

/// An event, and its period since the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A command starts to move, or a tool order goes out.
    Started {
        /// Index of the command.
        command: u32,
        /// The period.
        tick: u64,
    },
    /// A command ended at rest, or a tool did what it should.
    Finished {
        /// Index of the command.
        command: u32,
        /// The period.
        tick: u64,
    },
    /// The arm rests after a pause or stop.
    Stopped {
        /// The period.
        tick: u64,
    },
    /// The queue was dropped; the arm rests.
    Aborted {
        /// Number of aborts asked for until then: commands given after the last of them stay.
        aborts: u32,
        /// The period.
        tick: u64,
    },
    /// A fault; the arm is being stopped.
    Faulted {
        /// What.
        fault: Fault,
        /// The period.
        tick: u64,
    },
    /// A new session is open, the fault is cleared, the queue is empty.
    Recovered {
        /// The period.
        tick: u64,
    },
    /// The thread ended; nothing follows.
    Ended {
        /// The period.
        tick: u64,
    },
}

/// One period: what was published, and what was measured in answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded<const N: usize> {
    /// The period since the start.
    pub tick: u64,
    /// The current command, or the last one.
    pub command: u32,
    /// Planned time since the command's start (s).
    pub path_time: f64,
    /// Share of the planned speed.
    pub time_scaling: f64,
    /// What was published.
    pub setpoint: Sample<N>,
    /// Positions of the last state before the next setpoint (rad).
    pub measured: [f64; N],
}

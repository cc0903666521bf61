//! Events that the real-time thread reports.

use core::fmt;

use ipc::{FaultCode, MessageError, bytes_of, text_of};
use realtime::{Sample, Trip};

/// A short text that can be made in the period: UTF-8, filled up with 0.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct ShortText(pub [u8; 96]);

impl ShortText {
    /// A text; what is longer than 96 bytes is cut.
    pub fn new(text: &str) -> Self {
        Self(bytes_of(text))
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.0[0] == 0
    }
}

impl fmt::Display for ShortText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&text_of(&self.0))
    }
}

impl fmt::Debug for ShortText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", text_of(&self.0))
    }
}

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
        /// The number that the arm's maker gives the fault; 0 if there is none.
        number: u32,
        /// What the arm's maker says of it; may be empty.
        text: ShortText,
    },
    /// The arm sent nothing to its driver for too long.
    Unmeasured {
        /// How long (ms).
        silent_ms: u64,
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
    NoSession {
        /// Why.
        reason: ShortText,
    },
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
                joint,
                number,
                text,
            } => {
                f.write_str("driver fault")?;
                if let Some(joint) = joint {
                    write!(f, " at joint {}", joint + 1)?;
                }
                match text.is_empty() {
                    true => write!(f, ": {}", code.reason())?,
                    false if *code == FaultCode::Hardware => write!(f, ": {text}")?,
                    false => write!(f, ": {}: {text}", code.reason())?,
                }
                if *number > 0 {
                    write!(f, " (number {number})")?;
                }
                Ok(())
            }
            Self::Unmeasured { silent_ms } => {
                write!(f, "the arm sent nothing to its driver for {silent_ms} ms")
            }
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
            Self::NoSession { reason } => write!(f, "the driver opened no session: {reason}"),
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
    /// Whether a command has taken the place of the one that moves.
    Spliced {
        /// Index of the new command.
        by: u32,
        /// Whether it was in time; otherwise the one that moves goes on.
        accepted: bool,
        /// The period.
        tick: u64,
    },
    /// The arm has not arrived at the end of a command within the patience; the command counts as
    /// finished.
    NotArrived {
        /// Index of the command.
        command: u32,
        /// The joint that is furthest away, from 0.
        joint: u32,
        /// How far it is (rad, m).
        error: f64,
        /// The period.
        tick: u64,
    },
    /// The measured tool has not come within the tolerance of a command's end within the patience; the
    /// command counts as finished.
    EndMissed {
        /// Index of the command.
        command: u32,
        /// How near it came: distance of the controlled point (m).
        point: f64,
        /// The angle to its orientation then (rad).
        angle: f64,
        /// The period.
        tick: u64,
    },
    /// The arm asks for less speed, or no longer does.
    SpeedAsked {
        /// Share of the planned speed, 0..=1.
        share: f64,
        /// The period.
        tick: u64,
    },
    /// A command ended at rest and the measured arm has arrived, or a tool did what it should.
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
    /// The thread ends although the joints that the driver commands, or the arm, do not come to rest at
    /// the last setpoint.
    NotSettled {
        /// The joint that is furthest away, from 0.
        joint: u32,
        /// How far it is (rad, m).
        error: f64,
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

//! What a session reports about its commands.

use core::fmt;

use serde::Serialize;

use planner::command_error::CommandError;

/// Who is to blame for a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Blame {
    /// A limit of a joint, or the guard of the cycle.
    Guard,
    /// The driver, a tool, or the communication with them.
    Driver,
}

/// One event, in the order of the commands.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Note {
    /// A command that takes time has begun.
    Started {
        /// Number of the command in this session, from 1.
        id: u32,
        /// Line of the program, from 1; 0 when there is none.
        line: usize,
        /// Name of the command.
        name: &'static str,
        /// Length that was planned, s; of a long smooth move, of what is planned so far.
        planned_s: f64,
        /// Servo period of the start.
        tick: u64,
    },
    /// A command has been executed.
    Done {
        /// Number of the command in this session, from 1.
        id: u32,
        /// Line of the program, from 1; 0 when there is none.
        line: usize,
        /// Name of the command.
        name: &'static str,
        /// Servo periods it took; 0 for a command that takes no time.
        ticks: u64,
    },
    /// Another move has taken the place of a command, which never becomes done.
    Replaced {
        /// Number of the command in this session, from 1.
        id: u32,
        /// Line of the program, from 1; 0 when there is none.
        line: usize,
        /// Name of the command.
        name: &'static str,
        /// Number of the other move.
        by: u32,
    },
    /// A guard has ended a command, and the arm rests.
    Guarded {
        /// Number of the command in this session, from 1.
        id: u32,
        /// Line of the program, from 1; 0 when there is none.
        line: usize,
        /// Name of the command.
        name: &'static str,
        /// Name of the sensor.
        sensor: String,
        /// The value that tripped the guard, SI.
        value: f64,
        /// The value furthest in the direction of the limit until the arm rested, SI.
        peak: f64,
        /// How far the measured controlled point may go on from where the guard tripped, by the
        /// limits of the joints on the path (m).
        allowed_m: f64,
        /// How far it went (m).
        stopped_m: f64,
        /// How long the stop took until the measured arm rested (s).
        stop_s: f64,
        /// Where the measured controlled point was when the guard tripped (m, workstation).
        position_m: [f64; 3],
        /// Its orientation: w, x, y, z.
        orientation_wxyz: [f64; 4],
        /// All this in a sentence.
        message: String,
    },
    /// A command could not be executed and had no effect.
    Refused {
        /// Number of the command in this session, from 1.
        id: u32,
        /// Line of the program, from 1; 0 when there is none.
        line: usize,
        /// Name of the command.
        name: &'static str,
        /// Why.
        error: CommandError,
        /// How many commands behind it were dropped.
        dropped: usize,
    },
    /// A text for the operator.
    Message {
        /// The text.
        text: String,
    },
    /// The program said that it is over.
    Ended {
        /// Its reason: 0 is success.
        reason: i64,
    },
    /// The arm rests on the path after a pause or a stop.
    Stopped,
    /// The arm rests and all commands are dropped.
    Aborted {
        /// How many commands were dropped.
        dropped: usize,
    },
    /// The arm was not where a command ends in time; the command counts as done.
    NotArrived {
        /// Number of the command in this session, from 1.
        id: u32,
        /// The joint that is furthest away, from 1.
        joint: u32,
        /// How far it is (rad, m).
        error: f64,
    },
    /// The measured tool did not come within the tolerance of a command's end in time; the command counts
    /// as done.
    EndMissed {
        /// Number of the command in this session, from 1.
        id: u32,
        /// How near the controlled point came to its place (m).
        off_m: f64,
        /// How far it was turned from its orientation then (rad).
        off_rad: f64,
    },
    /// The session ends although what the driver commands does not come to rest at the last setpoint.
    NotSettled {
        /// The joint that is furthest away, from 1.
        joint: u32,
        /// How far it is (rad, m).
        error: f64,
    },
    /// The arm asks for less speed, or no longer does; the motion keeps its path.
    SpeedAsked {
        /// Share of the planned speed, 0..=1.
        share: f64,
    },
    /// A fault; the arm is stopped until the operator recovers.
    Faulted {
        /// Who is to blame.
        blame: Blame,
        /// What went wrong: joint, value, limit.
        reason: String,
        /// Servo period in which it was seen.
        tick: u64,
        /// How many commands were dropped.
        dropped: usize,
    },
    /// The fault is cleared; the arm is ready for InitCanon.
    Recovered,
    /// The session is over; nothing follows.
    Closed,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Started { line, name, .. } => write!(f, "line {line}: {name} started"),
            Self::Done { line, name, .. } => write!(f, "line {line}: {name} done"),
            Self::Refused {
                line, name, error, ..
            } => write!(f, "line {line}: {name} refused: {}", error.message),
            Self::Replaced { line, name, by, .. } => {
                write!(f, "line {line}: {name}: command {by} has taken its place")
            }
            Self::Guarded {
                line,
                name,
                message,
                ..
            } => write!(f, "line {line}: {name}: {message}"),
            Self::Message { text } => write!(f, "message: {text}"),
            Self::Ended { reason } => write!(f, "the program ended with reason {reason}"),
            Self::NotArrived { id, joint, error } => write!(
                f,
                "warning: command {id}: joint {joint} is {error:.4} from its end and does not arrive"
            ),
            Self::EndMissed { id, off_m, off_rad } => write!(
                f,
                "warning: command {id}: the measured tool came no nearer to its end than {:.3} mm and {:.3} degrees; \
                 look at the arm, or set larger tolerances with SetEndPointTolerance and SetEndAngleTolerance",
                off_m * 1e3,
                off_rad.to_degrees()
            ),
            Self::NotSettled { joint, error } => write!(
                f,
                "warning: the session ends while the driver does not come to rest: joint {joint} is {error:.6} \
                 from the last setpoint; look at the driver's messages"
            ),
            Self::SpeedAsked { share } if *share > 0.98 => {
                f.write_str("the arm asks for full speed again")
            }
            Self::SpeedAsked { share } => {
                write!(f, "the arm asks for {:.0} % of the speed", share * 100.0)
            }
            Self::Stopped => f.write_str("stopped"),
            Self::Aborted { dropped } => write!(f, "aborted, {dropped} commands dropped"),
            Self::Faulted { reason, .. } => write!(f, "fault: {reason}"),
            Self::Recovered => f.write_str("recovered"),
            Self::Closed => f.write_str("the session is over"),
        }
    }
}

//! The setpoint: from engine to driver, once per period.

use iceoryx2::prelude::ZeroCopySend;

use crate::{
    MAX_ANALOGUE, MAX_JOINTS, MAX_TOOLS, MessageError, PROTOCOL, Payload, ToolAction, ToolCommand,
};

/// Bits of [`Setpoint::flags`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetpointFlags;

impl SetpointFlags {
    /// The setpoint is at rest and will stay there.
    pub const HOLD: u32 = 1;
    /// The engine is stopping on the path.
    pub const STOPPING: u32 = 2;
    /// The driver must stop by itself now, within its own limits, and latch.
    pub const STOP_REQUEST: u32 = 4;
    /// The engine ends: the session ends without a fault. Only together with [`Self::HOLD`].
    pub const GOODBYE: u32 = 8;
    /// `effort` is a feed-forward; without it, `effort` has no meaning.
    pub const EFFORT: u32 = 16;
}

/// The wanted state of the joints at one time. The engine sends it once per period.
///
/// Arrays hold [`MAX_JOINTS`] numbers; the first `joints` are used, the rest has no meaning. Times are
/// nanoseconds of `CLOCK_MONOTONIC`. What changes in each period is in the first two lines of 64 bytes,
/// and in lists that begin a line: the numbers of up to 8 joints are in one.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.Setpoint.2")]
pub struct Setpoint {
    /// Protocol version.
    pub protocol: u32,
    /// Number of joints.
    pub joints: u32,
    /// The session that the handshake gave.
    pub session: u64,
    /// Counts the setpoints of a session, from 1.
    pub sequence: u64,
    /// The number of the period since the session began; jumps where periods were skipped.
    pub tick: u64,
    /// When it was sent (ns).
    pub published_ns: u64,
    /// The time of the setpoint (ns): when the arm shall be there, by the engine's plan. It is when
    /// the period began in which it was made; the driver runs 0.4 periods later.
    pub tick_ns: u64,
    /// Sequence of the last state that the engine received.
    pub state_sequence: u64,
    /// Length of a period (ns).
    pub period_ns: u64,
    /// After this time without setpoints the driver stops by itself and latches (ns).
    pub watchdog_ns: u64,
    /// Index of the current canonical command.
    pub command: u32,
    /// Bits of [`SetpointFlags`].
    pub flags: u32,
    /// One bit for each joint whose numbers are valid.
    pub valid: u32,
    /// Counts the changes of tools, outputs and payload. In a session, setpoints
    /// of the same revision are equal there; 0 where the sender does not count.
    pub revision: u32,
    /// Planned time since the command's start (s).
    pub path_time: f64,
    /// Speed along the path as a fraction of the planned speed, 0..=1.
    pub time_scaling: f64,
    /// Digital outputs, one bit each.
    pub digital_outputs: u64,
    /// Which digital outputs the engine sets; the others stay as they are.
    pub digital_mask: u64,
    /// Which analogue outputs the engine sets, one bit each; the others stay as they are.
    pub analogue_mask: u64,
    /// Joint positions (rad, m).
    pub position: [f64; MAX_JOINTS],
    /// Joint velocities (rad/s, m/s).
    pub velocity: [f64; MAX_JOINTS],
    /// Joint accelerations (rad/s², m/s²).
    pub acceleration: [f64; MAX_JOINTS],
    /// Joint efforts as feed-forward (N m, N).
    pub effort: [f64; MAX_JOINTS],
    /// Orders to gripper and tool changer.
    pub tools: [ToolCommand; MAX_TOOLS],
    /// Analogue outputs, in the unit of the arm (V, A).
    pub analogue_outputs: [f64; MAX_ANALOGUE],
    /// What the arm carries.
    pub payload: Payload,
    /// For later; 0.
    pub reserved: [u64; 4],
}

impl Default for Setpoint {
    fn default() -> Self {
        Self {
            protocol: PROTOCOL,
            joints: 0,
            session: 0,
            sequence: 0,
            tick: 0,
            published_ns: 0,
            tick_ns: 0,
            state_sequence: 0,
            period_ns: 0,
            watchdog_ns: 0,
            command: 0,
            flags: 0,
            valid: 0,
            revision: 0,
            path_time: 0.0,
            time_scaling: 0.0,
            digital_outputs: 0,
            digital_mask: 0,
            analogue_mask: 0,
            position: [0.0; MAX_JOINTS],
            velocity: [0.0; MAX_JOINTS],
            acceleration: [0.0; MAX_JOINTS],
            effort: [0.0; MAX_JOINTS],
            tools: [ToolCommand::default(); MAX_TOOLS],
            analogue_outputs: [0.0; MAX_ANALOGUE],
            payload: Payload::default(),
            reserved: [0; 4],
        }
    }
}

impl Setpoint {
    /// Checks the message for an arm of `joints` joints: version, count, finite numbers, known
    /// codes, valid times. Does not allocate.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, joints: usize) -> Result<(), MessageError> {
        check_head(self.protocol, self.joints, joints)?;
        check_range("period_ns", self.period_ns, 1_000, 1_000_000_000)?;
        check_range(
            "watchdog_ns",
            self.watchdog_ns,
            self.period_ns,
            10_000_000_000,
        )?;
        check_finite("position", &self.position, joints)?;
        check_finite("velocity", &self.velocity, joints)?;
        check_finite("acceleration", &self.acceleration, joints)?;
        check_finite("effort", &self.effort, joints)?;
        for tool in &self.tools {
            if ToolAction::from_number(tool.action).is_none() {
                return Err(MessageError::Choice {
                    field: "tool action",
                    value: tool.action,
                });
            }
            let numbers = [tool.position, tool.velocity, tool.force, tool.tolerance];
            check_finite("tool order", &numbers, 4)?;
        }
        check_finite("analogue output", &self.analogue_outputs, MAX_ANALOGUE)?;
        let payload = &self.payload;
        check_finite("payload mass", &[payload.mass], 1)?;
        check_finite("payload centre", &payload.centre, 3)?;
        check_finite("payload inertia", &payload.inertia, 6)?;
        check_finite("tool position", &payload.tool_position, 3)?;
        check_finite("tool rotation", &payload.tool_rotation, 4)
    }
}

/// Version and number of joints.
pub(crate) fn check_head(protocol: u32, found: u32, joints: usize) -> Result<(), MessageError> {
    if protocol != PROTOCOL {
        return Err(MessageError::Protocol {
            expected: PROTOCOL,
            found: protocol,
        });
    }
    if found as usize != joints || joints > MAX_JOINTS {
        return Err(MessageError::Joints {
            expected: joints as u32,
            found,
        });
    }
    Ok(())
}

/// Whether a time or count is within its range.
pub(crate) fn check_range(
    field: &'static str,
    value: u64,
    least: u64,
    most: u64,
) -> Result<(), MessageError> {
    if value < least || value > most {
        return Err(MessageError::Range {
            field,
            value,
            least,
            most,
        });
    }
    Ok(())
}

/// Whether the first `count` values are finite. Compiled once: in a period each line of code may come from another
/// cache too.
#[inline(never)]
pub(crate) fn check_finite(
    quantity: &'static str,
    values: &[f64],
    count: usize,
) -> Result<(), MessageError> {
    let used = || values.iter().take(count);
    // Of a number that is not finite, no multiple is 0.
    if used().map(|value| value * 0.0).sum::<f64>() == 0.0 {
        return Ok(());
    }
    for (joint, value) in used().enumerate() {
        if !value.is_finite() {
            return Err(MessageError::NotFinite {
                quantity,
                joint: joint as u32,
                value: *value,
            });
        }
    }
    Ok(())
}

//! The state: from driver to engine, once per period.

use iceoryx2::prelude::ZeroCopySend;

use crate::setpoint::{check_finite, check_head};
use crate::{MAX_JOINTS, MAX_TOOLS, MessageError, PROTOCOL, ToolFeedback, ToolStatus};

/// Where a driver is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum DriverState {
    /// No engine.
    Disconnected = 0,
    /// The handshake is done, no setpoint has arrived.
    Synced = 1,
    /// The first setpoint of the session was the measured position; brakes are off.
    Armed = 2,
    /// Follows the setpoints.
    Active = 3,
    /// Stops by itself.
    Stopping = 4,
    /// Stopped by itself. Only a new session leaves this state.
    Fault = 5,
}

impl DriverState {
    /// The state that a number on the wire stands for.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::Disconnected),
            1 => Some(Self::Synced),
            2 => Some(Self::Armed),
            3 => Some(Self::Active),
            4 => Some(Self::Stopping),
            5 => Some(Self::Fault),
            _ => None,
        }
    }

    /// The state's name, lower case.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Disconnected => "disconnected",
            Self::Synced => "synced",
            Self::Armed => "armed",
            Self::Active => "active",
            Self::Stopping => "stopping",
            Self::Fault => "fault",
        }
    }
}

/// Why a driver stopped by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum FaultCode {
    /// No fault.
    None = 0,
    /// No setpoint within the watchdog time.
    Watchdog = 1,
    /// An invalid setpoint.
    BadSetpoint = 2,
    /// A setpoint is too far from the last one, or beyond the joint's range, speed or acceleration.
    OutOfRange = 3,
    /// The engine asked for it.
    StopRequest = 4,
    /// The hardware has a fault of its own.
    Hardware = 5,
    /// The driver itself did not run for longer than the watchdog time.
    Stalled = 6,
    /// The driver was told to end.
    Ended = 7,
}

impl FaultCode {
    /// How many there are, [`Self::None`] included.
    pub(crate) const COUNT: usize = 8;

    /// The fault that a number on the wire stands for.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::None),
            1 => Some(Self::Watchdog),
            2 => Some(Self::BadSetpoint),
            3 => Some(Self::OutOfRange),
            4 => Some(Self::StopRequest),
            5 => Some(Self::Hardware),
            6 => Some(Self::Stalled),
            7 => Some(Self::Ended),
            _ => None,
        }
    }

    /// What happened, as text.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::None => "no fault",
            Self::Watchdog => "no setpoint within the watchdog time",
            Self::BadSetpoint => "a setpoint made no sense",
            Self::OutOfRange => "a setpoint was out of range, too fast, or asked for a jump",
            Self::StopRequest => "the engine asked for a stop",
            Self::Hardware => "a fault of the hardware",
            Self::Stalled => "the driver itself did not run for longer than the watchdog time",
            Self::Ended => "the driver was told to end",
        }
    }
}

/// The measured state of the joints. The driver sends it once per period, also without a session.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.State.1")]
pub struct State {
    /// Protocol version.
    pub protocol: u32,
    /// Number of joints.
    pub joints: u32,
    /// The current session; 0 if there is none.
    pub session: u64,
    /// Counts the states of a driver process, from 1.
    pub sequence: u64,
    /// When the joints were measured (ns of `CLOCK_MONOTONIC`).
    pub measured_ns: u64,
    /// When it was sent (ns of `CLOCK_MONOTONIC`).
    pub published_ns: u64,
    /// Sequence of the last setpoint received.
    pub setpoint_sequence: u64,
    /// `published_ns` of the last setpoint received (ns).
    pub setpoint_published_ns: u64,
    /// When the last setpoint was received (ns of `CLOCK_MONOTONIC`).
    pub setpoint_received_ns: u64,
    /// A [`DriverState`] by number.
    pub driver_state: u32,
    /// A [`FaultCode`] by number.
    pub fault: u32,
    /// The joint that the fault is about; `u32::MAX` for none.
    pub fault_joint: u32,
    /// For later; 0.
    pub reserved_word: u32,
    /// Periods without a new setpoint in this session.
    pub missed: u64,
    /// Joint positions (rad, m).
    pub position: [f64; MAX_JOINTS],
    /// Joint velocities (rad/s, m/s).
    pub velocity: [f64; MAX_JOINTS],
    /// Joint efforts (N m, N).
    pub effort: [f64; MAX_JOINTS],
    /// Gripper and tool changer.
    pub tools: [ToolFeedback; MAX_TOOLS],
    /// Digital inputs, one bit each.
    pub digital_inputs: u64,
    /// The hardware's own clock (ns); 0 if there is none.
    pub hardware_ns: u64,
    /// For later; 0.
    pub reserved: [u64; 11],
}

impl Default for State {
    fn default() -> Self {
        Self {
            protocol: PROTOCOL,
            joints: 0,
            session: 0,
            sequence: 0,
            measured_ns: 0,
            published_ns: 0,
            setpoint_sequence: 0,
            setpoint_published_ns: 0,
            setpoint_received_ns: 0,
            driver_state: 0,
            fault: 0,
            fault_joint: u32::MAX,
            reserved_word: 0,
            missed: 0,
            position: [0.0; MAX_JOINTS],
            velocity: [0.0; MAX_JOINTS],
            effort: [0.0; MAX_JOINTS],
            tools: [ToolFeedback::default(); MAX_TOOLS],
            digital_inputs: 0,
            hardware_ns: 0,
            reserved: [0; 11],
        }
    }
}

impl State {
    /// Checks the message for an arm of `joints` joints: version, count, finite numbers, known
    /// codes. Does not allocate.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, joints: usize) -> Result<(), MessageError> {
        check_head(self.protocol, self.joints, joints)?;
        if DriverState::from_number(self.driver_state).is_none() {
            return Err(MessageError::Choice {
                field: "driver state",
                value: self.driver_state,
            });
        }
        if FaultCode::from_number(self.fault).is_none() {
            return Err(MessageError::Choice {
                field: "fault",
                value: self.fault,
            });
        }
        check_finite("position", &self.position, joints)?;
        check_finite("velocity", &self.velocity, joints)?;
        check_finite("effort", &self.effort, joints)?;
        for tool in &self.tools {
            if ToolStatus::from_number(tool.status).is_none() {
                return Err(MessageError::Choice {
                    field: "tool status",
                    value: tool.status,
                });
            }
            check_finite("tool feedback", &[tool.position, tool.force], 2)?;
        }
        Ok(())
    }

    /// The driver state; [`DriverState::Fault`] if the number is unknown.
    pub fn driver(&self) -> DriverState {
        DriverState::from_number(self.driver_state).unwrap_or(DriverState::Fault)
    }

    /// The fault; [`FaultCode::Hardware`] if the number is unknown.
    pub fn fault_code(&self) -> FaultCode {
        FaultCode::from_number(self.fault).unwrap_or(FaultCode::Hardware)
    }
}

//! The state: from driver to engine, once per period.

use iceoryx2::prelude::ZeroCopySend;

use crate::setpoint::{check_finite, check_head, check_range};
use crate::{
    MAX_ANALOGUE, MAX_JOINTS, MAX_SENSORS, MAX_TOOLS, MessageError, PROTOCOL, Sensor, ToolFeedback,
    ToolStatus, text_of,
};

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
    /// The arm cannot be moved now; the text of the state says why.
    NotReady = 8,
}

impl FaultCode {
    /// How many there are, [`Self::None`] included.
    pub(crate) const COUNT: usize = 9;

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
            8 => Some(Self::NotReady),
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
            Self::NotReady => "the arm is not ready",
        }
    }
}

/// Bits of [`State::flags`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateFlags;

impl StateFlags {
    /// The arm sends nothing: positions are the last known ones, of `measured_ns`.
    pub const UNKNOWN: u32 = 1;
    /// Velocities are not measured.
    pub const NO_VELOCITY: u32 = 2;
    /// Efforts are not measured.
    pub const NO_EFFORT: u32 = 4;
    /// `commanded` is what the arm's own controller says it commands; without it, it is what the
    /// driver told the arm.
    pub const COMMANDED: u32 = 8;
}

/// The measured state of the joints. The driver sends it once per period, also without a session.
/// What changes in each period is in the first two lines of 64 bytes, and in lists that begin a line: the
/// numbers of up to 8 joints are in one.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.State.2")]
pub struct State {
    /// Protocol version.
    pub protocol: u32,
    /// Number of joints.
    pub joints: u32,
    /// The current session; 0 if there is none.
    pub session: u64,
    /// Counts the states of a driver process, from 1.
    pub sequence: u64,
    /// When the joints were measured (ns of `CLOCK_MONOTONIC`); 0 if never.
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
    /// The number that the arm's maker gives the fault; 0 if there is none.
    pub fault_code: u32,
    /// Periods without a new setpoint in this session.
    pub missed: u64,
    /// Bits of [`StateFlags`].
    pub flags: u32,
    /// How many of `sensors` are used.
    pub sensor_count: u32,
    /// Share of the planned speed that the arm asks for, 0..=1; 1 without a wish.
    pub speed_scaling: f64,
    /// The hardware's own clock (ns); 0 if there is none.
    pub hardware_ns: u64,
    /// Digital inputs, one bit each.
    pub digital_inputs: u64,
    /// Counts the changes of tools and analogue inputs. In a session, states of the same revision are equal
    /// there; 0 where the sender does not count.
    pub revision: u64,
    /// Joint positions (rad, m).
    pub position: [f64; MAX_JOINTS],
    /// Joint velocities (rad/s, m/s).
    pub velocity: [f64; MAX_JOINTS],
    /// Joint efforts (N m, N).
    pub effort: [f64; MAX_JOINTS],
    /// Commanded joint positions (rad, m): what the arm's controller wants now.
    pub commanded: [f64; MAX_JOINTS],
    /// Gripper and tool changer.
    pub tools: [ToolFeedback; MAX_TOOLS],
    /// Analogue inputs, in the unit of the arm (V, A).
    pub analogue_inputs: [f64; MAX_ANALOGUE],
    /// Named values of sensors.
    pub sensors: [Sensor; MAX_SENSORS],
    /// What the fault is, as the arm's maker says it; UTF-8, filled up with 0.
    pub text: [u8; 96],
    /// For later; 0.
    pub reserved: [u64; 4],
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
            fault_code: 0,
            missed: 0,
            flags: 0,
            sensor_count: 0,
            speed_scaling: 1.0,
            hardware_ns: 0,
            digital_inputs: 0,
            revision: 0,
            position: [0.0; MAX_JOINTS],
            velocity: [0.0; MAX_JOINTS],
            effort: [0.0; MAX_JOINTS],
            commanded: [0.0; MAX_JOINTS],
            tools: [ToolFeedback::default(); MAX_TOOLS],
            analogue_inputs: [0.0; MAX_ANALOGUE],
            sensors: [Sensor::default(); MAX_SENSORS],
            text: [0; 96],
            reserved: [0; 4],
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
        check_finite("commanded position", &self.commanded, joints)?;
        check_finite("analogue input", &self.analogue_inputs, MAX_ANALOGUE)?;
        if !(0.0..=1.0).contains(&self.speed_scaling) {
            return Err(MessageError::Share {
                field: "speed scaling",
                value: self.speed_scaling,
            });
        }
        check_range(
            "sensor count",
            self.sensor_count.into(),
            0,
            MAX_SENSORS as u64,
        )
    }

    /// The value of the sensor `name`; NaN when the driver does not know it now, `None` when it has
    /// no such sensor. Does not allocate.
    pub fn sensor(&self, name: &str) -> Option<f64> {
        let named = self.sensors.iter().take(self.sensor_count as usize);
        let mut found = named.filter(|sensor| sensor.is(name));
        found.next().map(|sensor| sensor.value)
    }

    /// What the fault is, as the arm's maker says it; empty when the driver says nothing.
    pub fn fault_text(&self) -> String {
        text_of(&self.fault_bytes())
    }

    /// The bytes of [`Self::fault_text`]: without a fault there may be an old text in the message.
    pub fn fault_bytes(&self) -> [u8; 96] {
        match self.fault {
            0 => [0; 96],
            _ => self.text,
        }
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

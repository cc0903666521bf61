//! The handshake that opens a session.

use iceoryx2::prelude::ZeroCopySend;

use crate::setpoint::{check_finite, check_head, check_range};
use crate::{MAX_JOINTS, MessageError, PROTOCOL, schema_checksum};

/// Who sets the pace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Clock {
    /// Both sides run by `CLOCK_MONOTONIC`.
    Wall = 0,
    /// Each state releases the next setpoint, each setpoint the next state: as fast as both sides
    /// can, with the same result every time.
    LockStep = 1,
}

impl Clock {
    /// The clock that a number on the wire stands for.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::Wall),
            1 => Some(Self::LockStep),
            _ => None,
        }
    }
}

/// What a driver answers to a [`Hello`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Verdict {
    /// The session is open.
    Welcome = 0,
    /// Another protocol version.
    WrongProtocol = 1,
    /// Another message layout.
    WrongSchema = 2,
    /// Another number of joints.
    WrongJoints = 3,
    /// Another robot model.
    WrongModel = 4,
    /// A period that the driver cannot keep.
    WrongPeriod = 5,
    /// A clock mode that the driver does not have.
    WrongClock = 6,
    /// Another engine has a session.
    Busy = 7,
    /// The driver still moves, or its arm cannot be moved now; the reason says why.
    NotReady = 8,
    /// The arm is getting ready, for example its brakes open: ask again; the reason says what it
    /// waits for.
    Wait = 9,
}

impl Verdict {
    /// The verdict that a number on the wire stands for.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::Welcome),
            1 => Some(Self::WrongProtocol),
            2 => Some(Self::WrongSchema),
            3 => Some(Self::WrongJoints),
            4 => Some(Self::WrongModel),
            5 => Some(Self::WrongPeriod),
            6 => Some(Self::WrongClock),
            7 => Some(Self::Busy),
            8 => Some(Self::NotReady),
            9 => Some(Self::Wait),
            _ => None,
        }
    }
}

/// Bits of [`HelloAck::features`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriverFeatures;

impl DriverFeatures {
    /// It can be driven by the wall clock.
    pub const WALL: u32 = 1;
    /// It can be driven in lock-step.
    pub const LOCK_STEP: u32 = 2;
    /// The arm's controller has a clock of its own and reads the references at its own times.
    pub const OWN_CLOCK: u32 = 4;
    /// A real arm: tests that harm it or that only a simulation can pass are left out.
    pub const REAL: u32 = 8;
}

/// The engine's request for a session.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.Hello.2")]
pub struct Hello {
    /// Protocol version.
    pub protocol: u32,
    /// Number of joints.
    pub joints: u32,
    /// [`schema_checksum`] of the engine.
    pub schema: u64,
    /// [`crate::model_hash`] of the engine's robot; 0 is any.
    pub model: u64,
    /// Length of a period (ns).
    pub period_ns: u64,
    /// Wanted watchdog (ns).
    pub watchdog_ns: u64,
    /// A [`Clock`] by number.
    pub clock: u32,
    /// Process number of the engine.
    pub process: u32,
    /// Name of the engine, UTF-8, filled up with 0.
    pub name: [u8; 64],
    /// For later; 0.
    pub reserved: [u64; 4],
}

impl Hello {
    /// A request for an arm of `joints` joints with a period and watchdog in ns.
    pub fn new(joints: usize, period_ns: u64, watchdog_ns: u64, clock: Clock) -> Self {
        Self {
            protocol: PROTOCOL,
            joints: joints as u32,
            schema: schema_checksum(),
            model: 0,
            period_ns,
            watchdog_ns,
            clock: clock as u32,
            process: std::process::id(),
            name: bytes_of("canter engine"),
            reserved: [0; 4],
        }
    }

    /// Whether a driver of `joints` joints can use the request.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, joints: usize) -> Result<(), MessageError> {
        if self.protocol != PROTOCOL {
            return Err(MessageError::Protocol {
                expected: PROTOCOL,
                found: self.protocol,
            });
        }
        if self.schema != schema_checksum() {
            return Err(MessageError::Schema {
                expected: schema_checksum(),
                found: self.schema,
            });
        }
        check_head(self.protocol, self.joints, joints)?;
        check_range("period_ns", self.period_ns, 100_000, 1_000_000_000)?;
        check_range(
            "watchdog_ns",
            self.watchdog_ns,
            self.period_ns,
            10_000_000_000,
        )?;
        if Clock::from_number(self.clock).is_none() {
            return Err(MessageError::Choice {
                field: "clock",
                value: self.clock,
            });
        }
        Ok(())
    }
}

/// The driver's answer to a [`Hello`].
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.HelloAck.2")]
pub struct HelloAck {
    /// Protocol version of the driver.
    pub protocol: u32,
    /// Number of joints of the driver.
    pub joints: u32,
    /// A [`Verdict`] by number.
    pub verdict: u32,
    /// Bits of [`DriverFeatures`].
    pub features: u32,
    /// [`schema_checksum`] of the driver.
    pub schema: u64,
    /// The session; never 0 with a welcome.
    pub session: u64,
    /// The watchdog that the driver will keep (ns).
    pub watchdog_ns: u64,
    /// Measured joint positions (rad, m).
    pub position: [f64; MAX_JOINTS],
    /// Commanded joint positions (rad, m): the first setpoint must be exactly there. They are the
    /// measured ones where the arm's controller does not tell what it commands.
    pub commanded: [f64; MAX_JOINTS],
    /// Lower ends of the driver's joint ranges (rad, m).
    pub lower: [f64; MAX_JOINTS],
    /// Upper ends of the driver's joint ranges (rad, m).
    pub upper: [f64; MAX_JOINTS],
    /// Largest joint speeds that the driver follows (rad/s, m/s).
    pub velocity: [f64; MAX_JOINTS],
    /// Largest joint accelerations that the driver follows (rad/s², m/s²).
    pub acceleration: [f64; MAX_JOINTS],
    /// Largest joint jerks that the driver follows (rad/s³, m/s³).
    pub jerk: [f64; MAX_JOINTS],
    /// The shortest and the longest period that it can serve (ns).
    pub periods_ns: [u64; 2],
    /// How late the arm is behind the setpoints, by the driver's own delay (ns); 0 if none.
    pub delay_ns: u64,
    /// Name of the driver, UTF-8, filled up with 0.
    pub name: [u8; 64],
    /// The reason of a refusal or of waiting, UTF-8, filled up with 0.
    pub reason: [u8; 128],
    /// For later; 0.
    pub reserved: [u64; 4],
}

impl HelloAck {
    /// An answer without a session.
    pub fn refusal(joints: usize, verdict: Verdict, reason: &str) -> Self {
        Self {
            protocol: PROTOCOL,
            joints: joints as u32,
            verdict: verdict as u32,
            features: 0,
            schema: schema_checksum(),
            session: 0,
            watchdog_ns: 0,
            position: [0.0; MAX_JOINTS],
            lower: [0.0; MAX_JOINTS],
            upper: [0.0; MAX_JOINTS],
            commanded: [0.0; MAX_JOINTS],
            velocity: [0.0; MAX_JOINTS],
            acceleration: [0.0; MAX_JOINTS],
            jerk: [0.0; MAX_JOINTS],
            periods_ns: [0; 2],
            delay_ns: 0,
            name: [0; 64],
            reason: bytes_of(reason),
            reserved: [0; 4],
        }
    }

    /// Checks a welcome for an arm of `joints` joints.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, joints: usize) -> Result<(), MessageError> {
        if Verdict::from_number(self.verdict).is_none() {
            return Err(MessageError::Choice {
                field: "verdict",
                value: self.verdict,
            });
        }
        check_head(self.protocol, self.joints, joints)?;
        check_range("session", self.session, 1, u64::MAX)?;
        check_range("watchdog_ns", self.watchdog_ns, 1, 10_000_000_000)?;
        check_finite("position", &self.position, joints)?;
        check_finite("commanded position", &self.commanded, joints)?;
        check_finite("lower end", &self.lower, joints)?;
        check_finite("upper end", &self.upper, joints)?;
        check_finite("velocity limit", &self.velocity, joints)?;
        check_finite("acceleration limit", &self.acceleration, joints)?;
        check_finite("jerk limit", &self.jerk, joints)
    }
}

/// `text` cut to `L` bytes at a character and filled up with 0.
pub fn bytes_of<const L: usize>(text: &str) -> [u8; L] {
    let mut bytes = [0; L];
    let mut end = text.len().min(L);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
    bytes
}

/// The text of a field of a message; what is not UTF-8 or not printable becomes `?`.
pub fn text_of(bytes: &[u8]) -> String {
    let end = bytes
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end])
        .chars()
        .map(|c| {
            if c.is_control() || c == char::REPLACEMENT_CHARACTER {
                '?'
            } else {
                c
            }
        })
        .collect()
}

//! What a robot says about itself.

use ipc::{MAX_ANALOGUE, MAX_SENSORS, Sensor, bytes_of};

use crate::Reference;

/// How one joint is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Position (rad).
    pub position: f64,
    /// Velocity (rad/s).
    pub velocity: f64,
    /// Effort (N m).
    pub effort: f64,
}

impl From<Reference> for Measured {
    /// A joint that is exactly where it shall be.
    fn from(reference: Reference) -> Self {
        Self {
            position: reference.position,
            velocity: reference.velocity,
            effort: 0.0,
        }
    }
}

/// When the joints were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measurement {
    /// Now.
    Now,
    /// At another time.
    At {
        /// When (ns of `CLOCK_MONOTONIC`).
        measured_ns: u64,
        /// When by the hardware's own clock (ns); 0 if there is none.
        hardware_ns: u64,
    },
    /// The arm sends nothing; the joints are as they were last known.
    Unknown,
}

/// A fault of the hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotFault {
    /// The joint from 0; `u32::MAX` for none.
    pub joint: u32,
    /// The maker's number; 0 for none.
    pub code: u32,
    /// The maker's name of it, UTF-8, filled up with 0.
    pub text: [u8; 96],
}

impl RobotFault {
    /// A fault with its maker's number and name; a name longer than 96 bytes is cut.
    pub fn new(joint: Option<u32>, code: u32, text: &str) -> Self {
        Self {
            joint: joint.unwrap_or(u32::MAX),
            code,
            text: bytes_of(text),
        }
    }
}

/// Inputs of the arm's controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Digital inputs, one bit each.
    pub digital: u64,
    /// Analogue inputs, in the unit of the arm (V, A).
    pub analogue: [f64; MAX_ANALOGUE],
}

/// Outputs of the arm's controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outputs {
    /// Digital outputs, one bit each.
    pub digital: u64,
    /// Which of them are set; the others stay as they are.
    pub digital_mask: u64,
    /// Analogue outputs, in the unit of the arm (V, A).
    pub analogue: [f64; MAX_ANALOGUE],
    /// Which of them are set, one bit each; the others stay as they are.
    pub analogue_mask: u64,
}

/// Named values of sensors, of one period.
#[derive(Clone, Copy, Debug)]
pub struct Sensors {
    values: [Sensor; MAX_SENSORS],
    count: usize,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            values: [Sensor::default(); MAX_SENSORS],
            count: 0,
        }
    }
}

impl Sensors {
    /// Adds a value (SI units); NaN when it is not known now. Returns whether there was room.
    pub fn push(&mut self, name: &str, value: f64) -> bool {
        let Some(place) = self.values.get_mut(self.count) else {
            return false;
        };
        *place = Sensor::new(name, value);
        self.count += 1;
        true
    }

    /// Forgets all values.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Writes the values into a state; returns how many there are.
    pub(crate) fn write(&self, places: &mut [Sensor; MAX_SENSORS]) -> u32 {
        let values = places.iter_mut().zip(&self.values).take(self.count);
        values.for_each(|(place, value)| *place = *value);
        self.count as u32
    }
}

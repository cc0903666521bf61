//! Named sensor values in a state.

use iceoryx2::prelude::ZeroCopySend;

use crate::{bytes_of, text_of};

/// One value of a sensor: a force, a torque, a distance.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.Sensor.2")]
pub struct Sensor {
    /// The name, UTF-8, filled up with 0. It is the same for the whole session.
    pub name: [u8; 24],
    /// The value in SI units; NaN when it is not known now.
    pub value: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            name: [0; 24],
            value: f64::NAN,
        }
    }
}

impl Sensor {
    /// A value by name; a name longer than 24 bytes is cut.
    pub fn new(name: &str, value: f64) -> Self {
        Self {
            name: bytes_of(name),
            value,
        }
    }

    /// The name as text.
    pub fn text(&self) -> String {
        text_of(&self.name)
    }

    /// Whether this is the sensor `name`. Does not allocate.
    pub fn is(&self, name: &str) -> bool {
        self.name == bytes_of::<24>(name)
    }
}

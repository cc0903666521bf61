//! What the arm carries.

use iceoryx2::prelude::ZeroCopySend;

/// What the arm carries, repeated in every setpoint. A new `number` is a new payload; 0 is none:
/// the arm keeps what it knows.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.Payload.2")]
pub struct Payload {
    /// Number of the payload; 0 is none. It grows by one with each.
    pub number: u32,
    /// For later; 0.
    pub reserved: u32,
    /// Mass of tool and object (kg).
    pub mass: f64,
    /// Centre of mass in the flange's frame (m).
    pub centre: [f64; 3],
    /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz (kg m²).
    pub inertia: [f64; 6],
    /// Tool centre point in the flange's frame (m).
    pub tool_position: [f64; 3],
    /// Its orientation: w, x, y, z.
    pub tool_rotation: [f64; 4],
}

impl Default for Payload {
    fn default() -> Self {
        Self {
            number: 0,
            reserved: 0,
            mass: 0.0,
            centre: [0.0; 3],
            inertia: [0.0; 6],
            tool_position: [0.0; 3],
            tool_rotation: [1.0, 0.0, 0.0, 0.0],
        }
    }
}

//! What a recording is about.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The version of the form of recordings.
pub const FORM: u32 = 1;

/// What a recording is about; at the start of every file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// [`FORM`] of the writer.
    pub form: u32,
    /// Version of Canter that wrote it.
    pub version: String,
    /// `<cell>/<arm>`.
    pub arm: String,
    /// Name of the robot.
    pub robot: String,
    /// Name of the driver.
    pub driver: String,
    /// Names of the joints, root first.
    pub joints: Vec<String>,
    /// Name of the link at the robot's root, as in its URDF.
    pub root_link: String,
    /// Length of a servo period (ns).
    pub period_ns: u64,
    /// Wall time of period 0 (ns since 1970).
    pub begin_ns: u64,
    /// Where the base stands in the workstation: x, y, z (m), qw, qx, qy, qz.
    pub workstation_from_base: [f64; 7],
    /// Joint positions at the start of the session (rad, m).
    pub start: Vec<f64>,
    /// Unit of length of programs until they set one: `mm`, `m` or `inch`.
    pub default_length: String,
    /// Why the file was written: `record`, or `fault`.
    pub reason: String,
    /// Text of the URDF.
    #[serde(skip)]
    pub urdf: String,
    /// Text of robot.toml.
    #[serde(skip)]
    pub robot_toml: String,
}

impl Head {
    /// As a metadata record, for people and tools that look into the file.
    pub(crate) fn metadata(&self) -> BTreeMap<String, String> {
        let pairs = [
            ("version", self.version.clone()),
            ("arm", self.arm.clone()),
            ("robot", self.robot.clone()),
            ("driver", self.driver.clone()),
            ("period_ns", self.period_ns.to_string()),
            ("begin_ns", self.begin_ns.to_string()),
            ("reason", self.reason.clone()),
        ];
        pairs
            .into_iter()
            .map(|(name, value)| (name.to_owned(), value))
            .collect()
    }

    /// Wall time of a servo period (ns since 1970).
    #[must_use]
    pub fn time_of(&self, tick: u64) -> u64 {
        self.begin_ns
            .saturating_add(tick.saturating_mul(self.period_ns))
    }
}

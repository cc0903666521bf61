//! One servo period, as it is recorded.

/// How many joints a robot may have.
pub const MAX_JOINTS: usize = 8;

/// One servo period: what was published and what was measured in answer. Lists have one entry per
/// joint, root first, and 0 behind the last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The servo period since the start of the session.
    pub tick: u64,
    /// Number of the command in the session, from 1; 0 before the first.
    pub command: u32,
    /// Planned time since the command's start (s).
    pub path_time: f64,
    /// Speed along the path as a share of the planned one, 0..=1.
    pub time_scaling: f64,
    /// Joint positions published (rad, m).
    pub position: [f64; MAX_JOINTS],
    /// Joint velocities published (rad/s, m/s).
    pub velocity: [f64; MAX_JOINTS],
    /// Joint accelerations published (rad/s², m/s²).
    pub acceleration: [f64; MAX_JOINTS],
    /// Joint positions measured (rad, m).
    pub measured: [f64; MAX_JOINTS],
    /// Published pose of the controlled point in the workstation: x, y, z (m), qw, qx, qy, qz.
    pub tool: [f64; 7],
    /// Measured place of the controlled point in the workstation: x, y, z (m).
    pub measured_tool: [f64; 3],
}

/// Counts of servo periods since the start of the session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Periods {
    /// Periods in all: published and skipped.
    pub ticks: u64,
    /// Setpoints published.
    pub published: u64,
    /// Periods that came too late and were left out.
    pub skipped: u64,
    /// Setpoints that the driver missed, by its own count.
    pub driver_missed: u64,
    /// Samples that the recorder had no room for.
    pub unrecorded: u64,
}

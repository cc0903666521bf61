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

/// One servo period as it was published and answered: what a [`Sample`] is made of. Lists have one
/// entry per joint at least; what is behind the last joint is left out.
#[derive(Clone, Copy, Debug)]
pub struct Period<'a> {
    /// The servo period since the start of the session.
    pub tick: u64,
    /// Number of the command in the session, from 1; 0 before the first.
    pub command: u32,
    /// Planned time since the command's start (s).
    pub path_time: f64,
    /// Speed along the path as a share of the planned one, 0..=1.
    pub time_scaling: f64,
    /// Published positions, velocities and accelerations (rad, m, and per s, s²).
    pub published: [&'a [f64]; 3],
    /// Joint positions measured (rad, m).
    pub measured: &'a [f64],
    /// Published pose of the controlled point in the workstation: x, y, z (m), qw, qx, qy, qz.
    pub tool: [f64; 7],
    /// Measured place of the controlled point in the workstation: x, y, z (m).
    pub measured_tool: [f64; 3],
}

impl Sample {
    /// The sample of a period of an arm with so many joints.
    ///
    /// ```
    /// use recorder::{Period, Sample};
    /// let period = Period {
    ///     tick: 7, command: 1, path_time: 0.5, time_scaling: 1.0,
    ///     published: [&[0.1, 0.2, 9.0], &[0.3, 0.4, 9.0], &[0.5, 0.6, 9.0]],
    ///     measured: &[0.1, 0.2], tool: [0.0; 7], measured_tool: [0.0; 3],
    /// };
    /// let sample = Sample::of(&period, 2);
    /// assert_eq!(sample.position[..3], [0.1, 0.2, 0.0]);
    /// assert_eq!(sample.acceleration[1], 0.6);
    /// ```
    #[must_use]
    pub fn of(period: &Period<'_>, joints: usize) -> Self {
        let list = |values: &[f64]| {
            let mut all = [0.0; MAX_JOINTS];
            for (to, from) in all.iter_mut().zip(values.iter().take(joints)) {
                *to = *from;
            }
            all
        };
        let [position, velocity, acceleration] = period.published.map(list);
        Self {
            tick: period.tick,
            command: period.command,
            path_time: period.path_time,
            time_scaling: period.time_scaling,
            position,
            velocity,
            acceleration,
            measured: list(period.measured),
            tool: period.tool,
            measured_tool: period.measured_tool,
        }
    }
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

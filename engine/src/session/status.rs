//! The status of a session, for operators.

use nalgebra::Isometry3;
use serde::Serialize;

use planner::modal::{CanonState, Settings};
use servo::{Counters, Histogram};
use trajectory::ToolLimits;

/// A picture of a running session.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Status {
    /// `<cell>/<arm>`.
    pub arm: String,
    /// Name of the robot.
    pub robot: String,
    /// Name of the driver.
    pub driver: String,
    /// `unready`, `ready` or `ended`.
    pub state: &'static str,
    /// Name of the current command, if any.
    pub command: Option<&'static str>,
    /// Commands that wait.
    pub queued: usize,
    /// Whether each command waits until it is let go.
    pub single_step: bool,
    /// Whether nothing is left to do.
    pub idle: bool,
    /// Whether a pause or a stop holds the arm.
    pub held: bool,
    /// The latched fault, if any.
    pub fault: Option<String>,
    /// Share of the planned speed, now.
    pub time_scaling: f64,
    /// Share of the planned speed that the arm itself asks for; 1 without a wish.
    pub speed_asked: f64,
    /// Measured joint positions, rad or m.
    pub joints: Vec<f64>,
    /// Joint positions of the last setpoint, rad or m.
    pub setpoint: Vec<f64>,
    /// Name of each joint.
    pub joint_names: Vec<String>,
    /// Whether each joint slides.
    pub sliding: Vec<bool>,
    /// Measured position of the controlled point in the workstation, m.
    pub position_m: [f64; 3],
    /// Its orientation: w, x, y, z.
    pub orientation_wxyz: [f64; 4],
    /// Settings in force, SI.
    pub settings: Option<Settings>,
    /// The largest values that settings can have.
    pub largest: Option<Largest>,
    /// Number of moves that the session planned itself; moves that came with a plan do not count.
    pub plans: u64,
    /// Servo periods.
    pub cycles: Cycles,
    /// How long they took.
    pub timing: Timing,
}

/// What the robot can do at most, SI; infinite where there is no limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Largest {
    /// Speed of the controlled point, m/s.
    pub speed: f64,
    /// Acceleration of the controlled point, m/s2.
    pub acceleration: f64,
    /// Speed of rotation, rad/s.
    pub rot_speed: f64,
    /// Acceleration of rotation, rad/s2.
    pub rot_accel: f64,
}

impl From<ToolLimits> for Largest {
    fn from(limits: ToolLimits) -> Self {
        Self {
            speed: limits.speed,
            acceleration: limits.acceleration,
            rot_speed: limits.angular_speed,
            rot_accel: limits.angular_acceleration,
        }
    }
}

/// Counts of servo periods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Cycles {
    /// Periods in all: published and skipped.
    pub ticks: u64,
    /// Setpoints published.
    pub published: u64,
    /// Periods that came too late and were left out.
    pub skipped: u64,
    /// Setpoints that the driver missed, by its own count.
    pub driver_missed: u64,
    /// Events and samples of periods that were not read in time.
    pub lost_reports: u64,
}

impl From<Counters> for Cycles {
    fn from(counters: Counters) -> Self {
        Self {
            ticks: counters.ticks,
            published: counters.published,
            skipped: counters.skipped,
            driver_missed: counters.driver_missed,
            lost_reports: counters.lost_reports,
        }
    }
}

/// Durations of servo periods since the engine started, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Timing {
    /// How late the servo thread woke up.
    pub wake_up: Spread,
    /// How long the work of a period took.
    pub work: Spread,
}

/// A distribution of durations, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Spread {
    /// Half of them were shorter, to a sixteenth.
    pub p50: u64,
    /// One of a hundred was longer, to a sixteenth.
    pub p99: u64,
    /// The longest.
    pub longest: u64,
}

impl From<&Histogram> for Spread {
    fn from(durations: &Histogram) -> Self {
        Self {
            p50: durations.quantile(0.5),
            p99: durations.quantile(0.99),
            longest: durations.largest(),
        }
    }
}

impl Status {
    pub(super) fn set_pose(&mut self, pose: &Isometry3<f64>) {
        self.position_m = pose.translation.vector.into();
        let q = pose.rotation;
        self.orientation_wxyz = [q.w, q.i, q.j, q.k];
    }
}

pub(super) fn state_name(state: CanonState) -> &'static str {
    match state {
        CanonState::Unready => "unready",
        CanonState::Ready => "ready",
        CanonState::Ended => "ended",
    }
}

//! The problem of one joint: conversion between SI units and the normalised form.

use super::axis::Axis;
use super::brake::Brake;
use super::direct::direct;
use super::extremal::{Bounds, End};
use super::limits::Limits;
use super::options::Interface;
use super::profile::{BlendedProfile, Point};
use super::state::State;
use super::velocity_problem::VelocityProblem;

/// The units of the normalised form of one joint: jerk limit and acceleration limit are 1.
///
/// They depend on limits only, and only by multiplication and division, so a change of SI units
/// by powers of two changes no bit of the normalised numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    /// Seconds.
    pub(crate) time: f64,
    /// Radians or metres, and so on; negative or scaled for a joint that follows a line.
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

impl Units {
    fn new(velocity: f64, acceleration: f64, jerk: f64) -> Self {
        let time = if jerk.is_finite() {
            acceleration / jerk
        } else if velocity.is_finite() {
            velocity / acceleration
        } else {
            1.0
        };
        let speed = acceleration * time;
        Self {
            time,
            position: speed * time,
            velocity: speed,
            acceleration,
            jerk: acceleration / time,
        }
    }

    /// The units of a joint that moves `factor` times as far as the joint of these units.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self {
            time: self.time,
            position: self.position * factor,
            velocity: self.velocity * factor,
            acceleration: self.acceleration * factor,
            jerk: self.jerk * factor,
        }
    }
}

/// Start, target and limits of one joint (SI).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given {
    pub(crate) start: [f64; 3],
    pub(crate) target: [f64; 3],
    pub(crate) velocity: [f64; 2],
    pub(crate) acceleration: [f64; 2],
    pub(crate) jerk: f64,
    /// Largest effect of rounding the positions.
    pub(crate) grain: f64,
}

impl Given {
    pub(crate) fn of<const N: usize>(
        joint: usize,
        start: &State<N>,
        target: &State<N>,
        limits: &Limits<N>,
    ) -> Self {
        Self {
            start: [
                start.position[joint],
                start.velocity[joint],
                start.acceleration[joint],
            ],
            target: [
                target.position[joint],
                target.velocity[joint],
                target.acceleration[joint],
            ],
            velocity: [limits.velocity_min[joint], limits.velocity_max[joint]],
            acceleration: [
                limits.acceleration_min[joint],
                limits.acceleration_max[joint],
            ],
            jerk: limits.jerk[joint],
            grain: f64::EPSILON * (start.position[joint].abs() + target.position[joint].abs()),
        }
    }
}

/// What a joint has to do, normalised.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) enum Task {
    /// Hold the start position.
    #[default]
    Idle,
    /// Reach a state.
    Reach(Axis),
    /// Reach a velocity.
    VelocityProblem(VelocityProblem),
}

/// The frame of one joint's profile: its units, and the braking before the profile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    units: Units,
    brake: Brake,
    pause: f64,
    /// The normalised start before and after braking.
    start: Point,
    launch: Point,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            units: Units::new(1.0, 1.0, 1.0),
            brake: Brake::default(),
            pause: 0.0,
            start: Point::default(),
            launch: Point::default(),
        }
    }
}

impl Frame {
    /// The frame of a joint that begins in `from` (normalised) and brakes first.
    fn new(units: Units, from: End, brake: Brake) -> Self {
        let start = Point {
            velocity: from.velocity,
            acceleration: from.acceleration,
            ..Point::default()
        };
        let pause = brake.duration();
        let launch = if pause > 0.0 {
            brake.point(start, pause)
        } else {
            start
        };
        Self {
            units,
            brake,
            pause,
            start,
            launch,
        }
    }
}

/// One joint's problem.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint {
    pub(crate) frame: Frame,
    pub(crate) smooth: bool,
    task: Task,
}

impl Default for Joint {
    fn default() -> Self {
        Self {
            frame: Frame::default(),
            smooth: true,
            task: Task::Idle,
        }
    }
}

impl Joint {
    /// The problem of one joint.
    pub(crate) fn new(given: &Given, interface: Interface) -> Self {
        let units = Units::new(given.velocity[1], given.acceleration[1], given.jerk);
        let bounds = Bounds {
            rise: 1.0,
            fall: -given.acceleration[0] / units.acceleration,
            top: given.velocity[1] / units.velocity,
            bottom: given.velocity[0] / units.velocity,
            smooth: given.jerk.is_finite(),
        };
        let normal = |state: &[f64; 3]| End {
            velocity: state[1] / units.velocity,
            acceleration: if bounds.smooth {
                state[2] / units.acceleration
            } else {
                0.0
            },
        };
        let (from, to) = (normal(&given.start), normal(&given.target));
        let brake = Brake::new(from, bounds, interface == Interface::Position);
        let frame = Frame::new(units, from, brake);
        let launch = frame.launch;
        let ready = End {
            velocity: launch.velocity,
            acceleration: launch.acceleration,
        };
        let task = match interface {
            Interface::Position => {
                let distance = (given.target[0] - given.start[0]) / units.position;
                let noise = given.grain / units.position;
                Task::Reach(Axis::new(
                    ready,
                    to,
                    bounds,
                    distance - launch.position,
                    noise,
                ))
            }
            Interface::Velocity => Task::VelocityProblem(VelocityProblem::new(ready, to, bounds)),
        };
        Self {
            frame,
            smooth: bounds.smooth,
            task,
        }
    }

    /// The shortest possible duration (s) not below `from` (s); infinity if none can be computed.
    pub(crate) fn next_possible(&self, from: f64) -> f64 {
        let wanted = from / self.frame.units.time - self.frame.pause;
        let next = match &self.task {
            Task::Idle => return from,
            Task::Reach(axis) => axis.next_possible(wanted),
            Task::VelocityProblem(velocity_problem) => velocity_problem.next_possible(wanted),
        };
        if next <= wanted {
            from
        } else {
            (next + self.frame.pause) * self.frame.units.time
        }
    }

    /// The profile of `duration` (s) after braking, which must be possible.
    pub(crate) fn blended_profile(&self, duration: f64) -> BlendedProfile {
        let time = (duration / self.frame.units.time - self.frame.pause).max(0.0);
        match &self.task {
            Task::Idle => BlendedProfile::default(),
            Task::Reach(axis) => axis.blended_profile(time),
            Task::VelocityProblem(velocity_problem) => velocity_problem.blended_profile(time),
        }
    }

    /// The profile of `duration` (s) with one constant velocity, if there is one of that shape.
    pub(crate) fn direct_profile(&self, duration: f64) -> Option<BlendedProfile> {
        match &self.task {
            Task::Reach(axis) => direct(axis, duration / self.frame.units.time - self.frame.pause),
            Task::Idle | Task::VelocityProblem(_) => None,
        }
    }

    /// A quick estimate of the duration (s), to begin with the slowest joint.
    pub(crate) fn guess(&self) -> f64 {
        match &self.task {
            Task::Reach(axis) => (axis.guess() + self.frame.pause) * self.frame.units.time,
            _ => 0.0,
        }
    }
}

impl Frame {
    /// The frame of a joint that moves `share` times as far.
    pub(crate) fn scaled(mut self, share: f64) -> Self {
        self.units = self.units.scaled(share);
        self
    }

    /// The units of the profile.
    pub(crate) fn units(&self) -> &Units {
        &self.units
    }

    /// How long (s) it takes to get back inside the limits.
    pub(crate) fn braking(&self) -> f64 {
        self.pause * self.units.time
    }

    /// The normalised point at `time` (s).
    pub(crate) fn point(&self, blended_profile: &BlendedProfile, time: f64) -> Point {
        let time = time / self.units.time;
        if time < self.pause {
            self.brake.point(self.start, time)
        } else {
            blended_profile.point(self.launch, time - self.pause)
        }
    }

    /// The switching instants (s) of `blended profile`, each after the one before it on its profile.
    pub(crate) fn switches(&self, blended_profile: &BlendedProfile, mut visit: impl FnMut(f64)) {
        let mut time = 0.0;
        for (length, _) in self.brake.parts() {
            time += length;
            visit(time * self.units.time);
        }
        for (profile, _) in blended_profile.parts() {
            let mut time = self.pause;
            for length in profile.times {
                time += length;
                visit(time * self.units.time);
            }
        }
    }
}

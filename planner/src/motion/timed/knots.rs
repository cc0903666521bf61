//! The points of a joint trajectory with times, checked and in the order of the arm's joints.

use nalgebra::SVector;
use realtime::{Piece, Sample};

use super::super::Planner;
use super::super::timed_refusal::TimedRefusal;
use crate::timed::{TimedPoint, TimedTrajectory};

/// Largest number of points.
const MOST: usize = 100_000;
/// Least time between two points, s.
const LEAST_TIME: f64 = 1e-6;
/// Longest trajectory, s: a day.
const LONGEST: f64 = 86_400.0;
/// A velocity that counts as rest at the first and the last point (rad/s, m/s).
const REST: f64 = 1e-4;
/// How far beyond its range a joint may be by rounding (rad, m).
const ROUNDED: f64 = 1e-9;
/// A jump of the velocity that is none (rad/s, m/s).
const SMOOTH: f64 = 1e-9;

/// The points in the order of the arm's joints.
pub(super) struct Knots<const N: usize> {
    /// Time of each, s.
    pub times: Vec<f64>,
    /// Positions (rad, m), velocities and accelerations, where these are given or follow.
    pub samples: Vec<Sample<N>>,
    /// Whether the points have velocities.
    pub moving: bool,
    /// Whether they have accelerations.
    bent: bool,
    /// Number of the first sample: 1, or 0 where the arm's position was put before the first point.
    first: usize,
}

impl<const N: usize> Knots<N> {
    /// The points of a trajectory.
    ///
    /// # Errors
    /// The first thing that is wrong with their form.
    pub(super) fn read(
        planner: &Planner<N>,
        timed: &TimedTrajectory,
    ) -> Result<Self, TimedRefusal> {
        let got = timed.points.len();
        if got == 0 || got > MOST {
            return Err(TimedRefusal::Count { most: MOST, got });
        }
        let order = order(planner, &timed.joints)?;
        let has = |list: fn(&TimedPoint) -> &Vec<f64>| {
            timed.points.iter().any(|point| !list(point).is_empty())
        };
        let bent = has(|p| &p.accelerations);
        let given = [true, bent || has(|p| &p.velocities), bent];
        let mut samples = Vec::with_capacity(got);
        let mut times: Vec<f64> = Vec::with_capacity(got);
        for (index, point) in timed.points.iter().enumerate() {
            let number = index + 1;
            let least = times.last().map_or(0.0, |last| last + LEAST_TIME);
            let time = point.time;
            if !(least..=LONGEST).contains(&time) {
                return Err(TimedRefusal::Time {
                    point: number,
                    time,
                    least,
                });
            }
            times.push(time);
            samples.push(sample(planner, (number, point), &order, given)?);
        }
        Ok(Self {
            times,
            samples,
            moving: given[1],
            bent,
            first: 1,
        })
    }

    /// Puts the arm's position before the first point, if that is later than the start.
    pub(super) fn begin(&mut self, start: &SVector<f64, N>) {
        if self.times[0] > 0.0 {
            self.times.insert(0, 0.0);
            self.samples.insert(0, Sample::rest(*start));
            self.first = 0;
        }
    }

    /// In words, between which points piece `index` lies.
    pub(super) fn place(&self, index: usize) -> String {
        match index + self.first {
            0 => "before point 1".to_owned(),
            point => format!("between points {point} and {}", point + 1),
        }
    }

    /// The first and last point must be at rest; what is left of their velocities and accelerations
    /// is set to 0.
    ///
    /// # Errors
    /// Which joint moves at which of both.
    pub(super) fn rest_at_ends(&mut self, planner: &Planner<N>) -> Result<(), TimedRefusal> {
        let last = self.samples.len() - 1;
        for index in [0, last] {
            let sample = &mut self.samples[index];
            let joint = sample.velocity.iamax();
            let value = sample.velocity[joint];
            if value.abs() > REST {
                return Err(TimedRefusal::NotAtRest {
                    point: index + self.first,
                    joint: planner.joint_name(joint),
                    value,
                });
            }
            *sample = Sample::rest(sample.position);
        }
        Ok(())
    }

    /// Accelerations for points that have velocities only: the mean of both cubic pieces that meet
    /// there, so that the acceleration does not jump.
    pub(super) fn choose_accelerations(&mut self) {
        if self.bent {
            return;
        }
        let pairs = self.samples.windows(2).zip(self.times.windows(2));
        let bends: Vec<_> = pairs
            .map(|(ends, times)| cubic_bends(&ends[0], &ends[1], times[1] - times[0]))
            .collect();
        for (sample, meet) in self.samples.iter_mut().skip(1).zip(bends.windows(2)) {
            sample.acceleration = (meet[0][1] + meet[1][0]) * 0.5;
        }
    }

    /// The quintic pieces through the points.
    pub(super) fn pieces(&self) -> Vec<Piece<N>> {
        let pairs = self.samples.windows(2).zip(self.times.windows(2));
        pairs
            .map(|(ends, times)| Piece::hermite(times[1] - times[0], &ends[0], &ends[1]))
            .collect()
    }

    /// With positions only the pieces are straight: the arm must rest all the time, for each corner
    /// is a jump of the velocity.
    ///
    /// # Errors
    /// The largest jump of the first corner.
    pub(super) fn check_corners(&self, planner: &Planner<N>) -> Result<(), TimedRefusal> {
        let pairs = self.samples.windows(2).zip(self.times.windows(2));
        let slopes = pairs
            .map(|(ends, times)| (ends[1].position - ends[0].position) / (times[1] - times[0]));
        let mut before = SVector::zeros();
        for (index, slope) in slopes.chain([SVector::zeros()]).enumerate() {
            let jump: SVector<f64, N> = slope - before;
            let joint = jump.iamax();
            if jump[joint].abs() > SMOOTH {
                return Err(TimedRefusal::Corner {
                    point: index + self.first,
                    joint: planner.joint_name(joint),
                    jump: jump[joint].abs(),
                });
            }
            before = slope;
        }
        Ok(())
    }
}

/// Second derivatives at both ends of the cubic that has the positions and velocities of two
/// samples, `t` s apart.
///
/// # Source
/// Cubic Hermite interpolation; Biagiotti and Melchiorri, Trajectory Planning for Automatic
/// Machines and Robots, 2008, eq. 2.2.
fn cubic_bends<const N: usize>(from: &Sample<N>, to: &Sample<N>, t: f64) -> [SVector<f64, N>; 2] {
    let step = (to.position - from.position) * (6.0 / (t * t));
    let first = step - (from.velocity * 4.0 + to.velocity * 2.0) / t;
    let second = (from.velocity * 2.0 + to.velocity * 4.0) / t - step;
    [first, second]
}

/// For each joint of the arm its place in the numbers of a point.
fn order<const N: usize>(
    planner: &Planner<N>,
    given: &[String],
) -> Result<[usize; N], TimedRefusal> {
    let names = &planner.joint_names;
    for (index, joint) in given.iter().enumerate() {
        if !names.contains(joint) {
            return Err(TimedRefusal::UnknownJoint {
                joint: joint.clone(),
                known: names.join(", "),
            });
        }
        if given[..index].contains(joint) {
            return Err(TimedRefusal::JointTwice {
                joint: joint.clone(),
            });
        }
    }
    let mut order = [0; N];
    for (place, name) in order.iter_mut().zip(names) {
        let found = given.iter().position(|joint| joint == name);
        *place = found.ok_or_else(|| TimedRefusal::MissingJoint {
            joint: name.clone(),
        })?;
    }
    Ok(order)
}

/// One point in the order of the arm's joints; `given` tells whether the trajectory has positions,
/// velocities and accelerations.
fn sample<const N: usize>(
    planner: &Planner<N>,
    (number, point): (usize, &TimedPoint),
    order: &[usize; N],
    given: [bool; 3],
) -> Result<Sample<N>, TimedRefusal> {
    const WHAT: [(&str, &str); 3] = [
        ("positions", "position"),
        ("velocities", "velocity"),
        ("accelerations", "acceleration"),
    ];
    let lists = [&point.positions, &point.velocities, &point.accelerations];
    let mut read = [SVector::zeros(); 3];
    for (((list, given), (what, one)), values) in
        lists.into_iter().zip(given).zip(WHAT).zip(&mut read)
    {
        if !given {
            continue;
        }
        if list.is_empty() && what != WHAT[0].0 {
            return Err(TimedRefusal::Mixed {
                point: number,
                what,
            });
        }
        if list.len() != N {
            return Err(TimedRefusal::Length {
                point: number,
                what,
                got: list.len(),
                wanted: N,
            });
        }
        for joint in 0..N {
            let value = list[order[joint]];
            if !value.is_finite() {
                return Err(TimedRefusal::NoNumber {
                    point: number,
                    what: one,
                    joint: planner.joint_name(joint),
                    value,
                });
            }
            values[joint] = value;
        }
    }
    let [position, velocity, acceleration] = read;
    check_range(planner, number, &position)?;
    Ok(Sample {
        position,
        velocity,
        acceleration,
        jerk: SVector::zeros(),
    })
}

/// Whether a point is within the range of every joint.
fn check_range<const N: usize>(
    planner: &Planner<N>,
    number: usize,
    position: &SVector<f64, N>,
) -> Result<(), TimedRefusal> {
    for joint in 0..N {
        let (lower, upper) = (planner.limits.lower[joint], planner.limits.upper[joint]);
        let beyond = (position[joint] - upper).max(lower - position[joint]);
        if beyond > ROUNDED {
            return Err(TimedRefusal::Beyond {
                point: number,
                joint: planner.joint_name(joint),
                beyond: planner.amount(joint, beyond),
            });
        }
    }
    Ok(())
}

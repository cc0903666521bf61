//! What was proved of a planned move, as data.

use kinematics::Chain;
use nalgebra::{Isometry3, SVector, Vector3};
use serde::Serialize;
use trajectory::{JointLimits, ToolLimits, Trajectory};

use super::active::ActiveLimit;
use crate::task::{Move, Shape};

/// How one intermediate pose was passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PassReport {
    /// Which pose of the command, counted from 1.
    pub index: usize,
    /// Distance of the controlled point from the pose at the pass, m.
    pub deviation_m: f64,
    /// Tolerance in force, m.
    pub tolerance_m: f64,
    /// Time of the pass after the start of the move, s.
    pub time_s: f64,
}

/// Peak of each limited quantity, divided by its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Peaks {
    /// Joint velocity, one a joint.
    pub joint_velocity: Vec<f64>,
    /// Joint acceleration, one a joint.
    pub joint_acceleration: Vec<f64>,
    /// Joint jerk, one a joint.
    pub joint_jerk: Vec<f64>,
    /// Speed of the controlled point.
    pub tool_speed: f64,
    /// Acceleration of the controlled point.
    pub tool_acceleration: f64,
    /// Angular speed of the tool.
    pub tool_angular_speed: f64,
    /// Angular acceleration of the tool.
    pub tool_angular_acceleration: f64,
}

impl Peaks {
    /// How much slower a motion must be for every ratio to be at most 1:
    /// speeds fall with the factor, accelerations with its square, jerks with its cube.
    #[must_use]
    pub fn stretch(&self) -> f64 {
        let most = |ratios: &[f64]| ratios.iter().copied().fold(0.0, f64::max);
        let speed = most(&self.joint_velocity)
            .max(self.tool_speed)
            .max(self.tool_angular_speed);
        let acceleration = most(&self.joint_acceleration)
            .max(self.tool_acceleration)
            .max(self.tool_angular_acceleration);
        speed
            .max(acceleration.sqrt())
            .max(most(&self.joint_jerk).cbrt())
    }

    /// The largest ratio of all.
    #[must_use]
    pub fn largest(&self) -> f64 {
        let joints = self.joint_velocity.iter().chain(&self.joint_acceleration);
        joints
            .chain(&self.joint_jerk)
            .copied()
            .chain([
                self.tool_speed,
                self.tool_acceleration,
                self.tool_angular_speed,
                self.tool_angular_acceleration,
            ])
            .fold(0.0, f64::max)
    }
}

/// What holds of one planned move.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MoveCertificate {
    /// Time of the move, s.
    pub duration_s: f64,
    /// No move through the same poses to the same joints within the limits is
    /// shorter, s.
    pub lower_bound_s: f64,
    /// Which limit decides the speed when; where none does, the tolerance of
    /// poses or the change from one limit to the next.
    pub active: Vec<ActiveLimit>,
    /// Every intermediate pose, in the order of the command.
    pub poses: Vec<PassReport>,
    /// Whether the intermediate poses are passed in order, each within its tolerance.
    pub in_order: bool,
    /// Peaks of limits as ratios; at most 1.
    pub peaks: Peaks,
    /// Largest distance from the straight line, m; only for straight moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub straightness_m: Option<f64>,
    /// Distance from the last pose at the end, m.
    pub end_deviation_m: f64,
    /// Angle from the last pose at the end, rad.
    pub end_angle_rad: f64,
    /// Least distance of any joint from a position limit, rad or m; negative beyond it.
    pub joint_margin: f64,
}

/// One state of the tool, sampled from the joints.
pub(super) struct ToolSample {
    pub time: f64,
    pub pose: Isometry3<f64>,
    pub speed: f64,
    pub acceleration: f64,
    pub angular_speed: f64,
    pub angular_acceleration: f64,
}

/// Samples of a piece per evaluation of the tool; pieces are a few milliseconds long.
const PER_PIECE: usize = 4;

/// States of the tool all along a trajectory, from forward kinematics.
pub(super) fn tool_samples<const N: usize>(
    chain: &Chain<N>,
    trajectory: &Trajectory<N>,
) -> Vec<ToolSample> {
    let mut samples = Vec::with_capacity(trajectory.pieces().len() * PER_PIECE + 1);
    let mut start = 0.0;
    for piece in trajectory.pieces() {
        for part in 0..PER_PIECE {
            let within = piece.duration * part as f64 / PER_PIECE as f64;
            samples.push(tool_sample(chain, trajectory, start + within));
        }
        start += piece.duration;
    }
    samples.push(tool_sample(chain, trajectory, trajectory.duration()));
    samples
}

fn tool_sample<const N: usize>(
    chain: &Chain<N>,
    trajectory: &Trajectory<N>,
    time: f64,
) -> ToolSample {
    let joints = trajectory.sample(time);
    let (pose, jacobian) = chain.jacobian(&joints.position);
    let change = chain.jacobian_derivative(&joints.position, &joints.velocity);
    let twist = jacobian * joints.velocity;
    let rate = jacobian * joints.acceleration + change * joints.velocity;
    let (linear, angular) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
    let (linear_rate, angular_rate) = (rate.fixed_rows::<3>(0), rate.fixed_rows::<3>(3));
    ToolSample {
        time,
        pose,
        speed: linear.norm(),
        acceleration: linear_rate.norm(),
        angular_speed: angular.norm(),
        angular_acceleration: angular_rate.norm(),
    }
}

/// Peaks of tool and joints as ratios to their limits.
pub(super) fn peaks<const N: usize>(
    trajectory: &Trajectory<N>,
    tool: &[ToolSample],
    joints: &JointLimits<N>,
    limits: &ToolLimits,
) -> Peaks {
    let joint = trajectory.peaks();
    let ratios = |peak: &SVector<f64, N>, limit: &SVector<f64, N>| {
        peak.component_div(limit).as_slice().to_vec()
    };
    let most =
        |of: fn(&ToolSample) -> f64, limit: f64| tool.iter().map(of).fold(0.0, f64::max) / limit;
    Peaks {
        joint_velocity: ratios(&joint.velocity, &joints.velocity),
        joint_acceleration: ratios(&joint.acceleration, &joints.acceleration),
        joint_jerk: ratios(&joint.jerk, &joints.jerk),
        tool_speed: most(|s| s.speed, limits.speed),
        tool_acceleration: most(|s| s.acceleration, limits.acceleration),
        tool_angular_speed: most(|s| s.angular_speed, limits.angular_speed),
        tool_angular_acceleration: most(|s| s.angular_acceleration, limits.angular_acceleration),
    }
}

/// The way the tool takes, held against the poses of the command.
pub(super) struct Way {
    pub poses: Vec<PassReport>,
    pub in_order: bool,
    pub straightness_m: Option<f64>,
    pub end_deviation_m: f64,
    pub end_angle_rad: f64,
}

pub(super) fn way<const N: usize>(
    motion: &Move,
    chain: &Chain<N>,
    trajectory: &Trajectory<N>,
    samples: &[ToolSample],
) -> Way {
    let (poses, in_order) = match motion.shape {
        Shape::Smooth => passes(motion, chain, trajectory, samples),
        Shape::Joint | Shape::Straight => (Vec::new(), true),
    };
    let straight = motion.shape == Shape::Straight;
    let straightness_m = straight.then(|| straightness(samples));
    let end = chain.forward(&trajectory.sample(trajectory.duration()).position);
    let gap = motion
        .poses
        .last()
        .map(|goal| goal.inv_mul(&end))
        .unwrap_or_default();
    Way {
        poses,
        in_order,
        straightness_m,
        end_deviation_m: gap.translation.vector.norm(),
        end_angle_rad: gap.rotation.angle(),
    }
}

fn straightness(samples: &[ToolSample]) -> f64 {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return 0.0;
    };
    let origin = first.pose.translation.vector;
    let direction = last.pose.translation.vector - origin;
    let length = direction.norm();
    let along = if length > 0.0 {
        direction / length
    } else {
        Vector3::zeros()
    };
    let off = |sample: &ToolSample| {
        let way = sample.pose.translation.vector - origin;
        (way - along * way.dot(&along)).norm()
    };
    samples.iter().map(off).fold(0.0, f64::max)
}

/// Finds, in order, the first local closest approach to each intermediate
/// pose that lies within the tolerance; a later approach never repairs a miss.
fn passes<const N: usize>(
    motion: &Move,
    chain: &Chain<N>,
    trajectory: &Trajectory<N>,
    samples: &[ToolSample],
) -> (Vec<PassReport>, bool) {
    let intermediate = &motion.poses[..motion.poses.len() - 1];
    let (mut from, mut in_order) = (0, true);
    let mut reports = Vec::with_capacity(intermediate.len());
    for (index, pose) in intermediate.iter().enumerate() {
        let target = pose.translation.vector;
        let distance = |i: usize| (samples[i].pose.translation.vector - target).norm();
        let at = first_approach(from, samples.len(), motion.tolerance, distance);
        let window = (
            samples[at.saturating_sub(1)].time,
            samples[(at + 1).min(samples.len() - 1)].time,
        );
        let near = |t: f64| {
            let pose = chain.forward(&trajectory.sample(t).position);
            (pose.translation.vector - target).norm()
        };
        let (time_s, deviation_m) = closest(window, near);
        in_order &= deviation_m <= motion.tolerance.max(EXACT);
        reports.push(PassReport {
            index: index + 1,
            deviation_m,
            tolerance_m: motion.tolerance,
            time_s,
        });
        from = at;
    }
    (reports, in_order)
}

/// What counts as exact where the tolerance is zero, m: a hundredth of the
/// repeatability of the best arms.
const EXACT: f64 = 2e-7;

fn first_approach(
    from: usize,
    count: usize,
    tolerance: f64,
    distance: impl Fn(usize) -> f64,
) -> usize {
    let mut best = from;
    for i in from..count {
        let here = distance(i);
        let falls_before = i == from || here <= distance(i - 1);
        let rises_after = i + 1 == count || here < distance(i + 1);
        // Between samples the approach may be nearer than at them, hence the slack.
        let reach = if i + 1 < count {
            (distance(i + 1) - here).abs()
        } else {
            0.0
        };
        if falls_before && rises_after && here <= tolerance.max(EXACT) + reach {
            return i;
        }
        if here < distance(best) {
            best = i;
        }
    }
    best
}

/// Least value of a function with one valley between two times, by golden section.
fn closest((mut low, mut high): (f64, f64), distance: impl Fn(f64) -> f64) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let mut left = high - GOLDEN * (high - low);
    let mut right = low + GOLDEN * (high - low);
    let (mut at_left, mut at_right) = (distance(left), distance(right));
    for _ in 0..48 {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = distance(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = distance(right);
        }
    }
    if at_left <= at_right {
        (left, at_left)
    } else {
        (right, at_right)
    }
}

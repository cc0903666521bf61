//! What was proved of a planned move, as data.

use std::ops::Range;

use kinematics::Chain;
use nalgebra::{Isometry3, SVector};
use serde::{Serialize, Serializer};
use trajectory::bounds::{JointsToTool, Leg};
use trajectory::smooth::{RestCause, angular_tolerance};
use trajectory::timing::Limit;
use trajectory::{JointPoint, MotionBounds, ToolPoint, Trajectory};

use super::active::ActiveLimit;
use super::draft::Crossing;
use super::{Draft, Fault};
use crate::task::{Move, Shape};

/// How one intermediate pose was passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CrossingReport {
    /// Which pose of the command, counted from 1.
    pub index: usize,
    /// Distance of the controlled point from the pose at the pass, m.
    pub deviation_m: f64,
    /// Tolerance in force, m.
    pub tolerance_m: f64,
    /// Angle of the tool from the orientation of the pose at the pass, rad.
    pub angle_rad: f64,
    /// Largest such angle: [`trajectory::smooth::angular_tolerance`] of the tolerance, rad.
    pub angular_tolerance_rad: f64,
    /// Time of the pass after the start of the move, s.
    pub time_s: f64,
    /// Why the motion rests at the pose, if it does.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "in_words")]
    pub rests: Option<RestCause>,
}

impl CrossingReport {
    /// The same pass before it was looked at.
    pub(super) fn crossing(&self) -> Crossing {
        Crossing {
            time: self.time_s,
            rests: self.rests,
        }
    }
}

/// Writes a cause as its words.
fn in_words<S: Serializer>(cause: &Option<RestCause>, serializer: S) -> Result<S::Ok, S::Error> {
    cause.map(RestCause::as_str).serialize(serializer)
}

/// Peak of each limited quantity, divided by its limit: bounds for all times, at most one percent
/// above the largest value. 0 if there is no limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Peaks {
    /// Joint velocity, one per joint.
    pub joint_velocity: Vec<f64>,
    /// Joint acceleration, one per joint.
    pub joint_acceleration: Vec<f64>,
    /// Joint jerk, one per joint.
    pub joint_jerk: Vec<f64>,
    /// Joint effort, one per joint: from samples, with a margin for the times between them. Empty
    /// where efforts are not limited.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub joint_effort: Vec<f64>,
    /// Speed of the controlled point.
    pub tool_speed: f64,
    /// Acceleration of the controlled point.
    pub tool_acceleration: f64,
    /// Jerk of the controlled point.
    pub tool_jerk: f64,
    /// Angular speed of the tool.
    pub tool_angular_speed: f64,
    /// Angular acceleration of the tool.
    pub tool_angular_acceleration: f64,
    /// Angular jerk of the tool.
    pub tool_angular_jerk: f64,
}

impl Peaks {
    /// The ratios of a motion that is bounded.
    pub(super) fn of<const N: usize>(bounds: &MotionBounds<N>) -> Self {
        let joints = |limit: fn(usize) -> Limit| (0..N).map(|j| bounds.ratio(limit(j))).collect();
        Self {
            joint_velocity: joints(Limit::JointVelocity),
            joint_acceleration: joints(Limit::JointAcceleration),
            joint_jerk: joints(Limit::JointJerk),
            joint_effort: Vec::new(),
            tool_speed: bounds.ratio(Limit::ToolSpeed),
            tool_acceleration: bounds.ratio(Limit::ToolAcceleration),
            tool_jerk: bounds.ratio(Limit::ToolJerk),
            tool_angular_speed: bounds.ratio(Limit::AngularSpeed),
            tool_angular_acceleration: bounds.ratio(Limit::AngularAcceleration),
            tool_angular_jerk: bounds.ratio(Limit::AngularJerk),
        }
    }

    /// The largest ratio of all.
    #[must_use]
    pub fn largest(&self) -> f64 {
        let joints = self.joint_velocity.iter().chain(&self.joint_acceleration);
        joints
            .chain(&self.joint_jerk)
            .chain(&self.joint_effort)
            .copied()
            .chain([
                self.tool_speed,
                self.tool_acceleration,
                self.tool_jerk,
                self.tool_angular_speed,
                self.tool_angular_acceleration,
                self.tool_angular_jerk,
            ])
            .fold(0.0, f64::max)
    }
}

/// How near a move comes to one limit, and when.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitReport {
    /// Name of the limit: `tool speed`, `velocity of elbow`, ...
    pub limit: String,
    /// Bound of the quantity over its limit, for all times.
    pub ratio: f64,
    /// When the bound is about attained, s after the start of the move.
    pub time_s: f64,
}

/// What holds of one planned move.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MoveCertificate {
    /// Time of the move, s.
    pub duration_s: f64,
    /// Lower bound of the time of all moves through the same poses to the same joints within the
    /// limits, s.
    pub lower_bound_s: f64,
    /// The intervals in which limits are active. Where none is, the tolerance of poses or the
    /// change from one limit to the next limits the speed.
    pub active: Vec<ActiveLimit>,
    /// Every intermediate pose, in the order of the command.
    pub poses: Vec<CrossingReport>,
    /// Whether the intermediate poses are passed in order, each within its tolerances.
    pub in_order: bool,
    /// Peaks of limits as ratios; at most 1.
    pub peaks: Peaks,
    /// The peaks of all finite limits, with the time at which each is attained.
    pub limits: Vec<LimitReport>,
    /// Bound of the distance from the straight line at all times, m; only for straight moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub straightness_m: Option<f64>,
    /// Bound of the distance from the leg travelled at all times, m; only for smooth moves. At most
    /// the tolerance; if it is well within the tolerance, it need not be tight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corridor_m: Option<f64>,
    /// Distance from the last pose at the end, m.
    pub end_deviation_m: f64,
    /// Angle from the last pose at the end, rad.
    pub end_angle_rad: f64,
    /// Least distance of any joint from a position limit, rad or m; negative beyond it.
    pub joint_margin: f64,
}

/// The kinematics of an arm, for bounds of its tool's motion.
pub(super) struct Arm<'a, const N: usize>(pub &'a Chain<N>);

impl<const N: usize> JointsToTool<N> for Arm<'_, N> {
    fn motion(&self, joints: &JointPoint<N>) -> ToolPoint {
        let seen = self.0.motion(&joints.q);
        ToolPoint {
            pose: seen.pose,
            linear: seen.linear,
            angular: seen.angular,
        }
    }

    fn growth(&self, joints: &[SVector<f64, N>; 6]) -> ([f64; 9], [f64; 8]) {
        let growth = self.0.growth(joints);
        (growth.linear, growth.angular)
    }
}

/// The path of the tool, compared with the poses of the command.
pub(super) struct Way {
    pub poses: Vec<CrossingReport>,
    pub in_order: bool,
    pub straightness_m: Option<f64>,
    pub corridor_m: Option<f64>,
    pub end_deviation_m: f64,
    pub end_angle_rad: f64,
}

/// `start` is the joint position before the move.
pub(super) fn way<const N: usize>(
    motion: &Move,
    chain: &Chain<N>,
    start: &Isometry3<f64>,
    draft: &Draft<N>,
    bounds: &MotionBounds<N>,
) -> Way {
    let (poses, in_order) = match motion.shape {
        Shape::Smooth => crossings(motion, chain, &draft.trajectory, &draft.crossings),
        Shape::Joint | Shape::Straight => (Vec::new(), true),
    };
    let last = draft.trajectory.sample(draft.trajectory.duration());
    let end = chain.forward(&last.position);
    let line = || bounds.off_line(&start.translation.vector, &end.translation.vector);
    let gap = motion.poses.last().map(|goal| goal.inv_mul(&end));
    let gap = gap.unwrap_or_default();
    Way {
        straightness_m: (motion.shape == Shape::Straight).then(|| line().0),
        corridor_m: (motion.shape == Shape::Smooth).then(|| {
            bounds
                .off_legs(&legs(motion, start, &poses), corridor(motion))
                .0
        }),
        poses,
        in_order,
        end_deviation_m: gap.translation.vector.norm(),
        end_angle_rad: gap.rotation.angle(),
    }
}

/// Largest distance from the legs of a smooth move, m.
pub(super) fn corridor(motion: &Move) -> f64 {
    (motion.tolerance + FIT).max(super::STRAIGHT)
}

/// How far the joints may leave the planned path, m.
const FIT: f64 = 1e-6;

/// The legs of a smooth move, from pass to pass.
fn legs(motion: &Move, start: &Isometry3<f64>, crossings: &[CrossingReport]) -> Vec<Leg> {
    let times = crossings.iter().map(|pass| pass.time_s);
    let ends = times.clone().chain([f64::INFINITY]);
    let from = [start].into_iter().chain(&motion.poses);
    let pairs = from.zip(&motion.poses);
    let when = [0.0].into_iter().chain(times).zip(ends);
    pairs
        .zip(when)
        .map(|((from, to), (since, until))| Leg {
            ends: [from.translation.vector, to.translation.vector],
            when: [since, until],
        })
        .collect()
}

/// How each intermediate pose is passed at the time of its closest approach in the planned path. If
/// the joints leave the planned path, and so the ball, by rounding, the closest time near it
/// counts.
fn crossings<const N: usize>(
    motion: &Move,
    chain: &Chain<N>,
    trajectory: &Trajectory<N>,
    passes: &[Crossing],
) -> (Vec<CrossingReport>, bool) {
    let intermediate = &motion.poses[..motion.poses.len() - 1];
    let angular_tolerance_rad = angular_tolerance(motion.tolerance);
    let (mut since, mut in_order) = (0.0, passes.len() == intermediate.len());
    let mut reports = Vec::with_capacity(intermediate.len());
    for (index, (pose, planned)) in intermediate.iter().zip(passes).enumerate() {
        let seen = |t: f64| {
            let gap = pose.inv_mul(&chain.forward(&trajectory.sample(t).position));
            (gap.translation.vector.norm(), gap.rotation.angle())
        };
        let mut time_s = planned.time.clamp(since, trajectory.duration().max(since));
        let (mut deviation_m, mut angle_rad) = seen(time_s);
        if deviation_m > motion.tolerance {
            let after = passes
                .get(index + 1)
                .map_or(trajectory.duration(), |next| next.time);
            let window = since.max(time_s - NEAR)..(time_s + NEAR).min(after.max(time_s));
            let (closest_s, least) = closest(window, |t| seen(t).0);
            if least < deviation_m {
                time_s = closest_s;
                (deviation_m, angle_rad) = seen(time_s);
            }
        }
        let pass = CrossingReport {
            index: index + 1,
            deviation_m,
            tolerance_m: motion.tolerance,
            angle_rad,
            angular_tolerance_rad,
            time_s,
            rests: planned.rests,
        };
        in_order &= holds(&pass, since);
        reports.push(pass);
        since = time_s;
    }
    (reports, in_order)
}

/// Whether every intermediate pose is passed as the command asks.
pub(super) fn check_passes(certificate: &MoveCertificate, motion: &Move) -> Result<(), Fault> {
    let (poses, passed) = (motion.poses.len() - 1, certificate.poses.len());
    if poses != passed {
        return Err(Fault::Passes { poses, passed });
    }
    let mut since = 0.0;
    for pass in &certificate.poses {
        if !holds(pass, since) {
            return Err(Fault::Pass {
                pose: pass.index,
                deviation_m: pass.deviation_m,
                tolerance_m: pass.tolerance_m,
                angle_rad: pass.angle_rad,
                tolerance_rad: pass.angular_tolerance_rad,
                time_s: pass.time_s,
            });
        }
        since = pass.time_s;
    }
    Ok(())
}

/// Whether a pose is passed within its tolerances, not before a time (s).
fn holds(pass: &CrossingReport, since: f64) -> bool {
    pass.time_s >= since
        && pass.deviation_m <= pass.tolerance_m.max(EXACT)
        && pass.angle_rad <= pass.angular_tolerance_rad.max(EXACT_ANGLE)
}

/// Distance that counts as exact if the tolerance is zero, m: a hundredth of the repeatability of
/// the best arms.
const EXACT: f64 = 2e-7;
/// The same of an orientation, rad.
const EXACT_ANGLE: f64 = 1e-6;
/// Largest difference between the planned time of a pass and that of the joints, s.
const NEAR: f64 = 2e-3;

/// Minimum of a unimodal function between two times, by golden section.
pub(super) fn closest(within: Range<f64>, distance: impl Fn(f64) -> f64) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (within.start, within.end);
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

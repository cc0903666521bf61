//! The way of a joint trajectory with a time law of our own.
//!
//! Where points have velocities, the way is that of the quintic pieces: a spline through close
//! points of them. With positions only it is the straight lines between the points. The arm rests
//! where the way has a corner.

use nalgebra::SVector;
use trajectory::bounds::JointsToTool;
use trajectory::timing::time_path;
use trajectory::{JointPoint, Path, PathPoint, SplinePath, ToolLimits, ToolPoint};

use super::super::certificate::Arm;
use super::super::{Draft, MotionError, PlannedMove, Planner};
use super::knots::Knots;
use crate::motion::soonest::RESTING;

/// Points of the way on each piece, at least and at most.
const PARTS: (usize, usize) = (2, 16);
/// About how many points the way has.
const POINTS: usize = 600;
/// Points nearer to each other are one, rad or m; on a curve also those nearer than this share of it.
const SAME: f64 = 1e-6;
/// See [`SAME`].
const SHARE: f64 = 5e-4;
/// Cosine of the angle between two chords from which on the points lie on one straight line.
const STRAIGHT: f64 = 1.0 - 1e-9;
/// The same from which on close points of a curve have no corner: 30 degrees.
const SMOOTH: f64 = 0.866;

/// A way of the joints with the motion of the tool along it.
struct ArmPath<'a, const N: usize> {
    joints: SplinePath<N>,
    arm: Arm<'a, N>,
}

impl<const N: usize> Path<N> for ArmPath<'_, N> {
    fn end(&self) -> f64 {
        self.joints.end()
    }

    fn knots(&self) -> &[f64] {
        self.joints.knots()
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        let joint = self.joint_at(u);
        let tool = self.arm.motion(&joint);
        PathPoint { joint, tool }
    }

    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.joints.at(u).joint
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        self.arm.motion(&self.joint_at(u))
    }
}

impl<const N: usize> Planner<N> {
    /// The fastest motion along the way of the points, from rest to rest.
    pub(super) fn with_our_times(
        &self,
        knots: &Knots<N>,
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        let mut at = *start;
        let mut done = Vec::new();
        for run in runs(knots, start) {
            let Some(end) = run.last().copied() else {
                continue;
            };
            let chords = run.windows(2).map(|pair| (pair[1] - pair[0]).norm());
            let lengths = chords.scan(0.0, |sum, chord| {
                *sum += chord;
                Some(*sum)
            });
            let lengths: Vec<f64> = [0.0].into_iter().chain(lengths).collect();
            let joints = SplinePath::through(lengths, &run).ok_or(MotionError::NoWay)?;
            let arm = Arm(self.chain());
            let path = ArmPath { joints, arm };
            let timed = time_path(&path, &self.limits, most, &RESTING)?;
            let motion = self.joint_motion(&end, most);
            done.push(self.certify(&motion, &at, Draft::of(timed.trajectory))?);
            at = end;
        }
        match PlannedMove::joined(done) {
            Some(planned) => Ok(planned),
            None => {
                let still = trajectory::Trajectory::new(Vec::new());
                self.certify(&self.joint_motion(start, most), start, Draft::of(still))
            }
        }
    }
}

/// The way in parts that have no corner, each from where the one before ends, the first from the
/// start.
fn runs<const N: usize>(knots: &Knots<N>, start: &SVector<f64, N>) -> Vec<Vec<SVector<f64, N>>> {
    let (points, least): (Vec<_>, f64) = if knots.moving {
        (close_points(knots), SMOOTH)
    } else {
        let points = knots.samples.iter().map(|sample| sample.position);
        (points.collect(), STRAIGHT)
    };
    let length: f64 = points
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm())
        .sum();
    let same = if knots.moving {
        SAME.max(SHARE * length)
    } else {
        SAME
    };
    let mut runs: Vec<Vec<SVector<f64, N>>> = vec![vec![*start]];
    for (index, point) in points.iter().copied().enumerate() {
        let Some(run) = runs.last_mut() else { break };
        let [.., last] = run[..] else { break };
        let step = point - last;
        if step.norm() < same {
            // The way ends in the last point.
            if let ([_, .., last], true) = (&mut run[..], index + 1 == points.len()) {
                *last = point;
            }
            continue;
        }
        let turns = match run[..] {
            [.., before, last] => {
                let chord = last - before;
                chord.dot(&step) < least * chord.norm() * step.norm()
            }
            _ => false,
        };
        if turns {
            runs.push(vec![last, point]);
        } else {
            run.push(point);
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// Close points of the quintic pieces.
fn close_points<const N: usize>(knots: &Knots<N>) -> Vec<SVector<f64, N>> {
    let pieces = knots.pieces();
    let parts = (POINTS / pieces.len().max(1)).clamp(PARTS.0, PARTS.1);
    let mut points: Vec<_> = knots.samples.iter().take(1).map(|s| s.position).collect();
    for piece in &pieces {
        let share = |part: usize| part as f64 / parts as f64;
        points.extend((1..=parts).map(|part| piece.sample(piece.duration * share(part)).position));
    }
    points
}

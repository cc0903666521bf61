//! Joint trajectories whose times others have chosen: quintic pieces through the points, certified
//! before they move, or refused.
//!
//! The arm rests before and after, so acceleration is 0 at both ends, whatever the points say. Points
//! without accelerations get those that make the motion smooth; points with positions only would
//! have corners, which no limit allows.

mod knots;
mod retime;

use nalgebra::SVector;
use realtime::Piece;
use trajectory::{MotionBounds, ToolLimits, Trajectory};

use super::timed_refusal::TimedRefusal;
use super::{Draft, MotionError, PlannedMove, Planner, active};
use crate::task::{Move, Shape};
use crate::timed::TimedTrajectory;
use knots::Knots;

/// How far the first point may be from where the arm stands, rad or m.
const NEAR: f64 = 0.01;
/// A distance that is none, rad or m.
const THERE: f64 = 1e-9;
/// A trajectory that needs so much more time to keep all limits gets it: bounds are not exact, and
/// points are rounded.
const SLACK: f64 = 1.01;

impl<const N: usize> Planner<N> {
    pub(super) fn plan_timed(
        &self,
        timed: &TimedTrajectory,
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        let mut knots = Knots::read(self, timed)?;
        knots.begin(start);
        let off = knots.samples[0].position - start;
        self.check_start(&off)?;
        if knots.moving {
            knots.rest_at_ends(self)?;
            knots.choose_accelerations();
        } else if !timed.retime {
            knots.check_corners(self)?;
        }
        if timed.retime {
            return self.with_our_times(&knots, start, most);
        }
        let pieces = knots.pieces();
        let approach = self.approach(start, &knots.samples[0].position, most)?;
        let trajectory = Trajectory::new([&approach[..], &pieces].concat());
        let end = trajectory.sample(trajectory.duration()).position;
        let end = if trajectory.pieces().is_empty() {
            *start
        } else {
            end
        };
        let motion = self.joint_motion(&end, most);
        if trajectory.pieces().is_empty() {
            return self.certify(&motion, start, Draft::of(trajectory));
        }
        let place = |time: f64| place(&trajectory, (time, approach.len()), &knots);
        let draft = self.kept(&trajectory, &motion, place)?;
        self.certify(&motion, start, draft)
    }

    /// A motion of the joints to an end, as one of the controlled point.
    fn joint_motion(&self, end: &SVector<f64, N>, most: &ToolLimits) -> Move {
        Move {
            shape: Shape::Joint,
            poses: vec![self.chain().forward(end)],
            tolerance: 0.0,
            limits: *most,
        }
    }

    /// Whether the first point is near enough.
    fn check_start(&self, off: &SVector<f64, N>) -> Result<(), TimedRefusal> {
        let joint = off.iamax();
        if off[joint].abs() <= NEAR {
            return Ok(());
        }
        Err(TimedRefusal::Start {
            joint: self.joint_name(joint),
            off: self.amount(joint, off[joint].abs()),
            allowed: self.amount(joint, NEAR),
        })
    }

    /// The way from where the arm stands to the first point; nothing if it is there.
    fn approach(
        &self,
        start: &SVector<f64, N>,
        first: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<Vec<Piece<N>>, MotionError> {
        if (first - start).amax() <= THERE {
            return Ok(Vec::new());
        }
        let motion = self.joint_motion(first, most);
        let draft = self.joint_move(&motion, start, first)?;
        Ok(draft.trajectory.pieces().to_vec())
    }

    /// The trajectory within all limits; slowed down only by what bounds and rounding need.
    fn kept(
        &self,
        trajectory: &Trajectory<N>,
        motion: &Move,
        place: impl Fn(f64) -> String,
    ) -> Result<Draft<N>, MotionError> {
        let bounds = self.bounds(trajectory, motion);
        self.check_positions(&bounds)?;
        if bounds.slower() > SLACK || bounds.slower().is_nan() {
            let worst = bounds.worst();
            let worst = worst.map(|peak| {
                let limit = active::name(peak.limit, &self.joint_names);
                (limit, peak.ratio, peak.time)
            });
            return Err(over(worst.unwrap_or_default(), place).into());
        }
        let draft = Draft::of(trajectory.clone());
        let (draft, bounds) = self.within_efforts(draft.bounded(bounds));
        let longer = draft.trajectory.duration() / trajectory.duration();
        if longer > SLACK || longer.is_nan() {
            let reports = self.effort_reports(trajectory).into_iter();
            let worst = reports.max_by(|a, b| a.ratio.total_cmp(&b.ratio));
            let worst = worst.map(|report| (report.limit, report.ratio, report.time_s));
            return Err(over(worst.unwrap_or_default(), place).into());
        }
        Ok(Draft {
            bounds: Some(bounds),
            ..draft
        })
    }

    /// Whether every joint stays in its range between the points.
    fn check_positions(&self, bounds: &MotionBounds<N>) -> Result<(), TimedRefusal> {
        let [lowest, highest] = &bounds.positions;
        let below = self.limits.lower - lowest;
        let above = highest - self.limits.upper;
        let beyond = below.sup(&above);
        let joint = beyond.imax();
        if beyond[joint] <= THERE {
            return Ok(());
        }
        Err(TimedRefusal::BeyondBetween {
            joint: self.joint_name(joint),
            beyond: self.amount(joint, beyond[joint]),
        })
    }
}

/// The refusal for a limit that is exceeded.
fn over((limit, ratio, time): (String, f64, f64), place: impl Fn(f64) -> String) -> TimedRefusal {
    TimedRefusal::Limit {
        limit,
        ratio,
        time,
        place: place(time),
    }
}

/// In words, between which points a time lies; the first pieces, before the first point, are
/// `approach`.
fn place<const N: usize>(
    trajectory: &Trajectory<N>,
    (time, approach): (f64, usize),
    knots: &Knots<N>,
) -> String {
    let after = trajectory.times().partition_point(|start| *start <= time);
    let piece = after.saturating_sub(1).min(trajectory.pieces().len() - 1);
    match piece.checked_sub(approach) {
        Some(piece) => knots.place(piece),
        None => "before point 1".to_owned(),
    }
}

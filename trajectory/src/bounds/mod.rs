//! Bounds of a motion of the joints, and of the tool, for all times.
//!
//! The joint motion is a polynomial, bounded by the hull of its Bernstein points. The motion of the
//! tool is not a polynomial, but it is analytic: over an interval of time it is a quartic through
//! its values at five times, plus an error that is bounded by derivatives of higher order. Only
//! intervals that may contain the largest value are refined.

mod joints;
mod stretch;
mod way;

use nalgebra::SVector;

use crate::active::Active;
use crate::found::Found;
use crate::limit::{ActiveSpan, Limit, LimitPeak, order, root};
use crate::{JointLimits, JointPoint, ToolLimits, ToolPoint, Trajectory};
use stretch::Stretch;

pub use way::Leg;

/// The kinematics of a tool, given by the caller, so that this crate needs no kinematics.
pub trait JointsToTool<const N: usize> {
    /// Pose and time derivatives of the tool, from joints and their time derivatives.
    fn motion(&self, joints: &JointPoint<N>) -> ToolPoint;

    /// Bounds of the Taylor coefficients of the tool's motion over an interval of time of length
    /// `h`, from those of the joints: `joints[k]` bounds derivative `k` of each joint at every time
    /// of the interval, times `h^k / k!` (rad, m). First of the position: the norm of derivative
    /// `k` times `h^k / k!` (m), `k` from 0 to 8. Then of the angular velocity: the norm of its
    /// derivative `k` times `h^(k+1) / k!` (rad), `k` from 0 to 7.
    fn growth(&self, joints: &[SVector<f64, N>; 6]) -> ([f64; 9], [f64; 8]);
}

/// What a motion is held against.
#[derive(Clone, Copy, Debug)]
pub struct Held<'a, const N: usize> {
    /// Limits of the joints.
    pub joints: &'a JointLimits<N>,
    /// Limits of the tool.
    pub tool: &'a ToolLimits,
    /// Largest error of the tool's position (m) in bounds of its path; infinity if no bound of the
    /// path is needed.
    pub place: f64,
}

/// What holds of a motion at every moment.
#[derive(Clone, Debug)]
pub struct MotionBounds<const N: usize> {
    /// Every finite limit with the bound of its ratio and when it is attained, joints first.
    pub peaks: Vec<LimitPeak>,
    /// The highest ratio found at one time for each of `peaks`, less the error of the evaluation:
    /// no bound can be lower.
    pub reached: Vec<f64>,
    /// Lowest and highest position of each joint (rad, m).
    pub positions: [SVector<f64, N>; 2],
    /// Ratios of the joints over each piece, one column for each joint limit of `peaks`.
    rows: Vec<f64>,
    /// When each piece starts, and the last ends (s).
    times: Vec<f64>,
    stretches: Vec<Stretch>,
}

impl<const N: usize> MotionBounds<N> {
    /// Bounds every limit over the whole of a motion.
    pub fn new(
        trajectory: &Trajectory<N>,
        tool: &impl JointsToTool<N>,
        held: &Held<'_, N>,
    ) -> Self {
        let joints = joints::bound(trajectory, held.joints);
        let (stretches, found) = stretch::bound(trajectory, tool, held);
        let names = stretch::LIMITS.into_iter().zip(found);
        let finite = names.filter_map(|(limit, found)| found.map(|found| (limit, found)));
        let all: Vec<(Limit, Found)> = joints.found.into_iter().chain(finite).collect();
        let peak = |(limit, found): &(Limit, Found)| LimitPeak {
            limit: *limit,
            ratio: found.bound,
            time: found.time,
        };
        Self {
            peaks: all.iter().map(peak).collect(),
            reached: all.iter().map(|(_, found)| found.reached).collect(),
            positions: joints.positions,
            rows: joints.rows,
            times: trajectory.times().to_vec(),
            stretches,
        }
    }

    /// How long the motion lasts (s).
    pub fn duration(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The bound of the ratio to a limit; 0 where it is infinite.
    pub fn ratio(&self, limit: Limit) -> f64 {
        let peak = self.peaks.iter().find(|peak| peak.limit == limit);
        peak.map_or(0.0, |peak| peak.ratio)
    }

    /// The limit with the highest ratio; `None` without limits.
    pub fn worst(&self) -> Option<LimitPeak> {
        // NaN counts as the worst.
        let value = |peak: &LimitPeak| {
            if peak.ratio.is_nan() {
                f64::INFINITY
            } else {
                peak.ratio
            }
        };
        let worst = |a: &&LimitPeak, b: &&LimitPeak| value(a).total_cmp(&value(b));
        self.peaks.iter().max_by(worst).copied()
    }

    /// The factor on time with which every ratio is at most 1; below 1 if the motion could be
    /// faster. Speeds fall with the factor, accelerations with its square, jerks with its cube.
    pub fn slower(&self) -> f64 {
        let factors = self.peaks.iter();
        let factors = factors.map(|peak| root(peak.ratio, order(peak.limit)));
        factors.fold(0.0, f64::max)
    }

    /// The same of the motion `factor` times as long.
    #[must_use]
    pub fn stretched(mut self, factor: f64) -> Self {
        let scales = [1, 2, 3].map(|order| 1.0 / factor.powi(order));
        let scale = |limit: Limit| scales[order(limit) as usize - 1];
        let columns: Vec<f64> = self.joint_limits().map(scale).collect();
        for row in self.rows.chunks_mut(columns.len().max(1)) {
            row.iter_mut()
                .zip(&columns)
                .for_each(|(x, scale)| *x *= scale);
        }
        for (peak, reached) in self.peaks.iter_mut().zip(&mut self.reached) {
            peak.ratio *= scale(peak.limit);
            *reached *= scale(peak.limit);
            peak.time *= factor;
        }
        self.times.iter_mut().for_each(|time| *time *= factor);
        for stretch in &mut self.stretches {
            stretch.slow_down(factor, &scales);
        }
        self
    }

    /// The limits of `rows`.
    fn joint_limits(&self) -> impl Iterator<Item = Limit> + '_ {
        let joint = |limit: &Limit| {
            matches!(
                limit,
                Limit::JointVelocity(_) | Limit::JointAcceleration(_) | Limit::JointJerk(_)
            )
        };
        self.peaks.iter().map(|peak| peak.limit).take_while(joint)
    }

    /// The intervals of time in which limits may be used to a fraction of at least `share`, in the
    /// order of time.
    pub fn active(&self, share: f64) -> Vec<ActiveSpan> {
        let limits: Vec<Limit> = self.joint_limits().collect();
        let (columns, end) = (limits.len().max(1), self.duration());
        let mut joints = Active::new(limits, share);
        for (row, start) in self.rows.chunks(columns).zip(&self.times) {
            joints.add(*start, row);
        }
        let mut tool = Active::new(stretch::LIMITS.to_vec(), share);
        for stretch in &self.stretches {
            tool.add(stretch.start, &stretch.upper);
        }
        let mut spans = joints.finish(end);
        spans.extend(tool.finish(end));
        spans.sort_by(|a, b| a.start.total_cmp(&b.start).then(a.limit.cmp(&b.limit)));
        spans
    }
}

//! Plans a certified trajectory for a self-contained move from a start at rest.
//!
//! The planner is a pure function: the same move, arm and start give the same bytes. The dry run,
//! the real run and the benchmarks all call it.

mod active;
mod actuate;
mod blocked_cause;
mod cartesian;
mod certificate;
mod corners;
mod course;
mod draft;
mod efforts;
mod fault;
mod few_places;
mod figures;
mod goal;
mod in_parts;
mod jog;
mod joined;
mod kernel;
mod least;
mod least_turn;
mod legs;
mod many;
mod motion_error;
mod moving;
mod reach;
mod region;
mod rough;
mod rounder;
mod screw;
mod seam;
mod singular;
mod slow_time;
mod smooth;
mod smooth_joints;
mod soonest;
mod timed;
mod timed_refusal;
mod windowed;
mod with_joints;

use kinematics::{Chain, Solver};
use std::borrow::Cow;

use nalgebra::{Isometry3, SVector};
use realtime::Sample;
use trajectory::bounds::Held;
use trajectory::{JointLimits, MotionBounds, ToolLimits, Trajectory};

pub use active::ActiveLimit;
pub use blocked_cause::{BlockedCause, JogRefusal, JointAmount};
pub use certificate::{CrossingReport, LimitReport, MoveCertificate, Peaks};
pub use efforts::Efforts;
pub use fault::Fault;
pub use jog::Direction;
pub use motion_error::MotionError;
pub use timed_refusal::TimedRefusal;
pub use windowed::{MoveWindow, WindowedMove};

use certificate::{Arm, Way};
use draft::Draft;
use kernel::Kernel;

use crate::task::{JointMove, LegsMove, Move, ScrewMove, Shape};
use crate::timed::TimedTrajectory;

/// Joint ratios may exceed 1 by rounding only.
const ROUNDING: f64 = 1e-9;

/// A move that may be executed: its trajectory, its certificate and how its smooth path was
/// planned.
#[derive(Clone, Debug)]
pub struct PlannedMove<const N: usize> {
    /// Joints against time, rest to rest.
    pub trajectory: Trajectory<N>,
    /// What was proved of it.
    pub certificate: MoveCertificate,
    /// Joints at the end, at rest.
    pub end: SVector<f64, N>,
    /// For a smooth move: how its path was planned.
    pub blend: Option<Blend>,
}

/// How the path of a smooth move was planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Radius of the balls it was planned for, m: at most that of the command.
    pub tolerance: f64,
    /// Time with a stop at each pose, for a tool without an arm, s: no arm is faster.
    pub exact_stop: f64,
    /// Greatest distance from the leg / half width of the corridor.
    pub corridor_ratio: f64,
    /// Greatest jerk of the tool / limit, linear or angular, before the joints slow it down.
    pub jerk_ratio: f64,
    /// Rests between the start and the end.
    pub fallbacks: usize,
}

/// Plans moves of one arm with one tool.
#[derive(Clone, Debug)]
pub struct Planner<const N: usize> {
    solver: Solver<N>,
    limits: JointLimits<N>,
    joint_names: Vec<String>,
    flange_from_tool: Isometry3<f64>,
    efforts: Option<Efforts<N>>,
    kernel: Kernel<N>,
}

impl<const N: usize> Planner<N> {
    /// A planner for `chain` (workstation to the arm's end) with a tool.
    #[must_use]
    pub fn new(
        chain: &Chain<N>,
        flange_from_tool: Isometry3<f64>,
        limits: JointLimits<N>,
        joint_names: Vec<String>,
    ) -> Self {
        let kernel = Kernel::get();
        Self {
            solver: (kernel.solver)(chain.with_tool(&flange_from_tool)),
            limits,
            joint_names,
            flange_from_tool,
            efforts: None,
            kernel,
        }
    }

    /// The tool that this planner was made for.
    #[must_use]
    pub fn flange_from_tool(&self) -> &Isometry3<f64> {
        &self.flange_from_tool
    }

    /// From the workstation to the controlled point.
    #[must_use]
    pub fn chain(&self) -> &Chain<N> {
        self.solver.chain()
    }

    /// Limits of the joints.
    #[must_use]
    pub fn limits(&self) -> &JointLimits<N> {
        &self.limits
    }

    /// Plans a move from `start`, at rest; checks all of it before it returns.
    ///
    /// # Errors
    /// [`MotionError`] when any part of the move is not possible; then nothing of it may be
    /// executed.
    pub fn plan(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.plan)(self, motion, start)
    }

    /// Plans a path from `start`, at rest, as far as the arm can go in a direction, within the
    /// limits `most` of the controlled point.
    ///
    /// # Errors
    /// [`MotionError`] when it cannot move in that direction at all.
    pub fn jog(
        &self,
        direction: &Direction<N>,
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.jog)(self, direction, start, most)
    }

    /// Plans a move of single joints from `start`, at rest; the others rest.
    ///
    /// # Errors
    /// [`MotionError`] when any part of the move cannot be made.
    pub fn actuate(
        &self,
        motion: &JointMove,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.actuate)(self, motion, start)
    }

    /// Plans a smooth move from `start`, at rest, whose legs have limits of their own.
    ///
    /// # Errors
    /// [`MotionError`] when any part of the move cannot be made.
    pub fn legs(
        &self,
        motion: &LegsMove,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.legs)(self, motion, start)
    }

    /// Plans a screw from `start`, at rest: all its parts, at rest between them.
    ///
    /// # Errors
    /// [`MotionError`] when any part of the move cannot be made.
    pub fn screw(
        &self,
        motion: &ScrewMove,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.screw)(self, motion, start)
    }

    /// Plans a move that begins in a state of motion, to rest: any way in joint space, or straight on
    /// along the line that the controlled point moves on.
    ///
    /// # Errors
    /// [`MotionError`] when the move cannot begin in that state, or cannot be made; it may still be
    /// possible from rest.
    pub fn moving(&self, motion: &Move, start: &Sample<N>) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.moving)(self, motion, start)
    }

    /// Plans a joint trajectory whose times are given, from `start`, at rest, within the limits
    /// `most` of the controlled point: quintic pieces through its points, or, where it asks for
    /// that, the fastest motion along its way.
    ///
    /// # Errors
    /// [`MotionError::Timed`] with point, joint and limit when it is not one or breaks a limit.
    pub fn timed(
        &self,
        timed: &TimedTrajectory,
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        (self.kernel.timed)(self, timed, start, most)
    }

    /// Checks the whole way of a long smooth move from `start`, at rest, and times its first window; see
    /// [`WindowedMove`]. All windows of [`Self::window_of`] together are the motion of [`Self::plan`].
    /// `None` for a move that is planned as a whole. The poses are not copied.
    #[must_use]
    pub fn windows<'a>(
        &self,
        motion: Cow<'a, Move>,
        start: &SVector<f64, N>,
    ) -> Option<WindowedMove<'a, N>> {
        (self.kernel.windows)(self, motion, start)
    }

    /// The next window of a move, certified, from the state in which the one before it ends. A stop on
    /// the way is known at the end of each, and is the next window where no motion goes on.
    ///
    /// # Errors
    /// [`MotionError::OnTheWay`] when no motion begins where the window before it rests; the arm is
    /// then at rest on the way, within the tolerance.
    pub fn window_of(
        &self,
        windowed: &mut WindowedMove<'_, N>,
    ) -> Result<MoveWindow<N>, MotionError> {
        (self.kernel.window_of)(self, windowed)
    }

    /// Joint positions (rad, m) that hold the controlled point at `pose`, inside the range of the
    /// joints: all branches, the nearest to `near` first.
    #[must_use]
    pub fn postures(&self, pose: &Isometry3<f64>, near: &SVector<f64, N>) -> Vec<SVector<f64, N>> {
        (self.kernel.postures)(self, pose, near)
    }

    fn find_postures(&self, pose: &Isometry3<f64>, near: &SVector<f64, N>) -> Vec<SVector<f64, N>> {
        let branches = self.solver.solve_all(pose);
        let mut postures: Vec<_> = branches.iter().map(|branch| branch.q).collect();
        postures.extend(self.solver.nearest(pose, near).map(|solution| solution.q));
        postures.sort_by(|a, b| (a - near).norm().total_cmp(&(b - near).norm()));
        postures.dedup_by(|a, b| (*a - *b).amax() < 1e-6);
        postures
    }

    fn plan_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let planned = self.plan_once(motion, start)?;
        Ok(self.eased(motion, start, planned))
    }

    fn plan_once(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        self.check_reach(motion, start)?;
        match motion.shape {
            Shape::Joint => self.certify(motion, start, self.plan_joint(motion, start)?),
            Shape::Straight => self.certify(motion, start, self.plan_straight(motion, start)?),
            Shape::Smooth => self.smooth_move(motion, start),
        }
    }

    /// Proves that a motion within the limits does what the command asked for.
    fn certify(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        draft: Draft<N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if draft.trajectory.pieces().is_empty() {
            // Nothing to do: the arm is there. The certificate is that of a motion at rest.
            let still = Trajectory::new(vec![realtime::Piece::hold(*start, 0.0)]);
            let crossings = draft.crossings.clone();
            let still = Draft {
                crossings,
                ..Draft::of(still)
            };
            let standing = self.certify(motion, start, still)?;
            return Ok(PlannedMove {
                trajectory: draft.trajectory,
                ..standing
            });
        }
        check_smooth(&draft.trajectory, start)?;
        let (draft, bounds) = self.within_limits(draft, motion);
        let end = draft.trajectory.sample(draft.trajectory.duration());
        let certificate = self.certificate(motion, start, &draft, &bounds);
        check(&certificate, motion)?;
        Ok(PlannedMove {
            trajectory: draft.trajectory,
            certificate,
            end: end.position,
            blend: None,
        })
    }

    /// The certificate of a motion from one pose to another.
    fn certificate(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        draft: &Draft<N>,
        bounds: &MotionBounds<N>,
    ) -> MoveCertificate {
        let end = draft.trajectory.sample(draft.trajectory.duration());
        let lower_bound_s = self.least_time(motion, start, &end.position, draft);
        let from = self.chain().forward(start);
        let way = certificate::way(motion, self.chain(), &from, draft, bounds);
        MoveCertificate {
            lower_bound_s,
            ..self.proved(draft, bounds, way)
        }
    }

    /// The same without the least time.
    fn proved(&self, draft: &Draft<N>, bounds: &MotionBounds<N>, way: Way) -> MoveCertificate {
        let name = |limit| active::name(limit, &self.joint_names);
        let spans = bounds.active(active::ACTIVE).into_iter();
        let active = spans.map(|span| ActiveLimit {
            limit: name(span.limit),
            start_s: span.start,
            end_s: span.end,
        });
        let limits = bounds.peaks.iter().map(|peak| LimitReport {
            limit: name(peak.limit),
            ratio: peak.ratio,
            time_s: peak.time,
        });
        let efforts = self.effort_reports(&draft.trajectory);
        let mut peaks = Peaks::of(bounds);
        peaks.joint_effort = efforts.iter().map(|report| report.ratio).collect();
        MoveCertificate {
            duration_s: draft.trajectory.duration(),
            lower_bound_s: 0.0,
            active: active.collect(),
            poses: way.poses,
            in_order: way.in_order,
            peaks,
            limits: limits.chain(efforts).collect(),
            straightness_m: way.straightness_m,
            corridor_m: way.corridor_m,
            end_deviation_m: way.end_deviation_m,
            end_angle_rad: way.end_angle_rad,
            joint_margin: self.margin(bounds),
        }
    }

    /// Bounds of a motion of the joints at all times, under the limits of a move.
    fn bounds(&self, trajectory: &Trajectory<N>, motion: &Move) -> MotionBounds<N> {
        let held = Held {
            joints: &self.limits,
            tool: &motion.limits,
            place: match motion.shape {
                Shape::Joint => f64::INFINITY,
                Shape::Straight | Shape::Smooth => PLACE,
            },
        };
        MotionBounds::new(trajectory, &Arm(self.chain()), &held)
    }

    /// Slows a motion down, uniformly and by as little as needed, until every limit holds; with
    /// its bounds.
    fn within_limits(&self, draft: Draft<N>, motion: &Move) -> (Draft<N>, MotionBounds<N>) {
        match draft.bounds {
            Some(bounds) => {
                let draft = Draft {
                    bounds: None,
                    ..draft
                };
                (draft, bounds)
            }
            None => {
                let bounds = self.bounds(&draft.trajectory, motion);
                self.within_efforts(draft.bounded(bounds))
            }
        }
    }

    /// The same with the bounds kept for the certificate.
    fn slowed(&self, draft: Draft<N>, motion: &Move) -> Draft<N> {
        let (draft, bounds) = self.within_limits(draft, motion);
        Draft {
            bounds: Some(bounds),
            ..draft
        }
    }

    fn margin(&self, bounds: &MotionBounds<N>) -> f64 {
        let [lowest, highest] = bounds.positions;
        let below = (lowest - self.limits.lower).min();
        let above = (self.limits.upper - highest).min();
        below.min(above)
    }

    /// The name of a joint for messages, with the word joint.
    fn joint_name(&self, joint: usize) -> String {
        match self.joint_names.get(joint) {
            Some(name) if name.to_lowercase().contains("joint") => name.clone(),
            Some(name) => format!("joint {name}"),
            None => format!("joint {}", joint + 1),
        }
    }

    /// A joint quantity with its unit, for messages.
    fn amount(&self, joint: usize, value: f64) -> JointAmount {
        match self.chain().prismatic().get(joint) {
            Some(true) => JointAmount::Length(value),
            _ => JointAmount::Angle(value),
        }
    }
}

/// Largest jump of a joint between two pieces, and from the start, rad or m.
const JUMP: f64 = 1e-9;

/// Positions must not jump, and both ends must be at rest; velocity and acceleration follow from
/// the limits of the pieces.
fn check_smooth<const N: usize>(
    trajectory: &Trajectory<N>,
    start: &SVector<f64, N>,
) -> Result<(), Fault> {
    let mut last = realtime::Sample::rest(*start);
    for (piece, part) in trajectory.pieces().iter().enumerate() {
        let first = part.sample(0.0);
        let jump = (first.position - last.position).amax();
        if !jump.is_finite() || jump > JUMP {
            return Err(Fault::Position { piece, jump });
        }
        let jump = (first.velocity - last.velocity).amax();
        if !jump.is_finite() || jump > 1e-6 {
            return Err(Fault::Velocity { piece, jump });
        }
        last = part.sample(part.duration);
    }
    let speed = last.velocity.amax();
    if !speed.is_finite() || speed > 1e-6 {
        return Err(Fault::NotAtRest { speed });
    }
    Ok(())
}

/// Largest deviation from a straight line, m.
const STRAIGHT: f64 = 1e-5;
/// Largest distance and angle from the last pose, m and rad.
const ARRIVED: (f64, f64) = (1e-6, 1e-6);
/// Largest error of the tool's position in bounds of its path, m.
const PLACE: f64 = 1e-7;

/// Checks that a certificate proves what the command asked for.
fn check(certificate: &MoveCertificate, motion: &Move) -> Result<(), Fault> {
    let broken = |ratio: f64| ratio.is_nan() || ratio > 1.0 + ROUNDING;
    if let Some(worst) = certificate.limits.iter().find(|limit| broken(limit.ratio)) {
        return Err(Fault::Limit {
            limit: worst.limit.clone(),
            ratio: worst.ratio,
            time_s: worst.time_s,
        });
    }
    if motion.shape == Shape::Smooth {
        certificate::check_passes(certificate, motion)?;
    }
    let allowed_m = certificate::corridor(motion);
    let leaves = |off: &f64| off.is_nan() || *off > allowed_m;
    if let Some(off_m) = certificate.corridor_m.filter(leaves) {
        return Err(Fault::Corridor { off_m, allowed_m });
    }
    let allowed_m = STRAIGHT;
    let bends = |off: &f64| off.is_nan() || *off > allowed_m;
    if let Some(off_m) = certificate.straightness_m.filter(bends) {
        return Err(Fault::Straightness { off_m, allowed_m });
    }
    let (off_m, angle_rad) = (certificate.end_deviation_m, certificate.end_angle_rad);
    if off_m.is_nan() || angle_rad.is_nan() || off_m > ARRIVED.0 || angle_rad > ARRIVED.1 {
        return Err(Fault::End { off_m, angle_rad });
    }
    if certificate.joint_margin.is_nan() || certificate.joint_margin < -ROUNDING {
        let beyond = -certificate.joint_margin;
        return Err(Fault::Range { beyond });
    }
    Ok(())
}

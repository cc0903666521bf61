//! From a self-contained move and a start at rest to a certified trajectory.
//!
//! The planner is a pure function: the same move, arm and start give the same
//! bytes. The dry run, the real run and the benchmarks call it alike.

mod active;
mod cartesian;
mod certificate;
mod goal;
mod jog;
mod motion_error;

use kinematics::{Chain, Solver};
use nalgebra::{Isometry3, SVector};
use trajectory::smooth::{self, SmoothOptions};
use trajectory::{JointLimits, ToolLimits, Trajectory};

pub use active::ActiveLimit;
pub use certificate::{MoveCertificate, PassReport, Peaks};
pub use jog::Direction;
pub use motion_error::MotionError;

use crate::task::{Move, Shape};

/// Joint ratios may exceed 1 by rounding only.
const ROUNDING: f64 = 1e-9;

/// A move that may be executed: its trajectory, its certificate and how the
/// smooth path came about.
#[derive(Clone, Debug)]
pub struct PlannedMove<const N: usize> {
    /// Joints against time, rest to rest.
    pub trajectory: Trajectory<N>,
    /// What was proved of it.
    pub certificate: MoveCertificate,
    /// Joints at the end, at rest.
    pub end: SVector<f64, N>,
    /// For a smooth move: how its way was found.
    pub blend: Option<Blend>,
}

/// How the way of a smooth move was found.
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
    /// Parts that are not the time-optimal spline.
    pub fallbacks: usize,
}

/// Plans moves of one arm with one tool.
#[derive(Clone, Debug)]
pub struct Planner<const N: usize> {
    solver: Solver<N>,
    limits: JointLimits<N>,
    joint_names: Vec<String>,
    flange_from_tool: Isometry3<f64>,
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
        let solver = Solver::new(chain.with_tool(&flange_from_tool));
        Self {
            solver,
            limits,
            joint_names,
            flange_from_tool,
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
    /// [`MotionError`] when any part of the move cannot be made; then nothing
    /// of it may be executed.
    pub fn plan(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        match motion.shape {
            Shape::Joint => self.certify(motion, start, self.plan_joint(motion, start)?),
            Shape::Straight => self.certify(motion, start, self.plan_straight(motion, start)?),
            Shape::Smooth => self.smooth_move(motion, start),
        }
    }

    /// The smooth motion in the tolerance asked for; where its certificate fails after
    /// the joints had their say, in a quarter of it, and at last with a stop at each pose.
    /// Never slower than with a stop at each pose.
    fn smooth_move(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        let attempt = |tolerance: f64| -> Result<_, MotionError> {
            let tighter = Move {
                tolerance,
                ..motion.clone()
            };
            let (trajectory, blend) = self.plan_smooth(&tighter, start)?;
            let planned = self.certify(motion, start, trajectory)?;
            Ok(PlannedMove {
                blend: Some(blend),
                ..planned
            })
        };
        let slower = |planned: &PlannedMove<N>, than: f64| planned.trajectory.duration() > than;
        match attempt(motion.tolerance) {
            Ok(planned) if slower(&planned, planned.blend.map_or(0.0, |b| b.exact_stop)) => {
                let stops = attempt(0.0).ok();
                let faster = stops.filter(|stops| slower(&planned, stops.trajectory.duration()));
                Ok(faster.unwrap_or(planned))
            }
            Err(first)
                if matches!(first, MotionError::Uncertified(_)) && motion.tolerance > 0.0 =>
            {
                attempt(0.25 * motion.tolerance)
                    .or_else(|_| attempt(0.0))
                    .map_err(|_| first)
            }
            other => other,
        }
    }

    /// Slows the motion down, uniformly and by as little as needed, until every
    /// limit holds, and proves what the command asked for.
    fn certify(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        trajectory: Trajectory<N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if trajectory.pieces().is_empty() {
            // Nothing to do: the arm is there. What is proved is that standing still is right.
            let still = Trajectory::new(vec![realtime::Piece::hold(*start, 0.0)]);
            let standing = self.certify(motion, start, still)?;
            return Ok(PlannedMove {
                trajectory,
                ..standing
            });
        }
        check_smooth(&trajectory, start)?;
        let trajectory = self.within_limits(trajectory, &motion.limits);
        let samples = certificate::tool_samples(self.chain(), &trajectory);
        let peaks = certificate::peaks(&trajectory, &samples, &self.limits, &motion.limits);
        let way = certificate::way(motion, self.chain(), &trajectory, &samples);
        let joint_margin = self.margin(&trajectory);
        let active = active::active(
            &trajectory,
            &samples,
            (&self.limits, &motion.limits),
            &self.joint_names,
        );
        let certificate = MoveCertificate {
            duration_s: trajectory.duration(),
            lower_bound_s: self.least_time(motion, start, &trajectory),
            active,
            poses: way.poses,
            in_order: way.in_order,
            peaks,
            straightness_m: way.straightness_m,
            end_deviation_m: way.end_deviation_m,
            end_angle_rad: way.end_angle_rad,
            joint_margin,
        };
        check(&certificate, motion)?;
        let end = trajectory.sample(trajectory.duration()).position;
        Ok(PlannedMove {
            trajectory,
            certificate,
            end,
            blend: None,
        })
    }

    /// No motion between the same ends within the limits is shorter, s: of each
    /// joint alone, and of the tool alone through the poses.
    fn least_time(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        trajectory: &Trajectory<N>,
    ) -> f64 {
        let end = trajectory.sample(trajectory.duration()).position;
        let joints = self.rest_to_rest(start, &end);
        let joints = joints.map_or(0.0, |found| found.duration());
        let tool = match motion.shape {
            Shape::Joint => 0.0,
            Shape::Straight | Shape::Smooth => {
                let mut poses = vec![self.chain().forward(start)];
                poses.extend_from_slice(&motion.poses);
                let options = SmoothOptions::new(motion.tolerance, motion.limits);
                smooth::least_time(&poses, &options).unwrap_or(0.0)
            }
        };
        // Both are exact up to rounding where they are the motion itself.
        joints.max(tool).min(trajectory.duration())
    }

    fn within_limits(&self, trajectory: Trajectory<N>, limits: &ToolLimits) -> Trajectory<N> {
        let samples = certificate::tool_samples(self.chain(), &trajectory);
        let stretch = certificate::peaks(&trajectory, &samples, &self.limits, limits).stretch();
        if stretch <= 1.0 {
            trajectory
        } else {
            trajectory.stretched(stretch)
        }
    }

    fn margin(&self, trajectory: &Trajectory<N>) -> f64 {
        let (lowest, highest) = trajectory.position_range();
        let below = (lowest - self.limits.lower).min();
        let above = (self.limits.upper - highest).min();
        below.min(above)
    }

    /// A joint as a message calls it: by its name, with the word joint in it.
    fn joint_name(&self, joint: usize) -> String {
        match self.joint_names.get(joint) {
            Some(name) if name.to_lowercase().contains("joint") => name.clone(),
            Some(name) => format!("joint {name}"),
            None => format!("joint {}", joint + 1),
        }
    }

    /// A joint quantity with the unit that people read.
    fn amount(&self, joint: usize, value: f64) -> String {
        match self.chain().prismatic().get(joint) {
            Some(true) => format!("{:.1} mm", value * 1e3),
            _ => format!("{:.2} degrees", value.to_degrees()),
        }
    }
}

/// Largest jump of a joint between two pieces, and from the start, rad or m.
const JUMP: f64 = 1e-9;

/// Position may not jump anywhere, and nothing may move at either end; velocity
/// and acceleration follow from the limits of the pieces.
fn check_smooth<const N: usize>(
    trajectory: &Trajectory<N>,
    start: &SVector<f64, N>,
) -> Result<(), MotionError> {
    let fault = |what: String| Err(MotionError::Uncertified(what));
    let mut last = realtime::Sample::rest(*start);
    for (index, piece) in trajectory.pieces().iter().enumerate() {
        let first = piece.sample(0.0);
        let jump = (first.position - last.position).amax();
        if !jump.is_finite() || jump > JUMP {
            return fault(format!(
                "piece {index} begins {jump:.1e} from where the arm is"
            ));
        }
        let jump = (first.velocity - last.velocity).amax();
        if !jump.is_finite() || jump > 1e-6 {
            return fault(format!("the velocity jumps by {jump:.1e} at piece {index}"));
        }
        last = piece.sample(piece.duration);
    }
    let speed = last.velocity.amax();
    if !speed.is_finite() || speed > 1e-6 {
        return fault(format!("it ends at a velocity of {speed:.1e}"));
    }
    Ok(())
}

/// Largest deviation from a straight line, m.
const STRAIGHT: f64 = 1e-5;
/// Largest distance and angle from the last pose, m and rad.
const ARRIVED: (f64, f64) = (1e-6, 1e-6);

fn check(certificate: &MoveCertificate, motion: &Move) -> Result<(), MotionError> {
    let fault = |what: String| Err(MotionError::Uncertified(what));
    let largest = certificate.peaks.largest();
    if largest.is_nan() || largest > 1.0 + ROUNDING {
        return fault(format!("a limit is exceeded {largest:.6} times"));
    }
    if !certificate.in_order {
        return fault(format!(
            "an intermediate pose is not passed in order within {:.4} mm",
            motion.tolerance * 1e3
        ));
    }
    if certificate.straightness_m.is_some_and(|off| off > STRAIGHT) {
        return fault("the straight line is not straight within 0.01 mm".into());
    }
    if certificate.end_deviation_m > ARRIVED.0 || certificate.end_angle_rad > ARRIVED.1 {
        return fault(format!(
            "it ends {:.6} mm off",
            certificate.end_deviation_m * 1e3
        ));
    }
    if certificate.joint_margin < -ROUNDING {
        let beyond = -certificate.joint_margin;
        return fault(format!(
            "a joint goes {beyond:.3e} beyond its position limit"
        ));
    }
    Ok(())
}

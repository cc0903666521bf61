//! Moves that begin while the arm moves: one motion takes the place of another without a stop.

use nalgebra::{SVector, vector};
use realtime::{Piece, Sample};
use trajectory::otg::{self, Otg};
use trajectory::timing::Limit;
use trajectory::{Line, MotionBounds, ToolCurve, ToolLimits, ToolPoint, Trajectory};

use super::cartesian::{Way, pieces};
use super::{ARRIVED, Draft, JUMP, MotionError, PlannedMove, Planner, ROUNDING, STRAIGHT};
use crate::task::{Move, Shape};

/// Shares of the limits of the joints that are tried, of the share that the tool is likely to allow.
const SHARES: [f64; 6] = [1.0, 0.85, 0.7, 0.5, 0.35, 0.2];
/// What bounds of the tool may exceed a limit by: a motion that goes on at its limit does so, and
/// bounds are up to one percent above what they bound.
const OF_TOOL: f64 = 0.01;
/// The same for joints: rounding.
const OF_JOINTS: f64 = 1e-6;
/// Largest difference of a joint's speed from that along the line (rad/s, m/s).
const ASTRAY: f64 = 1e-4;

impl<const N: usize> Planner<N> {
    pub(super) fn plan_moving(
        &self,
        motion: &Move,
        start: &Sample<N>,
    ) -> Result<PlannedMove<N>, MotionError> {
        if self.efforts.is_some() {
            return Err(MotionError::FromMotion(
                "the efforts of its joints are limited",
            ));
        }
        self.check_reach(motion, &start.position)?;
        let (draft, bounds) = match motion.shape {
            Shape::Joint => self.joints_moving(motion, start)?,
            Shape::Straight => self.straight_moving(motion, start)?,
            Shape::Smooth => return Err(MotionError::FromMotion("it goes through several poses")),
        };
        let first = draft
            .trajectory
            .pieces()
            .first()
            .map(|piece| piece.sample(0.0));
        let goes_on = first.is_some_and(|first| {
            (first.position - start.position).amax() <= JUMP
                && (first.velocity - start.velocity).amax() <= 1e-9
                && (first.acceleration - start.acceleration).amax() <= 1e-6
        });
        if !goes_on {
            return Err(MotionError::FromMotion("it would begin with a jump"));
        }
        let end = draft.trajectory.sample(draft.trajectory.duration());
        let certificate = self.certificate(motion, &start.position, &draft, &bounds);
        let bends = |off: f64| off.is_nan() || off > STRAIGHT;
        let misses = |off: f64, most: f64| off.is_nan() || off > most;
        if certificate.straightness_m.is_some_and(bends)
            || misses(certificate.end_deviation_m, ARRIVED.0)
            || misses(certificate.end_angle_rad, ARRIVED.1)
            || misses(-certificate.joint_margin, ROUNDING)
            || end.velocity.amax() > 1e-6
        {
            return Err(MotionError::FromMotion("it would not end as it should"));
        }
        Ok(PlannedMove {
            trajectory: draft.trajectory,
            certificate,
            end: end.position,
            blend: None,
        })
    }

    /// The fastest of a few motions in joint space that keep the limits of the tool too. A motion
    /// from a state of motion cannot be slowed down uniformly, so lower limits of the joints are
    /// tried instead.
    fn joints_moving(
        &self,
        motion: &Move,
        start: &Sample<N>,
    ) -> Result<(Draft<N>, MotionBounds<N>), MotionError> {
        let pose = motion.poses.first().copied().unwrap_or_default();
        let goals = self.configurations(&pose, &start.position)?;
        let mut best: Option<(Draft<N>, MotionBounds<N>)> = None;
        for goal in self.promising(goals, &start.position) {
            let free = self.to_rest(start, &goal, 1.0)?;
            let likely = 1.0 / self.least_stretch(&free, &motion.limits).max(1.0);
            for share in SHARES.map(|share| (share * likely).min(1.0 - 1e-9)) {
                let Ok(trajectory) = self.to_rest(start, &goal, share) else {
                    continue;
                };
                let limit = best.as_ref().map(|(draft, _)| draft.trajectory.duration());
                if limit.is_some_and(|limit| trajectory.duration() >= limit) {
                    break;
                }
                let bounds = self.bounds(&trajectory, motion);
                if self.goes_on(&bounds) {
                    best = Some((Draft::of(trajectory), bounds));
                    break;
                }
            }
        }
        best.ok_or(MotionError::FromMotion("it would be too fast for the tool"))
    }

    /// The motion of the joints from a state of motion to rest, with a share of their limits.
    fn to_rest(
        &self,
        start: &Sample<N>,
        goal: &SVector<f64, N>,
        share: f64,
    ) -> Result<Trajectory<N>, MotionError> {
        let mut limits = self.limits;
        limits.velocity *= share;
        limits.acceleration *= share;
        limits.jerk *= share;
        let plan = Otg::plan(
            &otg::State::from(*start),
            &otg::State::rest(*goal),
            &otg::Limits::from(&limits),
            &otg::Options::default(),
        );
        Ok(Trajectory::new(plan?.pieces()))
    }

    /// Straight on along the line that the controlled point moves on already.
    fn straight_moving(
        &self,
        motion: &Move,
        start: &Sample<N>,
    ) -> Result<(Draft<N>, MotionBounds<N>), MotionError> {
        let goal = motion.poses.first().copied().unwrap_or_default();
        let line = Line::new(self.chain().forward(&start.position), goal);
        let pace = self.pace(&line, start)?;
        for share in SHARES {
            let law = law(&line, &pace, &motion.limits, share)?;
            let curve = PacedLine::new(line.clone(), law)?;
            let points = self.followed(&Way::along(&curve), &start.position)?;
            let along = points.first().map(|point| point.q[1]);
            if along.is_none_or(|along| (along - start.velocity).amax() > ASTRAY) {
                return Err(MotionError::FromMotion("it leads another way"));
            }
            let trajectory = begun(Trajectory::new(pieces(&points)), start);
            let trajectory = self.finite(trajectory, &points, &|_| 1)?;
            let bounds = self.bounds(&trajectory, motion);
            if self.goes_on(&bounds) {
                return Ok((Draft::of(trajectory), bounds));
            }
        }
        Err(MotionError::FromMotion("it would be too fast"))
    }

    /// Whether a motion from a state of motion keeps the limits.
    fn goes_on(&self, bounds: &MotionBounds<N>) -> bool {
        bounds.peaks.iter().all(|peak| {
            let over = match peak.limit {
                Limit::JointVelocity(_) | Limit::JointAcceleration(_) | Limit::JointJerk(_) => {
                    OF_JOINTS
                }
                _ => OF_TOOL,
            };
            peak.ratio <= 1.0 + over
        })
    }

    /// How fast the parameter of the line moves in a state of motion.
    fn pace(&self, line: &Line, start: &Sample<N>) -> Result<otg::State<1>, MotionError> {
        let q = [
            start.position,
            start.velocity,
            start.acceleration,
            start.jerk,
        ];
        let seen = self.chain().motion(&q);
        let along = line.at(0.0);
        let (way, velocity, acceleration) = if along.linear[0].norm() > 1e-6 {
            (along.linear[0], seen.linear[0], seen.linear[1])
        } else {
            (along.angular[0], seen.angular[0], seen.angular[1])
        };
        let rate = way.dot(&velocity) / way.norm_squared();
        if !(rate.is_finite() && rate > 1e-6) {
            return Err(MotionError::FromMotion("it leads another way"));
        }
        Ok(otg::State {
            position: vector![0.0],
            velocity: vector![rate],
            acceleration: vector![way.dot(&acceleration) / way.norm_squared()],
        })
    }
}

/// The motion of the parameter of a line from a state to its end, within the limits of the tool; a
/// share of its acceleration and jerk.
fn law(
    line: &Line,
    pace: &otg::State<1>,
    limits: &ToolLimits,
    share: f64,
) -> Result<otg::Motion<1>, MotionError> {
    let least = |linear: f64, angular: f64| {
        (linear / line.length().max(1e-9)).min(angular / line.angle().max(1e-9))
    };
    // A motion at its limit goes on at its limit.
    let speed = least(limits.speed, limits.angular_speed).max(pace.velocity[0]);
    let acceleration = share * least(limits.acceleration, limits.angular_acceleration);
    let jerk = share * least(limits.jerk, limits.angular_jerk);
    let bounds = otg::Limits::symmetric(vector![speed], vector![acceleration], vector![jerk]);
    let end = otg::State::rest(vector![1.0]);
    Ok(Otg::plan(pace, &end, &bounds, &otg::Options::default())?)
}

/// A line in time.
struct PacedLine {
    line: Line,
    law: Trajectory<1>,
}

impl PacedLine {
    /// A line whose parameter moves by this law, never back.
    fn new(line: Line, law: otg::Motion<1>) -> Result<Self, MotionError> {
        let law = Trajectory::new(law.pieces());
        let (count, length) = (50, law.duration());
        let back = |index: usize| law.sample(length * index as f64 / count as f64).velocity[0];
        if (0..=count).any(|index| back(index) < -1e-9) {
            return Err(MotionError::FromMotion("it ends before the arm can stop"));
        }
        Ok(Self { line, law })
    }
}

impl ToolCurve for PacedLine {
    fn end(&self) -> f64 {
        self.law.duration()
    }

    fn knots(&self) -> Vec<f64> {
        self.law.times().to_vec()
    }

    fn at(&self, u: f64) -> ToolPoint {
        let pace = self.law.sample(u);
        let along = self.line.at(pace.position[0].min(1.0));
        let rates = [pace.velocity[0], pace.acceleration[0], pace.jerk[0]];
        ToolPoint {
            pose: along.pose,
            // The line and its axis are fixed.
            linear: rates.map(|rate| along.linear[0] * rate),
            angular: rates.map(|rate| along.angular[0] * rate),
        }
    }
}

/// The motion with its first piece from exactly this state.
fn begun<const N: usize>(trajectory: Trajectory<N>, start: &Sample<N>) -> Trajectory<N> {
    let mut pieces = trajectory.pieces().to_vec();
    if let Some(first) = pieces.first_mut() {
        let end = first.sample(first.duration);
        *first = Piece::hermite(first.duration, start, &end);
    }
    Trajectory::new(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;
    use crate::robot::{load, vector};
    use nalgebra::{Isometry3, Translation3};

    fn ur5e() -> (Planner<6>, SVector<f64, 6>, ToolLimits) {
        let robot = load("ur5e").unwrap();
        let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
        let mut most = robot.motion_limits();
        most = most.scaled(0.3, 0.3);
        (controller.planner().clone(), vector(&robot.home), most)
    }

    fn to(pose: Isometry3<f64>, shape: Shape, limits: ToolLimits) -> Move {
        Move {
            shape,
            poses: vec![pose],
            tolerance: 0.0,
            limits,
        }
    }

    fn by(pose: &Isometry3<f64>, x: f64, y: f64, z: f64) -> Isometry3<f64> {
        Translation3::new(x, y, z) * pose
    }

    /// A way in joint space goes on from any moment of another, within every limit, and arrives.
    #[test]
    fn a_move_begins_in_any_state_of_motion() {
        let (planner, home, most) = ur5e();
        let here = planner.chain().forward(&home);
        let first = planner
            .plan(&to(by(&here, -0.1, 0.15, -0.1), Shape::Joint, most), &home)
            .unwrap();
        let duration = first.trajectory.duration();
        let mut planned = 0;
        for (index, step) in [[0.1, 0.1, 0.0], [-0.2, -0.1, 0.1], [-0.05, 0.2, -0.15]]
            .into_iter()
            .cycle()
            .take(30)
            .enumerate()
        {
            let at = first
                .trajectory
                .sample(duration * (index as f64 + 0.5) / 30.0);
            let goal = by(&here, step[0], step[1], step[2]);
            let Ok(moving) = planner.moving(&to(goal, Shape::Joint, most), &at) else {
                continue;
            };
            planned += 1;
            let begin = moving.trajectory.sample(0.0);
            assert!((begin.velocity - at.velocity).amax() < 1e-9);
            assert!((begin.acceleration - at.acceleration).amax() < 1e-6);
            let end = planner.chain().forward(&moving.end);
            assert!((end.translation.vector - goal.translation.vector).norm() < 1e-6);
            assert!(moving.certificate.peaks.largest() <= 1.0 + OF_TOOL);
        }
        assert!(planned >= 25, "only {planned} of 30 moves begin in motion");
    }

    /// A straight move goes on along its line; another way is refused.
    #[test]
    fn a_straight_move_goes_on_along_its_line() {
        let (planner, home, most) = ur5e();
        let here = planner.chain().forward(&home);
        let down = |z| to(by(&here, 0.0, 0.0, z), Shape::Straight, most);
        let first = planner.plan(&down(-0.1), &home).unwrap();
        let at = first.trajectory.sample(0.5 * first.trajectory.duration());
        let on = planner.moving(&down(-0.2), &at).unwrap();
        assert!(on.certificate.straightness_m.unwrap() <= STRAIGHT);
        assert!(on.certificate.peaks.largest() <= 1.0 + OF_TOOL);
        let from_rest = planner.plan(&down(-0.2), &at.position.clone()).unwrap();
        assert!(on.trajectory.duration() < from_rest.trajectory.duration());
        assert!(planner.moving(&down(0.1), &at).is_err());
        let aside = to(by(&here, 0.1, 0.0, -0.1), Shape::Straight, most);
        assert!(planner.moving(&aside, &at).is_err());
    }
}

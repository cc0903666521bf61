//! Jogging: a move in one direction, as far as the arm can go, at a fraction of its speed. It is
//! stopped before its end, so jogging has the same limits, path and guard as any move.

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use trajectory::ToolLimits;

use super::{JogRefusal, MotionError, PlannedMove, Planner};
use crate::task::{Move, Shape};

/// Longest jog: of the tool in m, of the tool and of a joint in rad.
const FAR: (f64, f64, f64) = (1.0, 1.5, 3.0);
/// The nearest that is worth a move, m or rad.
const NEAR: f64 = 1e-4;
/// Distance kept from the end of a joint's range, rad or m.
const MARGIN: f64 = 1e-3;
/// How often a blocked path is tried with a shorter length.
const TRIES: usize = 8;

/// The direction of a jog, as fractions of the largest speeds, -1..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direction<const N: usize> {
    /// Each joint by itself, all in proportion.
    Joints {
        /// One fraction per joint.
        shares: SVector<f64, N>,
        /// How far the joint that moves most goes at most (rad, m); infinite: as far as it can.
        distance: f64,
    },
    /// Along and about the axes of the controlled point.
    Tool {
        /// Along x, y, z.
        linear: Vector3<f64>,
        /// About x, y, z.
        angular: Vector3<f64>,
        /// How far at most: m, and rad where it turns; infinite: as far as it can.
        distance: f64,
    },
    /// All joints together to a goal, as in `MoveTo`.
    Goal {
        /// Where to (rad, m).
        joints: SVector<f64, N>,
        /// The fraction of the largest speeds, above 0.
        share: f64,
    },
}

impl<const N: usize> Planner<N> {
    pub(super) fn plan_jog(
        &self,
        direction: &Direction<N>,
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        match direction {
            Direction::Joints { shares, distance } => {
                self.jog_joints((shares, *distance), start, most)
            }
            Direction::Tool {
                linear,
                angular,
                distance,
            } => self.jog_tool((linear, angular, *distance), start, most),
            Direction::Goal { joints, share } => self.jog_goal((joints, *share), start, most),
        }
    }

    fn jog_goal(
        &self,
        (goal, share): (&SVector<f64, N>, f64),
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        if (goal - start).amax() < NEAR {
            return Err(JogRefusal::AtGoal.into());
        }
        for joint in 0..N {
            let (lower, upper) = (self.limits.lower[joint], self.limits.upper[joint]);
            if !(lower..=upper).contains(&goal[joint]) {
                let joint = self.joint_name(joint);
                return Err(JogRefusal::GoalBeyond { joint }.into());
            }
        }
        self.jog_to((start, goal), self.limits.velocity * share, most)
    }

    /// The move of a jog in joint space from start to goal, with other speeds of the joints.
    fn jog_to(
        &self,
        (start, goal): (&SVector<f64, N>, &SVector<f64, N>),
        velocity: SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        let mut slow = self.clone();
        slow.limits.velocity = velocity;
        let motion = Move {
            shape: Shape::Joint,
            poses: vec![self.chain().forward(goal)],
            tolerance: 0.0,
            limits: *most,
        };
        slow.certify(&motion, start, slow.joint_move(&motion, start, goal)?)
    }

    fn jog_joints(
        &self,
        (shares, distance): (&SVector<f64, N>, f64),
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        let speeds = shares.component_mul(&self.limits.velocity);
        let largest = speeds.amax();
        let mut time = FAR.2.min(distance) / largest;
        let mut last = 0;
        for joint in (0..N).filter(|joint| speeds[*joint] != 0.0) {
            let (lower, upper) = (self.limits.lower[joint], self.limits.upper[joint]);
            let room = if speeds[joint] > 0.0 {
                upper - MARGIN - start[joint]
            } else {
                start[joint] - lower - MARGIN
            };
            if room / speeds[joint].abs() < time {
                (time, last) = (room / speeds[joint].abs(), joint);
            }
        }
        if time.is_nan() || time * largest < NEAR {
            let joint = self.joint_name(last);
            return Err(JogRefusal::EndOfRange { joint }.into());
        }
        let goal = start + speeds * time;
        let slow = speeds.zip_map(&self.limits.velocity, |speed, limit| {
            if speed == 0.0 { limit } else { speed.abs() }
        });
        self.jog_to((start, &goal), slow, most)
    }

    fn jog_tool(
        &self,
        (linear, angular, distance): (&Vector3<f64>, &Vector3<f64>, f64),
        start: &SVector<f64, N>,
        most: &ToolLimits,
    ) -> Result<PlannedMove<N>, MotionError> {
        let velocity = linear * most.speed;
        let turning = angular * most.angular_speed;
        let long = |speed: f64, far: f64| {
            if speed > 0.0 {
                far / speed
            } else {
                f64::INFINITY
            }
        };
        let along = long(velocity.norm(), FAR.0.min(distance));
        let mut time = along.min(long(turning.norm(), FAR.1.min(distance)));
        let from = self.chain().forward(start);
        let slower = |speed: f64, largest: f64| if speed > 0.0 { speed } else { largest };
        let limits = ToolLimits {
            speed: slower(velocity.norm(), most.speed),
            angular_speed: slower(turning.norm(), most.angular_speed),
            ..*most
        };
        let mut refusal = MotionError::from(JogRefusal::NoDirection);
        for _ in 0..TRIES {
            if !(time.is_finite() && time * velocity.norm().max(turning.norm()) >= NEAR) {
                break;
            }
            let turn = UnitQuaternion::from_scaled_axis(turning * time);
            let step = Isometry3::from_parts(Translation3::from(velocity * time), turn);
            let motion = Move {
                shape: Shape::Straight,
                poses: vec![from * step],
                tolerance: 0.0,
                limits,
            };
            match self.plan(&motion, start) {
                Ok(planned) => return Ok(planned),
                // Nearly as far as possible, or half the length if that is not known.
                Err(error) => {
                    time *= match &error {
                        MotionError::Blocked { percent, .. } => (percent * 0.0098).min(0.98),
                        _ => 0.5,
                    };
                    refusal = error;
                }
            }
        }
        Err(refusal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;
    use crate::robot::{load, vector};
    use nalgebra::vector;

    fn ur5e() -> (Planner<6>, SVector<f64, 6>, ToolLimits) {
        let robot = load("ur5e").unwrap();
        let controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
        let home = vector(&robot.home);
        (controller.planner().clone(), home, robot.motion_limits())
    }

    fn joints(shares: SVector<f64, 6>, distance: f64) -> Direction<6> {
        Direction::Joints { shares, distance }
    }

    /// A jog by a step goes as far as the step is.
    #[test]
    fn a_step_has_its_length() {
        let (planner, home, most) = ur5e();
        let mut shares = SVector::zeros();
        shares[1] = -0.3;
        let planned = planner.jog(&joints(shares, 0.01), &home, &most).unwrap();
        assert!((planned.end[1] - home[1] + 0.01).abs() < 1e-12);
        let down = Direction::Tool {
            linear: vector![0.0, 0.0, -0.5],
            angular: Vector3::zeros(),
            distance: 0.002,
        };
        let planned = planner.jog(&down, &home, &most).unwrap();
        let [from, to] = [&home, &planned.end].map(|joints| planner.chain().forward(joints));
        let step = from.inv_mul(&to).translation.vector;
        assert!((step - vector![0.0, 0.0, -0.002]).norm() < 1e-6, "{step}");
    }

    /// A jog towards a pose ends there, is as slow as asked for, and has nothing to do when there;
    /// a goal beyond the range of a joint is refused.
    #[test]
    fn a_goal_is_reached_at_its_share_of_the_speed() {
        let (planner, home, most) = ur5e();
        let goal = home + SVector::<f64, 6>::from_column_slice(&[0.4, 0.2, -0.3, 0.1, 0.0, 1.0]);
        let towards = |joints, share| Direction::Goal { joints, share };
        let planned = planner.jog(&towards(goal, 0.1), &home, &most).unwrap();
        assert!((planned.end - goal).amax() < 1e-9);
        let peaks = planned.trajectory.peaks().velocity;
        for joint in 0..6 {
            assert!(peaks[joint].abs() <= 0.1 * planner.limits().velocity[joint] + 1e-9);
        }
        let there = planner.jog(&towards(goal, 0.1), &planned.end, &most);
        assert!(matches!(there, Err(MotionError::Jog(JogRefusal::AtGoal))));
        let mut beyond = goal;
        beyond[0] = 100.0;
        let refused = planner.jog(&towards(beyond, 0.1), &home, &most);
        let named = |joint: &str| joint == planner.joint_name(0);
        assert!(matches!(
            refused,
            Err(MotionError::Jog(JogRefusal::GoalBeyond { joint })) if named(&joint)
        ));
    }

    /// All joints move in the proportion asked for, at their fractions of the speed, until the
    /// first reaches the end of its range.
    #[test]
    fn joints_go_to_the_end_of_the_range_in_proportion() {
        let (planner, home, most) = ur5e();
        let shares = SVector::<f64, 6>::from_column_slice(&[0.0, 0.05, -0.1, 0.0, 0.0, 0.02]);
        let planned = planner
            .jog(&joints(shares, f64::INFINITY), &home, &most)
            .unwrap();
        let moved = planned.end - home;
        assert!((moved[1] / moved[2] + 0.5).abs() < 1e-9, "{moved}");
        assert!(moved.amax() > 1.0);
        let limits = planner.limits();
        let peaks = planned.trajectory.peaks();
        for joint in 0..6 {
            let allowed = shares[joint].abs() * limits.velocity[joint];
            assert!(peaks.velocity[joint].abs() <= allowed + 1e-9);
            assert!((limits.lower[joint]..=limits.upper[joint]).contains(&planned.end[joint]));
        }
        // At the end, no further jog is possible.
        let on = planner.jog(&joints(shares, f64::INFINITY), &planned.end, &most);
        let at_the_end = |error| matches!(error, MotionError::Jog(JogRefusal::EndOfRange { .. }));
        assert!(on.map_or_else(at_the_end, |_| true));
    }

    /// The tool moves straight along its own axis, as far as the arm reaches; repeated from there,
    /// the jog ends with an error that says why.
    #[test]
    fn the_tool_goes_straight_as_far_as_it_can() {
        let (planner, home, most) = ur5e();
        let direction = Direction::Tool {
            linear: vector![0.2, 0.0, 0.0],
            angular: Vector3::zeros(),
            distance: f64::INFINITY,
        };
        let (mut at, mut legs) = (home, 0);
        let refusal = loop {
            match planner.jog(&direction, &at, &most) {
                Ok(planned) => {
                    let before = planner.chain().forward(&at);
                    let after = planner.chain().forward(&planned.end);
                    let step = before.inv_mul(&after);
                    assert!(step.translation.x > 0.0 && step.rotation.angle() < 1e-6);
                    let aside = step.translation.y.hypot(step.translation.z);
                    assert!(aside < 1e-5, "{aside} m beside the axis");
                    assert!(planned.certificate.peaks.largest() <= 1.0 + 1e-9);
                    at = planned.end;
                }
                Err(error) => break error,
            }
            legs += 1;
            assert!(legs < 200, "the arm has no end");
        };
        assert!(legs >= 1, "{refusal}");
    }

    #[test]
    fn a_turn_stays_in_its_place() {
        let (planner, home, most) = ur5e();
        let direction = Direction::Tool {
            linear: Vector3::zeros(),
            angular: vector![0.0, 0.0, 0.3],
            distance: f64::INFINITY,
        };
        let planned = planner.jog(&direction, &home, &most).unwrap();
        let step = planner
            .chain()
            .forward(&home)
            .inv_mul(&planner.chain().forward(&planned.end));
        assert!(step.translation.vector.norm() < 1e-6);
        assert!(step.rotation.angle() > 0.3);
    }
}

//! A goal of the action, checked as far as that needs no arm.

use ipc::FollowPoint;

use crate::messages::{Goal, Tolerance};

/// How far the start of a trajectory may be ahead of the clock (s).
const AHEAD: f64 = 1.0;

/// What one joint may be off; `None` where nothing was told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Allowed {
    position: Option<f64>,
    velocity: Option<f64>,
}

/// A goal that an engine can be asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wanted {
    /// Names of the joints, as the goal has them.
    pub(crate) joints: Vec<String>,
    /// The points.
    pub(crate) points: Vec<FollowPoint>,
    /// What each joint of the arm may be off on the way.
    pub(crate) path: Vec<Allowed>,
    /// What each joint of the arm may be off at the end.
    pub(crate) end: Vec<Allowed>,
    /// How long the joints may take to be there (s).
    pub(crate) patience: f64,
}

impl Wanted {
    /// Reads a goal for an arm with these joints; `now` is the time of ROS (s).
    ///
    /// # Errors
    /// Why no engine need be asked.
    pub(crate) fn read(goal: Goal, arm: &[String], now: f64) -> Result<Self, String> {
        if !goal.multi_dof_trajectory.joint_names.is_empty()
            || !goal.multi_dof_trajectory.points.is_empty()
        {
            return Err("the arm has no joints with several degrees of freedom".to_owned());
        }
        let begin = goal.trajectory.header.stamp.to_nanos() as f64 * 1e-9;
        if begin > now + AHEAD {
            let ahead = begin - now;
            return Err(format!(
                "the trajectory begins {ahead:.1} s from now; it is executed at once or not at all"
            ));
        }
        let points = goal.trajectory.points.into_iter().map(|point| FollowPoint {
            time_s: point.time_from_start.seconds(),
            positions: point.positions,
            velocities: point.velocities,
            accelerations: point.accelerations,
        });
        Ok(Self {
            joints: goal.trajectory.joint_names,
            points: points.collect(),
            path: allowed(&goal.path_tolerance, arm)?,
            end: allowed(&goal.goal_tolerance, arm)?,
            patience: goal.goal_time_tolerance.seconds().max(0.0),
        })
    }

    /// The point that is passed at a time after the start (s), from 0.
    pub(crate) fn index(&self, time: f64) -> i32 {
        let passed = self.points.partition_point(|point| point.time_s <= time);
        i32::try_from(passed.saturating_sub(1)).unwrap_or(i32::MAX)
    }
}

/// What each joint of the arm may be off.
fn allowed(given: &[Tolerance], arm: &[String]) -> Result<Vec<Allowed>, String> {
    let mut all = vec![Allowed::default(); arm.len()];
    for tolerance in given {
        let joint = arm.iter().position(|name| *name == tolerance.name);
        let joint = joint.ok_or_else(|| {
            format!(
                "there is a tolerance for {:?}, which the arm does not have",
                tolerance.name
            )
        })?;
        // 0 is not told, below 0 is no limit.
        let told = |value: f64| (value > 0.0).then_some(value);
        all[joint] = Allowed {
            position: told(tolerance.position),
            velocity: told(tolerance.velocity),
        };
    }
    Ok(all)
}

/// The first joint that is off by more than is allowed, in words; `off` has the error of the position
/// and of the velocity of each joint.
pub(crate) fn violation(
    arm: &[String],
    allowed: &[Allowed],
    off: impl Iterator<Item = (f64, f64)>,
) -> Option<String> {
    let rows = arm.iter().zip(allowed).zip(off);
    for ((name, allowed), (position, velocity)) in rows {
        let pairs = [
            ("position", position, allowed.position),
            ("velocity", velocity, allowed.velocity),
        ];
        for (what, off, allowed) in pairs {
            // NaN is too far.
            if let Some(most) = allowed
                && (off.is_nan() || off.abs() > most)
            {
                return Some(format!(
                    "the {what} of {name} is {off:.5} off, {most} are allowed"
                ));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Header, MultiTrajectory, Point, Span, Trajectory};
    use ros2_client::builtin_interfaces::Time;

    fn goal() -> Goal {
        let header = Header {
            stamp: Time::ZERO,
            frame_id: String::new(),
        };
        let point = |second: i32| Point {
            positions: vec![0.1, 0.2],
            time_from_start: Span {
                sec: second,
                nanosec: 500_000_000,
            },
            ..Point::default()
        };
        Goal {
            trajectory: Trajectory {
                header: header.clone(),
                joint_names: vec!["b".to_owned(), "a".to_owned()],
                points: vec![point(0), point(1), point(2)],
            },
            multi_dof_trajectory: MultiTrajectory {
                header,
                joint_names: Vec::new(),
                points: Vec::new(),
            },
            path_tolerance: Vec::new(),
            component_path_tolerance: Vec::new(),
            goal_tolerance: Vec::new(),
            component_goal_tolerance: Vec::new(),
            goal_time_tolerance: Span::default(),
        }
    }

    fn arm() -> Vec<String> {
        vec!["a".to_owned(), "b".to_owned()]
    }

    #[test]
    fn times_and_points() {
        let wanted = Wanted::read(goal(), &arm(), 100.0).unwrap();
        assert_eq!(wanted.points[2].time_s, 2.5);
        assert_eq!(
            [0.0, 0.5, 1.6, 9.0].map(|time| wanted.index(time)),
            [0, 0, 1, 2]
        );
    }

    #[test]
    fn what_an_arm_does_not_have_is_refused() {
        let mut later = goal();
        later.trajectory.header.stamp = Time::from_nanos(103_000_000_000);
        assert!(
            Wanted::read(later.clone(), &arm(), 100.0)
                .unwrap_err()
                .contains("3.0 s from now")
        );
        assert!(Wanted::read(later, &arm(), 103.5).is_ok());
        let mut multi = goal();
        multi
            .multi_dof_trajectory
            .joint_names
            .push("base".to_owned());
        assert!(Wanted::read(multi, &arm(), 0.0).is_err());
        let mut unknown = goal();
        unknown.goal_tolerance.push(Tolerance {
            name: "c".to_owned(),
            ..Tolerance::default()
        });
        assert!(
            Wanted::read(unknown, &arm(), 0.0)
                .unwrap_err()
                .contains("\"c\"")
        );
    }

    /// A tolerance of 0 or below is none; the joint that is too far off is named.
    #[test]
    fn tolerances_name_their_joint() {
        let mut goal = goal();
        let tolerance = |name: &str, position, velocity| Tolerance {
            name: name.to_owned(),
            position,
            velocity,
            acceleration: 0.0,
        };
        goal.path_tolerance = vec![tolerance("b", 0.1, -1.0), tolerance("a", 0.0, 0.5)];
        let wanted = Wanted::read(goal, &arm(), 0.0).unwrap();
        let judge = |off: [(f64, f64); 2]| violation(&arm(), &wanted.path, off.into_iter());
        assert_eq!(judge([(9.0, 0.4), (-0.09, 9.0)]), None);
        assert!(
            judge([(0.0, -0.6), (0.0, 0.0)])
                .unwrap()
                .contains("velocity of a")
        );
        assert!(
            judge([(0.0, 0.0), (-0.11, 0.0)])
                .unwrap()
                .contains("position of b")
        );
        assert!(judge([(0.0, 0.0), (f64::NAN, 0.0)]).is_some());
    }
}

//! Plans a list of poses for a robot and measures the motion: one case of a benchmark of smooth
//! motions.
//!
//! The list has its own frame. It is placed so that its middle is at the flange's home position,
//! its axes are parallel to those of the workstation, and its identity orientation is that of the
//! flange at home. The flange has no end effector, so that arms are compared and not their tools.

use std::time::Instant;

use nalgebra::{Isometry3, SVector, Translation3, Vector3};
use planner::motion::{PlannedMove, Planner};
use planner::robot::{Robot, RobotError, vector};
use planner::task::{Move, Shape};
use planner::with_dof;
use trajectory::ToolLimits;

use crate::Traced;
use crate::smooth::Measure;
use crate::traced::{places, times};

/// A smooth motion to be tried: the first pose is its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Poses in the frame of the list, m.
    pub poses: Vec<Isometry3<f64>>,
    /// Radius of the ball round each intermediate pose, m.
    pub tolerance: f64,
    /// Limits of the controlled point.
    pub limits: ToolLimits,
}

/// Configurations tried for the start at most, the nearest to home first.
const STARTS: usize = 8;

impl Trial {
    /// The poses in the workstation, placed for a robot that has its flange at `home`.
    ///
    /// ```
    /// use nalgebra::{Isometry3, Vector3};
    /// use trajectory::ToolLimits;
    /// let poses = vec![Isometry3::translation(0.0, 0.0, 0.0), Isometry3::translation(0.2, 0.0, 0.0)];
    /// let trial = measure::Trial { poses, tolerance: 0.001, limits: ToolLimits::UNLIMITED };
    /// let placed = trial.placed(&Isometry3::translation(0.5, 0.0, 0.3));
    /// assert_eq!(placed[0].translation.vector, Vector3::new(0.4, 0.0, 0.3));
    /// ```
    #[must_use]
    pub fn placed(&self, home: &Isometry3<f64>) -> Vec<Isometry3<f64>> {
        let places = || self.poses.iter().map(|pose| pose.translation.vector);
        let lowest = places().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let highest = places().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let middle: Vector3<f64> = (lowest + highest) * 0.5;
        let place = |pose: &Isometry3<f64>| {
            let point = home.translation.vector + pose.translation.vector - middle;
            Isometry3::from_parts(Translation3::from(point), pose.rotation * home.rotation)
        };
        self.poses.iter().map(place).collect()
    }

    /// Plans the motion on `robot` with the planner that runs programs, from the first pose to
    /// the last, and once more with a stop at each pose; measures both. A list that cannot be
    /// planned has a reason and no motion.
    ///
    /// # Errors
    /// [`RobotError`] when the robot cannot be planned for.
    pub fn measure(&self, robot: &Robot) -> Result<Measure, RobotError> {
        with_dof!(robot.dof(), N => self.measure_with::<N>(robot))
    }

    /// Plans the motion as [`Trial::measure`] does, and gives it as points to be drawn; or why there
    /// is none.
    ///
    /// # Errors
    /// [`RobotError`] when the robot cannot be planned for.
    pub fn trace(&self, robot: &Robot) -> Result<Result<Traced, String>, RobotError> {
        with_dof!(robot.dof(), N => self.trace_with::<N>(robot))
    }

    fn measure_with<const N: usize>(&self, robot: &Robot) -> Result<Measure, RobotError> {
        let planner = robot.planner::<N>()?;
        let home: SVector<f64, N> = vector(&robot.home);
        Ok(match self.find(&planner, &home) {
            Ok(found) => {
                let stops = found.with_stops(&planner);
                self.measured(&found.planned, stops.as_ref(), found.planning)
            }
            Err((reason, planning)) => self.unplanned(reason, planning),
        })
    }

    fn trace_with<const N: usize>(
        &self,
        robot: &Robot,
    ) -> Result<Result<Traced, String>, RobotError> {
        let planner = robot.planner::<N>()?;
        let home: SVector<f64, N> = vector(&robot.home);
        let found = self.find(&planner, &home).map_err(|(reason, _)| reason);
        Ok(found.map(|found| {
            let placed = self.placed(&planner.chain().forward(&home));
            let stops = found.with_stops(&planner);
            let trajectory = &found.planned.trajectory;
            let (step, count) = times(trajectory.duration());
            let list = |vector: &SVector<f64, N>| vector.as_slice().to_vec();
            let states = (0..count).map(|k| {
                let time = (k as f64 * step).min(trajectory.duration());
                trajectory.sample(time)
            });
            let (points, joints) = states
                .map(|state| {
                    let point = planner.chain().forward(&state.position).translation.vector;
                    let lists = [&state.position, &state.velocity, &state.acceleration].map(list);
                    (<[f64; 3]>::from(point), lists)
                })
                .unzip();
            let traced = Traced {
                poses: places(&placed),
                duration: trajectory.duration(),
                lower_bound: 0.0,
                exact_stop: stops.map(|stops| stops.trajectory.duration()),
                step,
                points,
                joints,
                passes: Vec::new(),
                active: Vec::new(),
            };
            traced.certified(&found.planned.certificate)
        }))
    }

    /// The first motion that can be planned from a configuration at the first pose; otherwise why
    /// there is none, and the time of the last attempt (s).
    fn find<const N: usize>(
        &self,
        planner: &Planner<N>,
        home: &SVector<f64, N>,
    ) -> Result<Found<N>, (String, f64)> {
        let placed = self.placed(&planner.chain().forward(home));
        let Some((first, rest)) = placed.split_first().filter(|(_, rest)| !rest.is_empty()) else {
            return Err(("at least two poses are needed".into(), 0.0));
        };
        let motion = Move {
            shape: Shape::Smooth,
            poses: rest.to_vec(),
            tolerance: self.tolerance,
            limits: self.limits,
        };
        let mut failed = ("the first pose is out of reach".to_owned(), 0.0);
        for start in planner.postures(first, home).into_iter().take(STARTS) {
            let clock = Instant::now();
            let planned = planner.plan(&motion, &start);
            let planning = clock.elapsed().as_secs_f64();
            match planned {
                Ok(planned) => {
                    return Ok(Found {
                        motion,
                        start,
                        planned,
                        planning,
                    });
                }
                Err(error) => failed = (error.to_string(), planning),
            }
        }
        Err(failed)
    }

    fn measured<const N: usize>(
        &self,
        planned: &PlannedMove<N>,
        stops: Option<&PlannedMove<N>>,
        planning: f64,
    ) -> Measure {
        let certificate = &planned.certificate;
        let peaks = &certificate.peaks;
        let most = |ratios: &[f64]| ratios.iter().copied().fold(0.0, f64::max);
        let blend = planned.blend;
        let deviation = certificate
            .poses
            .iter()
            .map(|pass| pass.deviation_m / pass.tolerance_m.max(f64::MIN_POSITIVE))
            .fold(0.0, f64::max);
        Measure {
            motion: Some(planned.trajectory.duration()),
            exact_stop: stops.map(|stops| stops.trajectory.duration()),
            deviation_ratio: if self.tolerance > 0.0 { deviation } else { 0.0 },
            corridor_ratio: blend.map_or(0.0, |blend| blend.corridor_ratio),
            velocity_ratio: most(&peaks.joint_velocity)
                .max(peaks.tool_speed)
                .max(peaks.tool_angular_speed),
            acceleration_ratio: most(&peaks.joint_acceleration)
                .max(peaks.tool_acceleration)
                .max(peaks.tool_angular_acceleration),
            jerk_ratio: most(&peaks.joint_jerk).max(blend.map_or(0.0, |blend| blend.jerk_ratio)),
            // The planner gives out what it has proved, or an error.
            certified: true,
            fallbacks: blend.map_or(0, |blend| blend.fallbacks),
            reason: None,
            ..self.unplanned(String::new(), planning)
        }
    }

    fn unplanned(&self, reason: String, planning: f64) -> Measure {
        Measure {
            planning,
            first: planning,
            ..Measure::unplanned(self.poses.len(), reason)
        }
    }
}

/// A motion that could be planned.
struct Found<const N: usize> {
    motion: Move,
    start: SVector<f64, N>,
    planned: PlannedMove<N>,
    /// Time that planning took (s).
    planning: f64,
}

impl<const N: usize> Found<N> {
    /// The same with a stop at each pose.
    fn with_stops(&self, planner: &Planner<N>) -> Option<PlannedMove<N>> {
        let stops = Move {
            tolerance: 0.0,
            ..self.motion.clone()
        };
        planner.plan(&stops, &self.start).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Trial {
        let points = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]];
        Trial {
            poses: points
                .map(|[x, y]| Isometry3::translation(x, y, 0.0))
                .to_vec(),
            tolerance: 0.001,
            limits: ToolLimits {
                speed: 0.5,
                acceleration: 5.0,
                jerk: 100.0,
                ..ToolLimits::UNLIMITED
            },
        }
    }

    #[test]
    fn a_gantry_with_generous_joints_is_as_fast_as_the_tool() {
        let robot = planner::robot::load("gantry").unwrap();
        let trial = corner();
        let options = trajectory::smooth::SmoothOptions::new(trial.tolerance, trial.limits);
        let free = crate::smooth::measure(&trial.poses, &options);
        let row = trial.measure(&robot).unwrap();
        assert!(row.certified, "{row:?}");
        let (ours, free) = (row.motion.unwrap(), free.motion.unwrap());
        assert!((ours / free - 1.0).abs() < 1e-3, "{ours} {free}");
        assert!(row.exact_stop.unwrap() > ours);
        assert!(row.deviation_ratio > 0.5 && row.deviation_ratio <= 1.0 + 1e-6);
    }

    /// Numbers from 0 to 1, the same each time.
    ///
    /// # Source
    /// G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8(14), 2003.
    fn random(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn an_arm_is_never_slower_than_with_stops() {
        let mut state = 11;
        for name in ["ur5e", "panda"] {
            let robot = planner::robot::load(name).unwrap();
            for count in 2..8 {
                let mut trial = corner();
                let place = |_| [0; 3].map(|_| 0.15 * random(&mut state));
                let places: Vec<_> = (0..count).map(place).collect();
                let pose = |[x, y, z]: &[f64; 3]| Isometry3::translation(*x, *y, *z);
                trial.poses = places.iter().map(pose).collect();
                trial.limits = ToolLimits {
                    speed: 2.0,
                    acceleration: 20.0,
                    jerk: 1000.0,
                    ..ToolLimits::UNLIMITED
                };
                let row = trial.measure(&robot).unwrap();
                let motion = row.motion.unwrap_or_else(|| panic!("{name}: {row:?}"));
                assert!(
                    motion <= row.exact_stop.unwrap() * (1.0 + 1e-9),
                    "{name}: {row:?}"
                );
            }
        }
    }

    /// What is drawn is what was measured: from the first pose to the last, within the certificate.
    #[test]
    fn a_traced_motion_is_the_measured_one() {
        let robot = planner::robot::load("ur5e").unwrap();
        let trial = corner();
        let row = trial.measure(&robot).unwrap();
        let traced = trial.trace(&robot).unwrap().unwrap();
        assert_eq!(Some(traced.duration), row.motion);
        assert_eq!(traced.exact_stop, row.exact_stop);
        let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(&traced.points[0], &traced.poses[0]), "{traced:?}");
        assert!(near(traced.points.last().unwrap(), &traced.poses[2]));
        assert_eq!(traced.points.len(), traced.joints.len());
        assert_eq!((traced.passes.len(), traced.passes[0].index), (1, 1));
        let far = Trial {
            poses: vec![
                Isometry3::translation(0.0, 0.0, 0.0),
                Isometry3::translation(9.0, 0.0, 0.0),
            ],
            ..trial
        };
        assert!(far.trace(&robot).unwrap().is_err());
    }

    #[test]
    fn what_is_out_of_reach_has_a_reason() {
        let robot = planner::robot::load("ur5e").unwrap();
        let mut trial = corner();
        trial.poses[2] = Isometry3::translation(9.0, 0.0, 0.0);
        let row = trial.measure(&robot).unwrap();
        assert_eq!(row.motion, None);
        assert!(row.reason.is_some());
    }
}

use measure::{Traced, Trial};
use planner::robot::Robot;
use trajectory::smooth::SmoothOptions;
use view::{ListMotion, PoseList, Source};

use super::suite::{self, Suite};
use crate::exit::Exit;
use crate::failure::Failure;

/// Every case as the page shows it: its poses and its motion.
///
/// # Errors
/// The robot cannot be planned for.
pub(super) fn source(suite: &Suite, robot: Option<&Robot>) -> Result<Source, Failure> {
    let cases = suite.cases.0.iter();
    let lists: Result<Vec<PoseList>, Failure> = cases
        .map(|(name, case)| match suite::trial(case) {
            Ok(trial) => list(name, &trial, robot),
            Err(reason) => Ok(PoseList {
                name: name.clone(),
                poses: Vec::new(),
                tolerance_m: 0.0,
                speed_m_s: 0.0,
                motion: Err(reason),
            }),
        })
        .collect();
    let robot = robot.map(|robot| {
        // The lists are planned for the flange: no tool is drawn.
        Box::new(Robot {
            mounted: None,
            ..robot.clone()
        })
    });
    Ok(Source::Lists {
        robot,
        lists: lists?,
    })
}

fn list(name: &str, trial: &Trial, robot: Option<&Robot>) -> Result<PoseList, Failure> {
    let traced = match robot {
        Some(robot) => trial
            .trace(robot)
            .map_err(|error| Failure::new(Exit::Unreadable, error))?,
        None => {
            let options = SmoothOptions::new(trial.tolerance, trial.limits);
            Traced::free(&trial.poses, &options)
        }
    };
    let place = |pose: &nalgebra::Isometry3<f64>| pose.translation.vector.into();
    let poses = match &traced {
        Ok(traced) => traced.poses.clone(),
        Err(_) => trial.poses.iter().map(place).collect(),
    };
    Ok(PoseList {
        name: name.to_owned(),
        poses,
        tolerance_m: trial.tolerance,
        speed_m_s: trial.limits.speed,
        motion: traced.map(motion),
    })
}

fn motion(traced: Traced) -> ListMotion {
    let passes = traced.passes.iter();
    let active = traced.active.into_iter();
    ListMotion {
        duration_s: traced.duration,
        lower_bound_s: traced.lower_bound,
        stop_s: traced.exact_stop,
        step_s: traced.step,
        points: traced.points,
        joints: traced.joints,
        passes: passes
            .map(|pass| (pass.index, pass.deviation, pass.time))
            .collect(),
        active: active
            .map(|span| (span.limit, span.start, span.end))
            .collect(),
    }
}

//! Where the descent begins.

use super::effort::Effort;
use super::nudge::nudge;
use super::problem::{Point, Problem};
use super::project::{project, ratios};

/// Moves a first iterate to a point from which the descent can begin.
pub(super) fn begin<const D: usize>(
    problem: &mut Problem<D>,
    point: &mut Point<D>,
    effort: Effort,
) {
    if (effort.spread.is_some() && problem.moving()) || problem.finish.is_some() {
        problem.anchor = Some(point.z);
    }
    problem.pin(point);
    project(problem, point, None, 20);
    if !problem.joints.is_empty() {
        nudge(problem, point);
    }
    if problem.anchor.is_some() || !problem.moving() {
        slow_down(problem, point);
    }
}

/// The cube of the factor on the time with which speed, acceleration and jerk hold with a margin.
fn time_cubed(ratios: [f64; 3]) -> f64 {
    let [speed, acceleration, jerk] = ratios.map(|ratio| ratio / 0.9);
    speed.powi(3).max(acceleration.powf(1.5)).max(jerk)
}

/// Raises `z` until speed, acceleration and jerk hold with a margin, those of joints, too.
fn slow_down<const D: usize>(problem: &Problem<D>, point: &mut Point<D>) {
    let mut need = 0.0_f64;
    for ratios in ratios(problem, point) {
        need = need.max(time_cubed(ratios));
    }
    let h = problem.spacing(point.z);
    for joint in &problem.joints {
        need = need.max(time_cubed(joint.ratios(&point.control, h)));
    }
    point.z *= need.max(1e-9);
}

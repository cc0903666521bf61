//! What is asked of the spline.

use nalgebra::{Isometry3, Vector3};

use super::effort::Effort;
use super::problem::FEW;
use super::start::KNOTS_PER_RAMP;
use crate::ToolPoint;
use crate::line::body_turn;
use crate::smooth::arm::ArmMotion;
use crate::smooth::options::SmoothOptions;
use crate::smooth::shares::Shares;
use crate::smooth::span::Span;

/// Times that the jump of an angular velocity within one knot may exceed the angular jerk where the
/// orientation is to follow the progress.
const HOPELESS: f64 = 30.0;

/// A start in motion: state and knot spacing of the motion it continues.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moving {
    pub(crate) state: ToolPoint,
    pub(crate) spacing: f64,
}

/// What is asked of the spline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request<'a> {
    /// The poses; with `moving` the first is the pose passed last.
    pub(crate) poses: &'a [Isometry3<f64>],
    pub(crate) options: &'a SmoothOptions,
    /// Shares of the tolerances that are used.
    pub(crate) shares: &'a Shares,
    /// State at the start; `None` at rest in the first pose.
    pub(crate) moving: Option<&'a Moving>,
    /// State at the end, between the last pose but one and the last; `None` at rest in the last pose. Only
    /// with a start in motion and a motion that is known.
    pub(crate) finish: Option<&'a ToolPoint>,
    pub(crate) effort: Effort,
    /// True: the orientation is part of the optimum. False: it follows the
    /// progress of the controlled point, which is faster to plan.
    pub(crate) coupled: bool,
    /// A motion from the same start through the same poses that holds, to start the search from.
    pub(crate) known: Option<&'a [Span]>,
    /// Whether the motion will be made from its end to its start: the first approaches to poses may be others then.
    pub(crate) backwards: bool,
    /// A motion of an arm from rest to rest through the poses, to start the search from, and what its joints may do.
    pub(crate) arm: Option<&'a ArmMotion<'a>>,
}

impl Request<'_> {
    /// Whether the poses and the ends move the controlled point, and whether they turn it.
    pub(crate) fn moves(&self) -> [bool; 2] {
        let begin = self.moving.map_or(self.poses[0], |m| m.state.pose);
        let far =
            |p: &Isometry3<f64>| (p.translation.vector - begin.translation.vector).norm() > 1e-12;
        let turned = |p: &Isometry3<f64>| body_turn(&begin.rotation, &p.rotation).norm() > 1e-12;
        let ends = || self.moving.map(|m| &m.state).into_iter().chain(self.finish);
        let fast = |k: fn(&ToolPoint) -> f64| ends().any(|state| k(state) > 1e-9);
        let finish = self.finish.map(|state| &state.pose);
        [
            self.poses.iter().chain(finish).any(far) || fast(|s| s.linear[0].norm()),
            self.poses.iter().chain(finish).any(turned) || fast(|s| s.angular[0].norm()),
        ]
    }

    /// Whether the poses are so few that their passing times may stand beside the band: they cost the square of their number.
    pub(super) fn has_few_poses(&self) -> bool {
        self.poses.len() <= FEW + 2
    }

    /// True when each leg that turns takes about as long to move as to turn, so that the orientation
    /// can follow the progress, and when no pose is passed with a jump of the angular velocity that is
    /// far above the angular jerk.
    pub(crate) fn can_follow(&self) -> bool {
        let least = self.options.tolerance.min(1e-3);
        self.follows(least)
    }

    /// The same where legs may be short: then poses are missed more often.
    pub(crate) fn may_follow(&self) -> bool {
        self.follows(0.0)
    }

    /// The same where legs that turn are longer than `least` (m).
    fn follows(&self, least: f64) -> bool {
        let limits = &self.options.limits;
        let ramps = [
            limits.acceleration / limits.jerk,
            limits.angular_acceleration / limits.angular_jerk,
        ];
        let knot = ramps[0].max(ramps[1]) / KNOTS_PER_RAMP;
        let most = HOPELESS * limits.angular_jerk * knot * knot / limits.speed;
        let mut before: Option<Vector3<f64>> = None;
        self.poses.windows(2).all(|pair| {
            let way = (pair[1].translation.vector - pair[0].translation.vector).norm();
            let turn = body_turn(&pair[0].rotation, &pair[1].rotation);
            let angle = turn.norm();
            let far = way > least;
            let slow = angle / limits.angular_speed < 1.5 * way / limits.speed;
            let rate = turn / way.max(1e-300);
            let jump = before
                .replace(rate)
                .map_or(0.0, |before| (rate - before).norm());
            (angle < 1e-12 || (far && slow)) && jump <= most
        })
    }
}

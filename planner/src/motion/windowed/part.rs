//! A part of a path, its time law, and where that law is cut.

use trajectory::smooth::FittedPart;
use trajectory::timing::Timed;
use trajectory::{
    HermitePath, JointLimits, JointPoint, Path, PathPoint, ToolCurve, ToolLimits, ToolPoint,
};

/// Time that is left for braking behind a cut, in times of braking from the speed there.
const BRAKES: f64 = 1.6;

/// A path from one parameter to another, which is the end at most.
pub(super) struct Part<'a, const N: usize> {
    path: &'a HermitePath<N, &'a FittedPart>,
    pub from: f64,
    pub to: f64,
    knots: Vec<f64>,
}

impl<'a, const N: usize> Part<'a, N> {
    pub(super) fn new(path: &'a HermitePath<N, &'a FittedPart>, from: f64, to: f64) -> Self {
        let all = path.knots();
        let first = all.partition_point(|u| *u <= from + NEAR);
        let last = all.partition_point(|u| *u < to - NEAR);
        let mut knots = vec![0.0];
        knots.extend(all[first..last.max(first)].iter().map(|u| u - from));
        knots.push(to - from);
        Self {
            path,
            from,
            to,
            knots,
        }
    }

    fn inside(&self, u: f64) -> f64 {
        (self.from + u).clamp(self.from, self.to)
    }
}

/// Parameters this near to each other are one.
const NEAR: f64 = 1e-6;

impl<const N: usize> Path<N> for Part<'_, N> {
    fn end(&self) -> f64 {
        self.to - self.from
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        self.path.at(self.inside(u))
    }

    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.path.joint_at(self.inside(u))
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        self.path.tool().at(self.inside(u))
    }
}

/// A share of all limits.
pub(super) fn lowered<const N: usize>(
    joints: &JointLimits<N>,
    tool: &ToolLimits,
    share: f64,
) -> (JointLimits<N>, ToolLimits) {
    (
        joints.scaled(share, share, share),
        tool.scaled(share, share),
    )
}

/// How many pieces of a law may be executed before a longer one takes its place: behind them, the
/// motion brakes.
pub(super) fn cut<const N: usize>(
    part: &Part<'_, N>,
    timed: &Timed<N>,
    joints: &JointLimits<N>,
    tool: &ToolLimits,
) -> usize {
    let brake = |speed: f64, acceleration: f64, jerk: f64| {
        if speed > 0.0 && acceleration.is_finite() {
            speed / acceleration + acceleration / jerk
        } else {
            0.0
        }
    };
    let duration = timed.law.duration();
    let early = |piece: &usize| {
        let time = timed.law.times()[*piece];
        let law = timed.law.pieces()[*piece].sample(0.0);
        let (u, rate) = (law.position[0], law.velocity[0]);
        let seen = part.tool_at(u);
        let speed = timed.trajectory.pieces()[*piece].sample(0.0).velocity;
        let place = seen.linear[0].norm() * rate;
        let turn = seen.angular[0].norm() * rate;
        let mut stop = brake(place, tool.acceleration, tool.jerk).max(brake(
            turn,
            tool.angular_acceleration,
            tool.angular_jerk,
        ));
        for j in 0..N {
            stop = stop.max(brake(
                speed[j].abs(),
                joints.acceleration[j],
                joints.jerk[j],
            ));
        }
        rate > 0.0 && time + BRAKES * stop <= duration
    };
    (1..timed.law.pieces().len()).rev().find(early).unwrap_or(0)
}

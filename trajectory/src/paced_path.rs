//! A path along which the tool has limits that change from place to place.

use nalgebra::Vector3;

use crate::{JointPoint, Path, PathPoint, ToolLimits, ToolPoint};

/// Share of a leg within which its limits take over from narrower ones beside it.
const BLEND: f64 = 0.1;

/// A path whose tool has limits of its own in each leg: the tool's derivatives are multiplied by the
/// factor by which the limits of the leg are narrower than the widest of all, so that the widest hold
/// for the product where the own limits hold for the tool.
///
/// Where limits change, the narrower ones hold a little longer, and the change is smooth. One factor
/// counts for speed and acceleration of a leg: the larger of both.
#[derive(Clone, Debug)]
pub struct PacedPath<P> {
    path: P,
    knots: Vec<f64>,
    /// Where each leg ends.
    ends: Vec<f64>,
    /// The factors of each leg, linear and angular, at least 1.
    factors: Vec<[f64; 2]>,
}

impl<P> PacedPath<P> {
    /// The path with limits of the tool in each leg; `ends` are the parameters at which the legs end,
    /// ascending, one less than there are `limits`, all of which are at most `widest`.
    pub fn new<const N: usize>(
        path: P,
        ends: &[f64],
        limits: &[ToolLimits],
        widest: &ToolLimits,
    ) -> Self
    where
        P: Path<N>,
    {
        let mut knots = [path.knots(), ends].concat();
        knots.sort_by(f64::total_cmp);
        knots.dedup_by(|b, a| *b - *a < 1e-9 * path.end());
        let ends = ends.iter().copied().chain([path.end()]).collect();
        let factors = limits
            .iter()
            .map(|limits| factors(limits, widest))
            .collect();
        Self {
            path,
            knots,
            ends,
            factors,
        }
    }

    /// The factors at a parameter.
    fn factors(&self, u: f64) -> [f64; 2] {
        let last = self.factors.len().saturating_sub(1);
        let leg = self.ends.partition_point(|end| *end <= u).min(last);
        let start = if leg == 0 { 0.0 } else { self.ends[leg - 1] };
        let own = self.factors.get(leg).copied().unwrap_or([1.0; 2]);
        let width = BLEND * (self.ends[leg] - start);
        let mut most = own;
        for (other, way) in [
            (leg.checked_sub(1), u - start),
            (Some(leg + 1), self.ends[leg] - u),
        ] {
            let Some(other) = other.and_then(|leg| self.factors.get(leg)) else {
                continue;
            };
            let x = if width > 0.0 {
                (way / width).clamp(0.0, 1.0)
            } else {
                1.0
            };
            // The share of the narrower limits falls smoothly from 1 to 0.
            let share = 1.0 - x * x * x * (10.0 - x * (15.0 - 6.0 * x));
            for ((most, own), other) in most.iter_mut().zip(own).zip(other) {
                *most = most.max(own + share * (other - own));
            }
        }
        most
    }

    fn paced(&self, tool: ToolPoint, u: f64) -> ToolPoint {
        let [linear, angular] = self.factors(u);
        let all = |vectors: [Vector3<f64>; 3], factor: f64| vectors.map(|vector| vector * factor);
        ToolPoint {
            pose: tool.pose,
            linear: all(tool.linear, linear),
            angular: all(tool.angular, angular),
        }
    }
}

/// By how much limits are narrower than the widest, linear and angular.
fn factors(limits: &ToolLimits, widest: &ToolLimits) -> [f64; 2] {
    let ratio = |widest: f64, own: f64| {
        if own.is_finite() {
            (widest / own).max(1.0)
        } else {
            1.0
        }
    };
    [
        ratio(widest.speed, limits.speed).max(ratio(widest.acceleration, limits.acceleration)),
        ratio(widest.angular_speed, limits.angular_speed).max(ratio(
            widest.angular_acceleration,
            limits.angular_acceleration,
        )),
    ]
}

impl<const N: usize, P: Path<N>> Path<N> for PacedPath<P> {
    fn end(&self) -> f64 {
        self.path.end()
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, u: f64) -> PathPoint<N> {
        let PathPoint { joint, tool } = self.path.at(u);
        PathPoint {
            joint,
            tool: self.paced(tool, u),
        }
    }

    fn joint_at(&self, u: f64) -> JointPoint<N> {
        self.path.joint_at(u)
    }

    fn tool_at(&self, u: f64) -> ToolPoint {
        self.paced(self.path.tool_at(u), u)
    }
}

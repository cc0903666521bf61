//! The simplest motion: straight legs with a stop at each pose.

use nalgebra::{Isometry3, Vector3};

use super::crossing::RESOLUTION;
use super::ramp::{self, Caps, Gate};
use super::span::{Span, Turn};
use crate::ToolLimits;
use crate::line::{Line, body_turn};

/// The straight leg between two poses, with progress 0 to 1 as its unit.
#[derive(Clone, Debug)]
pub(crate) struct Leg {
    pub(crate) from: Isometry3<f64>,
    /// Way of the controlled point, m.
    pub(crate) way: Vector3<f64>,
    /// Rotation vector of the turn in axes of `from`, rad.
    pub(crate) turn: Vector3<f64>,
}

impl Leg {
    /// The leg between two poses.
    pub(crate) fn new(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Self {
        Self {
            from: *from,
            way: to.translation.vector - from.translation.vector,
            turn: body_turn(&from.rotation, &to.rotation),
        }
    }

    /// Limits of the progress: the tightest of the linear and angular ones.
    pub(crate) fn caps(&self, limits: &ToolLimits) -> Caps {
        let (length, angle) = (self.way.norm(), self.turn.norm());
        let cap = |linear: f64, angular: f64| (linear / length).min(angular / angle);
        Caps {
            speed: cap(limits.speed, limits.angular_speed),
            acceleration: cap(limits.acceleration, limits.angular_acceleration),
            jerk: cap(limits.jerk, limits.angular_jerk),
        }
    }

    /// The progress at which a pose is passed, if the leg passes it.
    fn share(&self, pose: &Isometry3<f64>) -> Option<f64> {
        let other = Self::new(&self.from, pose);
        let length = self.way.norm();
        let share = if length > RESOLUTION {
            other.way.dot(&self.way) / (length * length)
        } else {
            other.turn.dot(&self.turn) / self.turn.norm_squared()
        };
        let missed = (self.way * share - other.way).norm();
        let askew = (self.turn * share - other.turn).norm();
        (missed <= RESOLUTION && askew <= 1e3 * RESOLUTION).then_some(share)
    }

    /// Spans of a motion along the leg with pieces (duration s, jerk of the
    /// progress in 1/s3), from the progress state `state`, starting at `time`.
    pub(crate) fn spans(
        &self,
        pieces: &[(f64, f64)],
        mut state: [f64; 3],
        mut time: f64,
    ) -> Vec<Span> {
        let mut spans = Vec::with_capacity(pieces.len());
        for &(duration, jerk) in pieces {
            if duration <= 0.0 {
                continue;
            }
            let angle = [state[0], state[1], state[2] / 2.0, jerk / 6.0, 0.0];
            let mut point = angle.map(|x| self.way * x);
            point[0] += self.from.translation.vector;
            let still = self.turn == Vector3::zeros();
            spans.push(Span {
                start: time,
                duration,
                point,
                base: self.from.rotation,
                turns: if still {
                    Vec::new()
                } else {
                    vec![Turn {
                        axis: self.turn,
                        angle,
                    }]
                },
            });
            state = ramp::advance(state, duration, jerk);
            time += duration;
        }
        spans
    }
}

/// Straight legs from pose to pose, at rest at each; poses that repeat the one
/// before take no time. Empty when nothing moves.
pub(crate) fn plan(poses: &[Isometry3<f64>], limits: &ToolLimits) -> Vec<Span> {
    let (mut spans, mut time) = (Vec::new(), 0.0);
    let Some(mut from) = poses.first() else {
        return spans;
    };
    for to in &poses[1..] {
        if Line::new(*from, *to).is_still() {
            continue;
        }
        let leg = Leg::new(from, to);
        let caps = leg.caps(limits);
        // A leg from rest to rest is never too short for its gates.
        let pieces = ramp::leg(1.0, Gate::default(), Gate::default(), &caps).unwrap_or_default();
        spans.extend(leg.spans(&pieces, [0.0; 3], time));
        time = spans.last().map_or(0.0, Span::end);
        from = to;
    }
    spans
}

/// The poses without those that the straight leg between their neighbours passes anyway, in
/// position and in orientation.
pub(crate) fn corners(poses: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let mut kept: Vec<Isometry3<f64>> = Vec::with_capacity(poses.len());
    // Index of the pose at which the current leg begins.
    let mut begin = 0;
    for (i, pose) in poses.iter().enumerate() {
        let inner = &poses[(begin + 1).min(i)..i];
        let grows = kept.len() > 1 && {
            let leg = Leg::new(&poses[begin], pose);
            let mut last = 0.0;
            inner.iter().all(|pose| {
                let share = leg.share(pose);
                let ahead = share.is_some_and(|share| share > last && share < 1.0);
                last = share.unwrap_or(last);
                ahead
            })
        };
        if grows {
            kept.pop();
        } else {
            begin = i.saturating_sub(1);
        }
        kept.push(*pose);
    }
    kept
}

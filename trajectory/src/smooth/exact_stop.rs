//! The simplest motion: straight legs with a stop at each pose.

use nalgebra::{Isometry3, Vector3};

use super::crossing::RESOLUTION;
use super::ramp::{self, Caps, Gate};
use super::span::{Span, Turn};
use crate::ToolLimits;
use crate::line::{Line, body_turn};
use crate::timing::least_time;

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

/// Time of [`plan`], s: the sum of the least times of the legs.
pub(crate) fn duration(poses: &[Isometry3<f64>], limits: &ToolLimits) -> f64 {
    let legs = poses
        .windows(2)
        .filter(|pair| !Line::new(pair[0], pair[1]).is_still());
    legs.map(|pair| least_time(1.0, Leg::new(&pair[0], &pair[1]).caps(limits).values()))
        .sum()
}

/// Which poses of a list are its ends and corners: the straight legs between them pass the other poses anyway, in
/// position and in orientation.
///
/// ```
/// use nalgebra::Isometry3;
/// use trajectory::smooth::corners;
/// let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.0);
/// let poses = [at(0.0, 0.0), at(0.1, 0.0), at(0.2, 0.0), at(0.2, 0.1)];
/// assert!(corners(&poses).eq([0, 2, 3]));
/// ```
pub fn corners(poses: &[Isometry3<f64>]) -> impl Iterator<Item = usize> {
    let last = poses.len().saturating_sub(1);
    let first = (!poses.is_empty()).then_some(0);
    std::iter::successors(first, move |from| {
        (*from < last).then(|| farthest(poses, *from))
    })
}

/// The poses at the ends and corners of a list.
pub(crate) fn at_corners(poses: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    corners(poses).map(|at| poses[at]).collect()
}

/// The farthest pose that is found to which a leg from pose `from` passes those between: doubling finds one too
/// far, halving the farthest before it, so a long straight way costs little more than one look at each pose.
fn farthest(poses: &[Isometry3<f64>], from: usize) -> usize {
    let last = poses.len() - 1;
    let (mut good, mut bad, mut step) = (from + 1, last + 1, 2);
    while good < last && bad > last {
        let to = (from + step).min(last);
        if passes(&poses[from..=to]) {
            good = to;
            step *= 2;
        } else {
            bad = to;
        }
    }
    while good + 1 < bad {
        let middle = good.midpoint(bad);
        if passes(&poses[from..=middle]) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// Whether the leg from the first pose to the last passes those between, in order.
fn passes(poses: &[Isometry3<f64>]) -> bool {
    let [first, inner @ .., goal] = poses else {
        return true;
    };
    let leg = Leg::new(first, goal);
    let mut last = 0.0;
    inner.iter().all(|pose| {
        let share = leg.share(pose);
        let ahead = share.is_some_and(|share| share > last && share < 1.0);
        last = share.unwrap_or(last);
        ahead
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn at(x: f64, y: f64) -> Isometry3<f64> {
        Isometry3::translation(x, y, 0.0)
    }

    /// Poses on straight legs are left out, however many; tips, repeats and other orientations stay.
    #[test]
    fn corners_are_kept() {
        let mut way: Vec<_> = (0..1000_i32)
            .map(|i| at(1e-3 * f64::from(i), 0.0))
            .collect();
        way.extend((1..700_i32).map(|i| at(0.999, 1e-3 * f64::from(i))));
        assert_eq!(at_corners(&way), [way[0], way[999], way[1698]]);
        let back = [
            at(0.0, 0.0),
            at(0.2, 0.0),
            at(0.1, 0.0),
            at(0.1, 0.0),
            at(0.0, 0.0),
        ];
        assert_eq!(at_corners(&back[..3]), back[..3]);
        assert_eq!(corners(&back).count(), 5);
        let turned = |x: f64, angle: f64| {
            Isometry3::from_parts(
                at(x, 0.0).translation,
                UnitQuaternion::from_scaled_axis(Vector3::x() * angle),
            )
        };
        let even = [turned(0.0, 0.0), turned(0.1, 0.2), turned(0.2, 0.4)];
        assert_eq!(at_corners(&even), [even[0], even[2]]);
        let uneven = [turned(0.0, 0.0), turned(0.1, 0.3), turned(0.2, 0.4)];
        assert_eq!(at_corners(&uneven), uneven);
        assert_eq!(at_corners(&[]), []);
    }
}

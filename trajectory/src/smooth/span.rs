//! One span of a smooth motion: a polynomial in time.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::poly;
use crate::ToolPoint;

/// One factor of the orientation: a turn by a polynomial angle about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    /// Axis times a constant scale, in the axes left by the factors before.
    pub(crate) axis: Vector3<f64>,
    /// Quartic `sum_k angle[k] t^k`; the rotation vector is `axis * angle(t)`.
    pub(crate) angle: [f64; 5],
}

/// One span: for `0 <= t <= duration` (s) the controlled point is `sum_k point[k] t^k` (m) and the
/// orientation `base * exp(axis_0 angle_0(t)) * exp(axis_1 angle_1(t)) * ..`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Span {
    /// Time at which the span starts, s.
    pub(crate) start: f64,
    pub(crate) duration: f64,
    pub(crate) point: [Vector3<f64>; 5],
    pub(crate) base: UnitQuaternion<f64>,
    pub(crate) turns: Vec<Turn>,
}

impl Span {
    /// Time at which the span ends, s.
    pub(crate) fn end(&self) -> f64 {
        self.start + self.duration
    }

    /// Whether neither the controlled point nor the tool moves at its start.
    pub(crate) fn starts_at_rest(&self) -> bool {
        self.point[1] == Vector3::zeros() && self.turns.iter().all(|turn| turn.angle[1] == 0.0)
    }

    /// Lays the span elsewhere: what it says is seen from `frame` until now.
    pub(crate) fn place(&mut self, frame: &Isometry3<f64>) {
        for coefficient in &mut self.point {
            *coefficient = frame.rotation * *coefficient;
        }
        self.point[0] += frame.translation.vector;
        self.base = frame.rotation * self.base;
    }

    /// The part from one time of the motion to another (s), both inside; it starts at the time 0.
    pub(crate) fn part(&self, from: f64, to: f64) -> Self {
        let (from, to) = (from.max(self.start), to.min(self.end()));
        let local = from - self.start;
        let turns = self.turns.iter().map(|turn| Turn {
            axis: turn.axis,
            angle: poly::shifted(&turn.angle, local),
        });
        Self {
            start: 0.0,
            duration: to - from,
            point: poly::shifted(&self.point, local),
            base: self.base,
            turns: turns.collect(),
        }
    }

    /// The same way from its end to its start, in a motion of `total` (s).
    pub(crate) fn reversed(&self, total: f64) -> Self {
        let turns = self.turns.iter().map(|turn| Turn {
            axis: turn.axis,
            angle: poly::reversed(&turn.angle, self.duration),
        });
        Self {
            start: total - self.end(),
            duration: self.duration,
            point: poly::reversed(&self.point, self.duration),
            base: self.base,
            turns: turns.collect(),
        }
    }

    /// Position, velocity, acceleration and jerk at local time `t`.
    pub(crate) fn motion(&self, t: f64) -> [Vector3<f64>; 4] {
        poly::quartic(&self.point, t)
    }

    /// Orientation at local time `t`.
    pub(crate) fn rotation(&self, t: f64) -> UnitQuaternion<f64> {
        self.turns.iter().fold(self.base, |rotation, turn| {
            let angle = poly::quartic(&turn.angle, t)[0];
            rotation * UnitQuaternion::from_scaled_axis(turn.axis * angle)
        })
    }

    /// Pose and time derivatives at local time `t`.
    pub(crate) fn at(&self, t: f64) -> ToolPoint {
        let [point, velocity, acceleration, jerk] = self.motion(t);
        let (rotation, angular) = self.turning(t);
        ToolPoint {
            pose: Isometry3::from_parts(point.into(), rotation),
            linear: [velocity, acceleration, jerk],
            angular,
        }
    }

    /// Orientation, and angular velocity, acceleration and jerk at local time `t`.
    ///
    /// With the world axis `a_j` of factor `j` and the angular velocity
    /// `W_j` of the factors before it, `a_j' = W_j x a_j`; the angular velocity
    /// is the sum of `angle_j' a_j`, and its derivatives follow.
    pub(crate) fn turning(&self, t: f64) -> (UnitQuaternion<f64>, [Vector3<f64>; 3]) {
        let mut rotation = self.base;
        let mut angular = [Vector3::zeros(); 3];
        for turn in &self.turns {
            let [angle, rate, rate2, rate3] = poly::quartic(&turn.angle, t);
            let axis = rotation * turn.axis;
            let axis1 = angular[0].cross(&axis);
            let axis2 = angular[1].cross(&axis) + angular[0].cross(&axis1);
            angular[0] += axis * rate;
            angular[1] += axis * rate2 + axis1 * rate;
            angular[2] += axis * rate3 + axis1 * (2.0 * rate2) + axis2 * rate;
            rotation *= UnitQuaternion::from_scaled_axis(turn.axis * angle);
        }
        (rotation, angular)
    }

    /// Position in Bernstein form on the local interval `[from, to]`.
    pub(crate) fn position_control(&self, from: f64, to: f64) -> [Vector3<f64>; 5] {
        poly::bernstein(&self.point, from, to)
    }

    /// Velocity in Bernstein form on the local interval `[from, to]`.
    pub(crate) fn velocity_control(&self, from: f64, to: f64) -> [Vector3<f64>; 4] {
        poly::bernstein(&first(&self.point), from, to)
    }

    /// Acceleration in Bernstein form on the local interval `[from, to]`.
    pub(crate) fn acceleration_control(&self, from: f64, to: f64) -> [Vector3<f64>; 3] {
        let [_, _, c2, c3, c4] = self.point;
        poly::bernstein(&[c2 * 2.0, c3 * 6.0, c4 * 12.0], from, to)
    }

    /// Jerk at both ends of the local interval `[from, to]`; linear between.
    pub(crate) fn jerk_control(&self, from: f64, to: f64) -> [Vector3<f64>; 2] {
        let [_, _, _, c3, c4] = self.point;
        [c3 * 6.0 + c4 * (24.0 * from), c3 * 6.0 + c4 * (24.0 * to)]
    }
}

/// The span of a motion at a time and the time within it; that of its nearer end outside. `None` if nothing moves.
pub(super) fn span_at(spans: &[Span], time: f64) -> Option<(&Span, f64)> {
    let next = spans.partition_point(|span| span.start <= time);
    let span = spans.get(next.saturating_sub(1))?;
    Some((span, (time - span.start).clamp(0.0, span.duration)))
}

/// The spans of a motion from its end to its start.
pub(super) fn reversed(spans: &[Span]) -> Vec<Span> {
    let total = spans.last().map_or(0.0, Span::end);
    spans
        .iter()
        .rev()
        .map(|span| span.reversed(total))
        .collect()
}

/// Slows a motion down by a factor; its path does not change.
pub(crate) fn stretch(spans: &mut [Span], factor: f64) {
    for span in spans {
        span.start *= factor;
        span.duration *= factor;
        let mut scale = 1.0;
        for k in 0..5 {
            span.point[k] /= scale;
            for turn in &mut span.turns {
                turn.angle[k] /= scale;
            }
            scale *= factor;
        }
    }
}

/// Power form of the first derivative of a quartic.
fn first(power: &[Vector3<f64>; 5]) -> [Vector3<f64>; 4] {
    let [_, c1, c2, c3, c4] = *power;
    [c1, c2 * 2.0, c3 * 3.0, c4 * 4.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn span() -> Span {
        let turn = |x: f64, y: f64| Turn {
            axis: Vector3::new(x, y, 0.3),
            angle: [0.1, 0.4 * x, -0.3, 0.2 * y, 0.5],
        };
        Span {
            start: 1.0,
            duration: 2.0,
            point: [0.1, 0.2, -0.3, 0.4, 0.05].map(|x| Vector3::new(x, -x, x * x)),
            base: UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
            turns: vec![turn(1.0, 0.2), turn(-0.3, 0.8), turn(0.0, 1.0)],
        }
    }

    /// Angular velocity and its derivatives agree with difference quotients.
    #[test]
    fn derivatives_are_derivatives() {
        let (span, t, d) = (span(), 0.7, 1e-5);
        let (a, b, c) = (span.at(t - d), span.at(t), span.at(t + d));
        let turned = (c.pose.rotation * a.pose.rotation.inverse()).scaled_axis() / (2.0 * d);
        assert_relative_eq!(turned, b.angular[0], epsilon = 1e-7);
        for k in 0..2 {
            assert_relative_eq!(
                (c.angular[k] - a.angular[k]) / (2.0 * d),
                b.angular[k + 1],
                epsilon = 1e-6
            );
            assert_relative_eq!(
                (c.linear[k] - a.linear[k]) / (2.0 * d),
                b.linear[k + 1],
                epsilon = 1e-6
            );
        }
        assert_relative_eq!(b.pose.rotation, span.rotation(t), epsilon = 1e-14);
    }

    /// A span that is reversed or laid elsewhere has the same poses.
    #[test]
    fn reversed_and_placed() {
        let span = span();
        let back = span.reversed(5.0);
        assert_relative_eq!(back.start, 2.0, epsilon = 1e-15);
        for t in [0.0, 0.4, 2.0] {
            let (there, here) = (span.at(t), back.at(2.0 - t));
            assert_relative_eq!(there.pose, here.pose, epsilon = 1e-12);
            assert_relative_eq!(there.linear[0], -here.linear[0], epsilon = 1e-12);
            assert_relative_eq!(there.angular[1], here.angular[1], epsilon = 1e-12);
        }
        let frame = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -0.2, 0.9));
        let mut placed = span.clone();
        placed.place(&frame);
        assert_relative_eq!(
            placed.at(0.7).pose,
            frame * span.at(0.7).pose,
            epsilon = 1e-12
        );
    }

    /// A part of a span is the same motion, from the time 0 on.
    #[test]
    fn part_is_the_same_motion() {
        let span = span();
        let part = span.part(1.5, 2.2);
        assert_relative_eq!(part.duration, 0.7, epsilon = 1e-15);
        assert_eq!(part.start, 0.0);
        for t in [0.0, 0.3, 0.7] {
            let (here, there) = (part.at(t), span.at(0.5 + t));
            assert_relative_eq!(here.pose, there.pose, epsilon = 1e-12);
            for k in 0..3 {
                assert_relative_eq!(here.linear[k], there.linear[k], epsilon = 1e-12);
                assert_relative_eq!(here.angular[k], there.angular[k], epsilon = 1e-12);
            }
        }
        // Not beyond its ends.
        assert_relative_eq!(span.part(0.0, 9.0).duration, 2.0, epsilon = 1e-15);
    }

    /// The control forms interpolate the motion at the ends of any interval.
    #[test]
    fn control_forms_interpolate() {
        let span = span();
        let (low, high) = (span.motion(0.3), span.motion(1.1));
        let p = span.position_control(0.3, 1.1);
        let v = span.velocity_control(0.3, 1.1);
        let a = span.acceleration_control(0.3, 1.1);
        let j = span.jerk_control(0.3, 1.1);
        for (first, last, k) in [
            (p[0], p[4], 0),
            (v[0], v[3], 1),
            (a[0], a[2], 2),
            (j[0], j[1], 3),
        ] {
            assert_relative_eq!(first, low[k], epsilon = 1e-12);
            assert_relative_eq!(last, high[k], epsilon = 1e-12);
        }
    }
}

//! A fitted curve of the tool.

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};

use super::fit::Fit;
use super::places::Units;
use crate::smooth::fade::Fade;
use crate::smooth::poly;
use crate::{ToolCurve, ToolPoint};

/// Knot intervals of the fit from one knot that the time law sees to the next.
pub(super) const SEEN: usize = 4;

/// A fitted curve of the tool.
#[derive(Clone, Debug)]
pub(super) struct Curve<const D: usize> {
    pub(super) fit: Fit<D>,
    units: Units,
    origin: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    /// Rotation vector (rad, axes of the start) by which a curve of places is turned from its start to its end.
    turn: Vector3<f64>,
    knots: Vec<f64>,
    /// Parameter at which the fit begins, and at which the curve ends that it is a part of.
    pub(super) from: f64,
    end: f64,
}

impl<const D: usize> Curve<D> {
    /// The curve of a fit to poses the first of which is `start`.
    pub(super) fn new(fit: Fit<D>, units: Units, start: &Isometry3<f64>) -> Self {
        let spans = fit.spans();
        let mut knots: Vec<f64> = (0..spans).step_by(SEEN).map(|k| k as f64).collect();
        knots.push(spans as f64);
        Self {
            knots,
            ..Self::part((fit, spans as f64), units, start)
        }
    }

    /// The same where the fit is a part of a curve, for now its beginning, and the curve ends at `end`.
    pub(super) fn part((fit, end): (Fit<D>, f64), units: Units, start: &Isometry3<f64>) -> Self {
        Self {
            fit,
            units,
            origin: start.translation.vector,
            rotation: start.rotation,
            turn: Vector3::zeros(),
            knots: Vec::new(),
            from: 0.0,
            end,
        }
    }

    /// A curve of places that turns by so little that it changes nothing else: by a rotation vector (rad) in axes of
    /// the start.
    pub(super) fn turned(mut self, turn: Vector3<f64>) -> Self {
        self.turn = turn;
        self
    }

    /// Orientation of a curve of places, and its angular velocity to the parameter with two derivatives.
    fn slight_turn(&self, u: f64) -> (UnitQuaternion<f64>, [Vector3<f64>; 3]) {
        if self.turn == Vector3::zeros() {
            return (self.rotation, [Vector3::zeros(); 3]);
        }
        let share = Fade::over(self.end).since(0.0);
        let [share, rate, rate2, rate3] = poly::quartic(&share, u);
        let axis = self.rotation * self.turn;
        let turned = self.rotation * UnitQuaternion::from_scaled_axis(self.turn * share);
        (turned, [axis * rate, axis * rate2, axis * rate3])
    }

    /// Pose at a parameter.
    pub(super) fn pose(&self, at: f64) -> Isometry3<f64> {
        let point = self.fit.point(at - self.from);
        let place = self.origin + self.units.place(&point);
        let turn = if D > 3 {
            self.units.rotation(&point)
        } else {
            self.slight_turn(at).0
        };
        Isometry3::from_parts(place.into(), turn)
    }

    /// Angular velocity to the parameter and its two derivatives, from those of the quaternion
    /// before it is normalised.
    ///
    /// With `p = q conj(q)' ..`: the angular velocity is `w = 2 vec(q' conj(q)) / |q|^2`.
    fn angular(&self, d: &[SVector<f64, D>; 4]) -> [Vector3<f64>; 3] {
        let [q, q1, q2, q3] = d.map(|x| self.units.quaternion(&x));
        let vec = |a: nalgebra::Quaternion<f64>, b: nalgebra::Quaternion<f64>| {
            (a * b.conjugate()).imag() * 2.0
        };
        // v = 2 vec(q' q*), n = |q|^2, w = v / n.
        let n = [
            q.norm_squared(),
            2.0 * q.dot(&q1),
            2.0 * (q1.norm_squared() + q.dot(&q2)),
        ];
        let v = vec(q1, q);
        let v1 = vec(q2, q);
        let v2 = vec(q3, q) + vec(q2, q1);
        let w = v / n[0];
        let w1 = (v1 - w * n[1]) / n[0];
        let w2 = (v2 - w1 * (2.0 * n[1]) - w * n[2]) / n[0];
        [w, w1, w2]
    }
}

impl<const D: usize> ToolCurve for Curve<D> {
    fn end(&self) -> f64 {
        self.end
    }

    fn knots(&self) -> Vec<f64> {
        self.knots.clone()
    }

    fn at(&self, u: f64) -> ToolPoint {
        let d = self.fit.derivatives(u - self.from);
        let place = self.origin + self.units.place(&d[0]);
        let (turn, angular) = if D > 3 {
            (self.units.rotation(&d[0]), self.angular(&d))
        } else {
            self.slight_turn(u)
        };
        ToolPoint {
            pose: Isometry3::from_parts(place.into(), turn),
            linear: [d[1], d[2], d[3]].map(|x| self.units.place(&x)),
            angular,
        }
    }
}

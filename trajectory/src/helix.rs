//! A screw of the controlled point: it turns about an axis and advances along it in step.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::{ToolCurve, ToolPoint};

/// Longest turn between two knots (rad): whoever looks at the orientation at some places between two
/// knots must not see a whole turn as none.
const KNOT: f64 = 0.5;

/// A screw from a pose, parameter 0 to 1: rotation about an axis and translation along it, both in
/// proportion to the parameter.
///
/// A point on the axis moves straight, every other along a helix. The turn may exceed a whole one,
/// either part may be zero. Pose, axis and result are in the same frame; lengths in m, angles in rad.
///
/// # Source
/// M. P. do Carmo, "Differential Geometry of Curves and Surfaces", 1976, section 1-2, example 1.
///
/// ```
/// use nalgebra::{Isometry3, Point3, Vector3};
/// use std::f64::consts::TAU;
/// use trajectory::{Helix, ToolCurve};
/// let start = Isometry3::translation(0.1, 0.0, 0.0);
/// let helix = Helix::new(start, (Point3::origin(), Vector3::z_axis()), 0.02, 2.0 * TAU);
/// let end = helix.at(1.0).pose.translation.vector;
/// assert!((end - Vector3::new(0.1, 0.0, 0.02)).norm() < 1e-12);
/// let half_a_turn = helix.at(0.25).pose.translation.vector;
/// assert!((half_a_turn - Vector3::new(-0.1, 0.0, 0.005)).norm() < 1e-12);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Helix {
    start: Isometry3<f64>,
    /// The point of the axis that is nearest to the start.
    foot: Vector3<f64>,
    axis: Unit<Vector3<f64>>,
    advance: f64,
    turn: f64,
}

impl Helix {
    /// The screw from `start` about the axis through a point: `advance` (m) along the axis during a
    /// `turn` (rad), counterclockwise for who looks against the axis.
    #[must_use]
    pub fn new(
        start: Isometry3<f64>,
        (point, axis): (Point3<f64>, Unit<Vector3<f64>>),
        advance: f64,
        turn: f64,
    ) -> Self {
        let along = (start.translation.vector - point.coords).dot(&axis);
        Self {
            start,
            foot: point.coords + *axis * along,
            axis,
            advance,
            turn,
        }
    }

    /// Distance of the controlled point from the axis, m.
    #[must_use]
    pub fn radius(&self) -> f64 {
        (self.start.translation.vector - self.foot).norm()
    }

    /// The parameter at which the helix is nearest to a place, near the parameter `u`, and its
    /// distance there, m.
    #[must_use]
    pub fn nearest(&self, place: &Vector3<f64>, u: f64) -> (f64, f64) {
        let mut u = u;
        for _ in 0..4 {
            let here = self.at(u);
            let [speed, ..] = here.linear;
            let square = speed.norm_squared();
            if square < 1e-18 {
                break;
            }
            let step = (place - here.pose.translation.vector).dot(&speed) / square;
            u = (u + step).clamp(0.0, 1.0);
        }
        (u, (place - self.at(u).pose.translation.vector).norm())
    }
}

impl ToolCurve for Helix {
    fn end(&self) -> f64 {
        1.0
    }

    fn knots(&self) -> Vec<f64> {
        let count = (self.turn.abs() / KNOT).ceil().clamp(1.0, 1e5);
        (0..=count as usize)
            .map(|knot| knot as f64 / count)
            .collect()
    }

    fn at(&self, u: f64) -> ToolPoint {
        let turned = UnitQuaternion::from_axis_angle(&self.axis, self.turn * u);
        let arm = turned * (self.start.translation.vector - self.foot);
        let place = self.foot + arm + *self.axis * (self.advance * u);
        let rate = *self.axis * self.turn;
        let first = rate.cross(&arm);
        let second = rate.cross(&first);
        let zero = Vector3::zeros();
        ToolPoint {
            pose: Isometry3::from_parts(place.into(), turned * self.start.rotation),
            linear: [
                first + *self.axis * self.advance,
                second,
                rate.cross(&second),
            ],
            angular: [rate, zero, zero],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

        /// Radius and pitch are those asked for everywhere, and derivatives are those of the
        /// difference quotient.
        #[test]
        fn is_a_screw(
            place in vector(), turned in vector(), point in vector(), axis in vector(),
            advance in -0.5..0.5_f64, turn in -30.0..30.0_f64, u in 0.01..0.99_f64,
        ) {
            prop_assume!(axis.norm() > 0.1);
            let start = Isometry3::new(place, turned);
            let axis = Unit::new_normalize(axis);
            let helix = Helix::new(start, (point.into(), axis), advance, turn);
            assert_relative_eq!(helix.at(0.0).pose, start, epsilon = 1e-12);
            let at = helix.at(u);
            let from_axis = (at.pose.translation.vector - point).cross(&axis).norm();
            assert_relative_eq!(from_axis, helix.radius(), epsilon = 1e-12);
            let advanced = (at.pose.translation.vector - place).dot(&axis);
            assert_relative_eq!(advanced, advance * u, epsilon = 1e-12);
            prop_assert!(helix.nearest(&at.pose.translation.vector, u).1 < 1e-12);
            let h = 1e-5;
            let (before, after) = (helix.at(u - h), helix.at(u + h));
            let slope = |a: Vector3<f64>, b: Vector3<f64>| (b - a) / (2.0 * h);
            let places = [before, after].map(|at| at.pose.translation.vector);
            assert_relative_eq!(slope(places[0], places[1]), at.linear[0], epsilon = 1e-5, max_relative = 1e-5);
            for k in 0..2 {
                let rate = slope(before.linear[k], after.linear[k]);
                assert_relative_eq!(rate, at.linear[k + 1], epsilon = 1e-3, max_relative = 1e-6);
            }
            let turned = (after.pose.rotation * before.pose.rotation.inverse()).scaled_axis() / (2.0 * h);
            assert_relative_eq!(turned, at.angular[0], epsilon = 1e-6);
        }
    }
}

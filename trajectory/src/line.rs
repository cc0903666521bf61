//! A straight line of the controlled point; the tool turns in proportion to the distance.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::{ToolCurve, ToolPoint};

/// A move below this length (m) and angle (rad) counts as no move.
const STILL: f64 = 1e-12;

/// Straight line between two poses, parameter 0 to 1.
///
/// The controlled point moves along the line in proportion to the parameter; the orientation turns
/// in the same proportion about one fixed axis (slerp, the shorter way). Either part may be empty:
/// a pure rotation and a pure translation are lines too. Both poses are in the same frame, and so
/// is the result; lengths in m, angles in rad.
///
/// # Source
/// K. Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.
///
/// ```
/// use nalgebra::{Isometry3, Vector3};
/// use trajectory::{Line, ToolCurve};
/// let start = Isometry3::identity();
/// let end = Isometry3::new(Vector3::new(0.2, 0.0, 0.0), Vector3::z() * 0.5);
/// let line = Line::new(start, end);
/// assert!((line.length() - 0.2).abs() < 1e-15 && (line.angle() - 0.5).abs() < 1e-15);
/// let middle = line.at(0.5).pose;
/// assert!((middle.translation.x - 0.1).abs() < 1e-15);
/// assert!((middle.rotation.angle() - 0.25).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    start: Isometry3<f64>,
    end: Isometry3<f64>,
    direction: Vector3<f64>,
    turn: Vector3<f64>,
}

impl Line {
    /// The line from `start` to `end`. A line of no length and no angle is
    /// allowed: [`Line::is_still`] tells.
    #[must_use]
    pub fn new(start: Isometry3<f64>, end: Isometry3<f64>) -> Self {
        let direction = end.translation.vector - start.translation.vector;
        let turn = body_turn(&start.rotation, &end.rotation);
        Self {
            start,
            end,
            direction,
            turn,
        }
    }

    /// Length of the path of the controlled point, m.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.direction.norm()
    }

    /// Angle of the turn, rad, 0 to pi.
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.turn.norm()
    }

    /// True when both length and angle are below 1e-12 m and 1e-12 rad: there
    /// is nothing to move.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.length() < STILL && self.angle() < STILL
    }
}

impl ToolCurve for Line {
    fn end(&self) -> f64 {
        1.0
    }

    fn knots(&self) -> Vec<f64> {
        vec![0.0, 1.0]
    }

    fn at(&self, u: f64) -> ToolPoint {
        let rotation = if u == 1.0 {
            self.end.rotation
        } else {
            self.start.rotation * UnitQuaternion::from_scaled_axis(self.turn * u)
        };
        let point = if u == 1.0 {
            self.end.translation.vector
        } else {
            self.start.translation.vector + self.direction * u
        };
        let zero = Vector3::zeros();
        ToolPoint {
            pose: Isometry3::from_parts(point.into(), rotation),
            linear: [self.direction, zero, zero],
            angular: [self.start.rotation * self.turn, zero, zero],
        }
    }
}

/// Rotation vector (rad, axes of `from`) that turns `from` into `to` the
/// shorter way; accurate for angles near 0 and near pi.
pub(crate) fn body_turn(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector3<f64> {
    let between = from.inverse() * to;
    let (real, vector) = (between.w, between.vector().into_owned());
    let sine = vector.norm();
    if sine < 1e-300 {
        return Vector3::zeros();
    }
    let half = sine.atan2(real.abs());
    vector * (2.0 * half * real.signum() / sine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn pose() -> impl Strategy<Value = Isometry3<f64>> {
        prop::array::uniform6(-3.0..3.0_f64).prop_map(|x| {
            Isometry3::new(
                Vector3::new(x[0], x[1], x[2]),
                Vector3::new(x[3], x[4], x[5]),
            )
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        /// The line starts and ends at its poses, and its first derivatives
        /// are those of the difference quotient.
        #[test]
        fn joins_its_poses(start in pose(), end in pose(), u in 0.01..0.99_f64) {
            let line = Line::new(start, end);
            assert_relative_eq!(line.at(0.0).pose, start, epsilon = 1e-12);
            assert_relative_eq!(line.at(1.0).pose, end, epsilon = 1e-12);
            let near_end = line.at(1.0 - 1e-12).pose;
            assert_relative_eq!(near_end, end, epsilon = 1e-9);
            let (a, b) = (line.at(u - 1e-5).pose, line.at(u + 1e-5).pose);
            let point = line.at(u);
            assert_relative_eq!(
                (b.translation.vector - a.translation.vector) / 2e-5, point.linear[0], epsilon = 1e-8);
            let turned = (b.rotation * a.rotation.inverse()).scaled_axis() / 2e-5;
            assert_relative_eq!(turned, point.angular[0], epsilon = 1e-8);
        }
    }

    #[test]
    fn pure_rotation_and_no_move_are_lines() {
        let start = Isometry3::identity();
        let turned = Isometry3::new(Vector3::zeros(), Vector3::x() * std::f64::consts::PI);
        let line = Line::new(start, turned);
        assert_eq!(line.length(), 0.0);
        assert_relative_eq!(line.angle(), std::f64::consts::PI);
        assert!(!line.is_still());
        assert!(Line::new(turned, turned).is_still());
    }
}

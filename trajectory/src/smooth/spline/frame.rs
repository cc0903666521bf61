//! The orientations of a search for an arm, beside those of the motion that is known.
//!
//! A rolled-out orientation depends on all before it, so a small change of the curve turns the tool elsewhere, too. Beside the
//! known motion a control point turns the tool there only.

use nalgebra::{UnitQuaternion, Vector3};

/// The known motion at a control point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Its orientation.
    pub(super) rotation: UnitQuaternion<f64>,
    /// The rotation vector of a control point that has this orientation.
    pub(super) vector: Vector3<f64>,
}

impl Frame {
    /// The orientation of a control point with this rotation vector.
    pub(super) fn at(&self, vector: &Vector3<f64>) -> UnitQuaternion<f64> {
        self.rotation * UnitQuaternion::from_scaled_axis(vector - self.vector)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known rotation vector stands for the known orientation, and a change of it turns the tool about its own axes.
    #[test]
    fn a_change_turns_the_tool_about_its_own_axes() {
        let frame = Frame {
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.2, 0.9)),
            vector: Vector3::new(5.0, 6.0, 7.0),
        };
        assert_eq!(frame.at(&frame.vector), frame.rotation);
        let turn = Vector3::new(0.1, 0.2, -0.1);
        let seen = frame
            .rotation
            .rotation_to(&frame.at(&(frame.vector + turn)));
        let about = frame.rotation.inverse() * seen.scaled_axis();
        assert!((about - turn).norm() < 1e-12, "{about}");
    }
}

//! Masses of rigid bodies.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass, centre of mass and moment of inertia of a rigid body, in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass (m).
    pub centre: Vector3<f64>,
    /// Moment of inertia about the centre of mass, axes of the frame (kg m²).
    pub moment: Matrix3<f64>,
}

impl Inertia {
    /// No mass at all.
    #[must_use]
    pub fn none() -> Self {
        Self {
            mass: 0.0,
            centre: Vector3::zeros(),
            moment: Matrix3::zeros(),
        }
    }

    /// The same body in another frame.
    #[must_use]
    pub fn in_frame(&self, other_from_own: &Isometry3<f64>) -> Self {
        let turn = other_from_own.rotation.to_rotation_matrix();
        Self {
            mass: self.mass,
            centre: (other_from_own * nalgebra::Point3::from(self.centre)).coords,
            moment: turn.matrix() * self.moment * turn.matrix().transpose(),
        }
    }

    /// Both bodies as one, in the same frame.
    ///
    /// # Source
    /// Parallel axis theorem (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, section 2.13).
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Self {
                mass: 0.0,
                centre: self.centre,
                moment: self.moment + other.moment,
            };
        }
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        let about = |body: &Self| {
            let d = body.centre - centre;
            body.moment + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * body.mass
        };
        Self {
            mass,
            centre,
            moment: about(self) + about(other),
        }
    }
}

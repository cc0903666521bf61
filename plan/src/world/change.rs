//! Changes of the world: plain data that the controller commits.

use nalgebra::Isometry3;

use super::{Location, Object, ObjectId, Scalar};

/// One change of the world model. A list of changes is committed as a whole or not at all.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// A new object; its number must be fresh ([`super::Model::fresh`]).
    Create(Object),
    /// The object is removed. Objects located relative to it must be removed or moved before.
    Delete(ObjectId),
    /// The object is somewhere else.
    Place {
        /// The object.
        object: ObjectId,
        /// Its new location.
        location: Location,
    },
    /// A stored property has a new value.
    Set {
        /// The object.
        object: ObjectId,
        /// Name of the property.
        property: String,
        /// The value.
        value: Scalar,
    },
    /// The end of the arm rests at this pose (m) in the frame of the workstation. A separate change
    /// places the end effector on it ([`super::Model::arm_changes`]).
    Arm(Isometry3<f64>),
}

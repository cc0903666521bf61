//! What stands in the workstation beside the arm.

use serde::Serialize;

/// A box of the workstation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorldObject {
    /// Its name.
    pub name: String,
    /// What it is, in one word.
    pub class: String,
    /// Middle of its bottom in the workstation: x, y, z (m), qw, qx, qy, qz.
    pub pose: [f64; 7],
    /// Length, width and height along its x, y and z (m).
    pub size: [f64; 3],
}

/// The workstation at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct World {
    /// What has a shape.
    pub objects: Vec<WorldObject>,
    /// The plan that is executed there and where it is, in one sentence.
    pub plan: Option<String>,
}

/// Reads the workstation again; nothing where it cannot be read now.
pub type ReadWorld = Box<dyn FnMut() -> Option<World> + Send>;

//! What a robot folder holds.

use std::path::Path;

/// The two texts of a robot folder.
pub(super) struct Files<'a> {
    pub(super) name: &'a str,
    pub(super) place: &'a Path,
    pub(super) urdf: &'a str,
    pub(super) toml: &'a str,
}

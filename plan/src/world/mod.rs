//! The world model: what is where in the workstation.
//!
//! [`Model`] is plain data in memory. [`Writer`] is the only type that can change the database;
//! only the controller has one. An interpreter has a [`Reader`]. In the program, lengths are in
//! metres and angles in radians; files use the units of the workstation.

mod change;
mod check;
pub mod class;
mod file;
mod geometry;
mod lock;
mod model;
mod nist;
mod object;
mod place;
mod presence;
pub(crate) mod reader;
pub mod schema;
mod stored_run;
mod writer;

pub use change::Change;
pub use check::{Concern, check};
pub use class::Class;
pub use file::{export_json, export_toml, import_json, import_toml};
pub use geometry::Bounds;
pub use model::Model;
pub use nist::import_nist;
pub use object::{BoxVolume, Design, DesignPart, Object, ObjectId, Scalar, Shape, Sku, Units};
pub use place::{Location, Relation, from_axes, from_roll_pitch_yaw, pointing_down};
pub use reader::Reader;
pub use stored_run::StoredRun;
pub use writer::{Durability, Writer};

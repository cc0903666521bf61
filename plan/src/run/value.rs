//! Values of variables while a plan runs.

use nalgebra::Isometry3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::world::reader::{pose_from_text, pose_to_text};
use crate::world::{Model, ObjectId};

/// A value.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub enum Value {
    /// No value.
    #[default]
    Null,
    /// true or false.
    Truth(bool),
    /// A number.
    Number(f64),
    /// A text or id.
    Text(String),
    /// An object of the world.
    Object(ObjectId),
    /// Objects in stored order.
    List(Vec<ObjectId>),
    /// A pose relative to an object.
    Pose(PoseValue),
    /// Three numbers: a point (m) or roll, pitch and yaw (rad).
    Triple([f64; 3]),
    /// The id of a stock keeping unit of the library.
    Sku(String),
}

/// A pose relative to an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseValue {
    /// The reference object.
    pub reference: ObjectId,
    /// `reference_from_place` (m).
    #[serde(serialize_with = "write_pose", deserialize_with = "read_pose")]
    pub pose: Isometry3<f64>,
    /// False for a location that only says "in" or "on".
    pub known: bool,
}

fn write_pose<S: Serializer>(pose: &Isometry3<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&pose_to_text(pose))
}

fn read_pose<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Isometry3<f64>, D::Error> {
    let text = String::deserialize(deserializer)?;
    pose_from_text(&text, "variable").map_err(serde::de::Error::custom)
}

impl Value {
    /// For messages: the kind of the value and what it is.
    #[must_use]
    pub fn describe(&self, model: &Model) -> String {
        let name = |id: ObjectId| {
            model
                .object(id)
                .map_or_else(|_| format!("object {}", id.0), |o| o.name.clone())
        };
        match self {
            Self::Null => "Null".into(),
            Self::Truth(truth) => truth.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Text(text) => format!("\"{text}\""),
            Self::Object(id) => name(*id),
            Self::List(list) => format!("a list of {}", list.len()),
            Self::Pose(pose) => format!("a pose relative to {}", name(pose.reference)),
            Self::Triple(_) => "three numbers".into(),
            Self::Sku(id) => format!("the stock keeping unit {id}"),
        }
    }
}

//! The things in the workstation and the descriptions they refer to.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use super::{Class, Location};

/// Number of an object; never used again after the object is removed.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct ObjectId(pub i64);

/// Value of a stored property. Lengths are in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Scalar {
    /// True or false.
    Truth(bool),
    /// A number.
    Number(f64),
    /// A name or text.
    Text(String),
}

impl Scalar {
    /// The text, if it is one.
    #[must_use]
    pub fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self {
            Some(text)
        } else {
            None
        }
    }

    /// The number, if it is one.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self {
            Some(*number)
        } else {
            None
        }
    }
}

/// A solid object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its number.
    pub id: ObjectId,
    /// Its name, unique in the workstation.
    pub name: String,
    /// Its class.
    pub class: Class,
    /// Where it is.
    pub location: Location,
    /// Stored properties by name (see [`super::class::PROPERTIES`]).
    pub properties: BTreeMap<String, Scalar>,
}

impl Object {
    /// A new object without properties.
    #[must_use]
    pub fn new(id: ObjectId, name: impl Into<String>, class: Class, location: Location) -> Self {
        Self {
            id,
            name: name.into(),
            class,
            location,
            properties: BTreeMap::new(),
        }
    }

    /// A new kit of a design, not finished.
    #[must_use]
    pub fn kit(
        id: ObjectId,
        name: impl Into<String>,
        location: Location,
        design: impl Into<String>,
    ) -> Self {
        let properties = [
            ("hasKitInstance_DesignRef", Scalar::Text(design.into())),
            ("isKitInstance_Finished", Scalar::Truth(false)),
        ];
        Self {
            properties: properties.map(|(name, value)| (name.into(), value)).into(),
            ..Self::new(id, name, Class::KitInstance, location)
        }
    }

    /// Text of a stored property.
    #[must_use]
    pub fn text(&self, property: &str) -> Option<&str> {
        self.properties.get(property).and_then(Scalar::text)
    }

    /// Number of a stored property (m for lengths).
    #[must_use]
    pub fn number(&self, property: &str) -> Option<f64> {
        self.properties.get(property).and_then(Scalar::number)
    }

    /// Id of its stock keeping unit; for a kit, id of its design.
    #[must_use]
    pub fn sku(&self) -> Option<&str> {
        self.class
            .sku_property()
            .and_then(|property| self.text(property))
    }

    /// Whether `id` names this object: its name, or the id of its robot or end effector.
    #[must_use]
    pub fn is_called(&self, id: &str) -> bool {
        self.name == id
            || self.text("hasEndEffector_Id") == Some(id)
            || self.text("hasRobot_Id") == Some(id)
    }

    /// From the mounting face of an end effector to its tip, along its Z axis (m).
    #[must_use]
    pub fn effector_length(&self) -> f64 {
        self.number("hasVacuumEffector_Length")
            .or_else(|| self.number("hasEndEffector_Length"))
            .unwrap_or(0.0)
    }
}

/// A box: its origin is the middle of its bottom, length along X, width along Y, height along Z (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Along X (m).
    pub length: f64,
    /// Along Y (m).
    pub width: f64,
    /// Along Z (m).
    pub height: f64,
    /// Closed above; a tray or an open box has no top.
    pub has_top: bool,
}

/// A stock keeping unit: the description that many objects share.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Sku {
    /// Its id.
    pub id: String,
    /// Free text.
    pub description: String,
    /// Its shape.
    pub shape: Option<Shape>,
    /// Its weight, in the workstation's weight unit.
    pub weight: Option<f64>,
    /// Ids of the end effectors that can hold it.
    pub effectors: Vec<String>,
    /// Where a gripper takes it: `object_from_tip` (m). Without it: middle of the top, pointing down.
    pub grasp: Option<Isometry3<f64>>,
}

impl Shape {
    /// Says what is wrong with sizes that no thing has.
    pub(crate) fn check(&self) -> Result<(), String> {
        let sizes = [self.length, self.width, self.height];
        if sizes.iter().all(|size| size.is_finite() && *size > 0.0) {
            Ok(())
        } else {
            Err("sizes must be positive".into())
        }
    }
}

impl Sku {
    /// Says what is wrong with a description of nothing that can be.
    pub(crate) fn check(&self) -> Result<(), String> {
        let describe = |why: String| format!("shape of {}: {why}", self.id);
        self.shape
            .map_or(Ok(()), |shape| shape.check())
            .map_err(describe)?;
        match self.weight {
            Some(weight) if !(weight.is_finite() && weight >= 0.0) => {
                Err(format!("weight of {}: it must not be negative", self.id))
            }
            _ => Ok(()),
        }
    }
}

/// A part of a kit design: which unit, and its pose (m) relative to the kit tray.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignPart {
    /// Id of the stock keeping unit.
    pub sku: String,
    /// `tray_from_part`.
    pub pose: Isometry3<f64>,
}

/// The design of a kit.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Design {
    /// Its id; the kit's own stock keeping unit has the same id.
    pub id: String,
    /// Id of the stock keeping unit of the tray.
    pub tray_sku: String,
    /// The parts, in order.
    pub parts: Vec<DesignPart>,
}

/// Units of the numbers in a workstation's files and in the literals of its plans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Units {
    /// `mm`, `meter` or `inch`.
    pub length: String,
    /// `degree` or `radian`.
    pub angle: String,
    /// `kilogram` and so on; kept, never converted.
    pub weight: String,
}

impl Default for Units {
    fn default() -> Self {
        Self {
            length: "meter".into(),
            angle: "radian".into(),
            weight: "kilogram".into(),
        }
    }
}

impl Units {
    /// Metres in one length unit; none for an unknown unit.
    #[must_use]
    pub fn metres(&self) -> Option<f64> {
        match self.length.as_str() {
            "mm" | "millimeter" => Some(0.001),
            "meter" | "metre" => Some(1.0),
            "inch" => Some(0.0254),
            _ => None,
        }
    }

    /// Radians in one angle unit; none for an unknown unit.
    #[must_use]
    pub fn radians(&self) -> Option<f64> {
        match self.angle.as_str() {
            "degree" => Some(std::f64::consts::PI / 180.0),
            "radian" => Some(1.0),
            _ => None,
        }
    }
}

/// A box in which a robot can work, in the robot's frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxVolume {
    /// The robot.
    pub robot: ObjectId,
    /// Corner with the smallest coordinates.
    pub minimum: [f64; 3],
    /// Corner with the largest coordinates.
    pub maximum: [f64; 3],
}

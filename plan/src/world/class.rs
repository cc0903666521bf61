//! Classes of the kitting ontology and their properties.

use std::fmt;
use std::str::FromStr;

/// A class of solid object in the workstation.
///
/// # Source
/// NIST kitting ontology, kittingClasses.owl of 2012-02-15; the two `LargeBoxWith...` classes from
/// the kitting workstation schema of 2013.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Any solid object (abstract root).
    SolidObject,
    /// A solid object that is a box: its origin is the middle of its bottom, Z up.
    BoxyObject,
    /// The workstation itself; the end of every location chain.
    KittingWorkstation,
    /// A robot with one arm.
    Robot,
    /// A table.
    WorkTable,
    /// The station where end effectors are kept.
    EndEffectorChangingStation,
    /// One place of the changing station.
    EndEffectorHolder,
    /// Any end effector.
    EndEffector,
    /// A gripper with fingers.
    GripperEffector,
    /// Any vacuum effector.
    VacuumEffector,
    /// A vacuum effector with one cup.
    VacuumEffectorSingleCup,
    /// A vacuum effector with several cups in a ring.
    VacuumEffectorMultiCup,
    /// A single part.
    Part,
    /// A tray that holds parts.
    PartsTray,
    /// A parts tray together with the parts in it.
    PartsTrayWithParts,
    /// A bin of unsorted parts.
    PartsBin,
    /// A tray for a kit.
    KitTray,
    /// A kit: a kit tray and the parts in it.
    KitInstance,
    /// A big box for kit trays or kits.
    LargeContainer,
    /// A big box together with the empty kit trays in it.
    LargeBoxWithEmptyKitTrays,
    /// A big box together with the kits in it.
    LargeBoxWithKits,
}

/// Every class with its name, in the order of declaration.
pub const CLASSES: [(Class, &str); 21] = [
    (Class::SolidObject, "SolidObject"),
    (Class::BoxyObject, "BoxyObject"),
    (Class::KittingWorkstation, "KittingWorkstation"),
    (Class::Robot, "Robot"),
    (Class::WorkTable, "WorkTable"),
    (
        Class::EndEffectorChangingStation,
        "EndEffectorChangingStation",
    ),
    (Class::EndEffectorHolder, "EndEffectorHolder"),
    (Class::EndEffector, "EndEffector"),
    (Class::GripperEffector, "GripperEffector"),
    (Class::VacuumEffector, "VacuumEffector"),
    (Class::VacuumEffectorSingleCup, "VacuumEffectorSingleCup"),
    (Class::VacuumEffectorMultiCup, "VacuumEffectorMultiCup"),
    (Class::Part, "Part"),
    (Class::PartsTray, "PartsTray"),
    (Class::PartsTrayWithParts, "PartsTrayWithParts"),
    (Class::PartsBin, "PartsBin"),
    (Class::KitTray, "KitTray"),
    (Class::KitInstance, "KitInstance"),
    (Class::LargeContainer, "LargeContainer"),
    (
        Class::LargeBoxWithEmptyKitTrays,
        "LargeBoxWithEmptyKitTrays",
    ),
    (Class::LargeBoxWithKits, "LargeBoxWithKits"),
];

impl Class {
    /// The name that plans and files use.
    #[must_use]
    pub fn name(self) -> &'static str {
        CLASSES
            .iter()
            .find(|(class, _)| *class == self)
            .map_or("SolidObject", |(_, name)| name)
    }

    /// The class directly above, or none for the root.
    #[must_use]
    pub fn parent(self) -> Option<Self> {
        match self {
            Self::SolidObject => None,
            Self::WorkTable
            | Self::PartsTray
            | Self::PartsBin
            | Self::KitTray
            | Self::LargeContainer => Some(Self::BoxyObject),
            Self::GripperEffector | Self::VacuumEffector => Some(Self::EndEffector),
            Self::VacuumEffectorSingleCup | Self::VacuumEffectorMultiCup => {
                Some(Self::VacuumEffector)
            }
            _ => Some(Self::SolidObject),
        }
    }

    /// Whether this class is `other` or below it.
    ///
    /// ```
    /// use plan::world::Class;
    /// assert!(Class::KitTray.is_a(Class::BoxyObject));
    /// assert!(!Class::Part.is_a(Class::BoxyObject));
    /// ```
    #[must_use]
    pub fn is_a(self, other: Self) -> bool {
        let mut class = Some(self);
        while let Some(current) = class {
            if current == other {
                return true;
            }
            class = current.parent();
        }
        false
    }

    /// Whether objects of this class are made of others, so that they have no shape of their own.
    #[must_use]
    pub fn is_composite(self) -> bool {
        matches!(
            self,
            Self::KitInstance
                | Self::PartsTrayWithParts
                | Self::LargeBoxWithEmptyKitTrays
                | Self::LargeBoxWithKits
        )
    }

    /// Whether trays and kits are piled up in objects of this class.
    #[must_use]
    pub fn is_container(self) -> bool {
        matches!(
            self,
            Self::LargeContainer | Self::LargeBoxWithKits | Self::LargeBoxWithEmptyKitTrays
        )
    }

    /// The property that names the stock keeping unit of objects of this class.
    #[must_use]
    pub fn sku_property(self) -> Option<&'static str> {
        match self {
            Self::Part => Some("hasPart_SkuRef"),
            Self::PartsTray => Some("hasPartsTray_SkuRef"),
            Self::PartsBin => Some("hasBin_SkuRef"),
            Self::KitTray => Some("hasKitTray_SkuRef"),
            Self::LargeContainer => Some("hasLargeContainer_SkuRef"),
            Self::KitInstance => Some("hasKitInstance_DesignRef"),
            _ => None,
        }
    }

    /// The property that holds the serial number of objects of this class.
    #[must_use]
    pub fn serial_property(self) -> Option<&'static str> {
        match self {
            Self::Part => Some("hasPart_SerialNumber"),
            Self::PartsTray => Some("hasPartsTray_SerialNumber"),
            Self::PartsBin => Some("hasBin_SerialNumber"),
            Self::KitTray => Some("hasKitTray_SerialNumber"),
            Self::LargeContainer => Some("hasLargeContainer_SerialNumber"),
            _ => None,
        }
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Class {
    type Err = String;

    /// The class of this name; `EndEffectorChangingStation` is also known as `ChangingStation`.
    fn from_str(name: &str) -> Result<Self, String> {
        let found = CLASSES.iter().find(|(_, known)| *known == name);
        match (found, name) {
            (Some((class, _)), _) => Ok(*class),
            (None, "Workstation") => Ok(Self::KittingWorkstation),
            (None, "Kit") => Ok(Self::KitInstance),
            (None, "ChangingStation") => Ok(Self::EndEffectorChangingStation),
            (None, _) => Err(format!("unknown class {name}")),
        }
    }
}

/// What kind of value a property has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A name or text.
    Text,
    /// A number without unit.
    Number,
    /// A length (m in the model, the workstation's length unit in files).
    Length,
    /// A weight, in the workstation's weight unit.
    Weight,
    /// True or false.
    Truth,
}

/// Stored properties: (owner class, name, kind). Everything that follows from the location chains
/// (a kit's tray, a tray's parts, the robot's end effector) is derived and not stored twice.
pub const PROPERTIES: &[(Class, &str, Kind)] = &[
    (Class::BoxyObject, "hasBox_Length", Kind::Length),
    (Class::BoxyObject, "hasBox_Width", Kind::Length),
    (Class::BoxyObject, "hasBox_Height", Kind::Length),
    (Class::SolidObject, "hasShape_Length", Kind::Length),
    (Class::SolidObject, "hasShape_Width", Kind::Length),
    (Class::SolidObject, "hasShape_Height", Kind::Length),
    (Class::SolidObject, "hasShape_HasTop", Kind::Truth),
    (Class::SolidObject, "hasShape_Description", Kind::Text),
    (Class::SolidObject, "hasSolidObject_Description", Kind::Text),
    (Class::Robot, "hasRobot_Id", Kind::Text),
    (Class::Robot, "hasRobot_Description", Kind::Text),
    (Class::Robot, "hasRobot_MaximumLoadWeight", Kind::Weight),
    (Class::EndEffector, "hasEndEffector_Id", Kind::Text),
    (Class::EndEffector, "hasEndEffector_Description", Kind::Text),
    (Class::EndEffector, "hasEndEffector_Weight", Kind::Weight),
    (
        Class::EndEffector,
        "hasEffector_MaximumLoadWeight",
        Kind::Weight,
    ),
    (Class::EndEffector, "hasEndEffector_Length", Kind::Length),
    (
        Class::VacuumEffector,
        "hasVacuumEffector_Length",
        Kind::Length,
    ),
    (
        Class::VacuumEffector,
        "hasVacuumEffector_CupDiameter",
        Kind::Length,
    ),
    (
        Class::VacuumEffectorMultiCup,
        "hasMultiCup_ArrayNumber",
        Kind::Number,
    ),
    (
        Class::VacuumEffectorMultiCup,
        "hasMultiCup_ArrayRadius",
        Kind::Length,
    ),
    (Class::Part, "hasPart_SkuRef", Kind::Text),
    (Class::Part, "hasPart_SerialNumber", Kind::Text),
    (Class::PartsTray, "hasPartsTray_SkuRef", Kind::Text),
    (Class::PartsTray, "hasPartsTray_SerialNumber", Kind::Text),
    (Class::PartsTray, "hasPartsTray_PartSkuRef", Kind::Text),
    (Class::PartsTray, "hasPartsTray_PartQuantity", Kind::Number),
    (Class::PartsBin, "hasBin_SkuRef", Kind::Text),
    (Class::PartsBin, "hasBin_SerialNumber", Kind::Text),
    (Class::PartsBin, "hasBin_PartSkuRef", Kind::Text),
    (Class::PartsBin, "hasBin_PartQuantity", Kind::Number),
    (Class::KitTray, "hasKitTray_SkuRef", Kind::Text),
    (Class::KitTray, "hasKitTray_SerialNumber", Kind::Text),
    (Class::KitInstance, "hasKitInstance_DesignRef", Kind::Text),
    (Class::KitInstance, "isKitInstance_Finished", Kind::Truth),
    (
        Class::LargeContainer,
        "hasLargeContainer_SkuRef",
        Kind::Text,
    ),
    (
        Class::LargeContainer,
        "hasLargeContainer_SerialNumber",
        Kind::Text,
    ),
    (
        Class::LargeContainer,
        "hasLargeContainer_Capacity",
        Kind::Number,
    ),
    (
        Class::LargeBoxWithKits,
        "hasLargeBoxWithKits_KitDesignRef",
        Kind::Text,
    ),
    (
        Class::LargeBoxWithKits,
        "hasLargeBoxWithKits_Capacity",
        Kind::Number,
    ),
];

/// The kind of a stored property of `class`, or none when the class has no such property.
#[must_use]
pub fn stored_property(class: Class, name: &str) -> Option<Kind> {
    PROPERTIES
        .iter()
        .find(|(owner, known, _)| *known == name && class.is_a(*owner))
        .map(|(_, _, kind)| *kind)
}

/// Properties that follow from location chains: (owner, name, class of the values, many values?).
pub const DERIVED: &[(Class, &str, Class, bool)] = &[
    (
        Class::PartsTrayWithParts,
        "hasPartsTrayWithParts_Parts",
        Class::Part,
        true,
    ),
    (
        Class::PartsTrayWithParts,
        "hasPartsTrayWithParts_Tray",
        Class::PartsTray,
        false,
    ),
    (
        Class::KitInstance,
        "hasKitInstance_Tray",
        Class::KitTray,
        false,
    ),
    (
        Class::KitInstance,
        "hasKitInstance_Parts",
        Class::Part,
        true,
    ),
    (
        Class::Robot,
        "hasRobot_EndEffector",
        Class::EndEffector,
        false,
    ),
    (
        Class::EndEffectorHolder,
        "hasEndEffectorHolder_EndEffector",
        Class::EndEffector,
        false,
    ),
    (
        Class::EndEffectorChangingStation,
        "hasChangingStation_Holders",
        Class::EndEffectorHolder,
        true,
    ),
    (
        Class::KittingWorkstation,
        "hasWorkstation_Robot",
        Class::Robot,
        false,
    ),
    (
        Class::KittingWorkstation,
        "hasWorkstation_Table",
        Class::WorkTable,
        false,
    ),
    (
        Class::KittingWorkstation,
        "hasWorkstation_ChangingStation",
        Class::EndEffectorChangingStation,
        false,
    ),
    (
        Class::KittingWorkstation,
        "hasWorkstation_OtherObstacles",
        Class::SolidObject,
        true,
    ),
    (Class::LargeContainer, "trays", Class::KitTray, true),
    (Class::LargeContainer, "kits", Class::KitInstance, true),
    (
        Class::LargeBoxWithEmptyKitTrays,
        "hasLargeBoxWithEmptyKitTrays_KitTrays",
        Class::KitTray,
        true,
    ),
    (
        Class::LargeBoxWithEmptyKitTrays,
        "hasLargeBoxWithEmptyKitTrays_LargeContainer",
        Class::LargeContainer,
        false,
    ),
    (
        Class::LargeBoxWithEmptyKitTrays,
        "trays",
        Class::KitTray,
        true,
    ),
    (
        Class::LargeBoxWithKits,
        "hasLargeBoxWithKits_Kits",
        Class::KitInstance,
        true,
    ),
    (
        Class::LargeBoxWithKits,
        "hasLargeBoxWithKits_LargeContainer",
        Class::LargeContainer,
        false,
    ),
    (Class::LargeBoxWithKits, "kits", Class::KitInstance, true),
];

/// The derived property `name` of `class`: class of its values and whether there may be many.
#[must_use]
pub fn derived_property(class: Class, name: &str) -> Option<(Class, bool)> {
    DERIVED
        .iter()
        .find(|(owner, known, _, _)| *known == name && class.is_a(*owner))
        .map(|(_, _, value, many)| (*value, *many))
}

//! The units and frames that a program can name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Unit of lengths, speeds, accelerations and point tolerances. Default: millimetre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// 25.4 mm exactly.
    Inch,
    /// The default of the language, written `mm`.
    #[default]
    #[serde(rename = "mm", alias = "millimeter", alias = "millimetre")]
    Millimeter,
    /// The SI unit.
    #[serde(alias = "metre")]
    Meter,
}

impl LengthUnit {
    /// The names to choose from in a program.
    pub const NAMES: &[&str] = &["inch", "mm", "meter"];
    /// Other spellings that are read as well.
    pub const OTHER_NAMES: &[&str] = &["millimeter", "millimetre", "metre"];

    /// The names in CRCL's XML.
    pub(crate) const XML_NAMES: &[(&'static str, Self)] = &[
        ("meter", Self::Meter),
        ("millimeter", Self::Millimeter),
        ("inch", Self::Inch),
    ];

    /// The unit of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "inch" => Some(Self::Inch),
            "mm" | "millimeter" | "millimetre" => Some(Self::Millimeter),
            "meter" | "metre" => Some(Self::Meter),
            _ => None,
        }
    }

    /// The name that a program is written with.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inch => "inch",
            Self::Millimeter => "mm",
            Self::Meter => "meter",
        }
    }

    /// How many metres one of this unit is.
    ///
    /// ```
    /// assert!((12.0 * crcl::LengthUnit::Inch.metres() - 0.3048).abs() < 1e-15);
    /// ```
    pub fn metres(self) -> f64 {
        match self {
            Self::Inch => 0.0254,
            Self::Millimeter => 0.001,
            Self::Meter => 1.0,
        }
    }
}

/// Unit of roll, pitch, yaw and of angle tolerances. Default: degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AngleUnit {
    /// The default of the language.
    #[default]
    Degree,
    /// The SI unit.
    Radian,
}

impl AngleUnit {
    /// The names to choose from in a program.
    pub const NAMES: &[&str] = &["degree", "radian"];

    /// The names in CRCL's XML.
    pub(crate) const XML_NAMES: &[(&'static str, Self)] =
        &[("degree", Self::Degree), ("radian", Self::Radian)];

    /// The unit of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "degree" => Some(Self::Degree),
            "radian" => Some(Self::Radian),
            _ => None,
        }
    }

    /// The name that a program is written with.
    pub fn name(self) -> &'static str {
        match self {
            Self::Degree => "degree",
            Self::Radian => "radian",
        }
    }

    /// How many radians one of this unit is.
    ///
    /// ```
    /// assert_eq!(180.0 * crcl::AngleUnit::Degree.radians(), std::f64::consts::PI);
    /// ```
    pub fn radians(self) -> f64 {
        match self {
            Self::Degree => std::f64::consts::PI / 180.0,
            Self::Radian => 1.0,
        }
    }
}

/// Unit of forces, in CRCL's XML only. Default: newton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ForceUnit {
    /// The SI unit.
    #[default]
    Newton,
    /// Pound-force, 4.4482216152605 N exactly.
    Pound,
    /// A sixteenth of it.
    Ounce,
}

impl ForceUnit {
    /// The names in CRCL's XML.
    pub(crate) const XML_NAMES: &[(&'static str, Self)] = &[
        ("newton", Self::Newton),
        ("pound", Self::Pound),
        ("ounce", Self::Ounce),
    ];

    /// How many newtons one of this unit is.
    ///
    /// # Source
    /// BIPM and NIST, SP 811 (2008), appendix B.8: pound-force.
    pub fn newtons(self) -> f64 {
        match self {
            Self::Newton => 1.0,
            Self::Pound => 4.448_221_615_260_5,
            Self::Ounce => 4.448_221_615_260_5 / 16.0,
        }
    }
}

/// Unit of torques, in CRCL's XML only. Default: newton metre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TorqueUnit {
    /// The SI unit.
    #[default]
    NewtonMeter,
    /// 1.3558179483314004 N m.
    FootPound,
}

impl TorqueUnit {
    /// The names in CRCL's XML.
    pub(crate) const XML_NAMES: &[(&'static str, Self)] = &[
        ("newtonMeter", Self::NewtonMeter),
        ("footPound", Self::FootPound),
    ];

    /// How many newton metres one of this unit is.
    ///
    /// # Source
    /// BIPM and NIST, SP 811 (2008), appendix B.8: foot pound-force.
    pub fn newton_meters(self) -> f64 {
        match self {
            Self::NewtonMeter => 1.0,
            Self::FootPound => 1.355_817_948_331_400_4,
        }
    }
}

/// The frame that poses are given in; set by the extension SetCoordinateFrame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum CoordinateFrame {
    /// The workstation: the frame of the standard language and the default.
    #[default]
    Workstation,
    /// The base of the robot.
    RobotBase,
    /// The controlled point at the start of the command.
    ToolTip,
}

impl CoordinateFrame {
    /// The names to choose from in a program.
    pub const NAMES: &[&str] = &["Workstation", "RobotBase", "ToolTip"];

    /// The frame of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "Workstation" => Some(Self::Workstation),
            "RobotBase" => Some(Self::RobotBase),
            "ToolTip" => Some(Self::ToolTip),
            _ => None,
        }
    }

    /// The name that a program is written with.
    pub fn name(self) -> &'static str {
        match self {
            Self::Workstation => "Workstation",
            Self::RobotBase => "RobotBase",
            Self::ToolTip => "ToolTip",
        }
    }
}

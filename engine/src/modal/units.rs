//! Units of the language and their SI value.

use crate::command_error::CommandError;

/// Unit of length that numbers of the program are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LengthUnit {
    /// 25.4 mm.
    Inch,
    /// The default of the language.
    #[default]
    Millimeter,
    /// SI.
    Meter,
}

impl LengthUnit {
    /// The unit of that name.
    ///
    /// # Errors
    /// A range error that lists the names, when there is no such unit.
    pub fn named(name: &str) -> Result<Self, CommandError> {
        match name {
            "inch" => Ok(Self::Inch),
            "mm" | "millimeter" | "millimetre" => Ok(Self::Millimeter),
            "meter" | "metre" => Ok(Self::Meter),
            _ => Err(CommandError::range(format!(
                "length unit must be one of \"inch\", \"mm\", \"meter\", got {name:?}"
            ))),
        }
    }

    /// Metres in one of this unit.
    #[must_use]
    pub fn meters(self) -> f64 {
        match self {
            Self::Inch => 0.0254,
            Self::Millimeter => 0.001,
            Self::Meter => 1.0,
        }
    }

    /// Name as it is written in programs.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Inch => "inch",
            Self::Millimeter => "mm",
            Self::Meter => "meter",
        }
    }
}

/// Unit of angle that numbers of the program are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum AngleUnit {
    /// The default of the language.
    #[default]
    Degree,
    /// SI.
    Radian,
}

impl AngleUnit {
    /// The unit of that name.
    ///
    /// # Errors
    /// A range error that lists the names, when there is no such unit.
    pub fn named(name: &str) -> Result<Self, CommandError> {
        match name {
            "degree" => Ok(Self::Degree),
            "radian" => Ok(Self::Radian),
            _ => Err(CommandError::range(format!(
                "angle unit must be \"degree\" or \"radian\", got {name:?}"
            ))),
        }
    }

    /// Radians in one of this unit.
    #[must_use]
    pub fn radians(self) -> f64 {
        match self {
            Self::Degree => std::f64::consts::PI / 180.0,
            Self::Radian => 1.0,
        }
    }

    /// Name as it is written in programs.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Degree => "degree",
            Self::Radian => "radian",
        }
    }
}

//! Rests inside a smooth motion.

use std::fmt;

/// A time inside a smooth motion at which nothing moves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Rest {
    /// Time of the rest, s.
    pub time: f64,
    /// Why the motion rests.
    pub cause: RestCause,
}

/// Why a smooth motion rests on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RestCause {
    /// The way turns back on itself.
    TurnsBack,
    /// A straight leg ends there: the tolerance is zero, or no faster motion past the pose was
    /// certified.
    Stop,
    /// The list was planned in parts, and no certified motion from one to the other was found.
    Division,
}

impl fmt::Display for RestCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TurnsBack => "the way turns back",
            Self::Stop => "exact stop",
            Self::Division => "planned in parts",
        })
    }
}

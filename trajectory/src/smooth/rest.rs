//! Rests inside a smooth motion.

use std::fmt;

/// A time inside a smooth motion at which nothing moves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Rest {
    /// Time of the rest, s.
    pub time: f64,
    /// Index in the list of the pose at which it rests: of those passed, the one nearest in time.
    pub pose: usize,
    /// Why the motion rests.
    pub cause: RestCause,
}

impl Rest {
    /// A rest of a motion that does not know its list yet.
    pub(crate) fn new(time: f64, cause: RestCause) -> Self {
        Self {
            time,
            pose: 0,
            cause,
        }
    }
}

/// Why a smooth motion rests on its way.
///
/// With a tolerance the way itself never asks for a rest: where it turns by 120 degrees or more, what goes on may begin
/// before what goes before has ended, and where it turns by less, an arc passes. So each of these says what kind of place
/// it is at which no faster motion was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RestCause {
    /// The way turns back on itself, by more than 135 degrees as seen at a few tolerances from the rest.
    TurnsBack,
    /// A straight leg ends there: the tolerance is zero, or no faster motion past the pose was
    /// certified.
    Stop,
    /// The list was planned in parts, and no certified motion from one to the other was found.
    Division,
}

impl RestCause {
    /// The cause in words.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::TurnsBack => "the way turns back",
            Self::Stop => "exact stop",
            Self::Division => "planned in parts",
        }
    }
}

impl fmt::Display for RestCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

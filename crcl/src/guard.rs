//! Guards: conditions on sensors that end a motion before its time.

use core::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::code;
use crate::finding::Finding;
use crate::value::{ValueError, within};

/// The longest name of a sensor (bytes): the room that a driver's state has for it.
pub const LONGEST_SENSOR: usize = 24;

/// The largest magnitude of a limit.
const LARGEST_LIMIT: f64 = 1e9;

/// What trips a guard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum GuardLimit {
    /// The value is above the limit.
    OverMax,
    /// The value is below the limit.
    UnderMin,
    /// The value has grown by more than the limit since the start.
    IncreaseOverLimit,
    /// The value has fallen by more than the limit since the start.
    DecreaseBeyondLimit,
}

impl GuardLimit {
    /// The names, in text, JSON and XML.
    pub(crate) const NAMES: &[(&'static str, Self)] = &[
        ("OVER_MAX", Self::OverMax),
        ("UNDER_MIN", Self::UnderMin),
        ("INCREASE_OVER_LIMIT", Self::IncreaseOverLimit),
        ("DECREASE_BEYOND_LIMIT", Self::DecreaseBeyondLimit),
    ];

    /// The name that a program is written with.
    pub fn name(self) -> &'static str {
        name_of(Self::NAMES, self)
    }
}

/// Whether the command behind a guard is then done or failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum GuardEnding {
    /// The command is done, whether the guard trips or not.
    #[default]
    Done,
    /// The command fails if the guard trips.
    ErrorOnTrigger,
    /// The command fails if it comes to its end and the guard has not tripped.
    RequireTrigger,
}

impl GuardEnding {
    /// The names, in text and JSON.
    pub(crate) const NAMES: &[(&'static str, Self)] = &[
        ("Done", Self::Done),
        ("ErrorOnTrigger", Self::ErrorOnTrigger),
        ("RequireTrigger", Self::RequireTrigger),
    ];

    /// The name that a program is written with.
    pub fn name(self) -> &'static str {
        name_of(Self::NAMES, self)
    }

    fn is_done(&self) -> bool {
        *self == Self::Done
    }
}

fn name_of<T: PartialEq>(names: &[(&'static str, T)], wanted: T) -> &'static str {
    let found = names.iter().find(|(_, value)| *value == wanted);
    found.map_or("", |(name, _)| name)
}

/// A condition on a sensor, for the next command that moves the arm or waits.
///
/// ```
/// use crcl::{ReadOptions, text};
/// let source = "Guard ({\"wrench.Fz\", \"OVER_MAX\", 10})";
/// let reading = text::read(source, &ReadOptions::default());
/// assert!(!reading.has_errors());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// The sensor: a name of the driver such as `wrench.Fz`, or `digital_input_0` to `63`,
    /// `analogue_input_0` to `7`.
    pub sensor: String,
    /// What trips it.
    pub limit: GuardLimit,
    /// The limit in SI units (N, N m, m), whatever units the program has chosen; 0.5 parts the two
    /// values of a digital input.
    pub value: f64,
    /// Whether the command is then done or failed.
    #[serde(default, skip_serializing_if = "GuardEnding::is_done")]
    pub ending: GuardEnding,
}

impl Guard {
    /// Checks everything that can be judged without a robot.
    pub(crate) fn check(&self) -> Result<(), ValueError> {
        let length = self.sensor.len();
        let control = self.sensor.chars().any(char::is_control);
        if length == 0 || length > LONGEST_SENSOR || control {
            return Err(ValueError::Sensor { length });
        }
        within("the limit of a guard", self.value, LARGEST_LIMIT).map(drop)
    }
}
/// A name that is none of `names`.
pub(crate) fn no_choice<T>(noun: &str, names: &[(&'static str, T)], span: Range<usize>) -> Finding {
    let listed: Vec<_> = names
        .iter()
        .map(|(name, _)| format!("\"{name}\""))
        .collect();
    let message = format!("{noun} of a guard is one of a few names");
    Finding::error(code::GUARD, span, message).expected(listed.join(" or "))
}

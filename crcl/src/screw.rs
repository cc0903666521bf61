//! A turn with an advance in step.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::pose::{LARGEST_ANGLE, LARGEST_COORDINATE, Pose};
use crate::value::{ValueError, within};

/// A turn about the tool's Z axis, or about an axis beside it, with an advance in step; in raw numbers
/// of the program.
///
/// ```
/// use crcl::{ReadOptions, text};
/// let reading = text::read("MoveScrew ({{-5, 720, -20}})", &ReadOptions::default());
/// assert!(!reading.has_errors());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Screw {
    /// Advance along the Z axis of the tool during the turn (length units); above 0 it leads away
    /// from the arm.
    pub advance: f64,
    /// The turn (angle units), which may exceed a whole one; above 0 it is counterclockwise for who
    /// looks at the tool from before it.
    pub turn: f64,
    /// Straight way along the Z axis of the tool before the turn (length units).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub free: f64,
    /// A point of the axis (length units); without one the axis goes through the controlled point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_point: Option<[f64; 3]>,
    /// Where to go before all this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Pose>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Screw {
    /// Checks every number that can be judged without settings and robot.
    pub(crate) fn check(&self) -> Result<(), ValueError> {
        within("the advance of a screw", self.advance, LARGEST_COORDINATE)?;
        within("the turn of a screw", self.turn, LARGEST_ANGLE)?;
        within("the way before a screw", self.free, LARGEST_COORDINATE)?;
        for value in self.axis_point.iter().flatten() {
            within("a coordinate of the axis", *value, LARGEST_COORDINATE)?;
        }
        let fault = |pose: &Pose| pose.faults().into_iter().next();
        match self.start.as_ref().and_then(fault) {
            Some((_, error)) => Err(error),
            None => Ok(()),
        }
    }

    /// The numbers as they are written in text: advance, turn, and the way before if there is one.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let mut numbers = vec![self.advance, self.turn];
        if self.free != 0.0 {
            numbers.push(self.free);
        }
        numbers
    }
}

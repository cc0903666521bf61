//! Where a single joint is to go.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The largest number of a joint.
pub(crate) const MOST_JOINTS: i64 = 16;

/// Where one joint is to go, in raw numbers of the program: angle units, or length units for a
/// joint that slides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointTarget {
    /// Number of the joint, from 1.
    #[schemars(range(min = 1, max = 16))]
    pub joint: i64,
    /// Where it stops.
    pub position: f64,
    /// Its largest speed (units per second); 0 leaves that to the speed in force.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0))]
    pub speed: f64,
    /// Its largest acceleration (units per second squared); 0 leaves that to the acceleration in
    /// force.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0))]
    pub acceleration: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl JointTarget {
    /// The numbers as they are written in text: joint, position, speed, acceleration; zeros at the
    /// end are left out.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let mut numbers = vec![self.joint as f64, self.position];
        if self.speed != 0.0 || self.acceleration != 0.0 {
            numbers.push(self.speed);
        }
        if self.acceleration != 0.0 {
            numbers.push(self.acceleration);
        }
        numbers
    }

    /// The target that these numbers of a text are, if their count and the joint's number fit.
    pub(crate) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (joint, position, rest) = match numbers {
            [joint, position, rest @ ..] if rest.len() <= 2 => (*joint, *position, rest),
            _ => return None,
        };
        let whole = joint.fract() == 0.0 && (1.0..=MOST_JOINTS as f64).contains(&joint);
        whole.then(|| Self {
            joint: joint as i64,
            position,
            speed: rest.first().copied().unwrap_or(0.0),
            acceleration: rest.get(1).copied().unwrap_or(0.0),
        })
    }
}

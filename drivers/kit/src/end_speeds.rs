//! Less speed near the ends of the range.

/// Speed limits that fall towards the ends of the range: towards an end at the distance `x`, a joint
/// may have the speed `sqrt(2 deceleration x) - offset`. Lists have one value per joint, root first.
#[derive(Clone, Debug, PartialEq)]
pub struct EndSpeeds {
    /// Lower ends (rad).
    pub lower: Vec<f64>,
    /// Upper ends (rad).
    pub upper: Vec<f64>,
    /// Decelerations (rad/s²).
    pub deceleration: Vec<f64>,
    /// Offsets (rad/s).
    pub offset: Vec<f64>,
}

impl EndSpeeds {
    /// The same limits times `share`.
    pub(crate) fn scaled(&self, share: f64) -> Self {
        let times = |values: &[f64], factor: f64| values.iter().map(|x| x * factor).collect();
        Self {
            deceleration: times(&self.deceleration, share * share),
            offset: times(&self.offset, share),
            ..self.clone()
        }
    }

    /// The limits of one joint.
    pub(crate) fn of(&self, joint: usize) -> NearEnds {
        NearEnds {
            ends: [self.lower[joint], self.upper[joint]],
            deceleration: self.deceleration[joint],
            offset: self.offset[joint],
        }
    }
}

/// The same of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NearEnds {
    /// Lower and upper end (rad).
    pub(crate) ends: [f64; 2],
    /// Deceleration (rad/s²).
    pub(crate) deceleration: f64,
    /// Offset (rad/s).
    pub(crate) offset: f64,
}

impl NearEnds {
    /// The largest speed upwards at a position (rad, rad/s); at least 0.
    pub(crate) fn upwards(&self, position: f64) -> f64 {
        let room = (self.ends[1] - position).max(0.0);
        ((2.0 * self.deceleration * room).sqrt() - self.offset).max(0.0)
    }

    /// The same limits with the two directions exchanged.
    pub(crate) fn mirrored(self) -> Self {
        let [lower, upper] = self.ends;
        Self {
            ends: [-upper, -lower],
            ..self
        }
    }
}

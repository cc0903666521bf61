//! What a robot shall do in a period.

use crate::Reference;

/// What the joints shall follow in one period.
#[derive(Clone, Copy, Debug)]
pub struct Command<'a> {
    /// The references, one entry per joint, within the limits of the joints.
    pub joints: &'a [Reference],
    /// Feed-forward efforts (N m), one entry per joint; they fade to zero where the engine sends
    /// none.
    pub effort: &'a [f64],
    /// When the joints shall be there, by the engine's plan (ns of `CLOCK_MONOTONIC`; in lock-step
    /// virtual time). A period's command is later than the one before it.
    pub at_ns: u64,
    /// Length of the period (s).
    pub period: f64,
}

/// The references of a [`Command`] with their time, for the thread that owns a controller: up to `N`
/// joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedReferences<const N: usize> {
    /// See [`Command::at_ns`].
    pub at_ns: u64,
    /// See [`Command::joints`]; those that it does not have are zero.
    pub joints: [Reference; N],
}

impl<const N: usize> From<&Command<'_>> for TimedReferences<N> {
    fn from(command: &Command<'_>) -> Self {
        let mut joints = [Reference::default(); N];
        for (to, from) in joints.iter_mut().zip(command.joints) {
            *to = *from;
        }
        Self {
            at_ns: command.at_ns,
            joints,
        }
    }
}

//! Options of a move.

/// What of the target has to be reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interface {
    /// Position, velocity and acceleration.
    #[default]
    Position,
    /// Velocity and acceleration; the final position is not given, and position limits do not
    /// apply.
    Velocity,
}

/// How the joints share time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Synchronisation {
    /// All joints arrive at the same instant.
    #[default]
    Time,
    /// All joints move along a straight line in joint space; an error where start and target do
    /// not allow one. Every enabled joint must have the same interface.
    Phase,
    /// A straight line where start and target allow one, otherwise as [`Self::Time`];
    /// `Motion::is_straight` tells which it was.
    PhaseIfPossible,
    /// Every joint arrives as early as it can. A joint that has arrived continues with the target's
    /// velocity and acceleration.
    None,
}

/// Options of a state-to-state move.
///
/// ```
/// use trajectory::otg::{Options, Synchronisation};
///
/// let options = Options::<6> { synchronisation: Synchronisation::Phase, ..Options::default() };
/// assert_eq!(options.enabled, [true; 6]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<const N: usize> {
    /// What of the target each joint has to reach.
    pub interface: [Interface; N],
    /// How the joints share time.
    pub synchronisation: Synchronisation,
    /// Joints that take part. The others hold their start position.
    pub enabled: [bool; N],
    /// The move lasts at least this long (s).
    pub minimum_duration: f64,
    /// The duration is a whole number of these periods (s).
    pub period: Option<f64>,
}

impl<const N: usize> Default for Options<N> {
    fn default() -> Self {
        Self {
            interface: [Interface::default(); N],
            synchronisation: Synchronisation::default(),
            enabled: [true; N],
            minimum_duration: 0.0,
            period: None,
        }
    }
}

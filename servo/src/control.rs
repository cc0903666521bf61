//! Requests of an operator while the arm moves.

/// A request of an operator while the arm moves. It acts in the next period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// Stop on the path and wait for [`Control::Resume`].
    Pause,
    /// Continue along the path.
    Resume,
    /// Fraction of the planned speed, 0..=1; other values are clamped, NaN is ignored.
    Override(f64),
    /// Stop on the path and wait for [`Control::Resume`].
    Stop {
        /// As fast as the joints can.
        fast: bool,
    },
    /// Stop on the path, then drop everything that was pushed. A pause or stop that is in force is
    /// over: what is pushed afterwards moves.
    Abort,
    /// Stop on the path, then drop everything that was pushed; a pause or stop that is in force
    /// stays. So ends a motion that its client or a time limit ends, for example a jog: nobody has
    /// asked then that a stopped arm may move again.
    Discard {
        /// As fast as the joints can.
        fast: bool,
    },
}

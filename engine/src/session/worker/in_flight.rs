//! A command that is executed, or waits for its turn in the ring.

use kinematics::Chain;
use trajectory::Trajectory;

use super::Note;
use super::guarding::Guarding;

/// A command that left the queue and is not yet reported.
pub(in crate::session) struct InFlight<const N: usize> {
    pub(super) id: u32,
    pub(super) line: usize,
    pub(super) name: &'static str,
    pub(super) planned_s: f64,
    /// The chain with the tool that it begins with.
    pub(super) chain: Chain<N>,
    pub(super) started: Option<u64>,
    pub(super) finished: Option<u64>,
    /// What is reported beside `Done` when its turn comes.
    pub(super) says: Option<Note>,
    /// A refused command is reported as such and not as done.
    pub(super) refused: bool,
    /// Number of the newest order when it was taken.
    pub(super) newest: u32,
    /// The guards of a guarded command: where it ends is not known before.
    pub(super) guarding: Option<Guarding<N>>,
    /// The motion of a move.
    pub(super) motion: Option<Trajectory<N>>,
}

impl<const N: usize> InFlight<N> {
    /// A command that has not begun, with its line and name, and the chain that it begins with; `newest`
    /// is the newest order when it was taken.
    pub(super) fn new(
        id: u32,
        (line, name): (usize, &'static str),
        chain: Chain<N>,
        newest: u32,
    ) -> Self {
        Self {
            id,
            line,
            name,
            planned_s: 0.0,
            chain,
            started: None,
            finished: None,
            says: None,
            refused: false,
            newest,
            guarding: None,
            motion: None,
        }
    }
}

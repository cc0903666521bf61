//! What the two threads tell each other.

use driver_kit::{Measured, RobotFault};
use ipc::MAX_JOINTS;

/// Where the bus is in its life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The first try to bring it up.
    #[default]
    Connecting,
    /// It could not be brought up, or was lost; it is tried again.
    Down,
    /// Process data flow, the drives are off.
    Idle,
    /// The drives are being enabled.
    Enabling,
    /// The drives follow.
    Following,
    /// The joints are brought to rest.
    Stopping,
    /// At rest after a fault; the drives are off.
    Faulted,
}

/// A cycle of the bus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Snapshot {
    /// When the process data came (ns of `CLOCK_MONOTONIC`); 0 before the first.
    pub(crate) received_ns: u64,
    pub(crate) joints: [Measured; MAX_JOINTS],
    /// What the drives are told (rad).
    pub(crate) commanded: [f64; MAX_JOINTS],
    pub(crate) phase: Phase,
    /// The session that phase and fault belong to.
    pub(crate) session: u32,
    /// Why the bus is down, or what it waits for.
    pub(crate) reason: [u8; 96],
    pub(crate) fault: Option<RobotFault>,
    /// Cycles, those with a wrong working counter, and those whose frame did not come back.
    pub(crate) cycles: u64,
    pub(crate) bad_counters: u64,
    pub(crate) lost_frames: u64,
    /// How far the targets are behind the newest reference (s).
    pub(crate) delay: f64,
    /// How far the frames are from their time by the drives' clock (s); NaN without one.
    pub(crate) clock_error: f64,
}

impl Default for Snapshot {
    fn default() -> Self {
        Self {
            received_ns: 0,
            joints: [Measured::default(); MAX_JOINTS],
            commanded: [0.0; MAX_JOINTS],
            phase: Phase::default(),
            session: 0,
            reason: [0; 96],
            fault: None,
            cycles: 0,
            bad_counters: 0,
            lost_frames: 0,
            delay: 0.0,
            clock_error: f64::NAN,
        }
    }
}

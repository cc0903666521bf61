//! Why the bus cannot be used.

use ethercrab::error::Error;
use thiserror::Error as ThisError;

/// Why the bus cannot be used. Joints count from 1, as operators do.
#[derive(Debug, ThisError)]
pub(crate) enum BusError {
    #[error("cannot open the network interface {interface}: {cause}")]
    Interface {
        interface: String,
        cause: std::io::Error,
    },
    #[error("cannot send on the network interface: {0}")]
    Network(std::io::Error),
    #[error(
        "no frame comes back: check cable, power of the drives, and that {interface} is their network"
    )]
    Silent { interface: String },
    #[error("no device answers on {interface}")]
    Nobody { interface: String },
    #[error("joint {joint} is at place {place} of the bus, which has {found} devices")]
    Missing {
        joint: usize,
        place: usize,
        found: usize,
    },
    #[error("joint {joint}: the device {name} is no CiA 402 drive (device type {found:#010x})")]
    NotADrive {
        joint: usize,
        name: String,
        found: u32,
    },
    #[error("joint {joint}: the drive has no cyclic synchronous position mode")]
    NoPosition { joint: usize },
    #[error("joint {joint}: the drive's process data has no {object}, or not on whole bytes")]
    Mapping { joint: usize, object: &'static str },
    #[error("joint {joint}: {what}: {cause}")]
    Drive {
        joint: usize,
        what: &'static str,
        cause: Error,
    },
    #[error("{what}: {cause}")]
    Bus { what: &'static str, cause: Error },
    #[error("the device at place {place} does not reach the state OP: it is in {state}")]
    NotOperational { place: usize, state: String },
    #[error("the device at place {place} left the state OP: {state}")]
    LeftOperation { place: usize, state: String },
    #[error("the driver ends")]
    Ends,
}

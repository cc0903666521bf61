//! The real-time thread and its link to the driver.
//!
//! [`Executor::start`] opens a session with the driver and starts the thread. Beside the
//! [`Executor`] itself there are three ends, each for one thread of the engine: a [`SegmentSender`] for
//! the planner (segments and tool orders, in order), a [`Remote`] for anyone (pause, override,
//! stop, where the arm is; [`Steering`] is the part of it that knows no joints), and a [`Monitor`]
//! for reports (events, samples).
//!
//! The thread never plans and never waits for any of them: what it gets comes through wait-free
//! rings and atomics. When the planner is late, the arm stops on the path; when the driver is
//! silent, the arm is stopped on the path and the fault latches until [`Remote::recover`].
#![forbid(unsafe_code)]
#![deny(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable
)]

mod config;
mod control;
mod event;
mod handle;
mod histogram;
mod monitor;
mod orders;
mod remote;
mod runner;
mod segment_sender;
mod thread;

pub use config::{ExecutorConfig, ExecutorError};
pub use control::Control;
pub use event::{Event, Fault, Recorded};
pub use handle::Executor;
pub use histogram::Histogram;
pub use monitor::Monitor;
pub use orders::{NoFault, Progress, Steering};
pub use remote::{Counters, Measured, Remote};
pub use runner::{Runner, Tick};
pub use segment_sender::{Full, SegmentSender, ToolOrder};

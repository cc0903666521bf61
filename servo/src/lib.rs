//! The real-time thread and its link to the driver.
//!
//! [`Executor::start`] opens a session with the driver and starts the thread. Beside the
//! [`Executor`] there are three handles: a [`SegmentSender`] for the planner (segments and tool
//! orders, in order), a [`Remote`] for any thread (pause, override, stop, position of the arm;
//! [`Steering`] is its part that does not depend on the number of joints), and a [`Monitor`] for
//! reports (events, samples).
//!
//! The thread never plans and never waits for any of them: it receives everything through wait-free
//! rings and atomics. If the planner is late, the arm stops on the path. If the driver sends no
//! states, the arm stops on the path and the fault latches until [`Remote::recover`].
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
mod end_tolerance;
mod event;
mod feed_forward;
mod guard;
mod handle;
mod histogram;
mod monitor;
mod orders;
mod remote;
mod runner;
mod segment_sender;
mod thread;

pub use config::{Arrival, ExecutorConfig, ExecutorError};
pub use control::Control;
pub use end_tolerance::{EndTolerance, OffEnd};
pub use event::{Event, Fault, Recorded, ShortText};
pub use feed_forward::FeedForward;
pub use guard::{
    GuardKind, GuardOrder, GuardOutcome, GuardSource, Guarded, MAX_GUARDS, SETTLED, SensorGuard,
};
pub use handle::Executor;
pub use histogram::Histogram;
pub use monitor::{Events, Monitor, Samples};
pub use orders::{NoFault, Progress, Steering};
pub use remote::{Counters, Measured, Remote};
pub use runner::{Runner, Tick};
pub use segment_sender::{Full, SegmentSender, Splice, ToolOrder, Work};

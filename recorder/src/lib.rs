//! The flight recorder: what an arm was told and what it did, in MCAP files.
//!
//! - [`Recording`] writes in a thread of its own, behind a bounded channel: who records waits for
//!   nothing, and what has no room is dropped and counted.
//! - [`Ring`] keeps the last seconds in memory, to be written when a fault comes.
//! - [`read`] reads a file back, also one that was cut off by a kill; [`recover`] makes a whole file
//!   of it.
//!
//! All messages are ROS 2 messages in CDR with their definitions in the file, so that Foxglove,
//! Lichtblick, PlotJuggler, Rerun and `ros2 bag` show them as they are. [`topic`] has the list.
//!
//! This crate never knows a robot, never plans and takes no part in the period.
#![forbid(unsafe_code)]

mod cdr;
mod error;
mod file;
mod head;
mod live;
mod message;
mod read;
mod recording;
mod recover;
mod ring;
mod sample;
mod schema;
pub mod topic;
mod writer;

pub use error::RecorderError;
pub use head::{FORM, Head};
pub use live::{LiveChannel, live_channels, live_messages, live_text};
pub use read::{Recorded, RecordedNote, read};
pub use recording::{Recording, Summary};
pub use recover::{Recovered, recover};
pub use ring::Ring;
pub use sample::{MAX_JOINTS, Period, Periods, Sample};
pub use writer::{Rotation, Writer};

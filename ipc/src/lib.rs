//! Messages and channels between processes, over iceoryx2.
//!
//! - The engine sends a [`Setpoint`] to the driver once per period, the driver sends a [`State`]
//!   back. Both are plain numbers of fixed size: any bytes are a value. [`Setpoint::check`] and
//!   [`State::check`] check the value before it is used.
//! - [`Hello`] and [`HelloAck`] are the handshake that opens a session.
//! - [`EngineLink`] is the engine's end, [`DriverLink`] the driver's end.
//! - [`Client`] and [`ClientServer`] carry requests of operators to a running engine, and its
//!   answers; [`ControlClient`] and [`ControlServer`] carry the requests that act on the current
//!   motion.
//! - [`Observer`] only reads the cyclic messages of an arm.
//!
//! This crate knows no robot, never plans, never waits on a lock, and has no iceoryx2 type in a
//! public signature. No other crate uses iceoryx2. Everything of a [`Domain`] belongs to one user,
//! and only that user can read it.

mod arm;
mod client;
mod client_server;
mod control;
mod damage;
mod domain;
mod driver_link;
mod engine_link;
mod error;
mod hello;
mod link_end;
mod message;
mod node;
mod observer;
mod ownership;
mod payload;
mod probe;
mod repair;
mod request;
mod room;
mod sensor;
mod setpoint;
mod state;
mod status;
mod ticket;
mod tool;

pub use arm::{Arm, model_hash};
pub use client::Client;
pub use client_server::ClientServer;
pub use control::{
    ControlAnswer, ControlAsk, ControlClient, ControlRequest, ControlServer, Controlled,
};
pub use domain::{DOMAIN_VARIABLE, Domain};
pub use driver_link::{DriverLink, Greeting};
pub use engine_link::{EngineLink, Greeted, READY};
pub use error::{IpcError, MessageError};
pub use hello::{Clock, DriverFeatures, Hello, HelloAck, Verdict, bytes_of, text_of};
pub use node::{NodeCount, count_nodes, engines, look_at_services, remove_dead_nodes};
pub use observer::Observer;
pub use ownership::Ownership;
pub use payload::Payload;
pub use probe::{AnsweringProbe, AskingProbe, Probe};
pub use repair::{Inhabitant, inhabitants_of, repair};
pub use request::{
    Answer, FollowPoint, Identity, LONGEST_ANSWER, Request, SubmittedProgram, Verb, whole_text,
};
pub use room::{ROOM_NEEDED, room_left};
pub use sensor::Sensor;
pub use setpoint::{Setpoint, SetpointFlags};
pub use state::{DriverState, FaultCode, State, StateFlags};
pub use status::{StatusReader, StatusWriter};
pub use ticket::RequestId;
pub use tool::{ToolAction, ToolCommand, ToolFeedback, ToolFlags, ToolStatus};

/// How many joints fit into a message.
pub const MAX_JOINTS: usize = 16;

/// How many tools fit into a message: 0 is the gripper, 1 the tool changer.
pub const MAX_TOOLS: usize = 2;

/// How many sensor values fit into a state.
pub const MAX_SENSORS: usize = 16;

/// How many analogue inputs and outputs fit into a message.
pub const MAX_ANALOGUE: usize = 8;

/// The index of the gripper among the tools of a message.
pub const GRIPPER: usize = 0;

/// The index of the tool changer among the tools of a message.
pub const TOOL_CHANGER: usize = 1;

/// The version of the driver protocol. Both sides must have the same.
pub const PROTOCOL: u32 = 2;

/// A checksum of the byte layout of the messages and of the number of fault codes; part of the handshake, so that a
/// driver built from other headers is refused before it moves.
///
/// # Source
/// Fowler, Noll, Vo, hash FNV-1a, 64 bit, over the sizes and offsets.
pub const fn schema_checksum() -> u64 {
    let numbers = [
        PROTOCOL as usize,
        MAX_JOINTS,
        MAX_TOOLS,
        MAX_SENSORS,
        MAX_ANALOGUE,
        size_of::<Setpoint>(),
        core::mem::offset_of!(Setpoint, position),
        core::mem::offset_of!(Setpoint, tools),
        core::mem::offset_of!(Setpoint, digital_outputs),
        core::mem::offset_of!(Setpoint, payload),
        size_of::<State>(),
        core::mem::offset_of!(State, position),
        core::mem::offset_of!(State, tools),
        core::mem::offset_of!(State, digital_inputs),
        core::mem::offset_of!(State, sensors),
        core::mem::offset_of!(State, text),
        size_of::<Hello>(),
        size_of::<HelloAck>(),
        FaultCode::COUNT,
    ];
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    let mut index = 0;
    while index < numbers.len() {
        hash = (hash ^ numbers[index] as u64).wrapping_mul(0x0100_0000_01b3);
        index += 1;
    }
    hash
}

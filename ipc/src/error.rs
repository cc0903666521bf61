//! Errors of the communication between processes.

use thiserror::Error;

/// Why a channel could not be opened or used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum IpcError {
    /// The name is not `cell/arm`.
    #[error("an arm is named cell/arm with letters, digits, - and _, got {name:?}")]
    BadArmName {
        /// The name that was given.
        name: String,
    },
    /// The directory of the domain cannot be used.
    #[error("{}: {cause}; {remedy}", directory.display())]
    Domain {
        /// The directory.
        directory: std::path::PathBuf,
        /// What is wrong with it.
        cause: String,
        /// The command or setting that repairs it.
        remedy: String,
    },
    /// Another living process already holds this end of the arm.
    #[error("{arm}: the {role} is already taken by {owner}")]
    Taken {
        /// The arm.
        arm: String,
        /// Which end: engine, driver, server of clients.
        role: &'static str,
        /// Executable and process number of the owner, as far as known.
        owner: String,
    },
    /// The other side was built with messages of another type or size.
    #[error(
        "{service}: the other side uses messages of another layout; this side speaks protocol \
         {protocol}. An engine or driver of another version runs here: end it, and build both from \
         the same version"
    )]
    Incompatible {
        /// The service.
        service: String,
        /// Our protocol version.
        protocol: u32,
    },
    /// The service exists, but was made by another version of iceoryx2 or is broken.
    #[error(
        "{service}: made by another version of iceoryx2 than 0.9.3, or left broken by a crash; \
         stop all engines and drivers of this arm and run `canter doctor --repair`"
    )]
    OtherLibrary {
        /// The service.
        service: String,
    },
    /// The operating system refused.
    #[error(
        "{service}: {operation} refused: not the same user as the other side, or shared memory is not accessible"
    )]
    Permission {
        /// The service.
        service: String,
        /// What was tried.
        operation: &'static str,
    },
    /// Anything else, with the name that iceoryx2 gives it.
    #[error(
        "{service}: {operation} failed ({cause}); if it stays so, end the engines and drivers \
         there and run `canter doctor --repair`"
    )]
    Failed {
        /// The service.
        service: String,
        /// What was tried.
        operation: &'static str,
        /// The cause in iceoryx2's own words.
        cause: String,
    },
    /// No answer in time.
    #[error("{arm}: no {role} answered within {waited_ms} ms")]
    NoAnswer {
        /// The arm.
        arm: String,
        /// Who was asked: driver or engine.
        role: &'static str,
        /// How long was waited (ms).
        waited_ms: u64,
    },
    /// There is too little room in shared memory.
    #[error(
        "{place} has {found} bytes left, {needed} are needed; remove what fills it \
         (`ls -lS {place}`, `canter doctor`) or give it more (mount -o remount,size=256m {place}); \
         SIGINT to the engine stops the arm meanwhile"
    )]
    NoRoom {
        /// The file system.
        place: &'static str,
        /// What must be free (bytes).
        needed: u64,
        /// What is free (bytes).
        found: u64,
    },
    /// A segment is not what iceoryx2 makes.
    #[error(
        "{segment}: damaged shared memory ({cause}); end the engines and drivers of {}, then \
         `canter doctor --repair`", directory.display()
    )]
    Damaged {
        /// The directory of the domain.
        directory: std::path::PathBuf,
        /// The segment.
        segment: String,
        /// What is wrong with it.
        cause: String,
    },
    /// What shall be removed is in use.
    #[error("{} is in use by {processes}; end them first", directory.display())]
    InUse {
        /// The directory of the domain.
        directory: std::path::PathBuf,
        /// The processes that use it.
        processes: String,
    },
    /// The engine took a request and did not say what became of it.
    #[error(
        "{arm}: the engine took the request and then said nothing; \
         `canter status` shows whether it lives and what it does"
    )]
    NoWord {
        /// The arm.
        arm: String,
    },
    /// The driver was not ready in time.
    #[error("{arm}: driver {driver:?} was not ready within {waited_s} s: {reason}")]
    NotReady {
        /// The arm.
        arm: String,
        /// The driver's name.
        driver: String,
        /// What it waited for.
        reason: String,
        /// How long was waited (s).
        waited_s: u64,
    },
    /// The driver refused the handshake.
    #[error("{arm}: driver {driver:?} refused: {reason}")]
    Refused {
        /// The arm.
        arm: String,
        /// The driver's name.
        driver: String,
        /// Its reason.
        reason: String,
    },
    /// A message of the other side is invalid.
    #[error("{arm}: {cause}")]
    BadMessage {
        /// The arm.
        arm: String,
        /// What is wrong with it.
        #[source]
        cause: MessageError,
    },
    /// A text of a client channel is not what it should be.
    #[error("{service}: cannot read the message: {cause}")]
    BadText {
        /// The service.
        service: String,
        /// What the reader said.
        cause: String,
    },
}

/// What is wrong with a message that was read from shared memory. Plain numbers, so that it can
/// be made inside the cycle.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MessageError {
    /// Another protocol version.
    #[error("protocol {found}, expected {expected}; build engine and driver from the same version")]
    Protocol {
        /// Our version.
        expected: u32,
        /// The version in the message.
        found: u32,
    },
    /// Another number of joints.
    #[error("{found} joints, expected {expected}")]
    Joints {
        /// Joints of the arm.
        expected: u32,
        /// Joints in the message.
        found: u32,
    },
    /// A value of a joint is not finite.
    #[error("{quantity} of joint {joint} is {value}, not a finite number")]
    NotFinite {
        /// Position, velocity and so on.
        quantity: &'static str,
        /// The joint, from 0.
        joint: u32,
        /// The value.
        value: f64,
    },
    /// A number stands for none of the known choices.
    #[error("{field} is {value}, which is not a known code")]
    Choice {
        /// The field of the message.
        field: &'static str,
        /// Its value.
        value: u32,
    },
    /// A time or count is out of its range.
    #[error("{field} is {value}, allowed is {least} to {most}")]
    Range {
        /// The field of the message.
        field: &'static str,
        /// Its value.
        value: u64,
        /// The least allowed.
        least: u64,
        /// The most allowed.
        most: u64,
    },
    /// A share is not between 0 and 1.
    #[error("{field} is {value}, allowed is 0 to 1")]
    Share {
        /// The field of the message.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The layout checksum differs.
    #[error("layout checksum {found:#018x}, expected {expected:#018x}")]
    Schema {
        /// Ours.
        expected: u64,
        /// Theirs.
        found: u64,
    },
}

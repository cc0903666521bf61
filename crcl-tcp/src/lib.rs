//! CRCL over TCP: a server that is a client of the engine like any other, and a client of any
//! CRCL server.
//!
//! The server knows the protocol and no motion: it gives commands to the engine through
//! [`ipc::Client`], stops through [`ipc::ControlClient`], and reports what both say. The process
//! that moves the arm opens no socket. The protocol has no authentication; the server listens on
//! the loopback address unless told otherwise.
//!
//! # Source
//! NIST, CRCL schemas (2021Apr28) and the behaviour of NIST's own clients and simulators.

mod allow;
mod arm;
mod blocks;
mod cell;
mod client;
mod connection;
mod engine;
mod framing;
mod parameters;
mod report;
mod sensing;
mod server;
mod si;
mod stopper;
mod tls;

pub use allow::{AllowError, Network};
pub use client::{Client, ClientError, Progress};
pub use framing::{Frame, Frames, LONGEST_DOCUMENT};
pub use server::{LARGEST_CROWD, Server, ServerConfig, ServerError, WhenGone};
pub use si::Units;
pub use tls::{TlsClient, TlsError, TlsFiles, TlsServer};

//! The live view and pendant: a page in the browser, served by a process of its own.
//!
//! The server is a client of the engine like `canter jog`: the arm waits for nothing here. It serves
//! one page with a WebSocket, to browsers of this machine only; [`Guard`] says who may come in.
//! [`Source`] is what is shown: a running arm, a recording, a planned program, or lists of poses.
//!
//! This crate never moves an arm by itself: what a person asks for goes to the engine, which checks
//! it. It is no safety function.
#![forbid(unsafe_code)]

mod blocks;
mod error;
mod forward;
mod foxglove;
mod freshness;
mod guard;
mod hand;
mod http;
mod lists;
mod live;
mod live_periods;
mod mesh;
mod page;
mod player;
mod preview;
mod reach;
mod request;
mod scene;
mod server;
mod socket;
mod source;
mod token;
mod world;

pub use error::ViewError;
pub use guard::{Access, Guard, Refusal, Visitor};
pub use lists::{ListMotion, PoseList};
pub use server::{Server, ServerOptions};
pub use source::Source;
pub use token::Token;
pub use world::{ReadWorld, World, WorldObject};

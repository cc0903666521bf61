//! Many cells over Zenoh: the program `canter-fleet`.
//!
//! `canter-fleet cell` is a client of the engines of one cell, beside them: it publishes their
//! reports and notes, and hands programs and stops to them. The other commands show all cells and
//! command them. Whoever connects has a certificate, and the router lets each do what its
//! certificate allows. Setpoints, states of every period, handshakes, jogs and recoveries never go
//! over it: [`Allowed`] lists what does. The process that moves the arm opens no socket.
//!
//! A stop that comes over a network is a convenience, not a safety function.

mod allowed;
mod answers;
mod authority;
mod cells;
mod commands;
mod failure;
mod keys;
mod link;
mod member;
mod one_thread;
mod options;
mod reporter;
mod rights;

pub use allowed::{Allowed, Refusal};
pub use options::main;

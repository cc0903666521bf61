//! The kitting process plan language: reading, writing, checking.

pub mod ast;
mod check;
mod check_world;
pub(crate) mod effects;
mod infer;
mod parser;
mod read;
mod statements;
mod token;
pub(crate) mod types;
mod write;

pub use ast::Plan;
pub use check::check;
pub use read::{Reading, read};
pub use write::{expression, write};

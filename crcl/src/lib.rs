//! The canonical robot command language: text, JSON, diagnostics.

mod command;
mod finding;
mod lexer;
mod meaning;
mod parser;
mod pose;
mod program;
mod source;
mod suggest;
pub mod text;
mod units;
mod value;

pub use command::{Argument, ArgumentKind, COMMANDS, Command, CommandInfo, Standing};
pub use finding::{Finding, Note, Omitted, Severity, code};
pub use pose::{ORTHOGONALITY, Pose, PosePart};
pub use program::{Located, Program, ReadOptions, Reading};
pub use source::Source;
pub use units::{AngleUnit, CoordinateFrame, LengthUnit};
pub use value::ValueError;

//! The canonical robot command language: text, JSON, diagnostics.

mod check;
mod command;
mod fields;
mod finding;
pub mod json;
mod lexer;
mod meaning;
mod parser;
mod pose;
mod program;
mod report;
mod source;
mod suggest;
pub mod text;
mod units;
mod value;

pub use check::{CheckOptions, check};
pub use command::{Argument, ArgumentKind, COMMANDS, Command, CommandInfo, LONGEST_S, Standing};
pub use finding::{Finding, Note, Omitted, Severity, code};
pub use pose::{LARGEST_ANGLE, LARGEST_COORDINATE, ORTHOGONALITY, Pose, PosePart};
pub use program::{Located, Program, ReadOptions, Reading};
pub use report::{FindingsReport, Look, NoteRecord, Record, records, render};
pub use source::Source;
pub use units::{AngleUnit, CoordinateFrame, LengthUnit};
pub use value::ValueError;

//! A command as it is written, before it means anything.

use std::ops::Range;

/// A name with arguments in parentheses.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) name: Range<usize>,
    pub(crate) arguments: Vec<Node>,
    /// From the name to the closing parenthesis.
    pub(crate) span: Range<usize>,
    pub(crate) state: State,
}

/// How whole a call is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum State {
    /// As it should be.
    Sound,
    /// An error was reported, but the meaning is clear enough to continue.
    Mended,
    /// Beyond use.
    Broken,
}

/// A value and its place.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) value: Tree,
    pub(crate) span: Range<usize>,
}

/// A value before it means anything.
#[derive(Debug)]
pub(crate) enum Tree {
    /// A number; `whole` when it is written without point and exponent.
    Number {
        number: f64,
        whole: bool,
    },
    Text(String),
    Word,
    Braces(Vec<Node>),
    Call {
        name: Range<usize>,
        arguments: Vec<Node>,
    },
    /// A value that was reported already.
    Faulty,
}

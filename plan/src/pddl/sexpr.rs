//! Symbolic expressions, the syntax of PDDL files.

use crate::finding::position;

/// Deepest nesting that is read.
const DEEPEST: usize = 64;

/// A word or a list, with the byte where it starts. Words are in small letters: PDDL does not
/// distinguish capitals.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Sexpr {
    Word(String, usize),
    List(Vec<Sexpr>, usize),
}

impl Sexpr {
    pub(crate) fn word(&self) -> Option<&str> {
        if let Self::Word(word, _) = self {
            Some(word)
        } else {
            None
        }
    }

    pub(crate) fn list(&self) -> Option<&[Self]> {
        if let Self::List(list, _) = self {
            Some(list)
        } else {
            None
        }
    }

    pub(crate) fn at(&self) -> usize {
        match self {
            Self::Word(_, at) | Self::List(_, at) => *at,
        }
    }

    /// First word of a list.
    pub(crate) fn head(&self) -> Option<&str> {
        self.list()
            .and_then(|list| list.first())
            .and_then(Self::word)
    }
}

/// A fault in a PDDL file, with its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {message}")]
pub struct PddlError {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
}

impl PddlError {
    pub(crate) fn new(source: &str, at: usize, message: impl Into<String>) -> Self {
        let (line, column) = position(source, at);
        Self {
            line,
            column,
            message: message.into(),
        }
    }
}

/// Reads one expression; nothing but blanks and comments may follow it.
pub(crate) fn read(source: &str) -> Result<Sexpr, PddlError> {
    let mut open: Vec<(Vec<Sexpr>, usize)> = Vec::new();
    let mut done: Option<Sexpr> = None;
    for (token, at) in words(source) {
        if done.is_some() {
            return Err(PddlError::new(
                source,
                at,
                format!("unexpected {token:?} after the end"),
            ));
        }
        let complete = match token {
            "(" if open.len() >= DEEPEST => {
                return Err(PddlError::new(source, at, "nested too deep"));
            }
            "(" => {
                open.push((Vec::new(), at));
                continue;
            }
            ")" => match open.pop() {
                Some((list, start)) => Sexpr::List(list, start),
                None => return Err(PddlError::new(source, at, "unexpected \")\"")),
            },
            word => Sexpr::Word(word.to_lowercase(), at),
        };
        match open.last_mut() {
            Some((list, _)) => list.push(complete),
            None => done = Some(complete),
        }
    }
    match (open.pop(), done) {
        (Some((_, start)), _) => Err(PddlError::new(source, start, "\"(\" without \")\"")),
        (None, Some(done)) => Ok(done),
        (None, None) => Err(PddlError::new(source, 0, "the file is empty")),
    }
}

/// Parentheses and words, without comments.
pub(crate) fn words(source: &str) -> impl Iterator<Item = (&str, usize)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let rest = source.get(at..)?;
            let first = rest.chars().next()?;
            if first.is_whitespace() {
                at += first.len_utf8();
            } else if first == ';' {
                at += rest.find('\n').unwrap_or(rest.len());
            } else {
                let stop = |c: char| c.is_whitespace() || matches!(c, '(' | ')' | ';');
                let length = match first {
                    '(' | ')' => 1,
                    _ => rest.find(stop).unwrap_or(rest.len()),
                };
                let start = at;
                at += length;
                return Some((&rest[..length], start));
            }
        }
    })
}

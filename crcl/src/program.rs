//! A program as read: commands with their places in the source.

use std::ops::Range;

use crate::command::Command;
use crate::finding::{Finding, Findings, Omitted};

/// A command and where it stands in the source.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The command.
    pub command: Command,
    /// Bytes of the source, from the name to the closing parenthesis.
    pub span: Range<usize>,
    /// Line of the name, from 1; 0 when the command comes from no file.
    pub line: usize,
    /// Column of the name in characters, from 1; 0 when the command comes from no file.
    pub column: usize,
}

/// The commands of a program, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// The commands, in order.
    pub commands: Vec<Located>,
}

impl Program {
    /// The commands without their places.
    pub fn iter(&self) -> impl Iterator<Item = &Command> {
        self.commands.iter().map(|located| &located.command)
    }
}

/// A program made in memory: its commands have no place (line 0, column 0).
impl FromIterator<Command> for Program {
    fn from_iter<I: IntoIterator<Item = Command>>(commands: I) -> Self {
        let located = |command| Located {
            command,
            span: 0..0,
            line: 0,
            column: 0,
        };
        Self {
            commands: commands.into_iter().map(located).collect(),
        }
    }
}

/// How a program is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Refuse the extensions of the language. Default: no.
    pub strict: bool,
    /// How many findings are kept; the rest is counted only. Default: 100.
    pub max_findings: usize,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            strict: false,
            max_findings: 100,
        }
    }
}

/// What came of reading a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// Every command that could be read. A command whose value is out of range is among them:
    /// it is well formed, and the executor refuses it again when its turn comes. A command that
    /// is not well formed is not.
    pub program: Program,
    /// Errors and warnings, in the order of the source.
    pub findings: Vec<Finding>,
    /// How many findings were not kept.
    pub omitted: Omitted,
}

impl Reading {
    /// Whether the program must be refused.
    pub fn has_errors(&self) -> bool {
        self.omitted.errors > 0 || self.findings.iter().any(Finding::is_error)
    }
}

impl Findings {
    /// The findings in the order of the source, with what could be read.
    pub(crate) fn into_reading(self, program: Program) -> Reading {
        let (mut findings, omitted) = (self.kept, self.omitted);
        findings.sort_by_key(|finding| (finding.span.start, finding.span.end));
        Reading {
            program,
            findings,
            omitted,
        }
    }
}

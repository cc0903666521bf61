//! One error or warning about a program, and the list of them.

use std::ops::Range;

use serde::Serialize;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The program runs, but probably not as meant.
    Warning,
    /// The program is refused.
    Error,
}

/// A second place that explains a finding, such as the bracket that was left open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Bytes of the source that the note is about.
    pub span: Range<usize>,
    /// What is to be seen there.
    pub text: String,
}

/// One error or warning about a program: what is wrong, where, and how to correct it.
///
/// `render` shows findings as text, `records` as JSON.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Error or warning.
    pub severity: Severity,
    /// Stable name of the kind of finding, one of [`crate::code`].
    pub code: &'static str,
    /// What is wrong, in one line.
    pub message: String,
    /// What would have been right here.
    pub expected: Option<String>,
    /// What stands here instead.
    pub found: Option<String>,
    /// What to do about it.
    pub help: Option<String>,
    /// Bytes of the source that the finding is about; empty where something is missing.
    pub span: Range<usize>,
    /// Other places that explain it.
    pub notes: Vec<Note>,
}

impl Finding {
    /// An error at `span` (bytes of the source).
    pub fn error(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, span, message.into())
    }

    /// A warning at `span` (bytes of the source).
    pub fn warning(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, span, message.into())
    }

    fn new(severity: Severity, code: &'static str, span: Range<usize>, message: String) -> Self {
        let (expected, found, help, notes) = (None, None, None, Vec::new());
        Self {
            severity,
            code,
            message,
            expected,
            found,
            help,
            span,
            notes,
        }
    }

    /// The same finding with what would have been right.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// The same finding with what stands there instead.
    #[must_use]
    pub fn found(mut self, found: impl Into<String>) -> Self {
        self.found = Some(found.into());
        self
    }

    /// The same finding with what to do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The same finding with another place that explains it.
    #[must_use]
    pub fn note(mut self, span: Range<usize>, text: impl Into<String>) -> Self {
        self.notes.push(Note {
            span,
            text: text.into(),
        });
        self
    }

    /// Whether the finding refuses the program.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// How many findings were made beyond those that are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Omitted {
    /// Errors that are counted only.
    pub errors: usize,
    /// Warnings that are counted only.
    pub warnings: usize,
}

impl Omitted {
    /// Errors and warnings together.
    pub fn total(&self) -> usize {
        self.errors + self.warnings
    }
}

/// Keeps the first findings up to a limit and counts the rest.
#[derive(Debug)]
pub(crate) struct Findings {
    pub(crate) kept: Vec<Finding>,
    pub(crate) omitted: Omitted,
    limit: usize,
}

impl Findings {
    pub(crate) fn new(limit: usize) -> Self {
        Self {
            kept: Vec::new(),
            omitted: Omitted::default(),
            limit,
        }
    }

    pub(crate) fn push(&mut self, finding: Finding) {
        if self.kept.len() < self.limit {
            self.kept.push(finding);
        } else if finding.is_error() {
            self.omitted.errors += 1;
        } else {
            self.omitted.warnings += 1;
        }
    }

    /// How many findings were made so far, kept or not.
    pub(crate) fn total(&self) -> usize {
        self.kept.len() + self.omitted.total()
    }
}

impl Extend<Finding> for Findings {
    fn extend<I: IntoIterator<Item = Finding>>(&mut self, findings: I) {
        findings.into_iter().for_each(|finding| self.push(finding));
    }
}

//! One error or warning about a program, and the list of them.

use std::ops::Range;

use serde::Serialize;

use crate::program::{Program, Reading};

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
    /// Stable name of the kind of finding, one of [`code`].
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

impl Extend<Finding> for Findings {
    fn extend<I: IntoIterator<Item = Finding>>(&mut self, findings: I) {
        findings.into_iter().for_each(|finding| self.push(finding));
    }
}

/// The stable names of all kinds of findings.
pub mod code {
    macro_rules! codes {
        ($($(#[$doc:meta])* $name:ident = $text:literal;)*) => {
            $($(#[$doc])* pub const $name: &str = $text;)*
            /// Every code, for documentation and tests.
            pub const ALL: &[&str] = &[$($name),*];
        };
    }

    codes! {
        /// The file is not text at all.
        BINARY = "crcl::binary-file";
        /// The file is text, but not in UTF-8.
        NOT_UTF8 = "crcl::not-utf8";
        /// The program has no command.
        EMPTY = "crcl::empty-program";
        /// A character that has no place in a program.
        CHARACTER = "crcl::unexpected-character";
        /// A `/*` without its `*/`.
        COMMENT = "crcl::unterminated-comment";
        /// A text without its closing quote.
        TEXT = "crcl::unterminated-text";
        /// A backslash in a text before a character that it cannot escape.
        ESCAPE = "crcl::bad-escape";
        /// Something that looks like a number and is none.
        NUMBER = "crcl::bad-number";
        /// Not a number, or infinite.
        NOT_FINITE = "crcl::not-finite";
        /// A number too large to be stored.
        OVERFLOW = "crcl::number-overflow";
        /// Something else where a command should begin.
        NOT_A_COMMAND = "crcl::expected-command";
        /// A command without its parentheses.
        PARENTHESES = "crcl::missing-parentheses";
        /// A name that is not a command.
        UNKNOWN_COMMAND = "crcl::unknown-command";
        /// A command that strict mode refuses.
        EXTENSION = "crcl::extension";
        /// A bracket that is never closed.
        UNCLOSED = "crcl::unclosed-bracket";
        /// A bracket of the wrong kind.
        BRACKET = "crcl::wrong-bracket";
        /// A closing bracket that closes nothing.
        SURPLUS_BRACKET = "crcl::surplus-bracket";
        /// Two values with no comma between them.
        COMMA = "crcl::missing-comma";
        /// A comma with no value beside it.
        SURPLUS_COMMA = "crcl::surplus-comma";
        /// Brackets within brackets, deeper than any command needs.
        TOO_DEEP = "crcl::too-deep";
        /// More or fewer arguments than the command takes.
        ARGUMENT_COUNT = "crcl::argument-count";
        /// An argument of the wrong type.
        ARGUMENT_TYPE = "crcl::argument-type";
        /// A list of poses whose stated number is not its length.
        COUNT_MISMATCH = "crcl::count-mismatch";
        /// A list without poses.
        NO_POSES = "crcl::no-poses";
        /// A pose, point or axis with too many or too few parts.
        POSE_SHAPE = "crcl::pose-shape";
        /// An axis of length zero.
        ZERO_AXIS = "crcl::zero-axis";
        /// A Z axis and an X axis that are not perpendicular.
        NOT_ORTHOGONAL = "crcl::axes-not-orthogonal";
        /// A unit that the language does not know.
        UNKNOWN_UNIT = "crcl::unknown-unit";
        /// A coordinate frame that the language does not know.
        UNKNOWN_FRAME = "crcl::unknown-frame";
        /// A quantity below zero that cannot be.
        NEGATIVE = "crcl::negative-value";
        /// A number larger than the largest that is accepted.
        TOO_LARGE = "crcl::too-large";
        /// A percentage outside 0 to 100.
        PERCENT = "crcl::percent-out-of-range";
        /// A percentage that looks like a fraction.
        FRACTION = "crcl::percent-looks-like-fraction";
        /// Commands before the first InitCanon.
        NO_INIT = "crcl::missing-init-canon";
        /// InitCanon while the robot is ready already.
        SECOND_INIT = "crcl::second-init-canon";
        /// EndCanon with nothing to end.
        NOTHING_TO_END = "crcl::nothing-to-end";
        /// Commands after EndCanon.
        AFTER_END = "crcl::command-after-end-canon";
        /// The program stops without EndCanon.
        NO_END = "crcl::missing-end-canon";
        /// A move while speed or acceleration is set to zero.
        ZERO_SPEED = "crcl::zero-speed";
        /// A gripper command while the tool changer is open.
        NO_TOOL = "crcl::gripper-without-tool";
        /// The tool changer opened while the gripper is closed.
        GRIPPER_CLOSED = "crcl::tool-change-gripper-closed";
        /// A program in default millimetres that looks like metres.
        LOOKS_LIKE_METRES = "crcl::looks-like-metres";
        /// JSON that is not JSON.
        JSON_SYNTAX = "crcl::json-syntax";
        /// JSON that lacks a field.
        MISSING_FIELD = "crcl::missing-field";
        /// JSON with a field that does not belong there.
        UNKNOWN_FIELD = "crcl::unknown-field";
        /// JSON with the same field twice.
        DUPLICATE_FIELD = "crcl::duplicate-field";
        /// JSON of a schema version that is not ours.
        SCHEMA_VERSION = "crcl::schema-version";
    }
}

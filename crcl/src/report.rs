//! Shows findings to people (with the source and a caret) and to machines (as JSON objects).

use std::fmt;
use std::ops::Range;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, SourceCode};
use serde::Serialize;

use crate::finding::{Finding, Omitted, Severity};
use crate::source::Source;

/// How findings are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Lines and colours, for a terminal.
    Colour,
    /// Lines without colours, for a terminal with `NO_COLOR`.
    Monochrome,
    /// ASCII, the place first on a line, for logs, editors and pipes.
    Plain,
}

/// One finding with its source, as a [`miette::Diagnostic`].
#[derive(Clone, Copy)]
pub struct FindingsReport<'a> {
    finding: &'a Finding,
    source: &'a Source,
}

impl<'a> FindingsReport<'a> {
    /// The finding in its source.
    pub fn new(finding: &'a Finding, source: &'a Source) -> Self {
        Self { finding, source }
    }

    /// Whether the finding is about the file as a whole, so that no line is worth showing.
    fn is_about_file(&self) -> bool {
        self.finding.span == (0..0)
    }

    fn label(&self) -> Option<String> {
        match (&self.finding.expected, &self.finding.found) {
            (Some(expected), Some(found)) => Some(format!("expected {expected}, found {found}")),
            (Some(expected), None) => Some(format!("expected {expected}")),
            (None, Some(found)) => Some(format!("found {found}")),
            (None, None) => None,
        }
    }

    fn span(&self, span: &Range<usize>) -> (usize, usize) {
        let shown = self.source.shown_span(span);
        (shown.start, shown.len())
    }
}

impl fmt::Debug for FindingsReport<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FindingsReport")
            .field("finding", self.finding)
            .finish_non_exhaustive()
    }
}

impl fmt::Display for FindingsReport<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_about_file() {
            write!(f, "{}: ", self.source.name())?;
        }
        f.write_str(&self.finding.message)
    }
}

impl std::error::Error for FindingsReport<'_> {}

impl Diagnostic for FindingsReport<'_> {
    fn code<'b>(&'b self) -> Option<Box<dyn fmt::Display + 'b>> {
        Some(Box::new(self.finding.code))
    }

    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.finding.severity {
            Severity::Warning => miette::Severity::Warning,
            Severity::Error => miette::Severity::Error,
        })
    }

    fn help<'b>(&'b self) -> Option<Box<dyn fmt::Display + 'b>> {
        let help = self.finding.help.as_ref()?;
        Some(Box::new(help))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        if self.is_about_file() {
            None
        } else {
            Some(self.source)
        }
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (start, length) = self.span(&self.finding.span);
        let primary = LabeledSpan::new_primary_with_span(self.label(), (start, length));
        let notes =
            self.finding.notes.iter().map(|note| {
                LabeledSpan::new_with_span(Some(note.text.clone()), self.span(&note.span))
            });
        Some(Box::new(std::iter::once(primary).chain(notes)))
    }
}

/// Draws findings of one source, each with its place, and a line that counts them.
///
/// `width` is that of the terminal in characters; [`Look::Plain`] does not use it.
///
/// ```
/// use crcl::{Look, ReadOptions, Source, render, text};
/// let source = Source::new("pick.canon", "Dwel (0.5)\n");
/// let reading = text::read(source.text(), &ReadOptions::default());
/// let shown = render(&reading.findings, reading.omitted, &source, (Look::Plain, 80));
/// assert!(shown.starts_with("pick.canon:1:1: error: there is no command `Dwel`"));
/// ```
pub fn render(
    findings: &[Finding],
    omitted: Omitted,
    source: &Source,
    (look, width): (Look, usize),
) -> String {
    let mut shown = String::new();
    for finding in findings {
        let report = FindingsReport::new(finding, source);
        match look {
            Look::Plain => shown += &plain(&report),
            Look::Monochrome => draw(
                &report,
                GraphicalTheme::unicode_nocolor(),
                width,
                &mut shown,
            ),
            Look::Colour => draw(&report, GraphicalTheme::unicode(), width, &mut shown),
        }
        shown.push('\n');
    }
    shown + &tally(findings, omitted)
}

fn draw(report: &FindingsReport, theme: GraphicalTheme, width: usize, shown: &mut String) {
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_links(false)
        .with_width(width);
    if handler.render_report(shown, report).is_err() {
        // Only a label outside the source can cause this; the finding is not lost.
        *shown += &plain(report);
    }
}

/// The line that counts findings; empty when there are none.
fn tally(findings: &[Finding], omitted: Omitted) -> String {
    let errors = findings.iter().filter(|finding| finding.is_error()).count();
    let (warnings, hidden) = (findings.len() - errors, omitted.total());
    let (errors, warnings) = (errors + omitted.errors, warnings + omitted.warnings);
    let count = |number: usize, noun: &str| match number {
        0 => None,
        1 => Some(format!("1 {noun}")),
        _ => Some(format!("{number} {noun}s")),
    };
    let counts = [count(errors, "error"), count(warnings, "warning")];
    let counts: Vec<_> = counts.into_iter().flatten().collect();
    match (counts.is_empty(), hidden) {
        (true, _) => String::new(),
        (false, 0) => format!("{}\n", counts.join(", ")),
        (false, _) => format!("{}; {hidden} of them not shown\n", counts.join(", ")),
    }
}

/// A finding in ASCII lines, with the place first.
fn plain(report: &FindingsReport) -> String {
    let (finding, source) = (report.finding, report.source);
    let severity = match finding.severity {
        Severity::Warning => "warning",
        Severity::Error => "error",
    };
    let help = finding
        .help
        .as_ref()
        .map(|help| format!("  help: {help}\n"))
        .unwrap_or_default();
    if report.is_about_file() {
        return format!("{report}: {severity} [{}]\n{help}", finding.code);
    }
    let (line, column) = source.position(finding.span.start);
    let place = format!("{}:{line}:{column}", source.name());
    let mut shown = format!(
        "{place}: {severity}: {} [{}]\n",
        finding.message, finding.code
    );
    shown += &plain_excerpt(source, &finding.span, &report.label().unwrap_or_default());
    for note in &finding.notes {
        shown += &plain_excerpt(source, &note.span, &note.text);
    }
    shown + &help
}

/// The line of a span and a line of carets below it.
fn plain_excerpt(source: &Source, span: &Range<usize>, label: &str) -> String {
    let (number, _) = source.position(span.start);
    let (excerpt, marked) = (source.excerpt(span), source.shown_span(span));
    let text = source.shown(excerpt.clone());
    let blank = |c: char| if c == '\t' { '\t' } else { ' ' };
    let before: String = source
        .shown(excerpt.start..marked.start.min(excerpt.end))
        .chars()
        .map(blank)
        .collect();
    let carets = "^".repeat(source.shown(marked).chars().count().max(1));
    let gutter = number.to_string();
    let space = " ".repeat(gutter.len());
    format!("  {gutter} | {text}\n  {space} | {before}{carets} {label}")
        .trim_end()
        .to_owned()
        + "\n"
}

/// A finding as a flat record for machines.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Record {
    /// Name of the source.
    pub file: String,
    /// Line of the first byte, from 1.
    pub line: usize,
    /// Column of the first byte in characters, from 1.
    pub column: usize,
    /// Line just after the last byte, from 1.
    pub end_line: usize,
    /// Column just after the last byte in characters, from 1.
    pub end_column: usize,
    /// Error or warning.
    pub severity: Severity,
    /// Stable name of the kind of finding.
    pub code: &'static str,
    /// What is wrong.
    pub message: String,
    /// What would have been right.
    pub expected: Option<String>,
    /// What stands there instead.
    pub found: Option<String>,
    /// What to do about it.
    pub help: Option<String>,
    /// Other places that explain it.
    pub notes: Vec<NoteRecord>,
}

/// A second place of a finding, for machines.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct NoteRecord {
    /// Line of the first byte, from 1.
    pub line: usize,
    /// Column of the first byte in characters, from 1.
    pub column: usize,
    /// What is to be seen there.
    pub text: String,
}

impl Record {
    /// The finding with its place in lines and columns.
    pub fn new(finding: &Finding, source: &Source) -> Self {
        let (line, column) = source.position(finding.span.start);
        let (end_line, end_column) = source.position(finding.span.end);
        let note = |note: &crate::finding::Note| {
            let (line, column) = source.position(note.span.start);
            NoteRecord {
                line,
                column,
                text: note.text.clone(),
            }
        };
        Self {
            file: source.name().to_owned(),
            line,
            column,
            end_line,
            end_column,
            severity: finding.severity,
            code: finding.code,
            message: finding.message.clone(),
            expected: finding.expected.clone(),
            found: finding.found.clone(),
            help: finding.help.clone(),
            notes: finding.notes.iter().map(note).collect(),
        }
    }
}

/// Findings as JSON-ready records.
///
/// ```
/// use crcl::{ReadOptions, Source, records, text};
/// let source = Source::new("pick.canon", "InitCanon ()\nDwell (\"1\")\n");
/// let reading = text::read(source.text(), &ReadOptions::default());
/// let record = &records(&reading.findings, &source)[0];
/// assert_eq!((record.line, record.column, record.code), (2, 8, "crcl::argument-type"));
/// ```
pub fn records(findings: &[Finding], source: &Source) -> Vec<Record> {
    findings
        .iter()
        .map(|finding| Record::new(finding, source))
        .collect()
}

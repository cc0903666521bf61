use std::io::{self, IsTerminal, Write};

use clap::{Args, ValueEnum};
use crcl::{CheckOptions, Finding, LengthUnit, Look, Program, ReadOptions, Reading, Source, code};
use engine::host::{GivenProgram, length_word};
use planner::command_error::ErrorClass;
use planner::dry_run::{FailurePolicy, Plan, PlanOptions, Refusal, plan_from};
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::{input, output};

/// Which program, and how it is read.
#[derive(Args, Debug)]
pub(crate) struct ProgramArgument {
    /// File of canonical commands, text, JSON or XML; `-` is standard input
    #[arg(value_name = "PROGRAM")]
    path: String,
    #[command(flatten)]
    reading: ReadingOptions,
}

/// How a program is read.
#[derive(Args, Clone, Debug)]
pub(crate) struct ReadingOptions {
    /// Refuse the extensions of the language
    #[arg(long)]
    strict: bool,
    /// Form of the program; without this option JSON and XML are recognised by their first character
    #[arg(long, value_enum, default_value_t = Form::Auto)]
    form: Form,
    /// Unit of length until the program sets one
    #[arg(long, value_enum, default_value_t = Length::Mm)]
    default_length: Length,
}

/// Form of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Form {
    /// JSON if it begins with a brace or bracket, XML if with `<`, else text.
    Auto,
    /// The call syntax of the specification.
    Text,
    /// JSON.
    Json,
    /// CRCL's XML.
    Xml,
}

impl Form {
    /// The form of a file, by its first character where it is not told.
    fn of(self, bytes: &[u8]) -> Self {
        let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
        match self {
            Self::Auto if crcl::xml::looks_like_xml(bytes) => Self::Xml,
            Self::Auto if first.is_some_and(|byte| matches!(byte, b'{' | b'[')) => Self::Json,
            Self::Auto => Self::Text,
            told => told,
        }
    }
}

/// Unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Length {
    /// The language's own default.
    Mm,
    /// For programs in metres without SetLengthUnits.
    Meter,
    /// Inch.
    Inch,
}

impl From<Length> for LengthUnit {
    fn from(length: Length) -> Self {
        match length {
            Length::Mm => Self::Millimeter,
            Length::Meter => Self::Meter,
            Length::Inch => Self::Inch,
        }
    }
}

/// A program that was read, with all findings so far.
pub(crate) struct ProgramFile {
    source: Source,
    reading: Reading,
    default_length: LengthUnit,
    form: Form,
}

impl ProgramArgument {
    /// The program at a path.
    pub(crate) fn new(path: &str, reading: &ReadingOptions) -> Self {
        Self {
            path: path.to_owned(),
            reading: reading.clone(),
        }
    }

    /// Reads and checks the program as far as that needs no robot.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] when the file cannot be read; errors of the program are findings.
    pub(crate) fn read(&self) -> Result<ProgramFile, Failure> {
        let bytes = input::bytes(&self.path)?;
        let name = if self.path == "-" {
            "standard input"
        } else {
            &self.path
        };
        let options = ReadOptions {
            strict: self.reading.strict,
            ..ReadOptions::default()
        };
        let form = self.reading.form.of(&bytes);
        let read = match form {
            Form::Json => crcl::json::read_bytes,
            Form::Xml => crcl::xml::read_bytes,
            Form::Auto | Form::Text => crcl::text::read_bytes,
        };
        let mut reading = read(&bytes, &options);
        let default_length = self.reading.default_length.into();
        // Errors after a syntax error may be its consequences.
        if !reading.findings.iter().any(is_unreadable) {
            let options = CheckOptions {
                strict: self.reading.strict,
                default_length,
            };
            reading
                .findings
                .extend(crcl::check(&reading.program, &options));
            reading.findings.sort_by_key(|finding| finding.span.start);
        }
        Ok(ProgramFile {
            source: Source::from_bytes(name, &bytes),
            reading,
            default_length,
            form,
        })
    }
}

impl ProgramFile {
    /// A program that came with a recording.
    pub(crate) fn given(given: &GivenProgram) -> Self {
        let bytes = given.text.as_bytes();
        let options = ReadOptions::default();
        let (form, reading) = match given.form.as_str() {
            "json" => (Form::Json, crcl::json::read_bytes(bytes, &options)),
            "xml" => (Form::Xml, crcl::xml::read_bytes(bytes, &options)),
            _ => (Form::Text, crcl::text::read_bytes(bytes, &options)),
        };
        Self {
            source: Source::from_bytes(&given.name, bytes),
            reading,
            default_length: given.length(),
            form,
        }
    }
}

/// The time of a clock that never jumps (s).
fn seconds() -> f64 {
    scheduling::now_ns() as f64 * 1e-9
}

impl ProgramFile {
    /// The program's commands.
    pub(crate) fn program(&self) -> &Program {
        &self.reading.program
    }

    /// Unit of length until the program sets one.
    pub(crate) fn default_length(&self) -> LengthUnit {
        self.default_length
    }

    /// The program as it is told to clients and recordings: the numbers of its commands, and the
    /// joints that it was planned from.
    pub(crate) fn given_as(&self, ids: &[u32], start: Option<Vec<f64>>) -> GivenProgram {
        GivenProgram {
            form: self.form_name().to_owned(),
            name: self.name().to_owned(),
            text: self.text().to_owned(),
            first: ids.first().copied().unwrap_or(0),
            last: ids.last().copied().unwrap_or(0),
            start,
            default_length: length_word(self.default_length).to_owned(),
        }
    }

    /// The name it is reported under.
    pub(crate) fn name(&self) -> &str {
        self.source.name()
    }

    /// The text.
    pub(crate) fn text(&self) -> &str {
        self.source.text()
    }

    /// The form that the program was read in.
    pub(crate) fn form(&self) -> Form {
        self.form
    }

    /// `json`, `xml` or `text`.
    pub(crate) fn form_name(&self) -> &'static str {
        match self.form {
            Form::Json => "json",
            Form::Xml => "xml",
            Form::Auto | Form::Text => "text",
        }
    }

    /// Writes findings about the program to standard error.
    pub(crate) fn report_findings(&self, findings: &[Finding]) {
        let look = look(io::stderr().is_terminal());
        let omitted = crcl::Omitted::default();
        let text = crcl::render(findings, omitted, &self.source, (look, 100));
        output::note(text.trim_end());
    }

    /// What is to be said about it.
    pub(crate) fn reading(&self) -> &Reading {
        &self.reading
    }

    /// Where findings point to.
    pub(crate) fn source(&self) -> &Source {
        &self.source
    }

    /// What the findings mean for the process.
    pub(crate) fn exit(&self) -> Exit {
        if self.reading.findings.iter().any(is_unreadable) {
            Exit::Unreadable
        } else if self.reading.has_errors() {
            Exit::Refused
        } else {
            Exit::Done
        }
    }

    /// Plans the program for a servo rate (Hz), from given joints or from home; commands that
    /// are refused are in the plan.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] when the robot cannot be planned for.
    pub(crate) fn plan(
        &self,
        robot: &Robot,
        rate_hz: f64,
        start: Option<Vec<f64>>,
        on_refusal: FailurePolicy,
    ) -> Result<Plan, Failure> {
        self.plan_from(robot, &self.options(rate_hz, start, on_refusal), None)
    }

    /// As [`Self::plan`], unless `earlier` begins where the arm stands.
    ///
    /// # Errors
    /// As [`Self::plan`].
    pub(crate) fn plan_from(
        &self,
        robot: &Robot,
        options: &PlanOptions,
        earlier: Option<Plan>,
    ) -> Result<Plan, Failure> {
        plan_from(robot, &self.reading.program, options, earlier)
            .map_err(|error| Failure::new(Exit::Unreadable, error))
    }

    /// How the program is planned.
    pub(crate) fn options(
        &self,
        rate_hz: f64,
        start: Option<Vec<f64>>,
        on_refusal: FailurePolicy,
    ) -> PlanOptions {
        PlanOptions {
            rate_hz,
            default_length: self.default_length,
            on_refusal,
            start,
            clock: seconds,
        }
    }

    /// Adds the errors of the program with a robot. A command that already has an error is not
    /// reported again; wrong order is reported only if no other error explains it.
    pub(crate) fn add_refusals(&mut self, refusals: &[Refusal]) {
        let explained = self.reading.has_errors();
        let findings = &mut self.reading.findings;
        for refusal in refusals {
            let known = findings.iter().any(|finding| {
                finding.is_error()
                    && finding.span.start < refusal.span.end
                    && refusal.span.start < finding.span.end.max(finding.span.start + 1)
            });
            let repeats = explained && refusal.error.class == ErrorClass::Sequence;
            if !(known || repeats) {
                findings.push(finding(refusal));
            }
        }
        findings.sort_by_key(|finding| finding.span.start);
    }

    /// Findings as text for a terminal or file, with a last line that counts them.
    pub(crate) fn shown(&self, look: Look) -> String {
        let width = 100;
        crcl::render(
            &self.reading.findings,
            self.reading.omitted,
            &self.source,
            (look, width),
        )
    }

    /// Writes all findings to standard error.
    pub(crate) fn report(&self) {
        if !self.reading.findings.is_empty() {
            let look = look(io::stderr().is_terminal());
            // A closed standard error cannot be reported.
            let _ = write!(io::stderr(), "{}", self.shown(look));
        }
    }

    /// Writes a refusal of the planner to standard error.
    pub(crate) fn report_refusal(&self, refusal: &Refusal) {
        self.report_findings(&[finding(refusal)]);
    }
}

/// How findings look on a terminal or elsewhere.
pub(crate) fn look(terminal: bool) -> Look {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    match (terminal, plain) {
        (false, _) => Look::Plain,
        (true, true) => Look::Monochrome,
        (true, false) => Look::Colour,
    }
}

/// A refusal as a finding about its command.
fn finding(refusal: &Refusal) -> Finding {
    let code = match refusal.error.class {
        ErrorClass::Range => "engine::range",
        ErrorClass::Parse => "engine::parse",
        ErrorClass::Sequence => "engine::sequence",
        ErrorClass::GripperUse => "engine::gripper-use",
        ErrorClass::ToolChange => "engine::tool-change",
        ErrorClass::Motion => "engine::motion",
    };
    let message = format!("{}: {}", refusal.name, refusal.error.message);
    let finding = Finding::error(code, refusal.span.clone(), message);
    match &refusal.error.help {
        Some(help) => finding.help(help),
        None => finding,
    }
}

/// Whether a finding is a syntax error.
fn is_unreadable(finding: &Finding) -> bool {
    const FORM: [&str; 32] = [
        code::BINARY,
        code::NOT_UTF8,
        code::CHARACTER,
        code::COMMENT,
        code::TEXT,
        code::ESCAPE,
        code::NUMBER,
        code::NOT_A_COMMAND,
        code::PARENTHESES,
        code::UNKNOWN_COMMAND,
        code::UNCLOSED,
        code::BRACKET,
        code::SURPLUS_BRACKET,
        code::COMMA,
        code::SURPLUS_COMMA,
        code::TOO_DEEP,
        code::ARGUMENT_COUNT,
        code::ARGUMENT_TYPE,
        code::POSE_SHAPE,
        code::JSON_SYNTAX,
        code::MISSING_FIELD,
        code::UNKNOWN_FIELD,
        code::SCHEMA_VERSION,
        code::XML_SYNTAX,
        code::XML_ROOT,
        code::XML_ELEMENT,
        code::XML_MISSING,
        code::XML_TEXT,
        code::XML_KIND,
        code::XML_VALUE,
        code::LOOP,
        code::NO_FORM,
    ];
    finding.is_error() && FORM.contains(&finding.code)
}

//! The JSON form of programs: `{"schema": 1, "commands": [{"command": "Dwell", "seconds": 0.5}]}`.

use std::borrow::Cow;
use std::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::command::{Argument, ArgumentKind, Command, CommandInfo, Value};
use crate::fields::{Field, fields, items};
use crate::finding::{Finding, Findings, code};
use crate::joint::JointTarget;
use crate::lexer::clip;
use crate::meaning::{doubt, refused_extension, unknown_command, unknown_name, value_finding};
use crate::pose::{Pose, PosePart};
use crate::program::{Located, Program, ReadOptions, Reading};
use crate::source::Walker;
use crate::suggest;
use crate::text;
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};
use crate::value::{ValueError, check_targets};

/// The version of the JSON form that is read and written.
pub const SCHEMA: u32 = 1;

/// The JSON form as types, for the schema.
#[derive(JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Canonical robot program")]
struct Document {
    /// Where the schema of this file is found, for editors.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    location: Option<String>,
    /// Version of this form.
    #[schemars(range(min = 1, max = 1))]
    schema: u32,
    /// The commands, in order.
    commands: Vec<Command>,
}

/// The JSON Schema (draft 2020-12) of the JSON form.
///
/// ```
/// let schema = crcl::json::schema();
/// assert_eq!(schema["title"], "Canonical robot program");
/// ```
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Document).into()
}

/// Writes a program in JSON form, one command per line.
///
/// Reading it again gives the same commands, provided that all numbers are finite; others become
/// `null`, which is refused by the reader.
///
/// ```
/// use crcl::{Command, Program, json};
/// let program: Program = [Command::Dwell { seconds: 0.5 }].into_iter().collect();
/// let text = json::write(&program);
/// assert!(text.contains(r#"{"command":"Dwell","seconds":0.5}"#));
/// ```
pub fn write(program: &Program) -> String {
    let line = |command| serde_json::to_string(command).unwrap_or_else(|_| "null".to_owned());
    let lines: Vec<_> = program.iter().map(line).collect();
    if lines.is_empty() {
        return format!("{{\n  \"schema\": {SCHEMA},\n  \"commands\": []\n}}\n");
    }
    let commands = lines.join(",\n    ");
    format!("{{\n  \"schema\": {SCHEMA},\n  \"commands\": [\n    {commands}\n  ]\n}}\n")
}

/// Reads a program in JSON form: every command that can be read, and every fault. JSON that is
/// not well formed gives one finding and no command.
///
/// ```
/// use crcl::{Command, ReadOptions, json};
/// let source = r#"{"schema": 1, "commands": [{"command": "Dwell", "seconds": 0.5}]}"#;
/// let reading = json::read(source, &ReadOptions::default());
/// assert_eq!(reading.program.commands[0].command, Command::Dwell { seconds: 0.5 });
/// ```
pub fn read(source: &str, options: &ReadOptions) -> Reading {
    let mut findings = Findings::new(options.max_findings);
    let mut program = Program::default();
    match serde_json::from_str::<&RawValue>(source.trim_start_matches('\u{FEFF}')) {
        Err(error) => findings.push(syntax(source, &error)),
        Ok(document) => {
            let strict = options.strict;
            Reader {
                source,
                strict,
                findings: &mut findings,
            }
            .document(document, &mut program);
        }
    }
    findings.into_reading(program)
}

/// Reads a program in JSON form from the bytes of a file, which may be anything.
///
/// Bytes that are not UTF-8 text give one finding; [`crate::Source::from_bytes`] fits its span.
pub fn read_bytes(bytes: &[u8], options: &ReadOptions) -> Reading {
    match text::decode(bytes) {
        Ok(source) => read(source, options),
        Err(finding) => {
            let mut findings = Findings::new(options.max_findings);
            findings.push(*finding);
            findings.into_reading(Program::default())
        }
    }
}

/// The finding for text that is not JSON.
fn syntax(source: &str, error: &serde_json::Error) -> Finding {
    let full = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    let message = full.strip_suffix(&place).unwrap_or(&full);
    let mark = if source.starts_with('\u{FEFF}') {
        '\u{FEFF}'.len_utf8()
    } else {
        0
    };
    let body = source.get(mark..).unwrap_or_default();
    let lines = body
        .split_inclusive('\n')
        .take(error.line().saturating_sub(1));
    let start = mark + lines.map(str::len).sum::<usize>();
    let mut at = (start + error.column().saturating_sub(1)).min(source.len());
    while !source.is_char_boundary(at) {
        at -= 1;
    }
    let length = source
        .get(at..)
        .and_then(|rest| rest.chars().next())
        .map_or(0, char::len_utf8);
    let finding = Finding::error(
        code::JSON_SYNTAX,
        at..at + length,
        format!("not JSON: {message}"),
    );
    let help = match message {
        _ if message.contains("trailing comma") => "delete the comma before the closing bracket",
        _ if error.is_eof() => "a bracket or a quote is not closed",
        _ => "a program is `{\"schema\": 1, \"commands\": [...]}`",
    };
    finding.help(help)
}

/// Reads meaning into JSON values; each knows its place by where it lies in the source.
struct Reader<'a, 'f> {
    source: &'a str,
    strict: bool,
    findings: &'f mut Findings,
}

impl<'a> Reader<'a, '_> {
    fn document(&mut self, document: &'a RawValue, program: &mut Program) {
        let Some(fields) = self.fields("a program", document) else {
            return;
        };
        self.known("a program", &fields, &["$schema", "schema", "commands"]);
        if let Some(version) = self.wanted("a program", document, &fields, "schema") {
            self.version(version);
        }
        let Some(commands) = self.wanted("a program", document, &fields, "commands") else {
            return;
        };
        let Some(commands) = self.items("the commands", commands) else {
            return;
        };
        let mut walker = Walker::new(self.source);
        for raw in commands {
            if let Some(command) = self.command(raw) {
                let span = self.span(raw);
                let (line, column) = walker.position(span.start);
                program.commands.push(Located {
                    command,
                    span,
                    line,
                    column,
                });
            }
        }
    }

    fn version(&mut self, version: &RawValue) {
        if version.get() != SCHEMA.to_string() {
            let message = format!("this is schema {}, not {SCHEMA}", clip(version.get()));
            let finding = Finding::error(code::SCHEMA_VERSION, self.span(version), message);
            let found = describe(version);
            self.findings
                .push(finding.expected(format!("`{SCHEMA}`")).found(found));
        }
    }

    fn command(&mut self, raw: &'a RawValue) -> Option<Command> {
        let fields = self.fields("a command", raw)?;
        let name = self.wanted("a command", raw, &fields, "command")?;
        let text = self.text("the name of a command", name)?;
        let Some(info) = CommandInfo::find(&text) else {
            self.findings.push(unknown_command(&text, self.span(name)));
            return None;
        };
        let refused = refused_extension(info, self.span(name)).filter(|_| self.strict);
        let argument = info.argument.map_or("command", |argument| argument.name);
        let known = self.known(info.name, &fields, &["command", argument]) && refused.is_none();
        self.findings.extend(refused);
        let value = match info.argument {
            None => Some(Value::None),
            Some(Argument { name, kind }) => {
                let value = self.wanted(info.name, raw, &fields, name)?;
                self.value(kind, value)
            }
        }?;
        info.build(value).filter(|_| known)
    }

    fn value(&mut self, kind: ArgumentKind, raw: &'a RawValue) -> Option<Value> {
        match kind {
            ArgumentKind::Reason | ArgumentKind::Flag => self.integer(kind, raw),
            ArgumentKind::Text => self
                .text(kind.noun(), raw)
                .map(|t| Value::Text(t.into_owned())),
            ArgumentKind::LengthUnit | ArgumentKind::AngleUnit | ArgumentKind::Frame => {
                self.named(kind, raw)
            }
            ArgumentKind::Pose => self.pose(raw).map(Value::Pose),
            ArgumentKind::Poses => self.poses(raw).map(Value::Poses),
            ArgumentKind::Joints => self.joints(raw).map(Value::Joints),
            _ => self.quantity(kind, raw),
        }
    }

    fn quantity(&mut self, kind: ArgumentKind, raw: &RawValue) -> Option<Value> {
        let number = self.number(kind.noun(), raw)?;
        self.in_range(kind, number, raw);
        self.findings.extend(doubt(kind, number, self.span(raw)));
        Some(Value::Number(number))
    }

    fn integer(&mut self, kind: ArgumentKind, raw: &RawValue) -> Option<Value> {
        let number = self.number(kind.noun(), raw)?;
        let Ok(integer) = raw.get().parse::<i64>() else {
            return self.wrong_type(kind.noun(), "a whole number", raw);
        };
        self.in_range(kind, number, raw);
        Some(Value::Integer(integer))
    }

    fn in_range(&mut self, kind: ArgumentKind, number: f64, raw: &RawValue) {
        if let Err(error) = kind.check(number) {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
    }

    fn named(&mut self, kind: ArgumentKind, raw: &'a RawValue) -> Option<Value> {
        let name = self.text(kind.noun(), raw)?;
        let value = match kind {
            ArgumentKind::LengthUnit => LengthUnit::from_name(&name).map(Value::LengthUnit),
            ArgumentKind::AngleUnit => AngleUnit::from_name(&name).map(Value::AngleUnit),
            _ => CoordinateFrame::from_name(&name).map(Value::Frame),
        };
        if value.is_none() {
            self.findings
                .push(unknown_name(kind, &name, self.span(raw)));
        }
        value
    }

    fn joints(&mut self, raw: &'a RawValue) -> Option<Vec<JointTarget>> {
        let items = self.items("the joints", raw)?;
        let read: Vec<_> = items.into_iter().map(|item| self.joint(item)).collect();
        let joints = read.into_iter().collect::<Option<Vec<_>>>()?;
        if let Err(error) = check_targets(&joints) {
            self.findings.push(value_finding(&error, self.span(raw)));
        }
        Some(joints)
    }

    fn joint(&mut self, raw: &'a RawValue) -> Option<JointTarget> {
        const NAMES: [&str; 4] = ["joint", "position", "speed", "acceleration"];
        let noun = "the target of a joint";
        let fields = self.fields(noun, raw)?;
        let known = self.known(noun, &fields, &NAMES);
        let joint = self.wanted(noun, raw, &fields, "joint")?;
        let position = self.wanted(noun, raw, &fields, "position")?;
        let numbers = [
            Some(joint),
            Some(position),
            find(&fields, "speed"),
            find(&fields, "acceleration"),
        ]
        .map(|field| {
            field.map_or(Some(0.0), |field| {
                self.number("a part of a joint's target", field)
            })
        });
        let numbers = numbers.into_iter().collect::<Option<Vec<_>>>()?;
        let target = JointTarget::from_numbers(&numbers);
        if target.is_none() {
            let message = "a joint is a whole number from 1 to 16";
            let finding = Finding::error(code::JOINTS, self.span(joint), message);
            self.findings.push(finding.found(describe(joint)));
        }
        target.filter(|_| known)
    }

    fn poses(&mut self, raw: &'a RawValue) -> Option<Vec<Pose>> {
        let items = self.items("the poses", raw)?;
        if items.is_empty() {
            self.findings
                .push(value_finding(&ValueError::NoPoses, self.span(raw)));
            return None;
        }
        let mut poses = Vec::with_capacity(items.len());
        for &item in &items {
            poses.extend(self.pose(item));
        }
        (poses.len() == items.len()).then_some(poses)
    }

    fn pose(&mut self, raw: &'a RawValue) -> Option<Pose> {
        const NAMES: [&str; 6] = ["point", "z_axis", "x_axis", "roll", "pitch", "yaw"];
        let fields = self.fields("a pose", raw)?;
        let angles = NAMES[3..].iter().any(|name| find(&fields, name).is_some());
        let axes = NAMES[1..3].iter().any(|name| find(&fields, name).is_some());
        let known = self.known("a pose", &fields, &NAMES);
        if angles && axes {
            let message = "a pose has axes or angles, not both";
            let finding = Finding::error(code::POSE_SHAPE, self.opening(raw), message);
            let help = "keep `z_axis` and `x_axis`, or `roll`, `pitch` and `yaw`";
            self.findings.push(finding.help(help));
            return None;
        }
        let pose = if angles {
            self.angles_pose(raw, &fields)
        } else {
            self.axes_pose(raw, &fields)
        };
        let pose = pose?;
        for (part, error) in pose.faults() {
            let span = self.part(raw, &fields, part);
            self.findings.push(value_finding(&error, span));
        }
        known.then_some(pose)
    }

    fn axes_pose(&mut self, raw: &'a RawValue, fields: &[Field<'a>]) -> Option<Pose> {
        let point = self.vector(raw, fields, "point");
        let z_axis = self.vector(raw, fields, "z_axis");
        let x_axis = self.vector(raw, fields, "x_axis");
        Some(Pose::Axes {
            point: point?,
            z_axis: z_axis?,
            x_axis: x_axis?,
        })
    }

    fn angles_pose(&mut self, raw: &'a RawValue, fields: &[Field<'a>]) -> Option<Pose> {
        let point = self.vector(raw, fields, "point");
        let [roll, pitch, yaw] = ["roll", "pitch", "yaw"].map(|name| {
            let angle = self.wanted("a pose", raw, fields, name)?;
            self.number("an angle", angle)
        });
        Some(Pose::RollPitchYaw {
            point: point?,
            roll: roll?,
            pitch: pitch?,
            yaw: yaw?,
        })
    }

    /// Where a part of a pose stands.
    fn part(&self, raw: &RawValue, fields: &[Field<'a>], part: PosePart) -> Range<usize> {
        let name = match part {
            PosePart::Point => "point",
            PosePart::ZAxis => "z_axis",
            PosePart::XAxis => "x_axis",
            PosePart::Axes | PosePart::Angles => return self.span(raw),
        };
        find(fields, name).map_or_else(|| self.span(raw), |value| self.span(value))
    }

    fn vector(
        &mut self,
        pose: &'a RawValue,
        fields: &[Field<'a>],
        name: &'static str,
    ) -> Option<[f64; 3]> {
        let raw = self.wanted("a pose", pose, fields, name)?;
        let items = self.items(name, raw)?;
        let &[x, y, z] = items.as_slice() else {
            let message = format!("`{name}` has three numbers");
            let finding = Finding::error(code::POSE_SHAPE, self.span(raw), message);
            let found = format!("a list of {}", items.len());
            self.findings
                .push(finding.expected("`[x, y, z]`").found(found));
            return None;
        };
        let numbers = [x, y, z].map(|item| self.number("a part of a pose", item));
        Some([numbers[0]?, numbers[1]?, numbers[2]?])
    }

    fn number(&mut self, noun: &str, raw: &RawValue) -> Option<f64> {
        let written = raw.get();
        if !written.starts_with(|c: char| c == '-' || c.is_ascii_digit()) {
            return self.wrong_type(noun, "a number", raw);
        }
        let number = written
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite());
        if number.is_none() {
            let message = format!("`{}` is too large for a number", clip(written));
            self.findings
                .push(Finding::error(code::OVERFLOW, self.span(raw), message));
        }
        number
    }

    fn text(&mut self, noun: &str, raw: &'a RawValue) -> Option<Cow<'a, str>> {
        if !raw.get().starts_with('"') {
            return self.wrong_type(noun, "a text", raw);
        }
        match serde_json::from_str::<String>(raw.get()) {
            Ok(text) => Some(Cow::Owned(text)),
            Err(_) => self.wrong_type(noun, "a text of whole characters", raw),
        }
    }

    fn fields(&mut self, noun: &str, raw: &'a RawValue) -> Option<Vec<Field<'a>>> {
        let found = fields(raw);
        if found.is_none() && raw.get().starts_with('{') {
            let message = "a field name in this object has a broken escape";
            self.findings.push(Finding::error(
                code::JSON_SYNTAX,
                self.opening(raw),
                message,
            ));
        } else if found.is_none() {
            return self.wrong_type(noun, "an object in `{}`", raw);
        }
        found
    }

    fn items(&mut self, noun: &str, raw: &'a RawValue) -> Option<Vec<&'a RawValue>> {
        let found = items(raw);
        if found.is_none() {
            return self.wrong_type(noun, "a list in `[]`", raw);
        }
        found
    }

    fn wrong_type<T>(&mut self, noun: &str, expected: &str, raw: &RawValue) -> Option<T> {
        let message = format!("{noun} must be {expected}");
        let finding = Finding::error(code::ARGUMENT_TYPE, self.span(raw), message);
        self.findings
            .push(finding.expected(expected).found(describe(raw)));
        None
    }

    /// The value of a field that must be there.
    fn wanted(
        &mut self,
        noun: &str,
        object: &RawValue,
        fields: &[Field<'a>],
        name: &str,
    ) -> Option<&'a RawValue> {
        let value = find(fields, name);
        if value.is_none() {
            let message = format!("{noun} needs the field \"{name}\"");
            let finding = Finding::error(code::MISSING_FIELD, self.opening(object), message);
            let found: Vec<_> = fields
                .iter()
                .map(|f| format!("\"{}\"", clip(&f.name)))
                .collect();
            let found = if found.is_empty() {
                "no field".to_owned()
            } else {
                found.join(", ")
            };
            self.findings
                .push(finding.expected(format!("\"{name}\"")).found(clip(&found)));
        }
        value
    }

    /// Whether all fields are known and none comes twice; reports those that are not.
    fn known(&mut self, noun: &str, fields: &[Field<'a>], names: &[&'static str]) -> bool {
        let before = self.findings.total();
        let mut seen: Vec<&str> = Vec::new();
        for field in fields {
            let span = self.key(field);
            let name = field.name.as_ref();
            if !names.contains(&name) {
                let message = format!("{noun} has no field \"{}\"", clip(name));
                let finding = Finding::error(code::UNKNOWN_FIELD, span, message);
                self.findings.push(match suggest::nearest(name, names) {
                    Some(near) => finding.help(format!("did you mean \"{near}\"?")),
                    None => finding.help("delete it"),
                });
            } else if seen.contains(&name) {
                let message = format!("the field \"{name}\" comes twice");
                let finding = Finding::error(code::DUPLICATE_FIELD, span, message);
                self.findings.push(finding.help("keep one of them"));
            } else {
                seen.push(name);
            }
        }
        self.findings.total() == before
    }

    /// Bytes of the source that a value takes.
    fn span(&self, raw: &RawValue) -> Range<usize> {
        self.place(raw.get())
    }

    /// The first byte of a value, for findings about something that it lacks.
    fn opening(&self, raw: &RawValue) -> Range<usize> {
        let start = self.span(raw).start;
        start..start + 1
    }

    /// Bytes of the source that a field's name takes; its value's first byte when the name is
    /// written with escapes.
    fn key(&self, field: &Field<'a>) -> Range<usize> {
        match &field.name {
            Cow::Borrowed(name) => self.place(name),
            Cow::Owned(_) => self.opening(field.value),
        }
    }

    /// Where a part of the source lies in it.
    fn place(&self, part: &str) -> Range<usize> {
        let start = (part.as_ptr() as usize).saturating_sub(self.source.as_ptr() as usize);
        start..(start + part.len()).min(self.source.len())
    }
}

fn find<'a>(fields: &[Field<'a>], name: &str) -> Option<&'a RawValue> {
    fields
        .iter()
        .find(|field| field.name == name)
        .map(|field| field.value)
}

/// A description of a JSON value, for "found".
fn describe(raw: &RawValue) -> String {
    let written = raw.get();
    match written.chars().next() {
        Some('{') => "an object".to_owned(),
        Some('[') => "a list".to_owned(),
        Some('"') => format!("the text {}", clip(written)),
        Some('t' | 'f' | 'n') => format!("`{written}`"),
        _ => format!("the number `{}`", clip(written)),
    }
}

//! The text form of programs: the C++ calls of NIST's files.

use crate::argument::Value;
use crate::code;
use crate::command::Command;
use crate::finding::{Finding, Findings};
use crate::guard::{Guard, GuardEnding};
use crate::joint::JointTarget;
use crate::meaning::Meaning;
use crate::parser::Parser;
use crate::pose::Pose;
use crate::pose_and_set::PoseAndSet;
use crate::program::{Located, Program, ReadOptions, Reading};
use crate::screw::Screw;
use crate::source::Walker;

/// Reads a program in text form: every command that can be read, and every fault.
///
/// ```
/// use crcl::{Command, ReadOptions, text};
/// let reading = text::read("InitCanon ()\nDwel (0.5)\nEndCanon (0)\n", &ReadOptions::default());
/// assert_eq!(reading.program.commands.len(), 2);
/// assert_eq!(reading.findings[0].help.as_deref(), Some("did you mean `Dwell`?"));
/// ```
pub fn read(source: &str, options: &ReadOptions) -> Reading {
    let mut findings = Findings::new(options.max_findings);
    let mut walker = Walker::new(source);
    let mut program = Program::default();
    let mut parser = Parser::new(source, &mut findings);
    while let Some(call) = parser.next_call() {
        let mut meaning = Meaning {
            source,
            strict: options.strict,
            findings: parser.findings,
        };
        if let Some(command) = meaning.command(&call) {
            let (line, column) = walker.position(call.span.start);
            program.commands.push(Located {
                command,
                span: call.span,
                line,
                column,
            });
        }
    }
    findings.into_reading(program)
}

/// Reads a program in text form from the bytes of a file, which may be anything.
///
/// Bytes that are not UTF-8 text give one finding; [`crate::Source::from_bytes`] fits its span.
pub fn read_bytes(bytes: &[u8], options: &ReadOptions) -> Reading {
    decoded(bytes, options, read)
}

/// Reads bytes as text with the reader of a form; bytes that are not text give one finding.
pub(crate) fn decoded(
    bytes: &[u8],
    options: &ReadOptions,
    read: impl FnOnce(&str, &ReadOptions) -> Reading,
) -> Reading {
    match decode(bytes) {
        Ok(source) => read(source, options),
        Err(finding) => {
            let mut findings = Findings::new(options.max_findings);
            findings.push(*finding);
            findings.into_reading(Program::default())
        }
    }
}

/// The bytes as text, or the finding that says why they are none.
fn decode(bytes: &[u8]) -> Result<&str, Box<Finding>> {
    /// A NUL byte so far to the front tells a binary file.
    const LOOK: usize = 8192;
    if bytes.iter().take(LOOK).any(|&byte| byte == 0) {
        let utf16 = bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]);
        let kind = if utf16 {
            "UTF-16 text"
        } else {
            "a binary file"
        };
        let finding = Finding::error(code::BINARY, 0..0, format!("this is {kind}, not a program"));
        let help = if utf16 {
            "save it as UTF-8"
        } else {
            "give a program as text or JSON"
        };
        return Err(Box::new(
            finding.expected("UTF-8 text").found(kind).help(help),
        ));
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        let byte = bytes.get(at).copied().unwrap_or_default();
        let span = at..at + char::REPLACEMENT_CHARACTER.len_utf8();
        let message = format!("byte 0x{byte:02X} is not UTF-8 text");
        let finding = Finding::error(code::NOT_UTF8, span, message);
        Box::new(
            finding
                .expected("UTF-8 text")
                .help("save the file as UTF-8"),
        )
    })
}

/// Writes a program in text form, one command per line, longer lists over several lines.
///
/// Reading it again gives the same commands, provided that all numbers are finite.
///
/// ```
/// use crcl::{Command, Program, text};
/// let program: Program = [Command::InitCanon, Command::Dwell { seconds: 0.5 }].into_iter().collect();
/// assert_eq!(text::write(&program), "InitCanon ()\nDwell (0.5)\n");
/// ```
pub fn write(program: &Program) -> String {
    program
        .iter()
        .map(|command| write_command(command) + "\n")
        .collect()
}

/// Writes one command in text form, without a line end after it.
pub fn write_command(command: &Command) -> String {
    let (name, value) = command.parts();
    let argument = match value {
        Value::None => String::new(),
        Value::Integer(integer) => integer.to_string(),
        Value::Number(value) => number(value),
        Value::Text(text) => quote(&text),
        Value::LengthUnit(unit) => quote(unit.name()),
        Value::AngleUnit(unit) => quote(unit.name()),
        Value::Frame(frame) => quote(frame.name()),
        Value::Pose(value) => pose(&value),
        Value::Poses(poses) => list(&poses),
        Value::Joints(joints) => joint_list(&joints),
        Value::Screw(screw) => screw_parts(&screw),
        Value::Guard(guard) => guard_parts(&guard),
        Value::Waypoints(waypoints) => waypoint_list(&waypoints),
    };
    format!("{name} ({argument})")
}

fn list(poses: &[Pose]) -> String {
    let lines: Vec<_> = poses.iter().map(pose).collect();
    format!("{{{}}}, {}", lines.join(",\n    "), poses.len())
}

fn joint_list(joints: &[JointTarget]) -> String {
    let one = |joint: &JointTarget| {
        let numbers: Vec<_> = joint.numbers().into_iter().map(number).collect();
        format!("{{{}}}", numbers.join(", "))
    };
    let all: Vec<_> = joints.iter().map(one).collect();
    format!("{{{}}}", all.join(", "))
}

fn waypoint_list(waypoints: &[PoseAndSet]) -> String {
    let one = |waypoint: &PoseAndSet| {
        let settings = PoseAndSet::NAMES.into_iter().zip(waypoint.values());
        let told = settings.filter_map(|(name, value)| {
            value.map(|value| format!("{{{}, {}}}", quote(name), number(value)))
        });
        let parts: Vec<_> = [pose(&waypoint.pose)].into_iter().chain(told).collect();
        format!("{{{}}}", parts.join(", "))
    };
    let all: Vec<_> = waypoints.iter().map(one).collect();
    format!("{{{}}}", all.join(",\n    "))
}

fn guard_parts(guard: &Guard) -> String {
    let (sensor, limit) = (quote(&guard.sensor), quote(guard.limit.name()));
    let mut parts = vec![sensor, limit, number(guard.value)];
    if guard.ending != GuardEnding::Done {
        parts.push(quote(guard.ending.name()));
    }
    format!("{{{}}}", parts.join(", "))
}

fn screw_parts(screw: &Screw) -> String {
    let numbers: Vec<_> = screw.numbers().into_iter().map(number).collect();
    let mut parts = vec![format!("{{{}}}", numbers.join(", "))];
    let point = screw.axis_point.as_ref();
    parts.extend(point.map(|point| format!("{{{}}}", three(point))));
    parts.extend(screw.start.as_ref().map(pose));
    format!("{{{}}}", parts.join(", "))
}

fn pose(pose: &Pose) -> String {
    match pose {
        Pose::Axes {
            point,
            z_axis,
            x_axis,
        } => {
            format!(
                "{{{{{}}}, {{{}}}, {{{}}}}}",
                three(point),
                three(z_axis),
                three(x_axis)
            )
        }
        Pose::RollPitchYaw {
            point,
            roll,
            pitch,
            yaw,
        } => {
            let angles = three(&[*roll, *pitch, *yaw]);
            format!("Pose(Point({}), RollPitchYaw({angles}))", three(point))
        }
    }
}

fn three(numbers: &[f64; 3]) -> String {
    numbers.map(number).join(", ")
}

/// The shortest text that reads back as the same number.
fn number(number: f64) -> String {
    let text = format!("{number:?}");
    text.strip_suffix(".0")
        .map_or_else(|| text.clone(), str::to_owned)
}

fn quote(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for character in text.chars() {
        match character {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            '\n' => quoted.push_str("\\n"),
            '\r' => quoted.push_str("\\r"),
            '\t' => quoted.push_str("\\t"),
            _ if character.is_control() => {
                quoted.push_str(&format!("\\u{:04X}", u32::from(character)));
            }
            _ => quoted.push(character),
        }
    }
    quoted.push('"');
    quoted
}

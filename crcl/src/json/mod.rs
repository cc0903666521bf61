//! The JSON form of programs: `{"schema": 1, "commands": [{"command": "Dwell", "seconds": 0.5}]}`.

mod document;
mod guard;
mod reader;
mod values;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::code;
use crate::command::Command;
use crate::finding::{Finding, Findings};
use crate::program::{Program, ReadOptions, Reading};
use crate::text;
use reader::Reader;

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
    text::decoded(bytes, options, read)
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

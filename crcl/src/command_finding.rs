//! Findings about commands that text, JSON and XML have in common.

use std::ops::Range;

use crate::argument::ArgumentKind;
use crate::code;
use crate::command_info::{COMMANDS, CommandInfo, Standing};
use crate::finding::Finding;
use crate::lexer::clip;
use crate::suggest;
use crate::units::{AngleUnit, CoordinateFrame, LengthUnit};
use crate::value::ValueError;

/// The finding for a value out of range.
pub(crate) fn value_finding(error: &ValueError, span: Range<usize>) -> Finding {
    Finding::error(error.code(), span, error.to_string()).help(error.help())
}

/// A percentage that was probably meant as a fraction.
pub(crate) fn doubt(kind: ArgumentKind, number: f64, span: Range<usize>) -> Option<Finding> {
    let small = kind == ArgumentKind::Percent && 0.0 < number && number < 1.0;
    small.then(|| {
        let message = format!("{number} percent is very little: the range is 0 to 100");
        let help = format!(
            "for {number} of the maximum write `{}`",
            shortest(number * 100.0)
        );
        Finding::warning(code::FRACTION, span, message).help(help)
    })
}

/// A number in as few digits as its first nine need.
fn shortest(number: f64) -> f64 {
    format!("{number:.9e}").parse().unwrap_or(number)
}

/// The finding for a name that is not a command.
pub(crate) fn unknown_command(name: &str, span: Range<usize>) -> Finding {
    let names: Vec<_> = COMMANDS.iter().map(|info| info.name).collect();
    let message = format!("there is no command `{}`", clip(name));
    let finding = Finding::error(code::UNKNOWN_COMMAND, span, message)
        .expected("the name of a command")
        .found(format!("`{}`", clip(name)));
    match suggest::advice(name, &names) {
        Some(advice) => finding.help(advice),
        None => finding,
    }
}

/// The finding of strict mode for an extension; nothing for a standard command.
pub(crate) fn refused_extension(info: &CommandInfo, span: Range<usize>) -> Option<Finding> {
    let Standing::Extension { instead } = info.standing else {
        return None;
    };
    let message = format!("{} is not in the standard language", info.name);
    let finding = Finding::error(code::EXTENSION, span, message);
    Some(match instead {
        Some(standard) => finding.help(format!("the standard command is {standard}")),
        None => finding.help("no standard command does the same; read without strict mode"),
    })
}

/// The finding for a unit or frame that is none of those to choose from.
pub(crate) fn unknown_name(kind: ArgumentKind, name: &str, span: Range<usize>) -> Finding {
    let (code, names) = match kind {
        ArgumentKind::LengthUnit => (code::UNKNOWN_UNIT, LengthUnit::NAMES),
        ArgumentKind::AngleUnit => (code::UNKNOWN_UNIT, AngleUnit::NAMES),
        _ => (code::UNKNOWN_FRAME, CoordinateFrame::NAMES),
    };
    let choices: Vec<_> = names.iter().map(|name| format!("\"{name}\"")).collect();
    let noun = kind
        .noun()
        .trim_start_matches("an ")
        .trim_start_matches("a ");
    let message = format!("there is no {noun} \"{}\"", clip(name));
    let finding = Finding::error(code, span, message)
        .expected(format!("one of {}", choices.join(", ")))
        .found(format!("\"{}\"", clip(name)));
    match unit_advice(kind, name).or_else(|| suggest::nearest(name, names)) {
        Some(near) => finding.help(format!("did you mean \"{near}\"?")),
        None => finding,
    }
}

/// Abbreviations and plurals that people write.
fn unit_advice(kind: ArgumentKind, name: &str) -> Option<&'static str> {
    let name = name.to_lowercase();
    match (kind, name.as_str()) {
        (ArgumentKind::LengthUnit, "m" | "meters" | "metres") => Some("meter"),
        (ArgumentKind::LengthUnit, "in" | "inches" | "\"") => Some("inch"),
        (ArgumentKind::LengthUnit, "millimeters" | "millimetres" | "mms") => Some("mm"),
        (ArgumentKind::AngleUnit, "deg" | "degs" | "degrees") => Some("degree"),
        (ArgumentKind::AngleUnit, "rad" | "rads" | "radians") => Some("radian"),
        _ => None,
    }
}

//! Programs in each style that is in use: they are read, or every error is found.
#![allow(missing_docs, reason = "a test")]

use crcl::{ReadOptions, Reading, code, json, text};

fn read(source: &str) -> Reading {
    text::read(source, &ReadOptions::default())
}

/// Written by a viewer, by a plan executor, and by hand with all that the language has.
#[test]
fn every_dialect_is_read() {
    let programs = [
        (include_str!("data/viewer.canon"), 13),
        (include_str!("data/executor.canon"), 11),
        (include_str!("data/modern.canon"), 13),
    ];
    for (source, commands) in programs {
        let reading = read(source);
        assert_eq!(reading.findings, []);
        assert_eq!(reading.program.commands.len(), commands);
        let again = read(&text::write(&reading.program));
        let commands = |reading: &Reading| -> Vec<crcl::Command> {
            let located = reading.program.commands.iter();
            located.map(|located| located.command.clone()).collect()
        };
        assert_eq!(
            commands(&again),
            commands(&reading),
            "written and read again"
        );
    }
}

/// The same program as text and as JSON is the same list of commands.
#[test]
fn json_and_text_say_the_same() {
    let from_text = read(include_str!("data/modern.canon"));
    let from_json = json::read(include_str!("data/modern.json"), &ReadOptions::default());
    assert_eq!(from_json.findings, []);
    let pairs = from_text
        .program
        .commands
        .iter()
        .zip(&from_json.program.commands);
    for (one, other) in pairs {
        assert_eq!(one.command, other.command);
    }
    assert_eq!(
        from_text.program.commands.len(),
        from_json.program.commands.len()
    );
}

/// Each fault of a program is found, in the order of the text, and none hides another.
#[test]
fn every_fault_is_found() {
    let reading = read(include_str!("data/faulty.canon"));
    let codes: Vec<_> = reading
        .findings
        .iter()
        .map(|finding| finding.code)
        .collect();
    let expected = [
        code::FRACTION,
        code::NEGATIVE,
        code::PERCENT,
        code::UNKNOWN_UNIT,
        code::ARGUMENT_TYPE,
        code::NOT_ORTHOGONAL,
        code::COUNT_MISMATCH,
    ];
    assert_eq!(codes, expected);
}

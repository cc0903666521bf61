//! NIST's own program files parse, or give the diagnostic that their fault deserves.
#![allow(missing_docs, reason = "a test")]

use std::path::PathBuf;

use crcl::{ReadOptions, Reading, code, text};

/// A file of the data folder beside the project; nothing where the folder does not exist.
fn nist(name: &str) -> Option<Vec<u8>> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    std::fs::read(
        root.join("../../shared/data/nist/canonical-text")
            .join(name),
    )
    .ok()
}

fn read(name: &str) -> Option<Reading> {
    Some(text::read_bytes(&nist(name)?, &ReadOptions::default()))
}

#[test]
fn sound_programs_have_no_findings() {
    let programs = [
        ("commands1", 41),
        ("controller_Kit1FixedLoc.txt", 112),
        ("controller_kitbuild.txt", 190),
        ("crcl_demo_01_a.txt", 69),
        ("kitbuild_executor.txt", 185),
    ];
    for (name, commands) in programs {
        let Some(reading) = read(name) else { continue };
        assert_eq!(reading.findings, [], "{name}");
        assert_eq!(reading.program.commands.len(), commands, "{name}");
    }
}

#[test]
fn commands_with_errors() {
    let Some(reading) = read("commandsWithErrors") else {
        return;
    };
    let found: Vec<_> = reading
        .findings
        .iter()
        .map(|f| (f.code, f.message.as_str()))
        .collect();
    let deserved = [
        (
            code::FRACTION,
            "0.8 percent is very little: the range is 0 to 100",
        ),
        (
            code::FRACTION,
            "0.75 percent is very little: the range is 0 to 100",
        ),
        (
            code::PERCENT,
            "a percentage must be 0 to 100 percent, got -110",
        ),
        (code::ARGUMENT_TYPE, "a pose is a point and two axes"),
    ];
    assert_eq!(found, deserved);
}

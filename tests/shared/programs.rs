//! NIST's program files parse, or give the finding that fits their error.

use crcl::{ReadOptions, Reading, code, text};

fn read(name: &str) -> Reading {
    let bytes = std::fs::read(crate::path("data/nist/canonical-text").join(name)).unwrap();
    text::read_bytes(&bytes, &ReadOptions::default())
}

pub(crate) fn sound_programs_have_no_findings() {
    let programs = [
        ("commands1", 41),
        ("controller_Kit1FixedLoc.txt", 112),
        ("controller_kitbuild.txt", 190),
        ("crcl_demo_01_a.txt", 69),
        ("kitbuild_executor.txt", 185),
    ];
    for (name, commands) in programs {
        let reading = read(name);
        assert_eq!(reading.findings, [], "{name}");
        assert_eq!(reading.program.commands.len(), commands, "{name}");
    }
}

pub(crate) fn commands_with_errors() {
    let reading = read("commandsWithErrors");
    let found: Vec<_> = reading
        .findings
        .iter()
        .map(|f| (f.code, f.message.as_str()))
        .collect();
    let little = |number: &str| format!("{number} percent is very little: the range is 0 to 100");
    let (first, second) = (little("0.8"), little("0.75"));
    let deserved = [
        (code::FRACTION, first.as_str()),
        (code::FRACTION, second.as_str()),
        (
            code::PERCENT,
            "a percentage must be 0 to 100 percent, got -110",
        ),
        (code::ARGUMENT_TYPE, "a pose is a point and two axes"),
    ];
    assert_eq!(found, deserved);
}

//! The readers return a result for any bytes: no panic, and no command that is not in the text.
//! `CANTER_FUZZ_CASES` sets the number of inputs.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const TOKENS: &[&str] = &[
    "InitCanon",
    "MoveTo",
    "MoveSmoothlyTo",
    "SetLengthUnits",
    "EndCanon",
    "Dwell",
    "Message",
    "(",
    ")",
    "{",
    "}",
    ",",
    ";",
    "\"",
    "\"mm\"",
    "//",
    "/*",
    "*/",
    "\n",
    "\t",
    "0",
    "-1",
    ".12",
    "1e999",
    "NaN",
    "Pose",
    "Point",
    "RollPitchYaw",
    "{{1,2,3},{0,0,-1},{1,0,0}}",
    "\\",
    "[",
    "]",
    ":",
    "{\"schema\":1,\"commands\":[",
    "\"command\"",
    "\"poses\"",
    "null",
    "\u{feff}",
    "é",
];

fn cases() -> ProptestConfig {
    let cases = std::env::var("CANTER_FUZZ_CASES")
        .ok()
        .and_then(|text| text.parse().ok());
    ProptestConfig {
        cases: cases.unwrap_or(2000),
        rng_seed: RngSeed::Fixed(2012),
        ..ProptestConfig::default()
    }
}

/// Both readers answer, and what they keep can be written and read again.
fn read(bytes: &[u8]) -> Result<(), TestCaseError> {
    let options = crcl::ReadOptions::default();
    for reading in [
        crcl::text::read_bytes(bytes, &options),
        crcl::json::read_bytes(bytes, &options),
    ] {
        let written = crcl::text::write(&reading.program);
        let again = crcl::text::read(&written, &options);
        prop_assert_eq!(reading.program.commands.len(), again.program.commands.len());
        prop_assert!(reading.findings.len() <= options.max_findings);
        let source = crcl::Source::from_bytes("fuzz", bytes);
        for finding in &reading.findings {
            let (line, column) = source.position(finding.span.start);
            prop_assert!(line >= 1 && column >= 1);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read(&bytes)?;
    }

    #[test]
    fn soup_of_tokens(tokens in prop::collection::vec(prop::sample::select(TOKENS), 0..60)) {
        read(tokens.concat().as_bytes())?;
    }

    #[test]
    fn a_program_with_a_hole(at in 0..400_usize, cut in 0..40_usize, put in prop::sample::select(TOKENS)) {
        let text = "InitCanon()\nSetLengthUnits(\"mm\")\nMoveSmoothlyTo({{{1,2,3},{0,0,-1},{1,0,0}}, \
            {{4,5,6},{0,0,-1},{1,0,0}}}, 2) // end\nMoveTo(Pose(Point(1,2,3), RollPitchYaw(1,2,3)))\n\
            Message(\"hello\")\nDwell(0.5)\nEndCanon(0)\n";
        let at = at.min(text.len());
        let end = (at + cut).min(text.len());
        read([&text[..at], put, &text[end..]].concat().as_bytes())?;
    }
}

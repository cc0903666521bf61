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
    "<",
    ">",
    "</",
    "/>",
    "=",
    "&amp;",
    "&#0;",
    "<![CDATA[",
    "]]>",
    "<!--",
    "-->",
    "<?xml version=\"1.0\"?>",
    "<!DOCTYPE x [<!ENTITY a \"b\">]>",
    "<CRCLProgram xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">",
    "</CRCLProgram>",
    "<InitCanon><CommandID>1</CommandID></InitCanon>",
    "<EndCanon><CommandID>2</CommandID></EndCanon>",
    "<MiddleCommand xsi:type=\"DwellType\">",
    "</MiddleCommand>",
    "<CommandID>3</CommandID>",
    "<DwellTime>0.5</DwellTime>",
    "<Name>n</Name>",
];

/// Documents whose parts are taken out and put elsewhere.
const DOCUMENTS: [&str; 3] = [
    "<CRCLProgram xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"><InitCanon><CommandID>1\
     </CommandID></InitCanon><MiddleCommand xsi:type=\"MoveThroughToType\"><CommandID>2</CommandID>\
     <MoveStraight>true</MoveStraight><Waypoint><Point><X>1</X><Y>2</Y><Z>3</Z></Point><XAxis><I>1</I>\
     <J>0</J><K>0</K></XAxis><ZAxis><I>0</I><J>0</J><K>1</K></ZAxis></Waypoint><Waypoint \
     xsi:type=\"PoseAndSetType\"><Point><X>1</X><Y>2</Y><Z>3</Z></Point><XAxis><I>1</I><J>0</J><K>0</K>\
     </XAxis><ZAxis><I>0</I><J>0</J><K>1</K></ZAxis><Coordinated>1</Coordinated></Waypoint>\
     <NumPositions>2</NumPositions></MiddleCommand><EndCanon><CommandID>3</CommandID></EndCanon>\
     </CRCLProgram>",
    "<CRCLCommandInstance xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"><CRCLCommand \
     xsi:type=\"ActuateJointsType\"><Name>n</Name><CommandID>2</CommandID><Guard><SensorID>F</SensorID>\
     <LimitType>OVER_MAX</LimitType><LimitValue>3</LimitValue></Guard><ActuateJoint><JointNumber>1\
     </JointNumber><JointPosition>2E1</JointPosition><JointDetails xsi:type=\"JointSpeedAccelType\">\
     <JointSpeed>1</JointSpeed></JointDetails></ActuateJoint></CRCLCommand><ProgramIndex>4\
     </ProgramIndex></CRCLCommandInstance>",
    "<CRCLStatus><CommandStatus><CommandID>1</CommandID><StatusID>2</StatusID><CommandState>CRCL_Done\
     </CommandState></CommandStatus><JointStatuses><JointStatus><JointNumber>1</JointNumber>\
     <JointPosition>3</JointPosition></JointStatus></JointStatuses><SettingsStatus><AngleUnitName>\
     degree</AngleUnitName><TransSpeedAbsolute><Setting>3</Setting></TransSpeedAbsolute>\
     </SettingsStatus></CRCLStatus>",
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
        crcl::xml::read_bytes(bytes, &options),
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
    if let Ok(text) = std::str::from_utf8(bytes) {
        if let Ok(instance) = crcl::xml::read_instance(text) {
            let written = crcl::xml::write_instance(&instance);
            prop_assert!(crcl::xml::read_instance(&written).is_ok(), "{}", written);
        }
        if let Ok(status) = crcl::xml::read_status(text) {
            let written = crcl::xml::write_status(&status);
            prop_assert!(crcl::xml::read_status(&written).is_ok(), "{}", written);
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

    #[test]
    fn a_document_with_a_hole(
        which in 0..3_usize,
        at in 0..1200_usize,
        cut in 0..60_usize,
        put in prop::sample::select(TOKENS),
        twice in any::<bool>(),
    ) {
        let text = DOCUMENTS[which];
        let at = at % text.len();
        let end = (at + cut).min(text.len());
        let inside = if twice { [put, &text[at..end]].concat() } else { put.to_owned() };
        read([&text[..at], &inside, &text[end..]].concat().as_bytes())?;
    }
}

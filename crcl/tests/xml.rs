//! The XML form: what is read, what is refused and where, what comes back after writing.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use crcl::xml::{
    self, CommandState, CommandStatus, GripperState, GripperStatus, Guard, GuardLimit, Instance,
    Instruction, JointStatus, PoseStatus, ProgramPlace, Status, XmlCommand,
};
use crcl::{Command, LengthUnit, Pose, Program, ReadOptions, Reading, Source, code, json, text};

const XSI: &str = "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"";

fn program(middle: &str) -> String {
    format!(
        "<CRCLProgram {XSI}>\n<InitCanon><CommandID>1</CommandID></InitCanon>\n{middle}\n\
         <EndCanon><CommandID>9</CommandID></EndCanon>\n</CRCLProgram>"
    )
}

fn command(kind: &str, inside: &str) -> String {
    format!(
        "<MiddleCommand xsi:type=\"{kind}Type\"><CommandID>2</CommandID>{inside}</MiddleCommand>"
    )
}

fn read(source: &str) -> Reading {
    xml::read(source, &ReadOptions::default())
}

/// The first finding with the line, the column and the text it points to.
fn first(source: &str) -> (&'static str, usize, usize, String) {
    let reading = read(source);
    let finding = reading.findings.first().expect("a finding");
    let at = Source::new("test", source);
    let (line, column) = at.position(finding.span.start);
    let text = source[finding.span.clone()].to_owned();
    (finding.code, line, column, text)
}

const POSE: &str = "<Point><X>400</X><Y>1.5E1</Y><Z>300</Z></Point><XAxis><I>1</I><J>0</J><K>0</K>\
    </XAxis><ZAxis><I>0</I><J>0</J><K>-1</K></ZAxis>";

#[test]
fn what_the_language_has_is_read() {
    let middle = [
        command(
            "MoveTo",
            &format!("<MoveStraight>1</MoveStraight><EndPosition>{POSE}</EndPosition>"),
        ),
        command("SetEndEffector", "<Setting> 0.0 </Setting>"),
        command(
            "SetTransSpeed",
            "<TransSpeed xsi:type=\"TransSpeedRelativeType\"><Fraction>0.07</Fraction></TransSpeed>",
        ),
        command(
            "SetEndPoseTolerance",
            "<Tolerance><XPointTolerance>2</XPointTolerance><ZPointTolerance>1</ZPointTolerance><ZAxisTolerance>3</ZAxisTolerance></Tolerance>",
        ),
        command("SetLengthUnits", "<UnitName>inch</UnitName>"),
        command("StopMotion", "<StopCondition>Fast</StopCondition>"),
    ];
    let reading = read(&program(&middle.join("\n<!-- </CRCLProgram> -->\n")));
    assert_eq!(reading.findings, []);
    let pose = Pose::Axes {
        point: [400.0, 15.0, 300.0],
        z_axis: [0.0, 0.0, -1.0],
        x_axis: [1.0, 0.0, 0.0],
    };
    let commands: Vec<_> = reading.program.iter().cloned().collect();
    assert_eq!(
        commands,
        [
            Command::InitCanon,
            Command::MoveStraightTo { pose },
            Command::CloseGripper,
            Command::SetRelativeSpeed { percent: 7.0 },
            Command::SetEndPointTolerance { tolerance: 1.0 },
            Command::SetEndAngleTolerance { tolerance: 3.0 },
            Command::SetLengthUnits {
                unit: LengthUnit::Inch
            },
            Command::StopMotion { emergency: 1 },
            Command::EndCanon { reason: 0 },
        ]
    );
    assert_eq!(
        (
            reading.program.commands[1].line,
            reading.program.commands[1].column
        ),
        (3, 1)
    );
}

#[test]
fn blocks_are_written_out() {
    let start = |name: &str| command("LoopBlockStart", &format!("<LoopName>{name}</LoopName>"));
    let end = |name: &str, count: i64| {
        let inside = format!("<LoopName>{name}</LoopName><MaxCount>{count}</MaxCount>");
        command("LoopBlockEnd", &inside)
    };
    let open = command("SetEndEffector", "<Setting>1</Setting>");
    let nested = [
        start("a"),
        open.clone(),
        start("b"),
        open.clone(),
        end("b", 2),
        end("a", 3),
    ];
    let reading = read(&program(&nested.concat()));
    assert_eq!(reading.findings, []);
    assert_eq!(reading.program.commands.len(), 2 + 3 * 3);
    let none = read(&program(&[start("a"), open.clone(), end("a", 0)].concat()));
    assert_eq!(none.program.commands.len(), 2);
    for broken in [
        vec![end("a", 1)],
        vec![start("a")],
        vec![start("a"), end("b", 1)],
        vec![start("a"), end("a", -1)],
    ] {
        assert_eq!(first(&program(&broken.concat())).0, code::LOOP);
    }
    let many = [
        vec![start("a"), start("b"), start("c"), open],
        vec![end("c", 2000), end("b", 2000), end("a", 2000)],
    ];
    assert_eq!(first(&program(&many.concat().concat())).0, code::TOO_LARGE);
}

#[test]
fn what_cannot_be_done_is_refused_at_its_element() {
    let guard = "<Guard><SensorID>F</SensorID><LimitType>OVER_MAX</LimitType><LimitValue>3</LimitValue></Guard>";
    let guarded = format!("{guard}<UnitName>inch</UnitName>");
    let both = "<RequireTrigger>true</RequireTrigger><ErrorOnTrigger>true</ErrorOnTrigger></Guard>";
    let never = guard.replace("</Guard>", both) + "<DwellTime>1</DwellTime>";
    let twice = "<ProgramText>InitCanon() EndCanon(0) EndCanon(0)</ProgramText>";
    let cases = [
        ("SetLengthUnits", guarded.as_str(), "<Guard"),
        ("Dwell", never.as_str(), "<Guard"),
        ("RunProgram", "<ProgramText>x</ProgramText>", "<ProgramText"),
        ("RunProgram", twice, "<ProgramText"),
    ];
    for (kind, inside, element) in cases {
        let (code, line, _, text) = first(&program(&command(kind, inside)));
        assert_eq!(
            (code, line, text.as_str()),
            (code::UNSUPPORTED, 3, element),
            "{kind}"
        );
    }
}

/// A guard is a command before its own, with its limit in SI units; a program of the robot's own
/// language is its commands.
#[test]
fn guards_and_programs_of_the_robot_are_commands() {
    let guard = "<Guard><SensorID>ATI</SensorID><SubField>Fz</SubField>\
                 <LimitType>OVER_MAX</LimitType><LimitValue>2</LimitValue></Guard>";
    let text = command("SetForceUnits", "<UnitName>pound</UnitName>")
        + &command("Dwell", &format!("{guard}<DwellTime>1</DwellTime>"))
        + &command(
            "RunProgram",
            "<ProgramText>InitCanon() Dwell(2) EndCanon(0)</ProgramText>",
        );
    let reading = xml::read(&program(&text), &ReadOptions::default());
    assert_eq!(reading.findings, []);
    let middle: Vec<_> = reading.program.iter().skip(1).take(3).cloned().collect();
    let Command::Guard { guard } = &middle[0] else {
        panic!("{middle:?}");
    };
    assert_eq!(guard.sensor, "ATI.Fz");
    assert!((guard.value - 2.0 * 4.448_221_615_260_5).abs() < 1e-12);
    let dwell = |seconds| Command::Dwell { seconds };
    assert_eq!(middle[1..], [dwell(1.0), dwell(2.0)]);
    let strict = ReadOptions {
        strict: true,
        ..ReadOptions::default()
    };
    assert!(xml::read(&program(&text), &strict).has_errors());
}

/// Guards go round all three forms with the move behind them.
#[test]
fn guards_go_round_all_three_forms() {
    let guard = |sensor: &str, limit, value, ending| Command::Guard {
        guard: crcl::Guard {
            sensor: sensor.to_owned(),
            limit,
            value,
            ending,
        },
    };
    let end = crcl::GuardEnding::Done;
    let commands = [
        Command::InitCanon,
        guard("wrench.Tz", GuardLimit::IncreaseOverLimit, 0.25, end),
        guard(
            "digital_input_3",
            GuardLimit::OverMax,
            0.5,
            crcl::GuardEnding::ErrorOnTrigger,
        ),
        guard(
            "a.b",
            GuardLimit::UnderMin,
            -0.01,
            crcl::GuardEnding::RequireTrigger,
        ),
        Command::Dwell { seconds: 1.0 },
        Command::EndCanon { reason: 0 },
    ];
    let program: Program = commands.iter().cloned().collect();
    let options = ReadOptions::default();
    let from_text = text::read(&text::write(&program), &options);
    assert_eq!(from_text.findings, []);
    let from_xml = xml::read(&xml::write(&from_text.program).unwrap(), &options);
    assert_eq!(from_xml.findings, []);
    let from_json = json::read(&json::write(&from_xml.program), &options);
    let again: Vec<_> = from_json.program.iter().cloned().collect();
    assert_eq!(again, commands);
    // In strict mode a guard is refused by name.
    let strict = ReadOptions {
        strict: true,
        ..ReadOptions::default()
    };
    assert!(text::read(&text::write(&program), &strict).has_errors());
    assert!(json::read(&json::write(&program), &strict).has_errors());
    // A guard without a command behind it has no form in XML.
    let lonely: Program = [&commands[..2], &commands[5..]]
        .concat()
        .into_iter()
        .collect();
    assert!(xml::write(&lonely).is_err());
    for wrong in [
        "Guard ({\"\", \"OVER_MAX\", 1})",
        "Guard ({\"f\", \"OVER\", 1})",
        "Guard (3)",
    ] {
        assert!(text::read(wrong, &options).has_errors(), "{wrong}");
    }
}

#[test]
#[allow(clippy::too_many_lines, reason = "a table")]
fn faults_of_form_are_found_at_their_place() {
    let dwell = |inside: &str| program(&command("Dwell", inside));
    let cases = [
        (dwell("<DwellTime>NaN</DwellTime>"), code::NOT_FINITE, "NaN"),
        (dwell("<DwellTime>INF</DwellTime>"), code::NOT_FINITE, "INF"),
        (
            dwell("<DwellTime>infinity</DwellTime>"),
            code::XML_VALUE,
            "infinity",
        ),
        (
            dwell("<DwellTime>1e999</DwellTime>"),
            code::OVERFLOW,
            "1e999",
        ),
        (dwell("<DwellTime>-1</DwellTime>"), code::NEGATIVE, "-1"),
        (
            dwell("<DwellTime>2e6</DwellTime>"),
            code::TOO_LARGE,
            "<MiddleCommand",
        ),
        (dwell(""), code::XML_MISSING, "<MiddleCommand"),
        (
            dwell("<DwellTime>1</DwellTime><More/>"),
            code::XML_ELEMENT,
            "<More",
        ),
        (
            dwell("<DwellTime>1<X/></DwellTime>"),
            code::XML_ELEMENT,
            "<X",
        ),
        (dwell("x<DwellTime>1</DwellTime>"), code::XML_TEXT, "x"),
        (
            dwell("<DwellTime>1</DwellTime><Name>n</Name>"),
            code::XML_ELEMENT,
            "<Name",
        ),
        (
            program(&command("Dwel", "")),
            code::UNKNOWN_COMMAND,
            "<MiddleCommand",
        ),
        (
            program("<MiddleCommand/>"),
            code::XML_KIND,
            "<MiddleCommand",
        ),
        (
            program(&command("StopMotion", "<StopCondition>Now</StopCondition>")),
            code::XML_VALUE,
            "Now",
        ),
        (
            program(&command("SetEndEffector", "<Setting>2</Setting>")),
            code::FRACTION_RANGE,
            "2",
        ),
        (
            program(&command(
                "MoveTo",
                &format!("<MoveStraight>no</MoveStraight><EndPosition>{POSE}</EndPosition>"),
            )),
            code::XML_VALUE,
            "no",
        ),
        ("<CRCLStatus/>".to_owned(), code::XML_ROOT, "<CRCLStatus"),
        (
            "<CRCLProgram xmlns=\"urn:x\"/>".to_owned(),
            code::XML_ROOT,
            "<CRCLProgram",
        ),
        ("<CRCLProgram>".to_owned(), code::XML_SYNTAX, "<"),
        (
            "<!DOCTYPE x [<!ENTITY a \"b\">]><CRCLProgram>&a;</CRCLProgram>".to_owned(),
            code::XML_SYNTAX,
            "<",
        ),
    ];
    for (source, wanted, text) in cases {
        let (code, _, _, found) = first(&source);
        assert_eq!((code, found.as_str()), (wanted, text), "{source}");
    }
    let count = format!(
        "<MoveStraight>true</MoveStraight><Waypoint>{POSE}</Waypoint><Waypoint>{POSE}</Waypoint><NumPositions>3</NumPositions>"
    );
    assert_eq!(
        first(&program(&command("MoveThroughTo", &count))).0,
        code::COUNT_MISMATCH
    );
}

#[test]
fn axes_of_six_digits_are_put_right_and_skew_ones_are_refused() {
    let pose = |x: f64| {
        let inside = format!(
            "<MoveStraight>false</MoveStraight><EndPosition><Point><X>1</X><Y>2</Y><Z>3</Z></Point>\
             <XAxis><I>1</I><J>0</J><K>{x}</K></XAxis><ZAxis><I>0</I><J>0</J><K>-1</K></ZAxis></EndPosition>"
        );
        read(&program(&command("MoveTo", &inside)))
    };
    for x in [1e-6, 4e-4, 9e-4] {
        let reading = pose(x);
        assert_eq!(reading.findings, [], "{x}");
        assert!(reading.program.commands[1].command.check().is_ok());
    }
    assert_eq!(pose(2e-3).findings[0].code, code::NOT_ORTHOGONAL);
}

#[test]
fn strict_mode_refuses_extensions() {
    let source = program(&command("OpenToolChanger", ""));
    let options = ReadOptions {
        strict: true,
        ..ReadOptions::default()
    };
    assert_eq!(
        xml::read(&source, &options).findings[0].code,
        code::EXTENSION
    );
    assert_eq!(read(&source).findings, []);
}

#[test]
fn deep_nesting_and_long_documents_are_answered() {
    let deep = "<a>".repeat(100_000);
    assert_eq!(first(&deep).0, code::XML_SYNTAX);
    let closed = format!("{deep}{}", "</a>".repeat(100_000));
    assert_eq!(first(&closed).0, code::XML_ROOT);
    let inside = program(&command("Message", &format!("<Message>{closed}</Message>")));
    assert_eq!(first(&inside).0, code::XML_ELEMENT);
}

#[test]
fn what_xml_cannot_say_is_not_written() {
    let write = |commands: &[Command]| {
        let program: Program = commands.iter().cloned().collect();
        xml::write(&program).map_err(|findings| findings[0].message.clone())
    };
    let end = Command::EndCanon { reason: 0 };
    let frame = Command::SetCoordinateFrame {
        frame: crcl::CoordinateFrame::RobotBase,
    };
    let refused = write(&[Command::InitCanon, frame, end.clone()]).unwrap_err();
    assert!(refused.contains("coordinate frames"), "{refused}");
    assert!(write(&[]).is_err() && write(std::slice::from_ref(&end)).is_err());
    assert!(write(&[Command::InitCanon]).is_err());
    assert!(
        write(&[
            Command::InitCanon,
            end.clone(),
            Command::InitCanon,
            end.clone()
        ])
        .is_err()
    );
    let bell = Command::Message {
        text: "\u{7}".to_owned(),
    };
    assert!(
        write(&[Command::InitCanon, bell, end])
            .unwrap_err()
            .contains("U+0007")
    );
}

#[test]
fn a_status_comes_back() {
    let pose = Pose::Axes {
        point: [0.1 + 0.2, -1e-7, 1e8],
        z_axis: [0.0, 0.0, -1.0],
        x_axis: [1.0, 0.0, 0.0],
    };
    let status = Status {
        command: CommandStatus {
            command: -4,
            status: 17,
            state: CommandState::Error,
            description: Some("a < b & \"c\" </CRCLStatus>\r".to_owned()),
            place: ProgramPlace {
                file: Some("a.xml".to_owned()),
                index: Some(1),
                length: None,
            },
            ..CommandStatus::default()
        },
        joints: vec![JointStatus {
            joint: 1,
            position: Some(1.0 / 3.0),
            effort: Some(0.0),
            velocity: None,
        }],
        pose: Some(PoseStatus {
            pose,
            twist: Some(([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])),
            wrench: None,
            configuration: None,
        }),
        gripper: Some(GripperStatus {
            name: "gripper".to_owned(),
            options: Vec::new(),
            holding: Some(false),
            state: GripperState::Parallel { separation: 12.5 },
        }),
        ..Status::default()
    };
    let written = xml::write_status(&status);
    assert_eq!(written.matches("</CRCLStatus>").count(), 1);
    assert!(!written.contains('\n') && !written.contains("e-"));
    let head = "<?xml version=\"1.0\" encoding=\"UTF-8\"?><CRCLStatus xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:noNamespaceSchemaLocation=\"CRCLStatus.xsd\"><CommandStatus>";
    assert!(written.starts_with(head), "{written}");
    assert_eq!(xml::read_status(&written).unwrap(), status);
}

#[test]
fn guards_come_back() {
    let guard = Guard {
        name: Some("g".to_owned()),
        sensor: "ATI".to_owned(),
        field: Some("Fz".to_owned()),
        kind: GuardLimit::DecreaseBeyondLimit,
        limit: -3.5,
        recheck_us: Some(1000),
        check_count: None,
        last_check_ms: Some(5),
        last_check_value: None,
        require_trigger: Some(true),
        error_on_trigger: None,
    };
    let instruction = Instruction {
        guards: vec![guard],
        ..Instruction::new(3, XmlCommand::Dwell(0.5))
    };
    let instance = Instance::new(instruction);
    assert_eq!(
        xml::read_instance(&xml::write_instance(&instance)).unwrap(),
        instance
    );
}

//! NIST's CRCL files are read, or refused for a stated reason; what Canter writes is valid against
//! NIST's schema; recorded conversations get the kind of answer that NIST's simulator gave.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use crcl::{ReadOptions, code, xml};

use crate::crcl_client::{Answer, Scene, document};

fn folder(name: &str) -> PathBuf {
    crate::path("data/crcl").join(name)
}

fn files(name: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder(name)).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

/// Files that no schema allows.
const INVALID: [&str; 3] = [
    "harmanpa_programExample_text_after_root.xml",
    "nistfanuc_copy_invalid_name_order.xml",
    "forceTorqueStatusExample.xml",
];

/// Every program that is valid is read; what it asks for and Canter cannot do is an error of its
/// own kind, at its place.
pub(crate) fn programs_are_read_or_refused_for_a_reason() {
    let mut refused = BTreeMap::new();
    let mut whole = 0;
    for path in files("program") {
        let bytes = fs::read(&path).unwrap();
        let reading = xml::read_bytes(&bytes, &ReadOptions::default());
        let errors: Vec<_> = reading.findings.iter().filter(|f| f.is_error()).collect();
        let file = name(&path);
        if INVALID.contains(&file.as_str()) {
            assert!(!errors.is_empty(), "{file} is not valid");
            continue;
        }
        for error in &errors {
            assert_eq!(error.code, code::UNSUPPORTED, "{file}: {error:?}");
            assert!(
                error.message.starts_with("Canter cannot do this yet"),
                "{error:?}"
            );
            *refused.entry(error.message.clone()).or_insert(0) += 1;
        }
        whole += usize::from(errors.is_empty());
        let instructions = xml::read_instructions(&String::from_utf8(bytes).unwrap());
        assert!(instructions.is_ok(), "{file}: {instructions:?}");
    }
    eprintln!("{whole} programs are whole; refused: {refused:#?}");
    assert!(whole >= 2, "{whole}");
}

pub(crate) fn commands_are_read() {
    for path in files("command") {
        let text = fs::read_to_string(&path).unwrap();
        let instance = xml::read_instance(&text);
        assert!(instance.is_ok(), "{}: {instance:?}", name(&path));
        let written = xml::write_instance(instance.as_ref().unwrap());
        assert_eq!(xml::read_instance(&written), instance, "{}", name(&path));
    }
}

pub(crate) fn statuses_are_read() {
    for path in files("status") {
        let text = fs::read_to_string(&path).unwrap();
        let status = xml::read_status(&text);
        let valid = !INVALID.contains(&name(&path).as_str());
        assert_eq!(status.is_ok(), valid, "{}: {status:?}", name(&path));
        if let Ok(status) = status {
            let again = xml::read_status(&xml::write_status(&status)).unwrap();
            assert_eq!(again, status, "{}", name(&path));
        }
    }
}

/// Validates each file given against the schema given, with libxml2; prints what is wrong.
const VALIDATE: &str = "
import sys
from lxml import etree
schema = etree.XMLSchema(etree.parse(sys.argv[1]))
bad = 0
for path in sys.argv[2:]:
    document = etree.parse(path)
    if not schema.validate(document):
        bad += 1
        print(path, schema.error_log)
sys.exit(1 if bad else 0)
";

/// Whether Python with lxml is there.
pub(crate) fn has_validator() -> bool {
    let run = Command::new("python3")
        .args(["-c", "import lxml.etree"])
        .output();
    run.is_ok_and(|output| output.status.success())
}

/// The newest version of the schema.
const NEWEST: &str = "2021Apr28";

fn validate(version: &str, schema: &str, documents: &[String]) {
    let schema = folder("xsd").join(version).join(schema);
    let place = tempfile::tempdir().unwrap();
    let paths = documents.iter().enumerate().map(|(index, text)| {
        let path = place.path().join(format!("{index}.xml"));
        fs::write(&path, text).unwrap();
        path
    });
    let paths: Vec<_> = paths.collect();
    let mut command = Command::new("python3");
    let output = command
        .args(["-c", VALIDATE])
        .arg(schema)
        .args(&paths)
        .output()
        .unwrap();
    let (out, err) = (output.stdout, output.stderr);
    let said = String::from_utf8_lossy(&out).into_owned() + &String::from_utf8_lossy(&err);
    assert!(output.status.success(), "{said}");
}

/// What is written is valid against the schema of 2021Apr28, says somebody else.
pub(crate) fn what_is_written_is_valid() {
    let mut programs = Vec::new();
    let mut instances = Vec::new();
    for path in files("program") {
        let text = fs::read_to_string(&path).unwrap();
        let Ok(instructions) = xml::read_instructions(&text) else {
            continue;
        };
        programs.push(xml::write_instructions(&instructions));
        let each = instructions.into_iter().map(xml::Instance::new);
        instances.extend(each.map(|instance| xml::write_instance(&instance)));
        let program = xml::read(&text, &ReadOptions::default()).program;
        programs.extend(xml::write(&program));
    }
    let examples = system_tests::repository::root().join("examples");
    for entry in fs::read_dir(examples).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "canon")
        {
            let text = fs::read_to_string(&path).unwrap();
            let program = crcl::text::read(&text, &ReadOptions::default()).program;
            programs.extend(xml::write(&program));
        }
    }
    assert!(programs.len() > 20 && instances.len() > 100);
    validate(NEWEST, "CRCLProgramInstance.xsd", &programs);
    validate(NEWEST, "CRCLCommandInstance.xsd", &instances);
    let statuses = files("status").into_iter().filter_map(|path| {
        let status = xml::read_status(&fs::read_to_string(path).unwrap()).ok()?;
        Some(xml::write_status(&status))
    });
    let mut statuses: Vec<_> = statuses.collect();
    let scene = Scene::new("valid", &[]);
    let mut client = scene.connect();
    let mut plain = vec![client.status().0, client.done("InitCanon", 4, "").0];
    let flags = [
        "JointStatuses",
        "PoseStatus",
        "GripperStatus",
        "SettingsStatus",
        "SensorsStatus",
        "GuardsStatus",
    ]
    .map(|part| format!("<Report{part}>true</Report{part}>"));
    // The client of 2017 knows four flags.
    let four = flags[..4].concat();
    plain.push(client.done("ConfigureStatusReport", 5, &four).0);
    let parameter = "<ParameterSetting><ParameterName>a</ParameterName><ParameterValue>1</ParameterValue></ParameterSetting>";
    plain.push(client.done("SetRobotParameters", 6, parameter).0);
    assert!(plain[3].contains("<RobotParameterSetting>"), "{}", plain[3]);
    plain.push(client.done("SetEndEffectorParameters", 7, parameter).0);
    validate("2017May01", "CRCLStatus.xsd", &plain);
    statuses.extend(plain);
    statuses.push(client.done("ConfigureStatusReport", 8, &flags.concat()).0);
    statuses.push(
        client
            .failed("RunProgram", 9, "<ProgramText>x</ProgramText>")
            .0,
    );
    validate(NEWEST, "CRCLStatus.xsd", &statuses);
}

/// The commands of a recorded stream, without GetStatus: kind, number, document.
fn commands(stream: &str) -> Vec<(String, i64, String)> {
    let mut found = Vec::new();
    let mut rest = stream;
    while let Some(start) = rest.find("<CRCLCommandInstance") {
        let end = rest.find("</CRCLCommandInstance>").unwrap() + 22;
        let document = &rest[start..end];
        rest = &rest[end..];
        let instance = xml::read_instance(document).unwrap();
        let kind = instance.instruction.command.name().to_owned();
        if kind != "GetStatus" {
            found.push((kind, instance.instruction.id, document.to_owned()));
        }
    }
    found
}

/// What the recorded client was told of each command: the first state that ends its waiting. The
/// simulator of 2017 sometimes says Working under the same number afterwards.
fn verdicts(stream: &str) -> BTreeMap<i64, String> {
    let statuses = stream.split_inclusive("</CRCLStatus>");
    let statuses = statuses.filter(|text| text.contains("</CRCLStatus>"));
    let mut found = BTreeMap::new();
    for answer in statuses.map(|text| Answer(text.to_owned())) {
        if matches!(answer.state(), "CRCL_Done" | "CRCL_Error") {
            let state = answer.state().to_owned();
            found.entry(answer.id()).or_insert(state);
        }
    }
    found
}

/// What the simulator said was done and Canter refuses with a sentence: the simulator of 2017 said
/// so of every program in a foreign language, its arm reaches every pose, and it leaves its tool
/// anywhere.
const REFUSED: [&str; 6] = [
    "OpenToolChanger",
    "MoveScrew",
    "RunProgram",
    "MoveTo",
    "MoveThroughTo",
    "ActuateJoints",
];

/// The recorded conversations: each command gets the kind of answer that NIST's simulator gave.
pub(crate) fn recorded_conversations_get_the_same_kind_of_answer() {
    // Each has an arm of its own, and waits for it most of the time.
    std::thread::scope(|scope| {
        for conversation in [
            "auto_client2021_sim2017.conn1",
            "joints_client2021_sim2017.conn1",
            "programAll_client2017_sim2017.conn1",
            "error_client2021_sim2021.conn1",
        ] {
            scope.spawn(move || hold_again(conversation));
        }
    });
}

/// Sends what a recorded client sent, and compares the answers.
fn hold_again(conversation: &str) {
    let read = |end: &str| {
        let path = folder("wire").join(format!("{conversation}.{end}.bin"));
        String::from_utf8(fs::read(path).unwrap()).unwrap()
    };
    let (said, sent) = (verdicts(&read("s2c")), commands(&read("c2s")));
    let scene = Scene::new(&conversation.replace('.', "_"), &[]);
    let mut client = scene.connect();
    client.status();
    let (mut same, mut refused) = (0, Vec::new());
    for (kind, id, text) in sent {
        client.send(&text);
        let answer = client.wait(id);
        let expected = said.get(&id).map(String::as_str);
        if Some(answer.state()) == expected {
            same += 1;
            continue;
        }
        assert_eq!(answer.state(), "CRCL_Error", "{kind} {id}: {}", answer.0);
        assert!(!answer.why().is_empty(), "{kind} {id}");
        assert!(
            REFUSED.contains(&kind.as_str()),
            "{kind} {id}: {}",
            answer.0
        );
        refused.push(format!("{kind}: {}", answer.why()));
        // The recorded client went on; here an error stays until InitCanon.
        client.done("InitCanon", id + 100_000, "");
    }
    eprintln!("{conversation}: {same} the same; refused: {refused:#?}");
    assert!(same >= 3, "{conversation}: {same}");
}

/// The bytes of every recorded client, CRPI's among them, in the pieces they came in: as many
/// answers as requests, and none that is too long.
pub(crate) fn recorded_bytes_are_answered() {
    let scene = Scene::new("bytes", &[]);
    for path in files("wire") {
        if !name(&path).ends_with(".c2s.bin") {
            continue;
        }
        let text = String::from_utf8(fs::read(&path).unwrap()).unwrap();
        let requests = text.matches("\"GetStatusType\"").count();
        let mut client = scene.connect();
        client.send(&text);
        let end = Instant::now() + Duration::from_secs(60);
        for _ in 0..requests {
            client.answer();
            assert!(Instant::now() < end);
        }
        let last = client.done("StopMotion", 7, "<StopCondition>Fast</StopCondition>");
        assert!(last.0.len() < 4095);
        client.send(&document("InitCanon", 8, ""));
        client.wait(8);
    }
}

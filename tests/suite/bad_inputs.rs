//! Bad inputs: each gives its own clear message and exit code, and moves nothing.
//!
//! The inputs and what is said about them are in `tests/data/bad_inputs`; `UPDATE_EXPECT=1` rewrites
//! what is said. Inputs that are long or no text are made here.

use expect_test::expect_file;
use system_tests::repository::{files, root};

use crate::canter::{Ran, canter, canter_reading};

const FOLDER: &str = "tests/data/bad_inputs";

/// Exit code, answer and messages, as one text; paths of this machine are left out.
fn said(ran: &Ran) -> String {
    format!(
        "exit {}\n--- stdout\n{}--- stderr\n{}",
        ran.code,
        without_rounding(&ran.stdout),
        ran.stderr
    )
}

/// The joint that would jump at a singular pose, and how singular it is, hang on the last digits.
fn without_rounding(text: &str) -> String {
    let (start, end) = ("a singular pose, where ", ')');
    let Some((before, after)) = text.split_once(start) else {
        return text.to_owned();
    };
    let after = after.split_once(end).map_or("", |(_, after)| after);
    format!("{before}{start}...){after}")
}

fn robot_for(name: &str) -> &'static str {
    if name == "behind_a_joint_limit" {
        "iiwa14"
    } else {
        "ur5e"
    }
}

/// `canter check` of every program, against the golden text beside it; `canter run` refuses it
/// with the same exit code, writes no samples and starts no driver.
#[test]
fn bad_programs_are_refused() {
    let mut programs = files(FOLDER, "canon").unwrap();
    programs.extend(files(FOLDER, "json").unwrap());
    assert!(programs.len() >= 40, "{} bad programs", programs.len());
    let folder = tempfile::tempdir().unwrap();
    for path in programs {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let program = format!("{FOLDER}/{}", path.file_name().unwrap().display());
        let checked = canter(["check", &program, "--robot", robot_for(&name)]);
        assert!(
            [1, 3].contains(&checked.code),
            "{name}: exit {}",
            checked.code
        );
        expect_file![root().join(FOLDER).join(format!("{name}.txt"))].assert_eq(&said(&checked));
        let samples = folder.path().join(&name);
        let sink = samples.to_str().unwrap();
        let ran = canter([
            "run",
            &program,
            "--robot",
            robot_for(&name),
            "--samples",
            sink,
        ]);
        assert_eq!(ran.code, checked.code, "{name}: {}", ran.stderr);
        assert_eq!(ran.stdout, "", "{name}");
        assert!(!ran.stderr.is_empty() && !samples.exists(), "{name}");
    }
}

#[test]
fn bad_robots_are_refused() {
    let mut seen = 0;
    for entry in std::fs::read_dir(root().join(FOLDER)).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            let shown = canter(["robots", "show", &format!("{FOLDER}/{name}")]);
            assert_eq!(shown.code, 3, "{name}");
            expect_file![path.with_extension("txt")].assert_eq(&said(&shown));
            seen += 1;
        }
    }
    assert!(seen >= 8, "{seen} bad robots");
}

#[test]
fn missing_things_are_named() {
    let cases = [
        (
            vec!["check", "examples/none.canon"],
            3,
            "examples/none.canon",
        ),
        (
            vec![
                "plan",
                "examples/pick_and_place.canon",
                "--robot",
                "hal9000",
            ],
            3,
            "hal9000",
        ),
        (vec!["plan", "examples/pick_and_place.canon"], 2, "--robot"),
        (
            vec![
                "run",
                "examples/pick_and_place.canon",
                "--robot",
                "ur5e",
                "--rate",
                "9",
            ],
            2,
            "4000",
        ),
        (vec!["robots", "import", "none.urdf"], 3, "none.urdf"),
        (vec!["check", "examples"], 3, "examples"),
    ];
    for (arguments, code, named) in cases {
        let ran = canter(&arguments);
        assert_eq!(
            (ran.code, ran.stdout.as_str()),
            (code, ""),
            "{arguments:?}: {}",
            ran.stderr
        );
        assert!(ran.stderr.contains(named), "{arguments:?}: {}", ran.stderr);
    }
}

/// Bytes that are no program: refused in one screen of text.
#[test]
fn bytes_that_are_no_program() {
    let line = [b"InitCanon() Message(\"".to_vec(), vec![b'x'; 10_000_000]].concat();
    let junk: Vec<u8> = (0..100_000u32)
        .map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8)
        .collect();
    let deep = [b"InitCanon() MoveTo(".to_vec(), vec![b'{'; 1_000_000]].concat();
    let elf = [&b"\x7fELF\x02\x01\x01\0\0\0\0\0"[..], &[0; 5000]].concat();
    let utf16: Vec<u8> = "InitCanon()"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let inputs = [
        ("a line of 10 MB", line),
        ("random bytes", junk),
        ("a million braces", deep),
        ("an executable", elf),
        ("UTF-16", utf16),
        (
            "broken UTF-8",
            b"InitCanon()\nMessage(\"\xff\xfe\")\nEndCanon(0)\n".to_vec(),
        ),
        ("a lone quote", b"\"".to_vec()),
        ("nothing", Vec::new()),
    ];
    for (what, input) in inputs {
        let ran = canter_reading(["check", "-"], &input);
        assert!([1, 3].contains(&ran.code), "{what}: exit {}", ran.code);
        let all = format!("{}{}", ran.stdout, ran.stderr);
        assert!(
            all.contains("error") || all.contains('\u{d7}'),
            "{what}: {all}"
        );
        assert!(all.len() < 60_000, "{what}: {} bytes are said", all.len());
    }
}

//! Wrong inputs: each gives its own clear message and exit code, and moves nothing.
//!
//! The inputs and the expected messages are in `tests/data/bad_inputs`; `UPDATE_EXPECT=1` rewrites
//! the messages. Inputs that are long or not text are made here.

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

/// The joint that would jump at a singular pose, and how singular the pose is, depend on rounding.
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

/// A file that is not a program: refused with at most one screen of text.
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

/// A disk that is full: the file is named, and it is no internal error.
#[test]
fn a_full_disk_is_named() {
    let program = "examples/pick_and_place.canon";
    let arm = format!("full{}/arm", std::process::id());
    let full = ["--robot", "ur5e", "--samples", "/dev/full"];
    let run = ["run", program, "--lock-step", "--arm", &arm];
    for arguments in [&["plan", program][..], &run] {
        let ran = canter(arguments.iter().chain(&full));
        assert_eq!(ran.code, 3, "{arguments:?}: {}", ran.stderr);
        let named = ran.stderr.contains("cannot write /dev/full");
        assert!(named, "{arguments:?}: {}", ran.stderr);
    }
}

/// A robot that is refused leaves no folder behind.
#[test]
fn a_refused_robot_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    // Nine joints: one more than are driven.
    let joint = |number: usize| {
        format!(
            "<link name=\"l{number}\"/><joint name=\"j{number}\" type=\"revolute\">\
             <parent link=\"{}\"/><child link=\"l{number}\"/><origin xyz=\"0 0 0.1\"/>\
             <axis xyz=\"0 {} {}\"/><limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"1\"/>\
             </joint>",
            if number == 0 {
                "base".to_owned()
            } else {
                format!("l{}", number - 1)
            },
            number % 2,
            1 - number % 2,
        )
    };
    let joints: String = (0..9).map(joint).collect();
    let file = folder.path().join("nine.urdf");
    std::fs::write(
        &file,
        format!("<robot name=\"nine\"><link name=\"base\"/>{joints}</robot>"),
    )
    .unwrap();
    let ran = canter(["robots", "import", file.to_str().unwrap()]);
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert!(ran.stderr.contains("9 movable joints"), "{}", ran.stderr);
    assert!(!folder.path().join("nine").exists());
}

/// Poses kilometres away are refused as fast as others out of reach: no curve is planned to them.
#[test]
fn far_poses_are_refused_at_once() {
    let pose = |x: f64, y: f64| format!("{{{{{x}, {y}, 250}}, {{0,0,-1}}, {{1,0,0}}}}");
    // Metres forgotten, ten kilometres, a hundred thousand; straight and smooth, first and later.
    let mut program = "InitCanon()\nMoveTo({{450, 0, 250}, {0,0,-1}, {1,0,0}})\n".to_owned();
    program += "SetLengthUnits(\"meter\")\nSetIntermediatePointTolerance(0.02)\n";
    let moves = [
        format!(
            "MoveSmoothlyTo({{{}, {}}}, 2)\n",
            pose(450.0, -100.0),
            pose(450.0, 100.0)
        ),
        format!("MoveStraightTo({})\n", pose(450.0, 10.0)),
        format!("MoveStraightTo({})\n", pose(1e4, 0.0)),
        format!("MoveSmoothlyTo({{{}}}, 1)\n", pose(1e8, 0.0)),
        format!("MoveTo({})\n", pose(1e4, 0.0)),
    ];
    program += &moves.concat();
    program += "EndCanon(0)\n";
    let ran = canter_reading(["check", "-", "--robot", "ur5e"], program.as_bytes());
    assert_eq!(ran.code, 1, "{}{}", ran.stdout, ran.stderr);
    let said = ran.stdout.matches("pose 1 is out of reach by ").count();
    assert_eq!(said, moves.len(), "{}", ran.stdout);
    for word in ["NaN", "inf "] {
        assert!(!ran.stdout.contains(word), "{}", ran.stdout);
    }
}

/// A line that ends next to a singular pose can be followed, but has no time law: the error says
/// so.
#[test]
fn a_line_next_to_a_singular_pose_is_explained() {
    let program = "tests/data/next_to_singular.canon";
    let ran = canter(["check", program, "--robot", "ur5e"]);
    assert_eq!(ran.code, 1, "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("singular pose"), "{}", ran.stdout);
    assert!(!ran.stdout.contains("NaN"), "{}", ran.stdout);
}

/// Runs `canter` with a file as standard input; it must end by itself.
fn ended(arguments: &[&str], input: &str) -> Ran {
    let mut child = crate::canter::command(arguments)
        .stdin(std::fs::File::open(input).unwrap())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(120);
    while child.try_wait().unwrap().is_none() {
        if std::time::Instant::now() > deadline {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    crate::canter::ran(child.wait_with_output().unwrap())
}

/// Where a file is expected, a pipe is not waited for and a device is not read until memory ends.
#[test]
fn pipes_and_devices_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str| {
        let path = folder.path().join(name).to_str().unwrap().to_owned();
        let status = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(status.unwrap().success());
        path
    };
    let (fifo, world, xml) = (made("fifo"), made("world.db"), made("world.xml"));
    let database = folder.path().join("new.db").to_str().unwrap().to_owned();
    let (zero, robot) = ("/dev/zero", ["--robot", "ur5e"]);
    let program = "examples/pick_and_place.canon";
    let plan = "examples/kitting/one-kit.pddl";
    let cases: Vec<Vec<&str>> = vec![
        vec!["check", &fifo],
        vec!["check", zero],
        vec!["plan", &fifo, robot[0], robot[1]],
        vec!["run", zero, robot[0], robot[1]],
        vec!["convert", &fifo],
        vec!["send", &fifo],
        vec!["verify", zero, program, robot[0], robot[1]],
        vec!["fk", "--joints", &fifo, robot[0], robot[1]],
        vec!["ik", "--poses", zero, robot[0], robot[1]],
        vec!["plan-check", &fifo],
        vec!["plan-check", plan, "--actions", &fifo],
        vec![
            "plan-check",
            "examples/kitting/kit-abc.plan",
            "--world",
            &world,
        ],
        vec!["plan-run", zero, "--world", &world, robot[0], robot[1]],
        vec!["plan-run", plan, "--world", &world, robot[0], robot[1]],
        vec!["world", "show", &world],
        vec!["world", "show", &xml],
        vec!["world", "import", &xml, &database],
        vec!["world", "import", crate::plans::WORLD, &world],
        vec!["bench", "motion", &fifo],
    ];
    for case in cases {
        let ran = ended(&case, "/dev/null");
        assert_eq!(
            (ran.code, ran.stdout.as_str()),
            (3, ""),
            "{case:?}: {}",
            ran.stderr
        );
        assert!(
            ran.stderr.contains("regular file"),
            "{case:?}: {}",
            ran.stderr
        );
    }
    // Standard input may be anything, but not without end.
    let ran = ended(&["check", "-"], zero);
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert!(ran.stderr.contains("at most 256 MiB"), "{}", ran.stderr);
    let ran = ended(&["fk", "--joints", "-", robot[0], robot[1]], zero);
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert!(ran.stderr.contains("lines of at most"), "{}", ran.stderr);
}

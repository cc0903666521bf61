//! What was recorded is executed again with equal bits.

use std::fs;
use std::path::{Path, PathBuf};

use crate::arm;
use crate::canter::canter;

/// Programs with the robots that can execute them.
const RUNS: [(&str, &[&str]); 4] = [
    (
        "examples/pick_and_place.canon",
        &[
            "ur5e",
            "ur10e",
            "iiwa14",
            "xarm7",
            "lrmate200id",
            "irb1200_7_70",
            "tx2_60",
        ],
    ),
    (
        "examples/round_an_obstacle.canon",
        &["ur5e", "ur10e", "iiwa14", "panda", "fr3"],
    ),
    (
        "examples/inches_and_degrees.canon",
        &["ur5e", "ur10e", "iiwa14", "iiwa7"],
    ),
    (
        "examples/long_smooth_path.canon",
        &["ur5e", "ur10e", "iiwa14", "irb1200_7_70"],
    ),
];

/// Records a run in lock-step; nothing where the robot cannot execute the program.
fn record(folder: &Path, number: usize, program: &str, robot: &str) -> Option<PathBuf> {
    if canter(["check", program, "--robot", robot]).code != 0 {
        return None;
    }
    let file = folder.join(format!("{number}.mcap"));
    let option = format!("--record={}", file.display());
    let arm = arm(&format!("again{number}"));
    let ran = canter([
        "run",
        program,
        "--robot",
        robot,
        "--lock-step",
        "--arm",
        &arm,
        &option,
    ]);
    assert_eq!(ran.code, 0, "{program} {robot}: {}", ran.stderr);
    Some(file)
}

/// Recordings of programs and robots are bit-equal when executed again, and one changed byte of the
/// file is found.
pub(crate) fn twenty_recordings_are_executed_again() {
    let folder = tempfile::tempdir().unwrap();
    let runs = RUNS
        .iter()
        .flat_map(|(program, robots)| robots.iter().map(move |robot| (*program, *robot)));
    let mut done = 0;
    for (number, (program, robot)) in runs.enumerate() {
        let Some(file) = record(folder.path(), number, program, robot) else {
            println!("{program} {robot}: this robot cannot execute it");
            continue;
        };
        let shown = file.display().to_string();
        let ran = canter(["replay", "--check", &shown]);
        assert_eq!(ran.code, 0, "{program} {robot}: {}", ran.stderr);
        assert!(
            ran.stderr.contains("are equal bit by bit"),
            "{}",
            ran.stderr
        );
        println!("{program} {robot}: {}", ran.stderr.trim());
        let mut bytes = fs::read(&file).unwrap();
        let place = bytes.len() / 20 * (number % 20) + 4099 % (bytes.len() / 20);
        bytes[place] ^= 1;
        fs::write(&file, &bytes).unwrap();
        let ran = canter(["replay", "--check", &shown]);
        assert!(ran.code != 0, "byte {place} of {} is changed", bytes.len());
        done += 1;
    }
    println!("{done} recordings are equal");
    assert!(done >= 16, "{done} recordings only");
}

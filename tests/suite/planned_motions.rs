//! The output of `canter plan`, checked independently from its CSV: every example on every robot.

use crcl::Command;
use system_tests::arm::Arm;
use system_tests::motion::{Row, faults, rows};
use system_tests::repository::{files, root};

use crate::canter::canter;

/// Plans an example and reads the CSV back; `None` when the robot cannot do it.
fn planned(arm: &Arm, robot: &str, example: &str) -> Option<Vec<Row>> {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("samples.csv");
    let csv_argument = csv.to_str().unwrap();
    let ran = canter(["plan", example, "--robot", robot, "--samples", csv_argument]);
    if ran.code == 1 {
        assert!(
            ran.stderr.contains("error"),
            "{example} on {robot}: refused without a reason"
        );
        assert!(
            !csv.exists(),
            "{example} on {robot}: refused, but samples were written"
        );
        return None;
    }
    assert_eq!(ran.code, 0, "{example} on {robot}: {}", ran.stderr);
    let text = std::fs::read_to_string(csv).unwrap();
    Some(rows(&text, arm.joints.len()).unwrap())
}

fn program(example: &str) -> Vec<Command> {
    let text = std::fs::read_to_string(root().join(example)).unwrap();
    let reading = crcl::text::read(&text, &crcl::ReadOptions::default());
    assert!(!reading.has_errors(), "{example}: {:?}", reading.findings);
    reading.program.iter().cloned().collect()
}

fn examples() -> Vec<String> {
    let name =
        |path: &std::path::PathBuf| format!("examples/{}", path.file_name().unwrap().display());
    let examples: Vec<_> = files("examples", "canon")
        .unwrap()
        .iter()
        .map(name)
        .collect();
    assert!(examples.len() >= 5, "examples are missing: {examples:?}");
    examples
}

/// All examples on one robot; gives how many it can do.
fn check(robot: &str) -> usize {
    let arm = Arm::read(robot);
    let mut done = 0;
    for example in examples() {
        let Some(rows) = planned(&arm, robot, &example) else {
            continue;
        };
        let faults = faults(&arm, &program(&example), &rows);
        assert!(
            faults.is_empty(),
            "{example} on {robot}: {:#?}",
            &faults[..faults.len().min(8)]
        );
        done += 1;
    }
    done
}

macro_rules! robots {
    ($($robot:ident)*) => {
        $(#[test]
        fn $robot() {
            assert_eq!(check(stringify!($robot)), examples().len(), "an example was refused");
        })*
    };
}

robots! { ur5e ur10e panda fr3 iiwa7 iiwa14 }

/// Arms that are smaller or placed differently execute the examples that they reach, and these
/// correctly. The number of examples is part of the test: an arm that refuses everything must not
/// pass.
#[test]
fn every_other_robot() {
    let named = ["ur5e", "ur10e", "panda", "fr3", "iiwa7", "iiwa14"];
    let fewer = [("gantry", 4), ("irb120", 3)];
    for robot in planner::robot::list() {
        if !named.contains(&robot) {
            let known = fewer.iter().find(|(name, _)| *name == robot);
            let expected = known.map_or(examples().len(), |(_, count)| *count);
            assert_eq!(check(robot), expected, "examples that {robot} does");
        }
    }
}

/// The checker can fail: a good motion with one change is refused.
#[test]
fn a_wrong_motion_is_seen() {
    let arm = Arm::read("ur5e");
    let example = "examples/pick_and_place.canon";
    let program = program(example);
    let good = || planned(&arm, "ur5e", example).unwrap();
    let found = |change: &dyn Fn(&mut Vec<Row>)| {
        let mut rows = good();
        change(&mut rows);
        faults(&arm, &program, &rows).join("\n")
    };
    let middle = |rows: &Vec<Row>| rows.len() / 2;
    assert_eq!(found(&|_| {}), "");
    let pushed = found(&|rows| {
        let at = middle(rows);
        rows[at].q[2] += 1e-4;
    });
    assert!(
        pushed.contains("dq is off") && pushed.contains("pose at"),
        "{pushed}"
    );
    let fast = found(&|rows| {
        let at = middle(rows);
        rows[at].dq[1] = 4.0;
    });
    assert!(fast.contains("velocity 4"), "{fast}");
    let shaken = found(&|rows| {
        let at = middle(rows);
        rows[at].ddq[0] += 0.5;
    });
    assert!(shaken.contains("jerk"), "{shaken}");
    let short = found(&|rows| rows.truncate(rows.len() - 400));
    assert!(
        short.contains("at rest") || short.contains("from the last pose"),
        "{short}"
    );
    // The same motion for a program that asks for another way.
    let mut other = program.clone();
    for command in &mut other {
        if let Command::MoveSmoothlyTo { poses } = command {
            poses.swap(0, 1);
        }
        if let Command::SetAbsoluteSpeed { value } = command {
            *value = 1.0;
        }
    }
    let other = faults(&arm, &other, &good()).join("\n");
    assert!(
        other.contains("is passed at") && other.contains("m/s beyond"),
        "{other}"
    );
}

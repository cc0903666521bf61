//! `canter bench` and `canter verify` as a user runs them.

use serde_json::Value;

use crate::canter::{Ran, canter};

const SUITE: &str = r#"{"about": "two corners and two faults", "cases": {
    "corner": {"P": [[0,0,0],[100,0,0],[100,100,0]], "Q": null, "tol": 1, "V": 500, "A": 5000, "J": 1e5},
    "negative": {"P": [[0,0,0],[100,0,0]], "Q": null, "tol": -1, "V": 500, "A": 5000, "J": 1e5},
    "far": {"P": [[0,0,0],[90000,0,0],[0,0,0]], "Q": null, "tol": 1, "V": 500, "A": 5000, "J": 1e5},
    "wide": {"P": [[0,0,0],[100,0,0],[100,100,0]], "Q": null, "tol": 20, "V": 500, "A": 5000, "J": 1e5}}}"#;

fn bench(robot: Option<&str>) -> (Ran, Value) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("suite.json");
    std::fs::write(&file, SUITE).unwrap();
    let mut arguments = vec!["bench", "motion", file.to_str().unwrap(), "--json"];
    if let Some(robot) = robot {
        arguments.extend(["--robot", robot]);
    }
    let ran = canter(arguments);
    let report = serde_json::from_str(&ran.stdout).unwrap();
    (ran, report)
}

fn case<'a>(report: &'a Value, name: &str) -> &'a Value {
    let cases = report["cases"].as_array().unwrap();
    cases.iter().find(|case| case["name"] == name).unwrap()
}

#[test]
fn a_case_at_fault_does_not_stop_the_others() {
    for robot in [None, Some("gantry"), Some("ur5e")] {
        let (ran, report) = bench(robot);
        assert_eq!(ran.code, 1, "a case could not be planned");
        assert_eq!(report["schema"], 1);
        let names: Vec<_> = report["cases"].as_array().unwrap().iter().collect();
        assert_eq!(names.len(), 4);
        for name in ["corner", "wide"] {
            let case = case(&report, name);
            let number = |key: &str| case[key].as_f64().unwrap();
            assert_eq!(case["certified"], true, "{robot:?} {case}");
            assert!(case["reason"].is_null());
            assert!(number("motion_s") < number("exact_stop_s"), "{case}");
            for ratio in [
                "deviation_ratio",
                "corridor_ratio",
                "velocity_ratio",
                "acceleration_ratio",
                "jerk_ratio",
            ] {
                assert!(
                    (0.0..=1.0 + 1e-6).contains(&number(ratio)),
                    "{ratio}: {case}"
                );
            }
            assert!(number("planning_s") > 0.0 && case["fallbacks"].is_u64());
        }
        let faulty = case(&report, "negative");
        assert!(faulty["motion_s"].is_null() && faulty["certified"] == false);
        assert!(faulty["reason"].as_str().unwrap().contains("tol"));
        let far = case(&report, "far");
        assert_eq!(far["motion_s"].is_null(), robot.is_some(), "{far}");
        let time = |name: &str| case(&report, name)["motion_s"].as_f64().unwrap();
        assert!(time("wide") < time("corner"));
    }
}

#[test]
fn a_suite_that_cannot_be_read_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("suite.json");
    for (text, words) in [
        ("", "line 1"),
        ("{\"cases\": [1]}", "an object with a case for each name"),
        ("{\"cases\": {\"a\": {}, \"a\": {}}}", "twice"),
        ("{}", "cases"),
    ] {
        std::fs::write(&file, text).unwrap();
        let ran = canter(["bench", "motion", file.to_str().unwrap()]);
        assert_eq!((ran.code, ran.stdout.as_str()), (3, ""));
        assert!(ran.stderr.contains(words), "{text}: {}", ran.stderr);
    }
}

#[test]
fn random_benchmarks_are_sound() {
    for (what, count) in [("otg", "50"), ("timing", "2")] {
        let ran = canter(["bench", what, "--seed", "3", "--count", count, "--json"]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let report: Value = serde_json::from_str(&ran.stdout).unwrap();
        let rows = report["rows"].as_array().unwrap();
        assert!(
            rows.len() >= 5 && rows.iter().all(|row| row["failed"] == 0),
            "{report}"
        );
        let table = canter(["bench", what, "--count", count]);
        assert_eq!(table.code, 0);
        assert_eq!(
            table.stdout.lines().count(),
            rows.len() + 2,
            "{}",
            table.stdout
        );
    }
}

#[test]
fn a_planned_motion_verifies_and_a_changed_one_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("samples.csv");
    let csv_argument = csv.to_str().unwrap();
    for example in ["pick_and_place", "round_an_obstacle", "tool_change"] {
        let program = format!("examples/{example}.canon");
        let planned = canter(["plan", &program, "-r", "ur5e", "--samples", csv_argument]);
        assert_eq!(planned.code, 0, "{}", planned.stderr);
        let ran = canter(["verify", csv_argument, &program, "-r", "ur5e", "--json"]);
        let verdict: Value = serde_json::from_str(&ran.stdout).unwrap();
        assert_eq!(ran.code, 0, "{example}: {verdict:#}");
        assert_eq!(verdict["holds"], true);
    }
    let program = "examples/tool_change.canon";
    let text = std::fs::read_to_string(&csv).unwrap();
    let verify = |text: &str| {
        std::fs::write(&csv, text).unwrap();
        canter(["verify", csv_argument, program, "-r", "ur5e"])
    };
    // So is what a run has published.
    let run = [
        "run",
        "examples/round_an_obstacle.canon",
        "-r",
        "panda",
        "--lock-step",
        "--samples",
        csv_argument,
        "--arm",
    ];
    let arm = format!("test{}/verified", std::process::id());
    let ran = canter(run.iter().chain([&arm.as_str()]));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let ran = canter(["verify", csv_argument, run[1], "-r", "panda"]);
    assert_eq!(ran.code, 0, "{}", ran.stdout);

    let lines: Vec<&str> = text.lines().collect();
    let middle = lines.len() / 2;
    let shortened: Vec<_> = lines[..middle].to_vec();
    let ran = verify(&shortened.join("\n"));
    assert_eq!(ran.code, 1, "{}", ran.stdout);
    assert!(ran.stdout.contains("FAULT") && ran.stdout.contains("does NOT hold"));
    let mut broken = lines.clone();
    let word = broken[middle].replace(',', ",x");
    broken[middle] = &word;
    let ran = verify(&broken.join("\n"));
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert!(
        ran.stderr.contains(&format!("line {}", middle + 1)),
        "{}",
        ran.stderr
    );
}

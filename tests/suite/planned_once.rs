//! A program from a file is planned once, and executed as planned.

use std::fmt::Write;

use serde_json::Value;

use crate::canter::canter;
use crate::runs::same_setpoints;

/// Moves of the program.
const MOVES: usize = 300;

/// A program of straight and free moves over a small field.
fn program() -> String {
    let mut text = String::from(
        "InitCanon()\nSetRelativeSpeed(100)\nSetRelativeAcceleration(100)\n\
         MoveTo({{400, -100, 300}, {0, 0, -1}, {1, 0, 0}})\n",
    );
    for number in 1..MOVES {
        let name = if number % 3 == 0 {
            "MoveTo"
        } else {
            "MoveStraightTo"
        };
        let (x, y) = (400 + number % 7 * 3, number % 11 * 4);
        writeln!(
            text,
            "{name}({{{{{x}, {y}, 300}}, {{0, 0, -1}}, {{1, 0, 0}}}})"
        )
        .unwrap();
    }
    text + "EndCanon(0)\n"
}

#[test]
fn a_program_of_300_moves_is_planned_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(file("moves.canon"), program()).unwrap();
    let plan = canter([
        "plan",
        &file("moves.canon"),
        "-r",
        "ur5e",
        "--json",
        "--samples",
        &file("plan.csv"),
    ]);
    assert_eq!(plan.code, 0, "{}", plan.stderr);
    let planned: Value = serde_json::from_str(&plan.stdout).unwrap();
    assert_eq!(planned["plans"], MOVES, "the dry run plans each move once");
    let arm = format!("test{}/once", std::process::id());
    let run = canter([
        "run",
        &file("moves.canon"),
        "-r",
        "ur5e",
        "--json",
        "--lock-step",
        "--arm",
        &arm,
        "--samples",
        &file("run.csv"),
    ]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let summary: Value = serde_json::from_str(run.stdout.lines().last().unwrap()).unwrap();
    assert_eq!(summary["done"], MOVES + 4, "{summary}");
    assert_eq!(summary["plans"], MOVES, "planned before and never again");

    let file = |name: &str| folder.path().join(name);
    let compared = same_setpoints(&file("plan.csv"), &file("run.csv"), MOVES + 4);
    assert!(compared > 10_000, "only {compared} setpoints were compared");
}

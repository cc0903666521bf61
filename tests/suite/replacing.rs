//! A move takes the place of the one that moves, in the same state of motion: in lock-step, where
//! time stands while the planner works.

use std::time::Duration;

use crcl::{Located, ReadOptions};
use engine::session::{Note, RunSample};
use planner::dry_run::FailurePolicy;

use crate::guards::{Cell, pose};

fn commands(text: &str) -> Vec<Located> {
    let read = crcl::text::read(text, &ReadOptions::default());
    assert!(!read.has_errors(), "{text}: {:?}", read.findings);
    read.program.commands
}

/// Begins a long slow move and waits until it moves.
fn begin(cell: &Cell, kind: &str) {
    cell.execute(&format!(
        "InitCanon()\nSetRelativeSpeed(50)\nMoveTo({})\nSetAbsoluteSpeed(10)",
        pose(320.0)
    ));
    drop(cell.session.samples());
    let ids = cell
        .session
        .submit(commands(&format!("{kind}({})", pose(120.0))))
        .unwrap();
    for _ in 0..200 {
        let note = cell.session.note(Duration::from_millis(50));
        if matches!(note, Some(Note::Started { id, .. }) if id == ids[0]) {
            return;
        }
    }
    panic!("nothing moves");
}

/// Waits until this command is done; gives the names of all that were done.
fn wait(cell: &Cell, last: u32) -> Vec<u32> {
    let mut done = Vec::new();
    for _ in 0..600 {
        match cell.session.note(Duration::from_millis(100)) {
            Some(Note::Done { id, .. }) => done.push(id),
            Some(note @ (Note::Faulted { .. } | Note::Refused { .. })) => panic!("{note}"),
            _ => {}
        }
        if done.last() == Some(&last) {
            return done;
        }
    }
    panic!("{last} is not done: {done:?}");
}

/// From the first motion to the last, nothing rests, and each row follows from the one before: speed
/// and acceleration do not jump.
fn judge(samples: &[RunSample]) {
    let moves = |sample: &RunSample| sample.dq.iter().any(|speed| speed.abs() > 1e-9);
    let first = samples.iter().position(moves).unwrap();
    let last = samples.iter().rposition(moves).unwrap();
    let rows = &samples[first..=last];
    assert!(rows.iter().all(moves), "the arm rests between the moves");
    let limits = planner::robot::load("ur5e").unwrap().joints;
    for pair in rows.windows(2) {
        for joint in 0..6 {
            let (before, after) = (&pair[0], &pair[1]);
            let step = after.q[joint] - before.q[joint];
            let expected = (before.dq[joint] + after.dq[joint]) * 0.5e-3;
            assert!((step - expected).abs() < 1e-6, "a jump of joint {joint}");
            let jerk = (after.ddq[joint] - before.ddq[joint]) / 1e-3;
            assert!(
                jerk.abs() < 1.01 * limits.jerk[joint],
                "jerk {jerk} of joint {joint}"
            );
        }
    }
}

fn replaced(kind: &str, first: &str) {
    let cell = Cell::start(&format!("replace{kind}{first}"), FailurePolicy::Abort);
    begin(&cell, first);
    let settings = "SaveSettings()\nSetAbsoluteSpeed(40)";
    let text = format!("{settings}\n{kind}({})\nRestoreSettings()", pose(170.0));
    let ids = cell.session.replace(commands(&text)).unwrap();
    let done = wait(&cell, *ids.last().unwrap());
    assert_eq!(done, ids, "the old move never becomes done");
    judge(&cell.session.samples());
    let [_, _, z] = cell.session.status().position_m;
    assert!((z - 0.17).abs() < 1e-4, "{z}");
    // The next command begins there.
    cell.execute(&format!(
        "SetAbsoluteSpeed(200)\nMoveStraightTo({})",
        pose(200.0)
    ));
}

#[test]
fn a_straight_move_takes_the_place_of_a_straight_one() {
    replaced("MoveStraightTo", "MoveStraightTo");
}

#[test]
fn a_move_takes_the_place_of_any() {
    replaced("MoveTo", "MoveStraightTo");
    replaced("MoveTo", "MoveTo");
}

/// What cannot begin in motion is refused, and the old move goes on to its end.
#[test]
fn a_move_that_leads_back_is_refused() {
    let cell = Cell::start("leads_back", FailurePolicy::Abort);
    begin(&cell, "MoveStraightTo");
    for text in [
        format!("MoveStraightTo({})", pose(320.0)),
        format!(
            "Guard({{\"force\", \"OVER_MAX\", 5}})\nMoveTo({})",
            pose(170.0)
        ),
        "Dwell(1)".to_owned(),
        format!("MoveTo({})\nMoveTo({})", pose(170.0), pose(180.0)),
    ] {
        assert!(cell.session.replace(commands(&text)).is_err(), "{text}");
    }
    assert!(cell.session.status().fault.is_none());
    let rest = cell.execute("Message(\"behind\")");
    assert!(rest.iter().any(|note| matches!(
        note,
        Note::Done {
            name: "MoveStraightTo",
            ..
        }
    )));
    let [_, _, z] = cell.session.status().position_m;
    assert!((z - 0.12).abs() < 1e-4, "{z}");
}

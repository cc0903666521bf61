//! Programs that broke a law at commit a4f2825, one fault each: what must hold now.

use std::path::PathBuf;

use crcl::{LengthUnit, Program, ReadOptions};
use planner::dry_run::{Plan, PlanOptions, plan_program};
use planner::recorded::{RecordedSample, verify_program};
use planner::robot::{Robot, load};

const FOLDER: &str = "data/repro";

/// The programs that can be planned, with their robots.
const SOUND: [(&str, &str); 9] = [
    ("angular_jerk_xarm6", "xarm6"),
    ("mixed_ur5e_tol0", "ur5e"),
    ("mixed_ur5e_tol20", "ur5e"),
    ("panic_turn_at_end", "ur5e"),
    ("shipcap_irb120_23", "irb120"),
    ("slow_planning_lrmate200id", "lrmate200id"),
    ("slower_than_straights_ur5e_tol20", "ur5e"),
    ("stay", "ur5e"),
    ("times_back_xarm7", "xarm7"),
];

/// Most that a motion may be slower by (s): the start and the end of a command are on ticks.
const TICKS: f64 = 3e-3;

fn program(name: &str) -> Program {
    let text = crate::text(&format!("{FOLDER}/{name}.canon"));
    let reading = crcl::text::read(&text, &ReadOptions::default());
    assert!(!reading.has_errors(), "{name}: {:?}", reading.findings);
    reading.program
}

fn planned(robot: &Robot, program: &Program) -> Plan {
    plan_program(robot, program, &PlanOptions::default()).unwrap()
}

/// The plan of a program on a robot, which has no refusal.
fn whole(name: &str, robot: &str) -> Plan {
    let plan = planned(&load(robot).unwrap(), &program(name));
    assert!(plan.refusals.is_empty(), "{name}: {:?}", plan.refusals);
    plan
}

/// Every row of a plan at 1 kHz, as `canter verify` reads it.
fn rows(plan: &Plan) -> Vec<RecordedSample> {
    plan.samples(1e-3).map(RecordedSample::from).collect()
}

/// No limit is broken, no passing time goes back, no number is NaN, and the checker agrees.
pub(crate) fn programs_that_broke_a_law_hold_now() {
    for (name, robot) in SOUND {
        let plan = whole(name, robot);
        for command in &plan.commands {
            let Some(certificate) = &command.certificate else {
                continue;
            };
            let peak = certificate.peaks.largest();
            assert!(peak <= 1.0 + 1e-9, "{name}: {}: {peak}", command.name);
            assert!(certificate.in_order, "{name}: {}", command.name);
            let times = certificate.poses.iter().map(|pass| pass.time_s);
            assert!(times.is_sorted(), "{name}: {:?}", certificate.poses);
        }
        let (robot, program) = (load(robot).unwrap(), program(name));
        let verdict = verify_program(&robot, &program, LengthUnit::default(), &rows(&plan));
        assert!(verdict.holds, "{name}: {verdict:?}");
    }
}

/// Three legs and then a turn on the spot at the last point: planned or refused, never a panic, on
/// arms of each kind.
pub(crate) fn a_turn_at_the_end_is_planned() {
    for name in ["panic_min", "panic_turn_at_end"] {
        let program = program(name);
        let plans = ["ur5e", "panda", "irb120", "gantry"].map(|robot| {
            let plan = planned(&load(robot).unwrap(), &program);
            usize::from(plan.refusals.is_empty())
        });
        let count: usize = plans.into_iter().sum();
        assert!(count > 0, "{name} is refused on every robot");
    }
}

/// A move to where the arm stands is made, and takes no time.
pub(crate) fn a_move_to_where_the_arm_stands_takes_no_time() {
    let plan = whole("stay", "ur5e");
    let stay = plan
        .commands
        .iter()
        .rfind(|command| command.certificate.is_some());
    assert_eq!(stay.unwrap().duration_s, 0.0);
}

/// A list with tolerance 0 takes no longer than straight moves to its poses.
pub(crate) fn tolerance_zero_is_not_slower_than_straight_moves() {
    for case in ["slower_than_straights_ur5e", "mixed_ur5e"] {
        let [smooth, straight] =
            ["tol0", "straights"].map(|kind| whole(&format!("{case}_{kind}"), "ur5e").duration_s);
        assert!(
            smooth <= straight + TICKS,
            "{case}: {smooth} s, {straight} s"
        );
    }
}

/// More tolerance makes no motion slower.
pub(crate) fn more_tolerance_is_not_slower() {
    let case = "more_tolerance_slower_panda";
    let [more, less, none] = ["tol20", "tol5", "straights"]
        .map(|kind| whole(&format!("{case}_{kind}"), "panda").duration_s);
    assert!(
        more <= less + TICKS,
        "{more} s with 20 mm, {less} s with 5 mm"
    );
    assert!(
        less <= none + TICKS,
        "{less} s with 5 mm, {none} s straight"
    );
}

/// Lines of seven-joint arms that can be followed with another motion of the spare joint.
pub(crate) fn lines_that_can_be_followed_are_not_refused() {
    for (name, robot) in [
        ("refused_but_possible_fr3_0", "fr3"),
        ("refused_but_possible_iiwa14_2", "iiwa14"),
        ("refused_but_possible_panda_5", "panda"),
    ] {
        whole(name, robot);
    }
}

/// Every program of the folder is in one of the tests above.
pub(crate) fn every_program_is_used() {
    let own = include_str!("repro.rs");
    let names = std::fs::read_dir(crate::path(FOLDER)).unwrap();
    for path in names.map(|entry| entry.unwrap().path()) {
        let name = PathBuf::from(path.file_stem().unwrap());
        let name = name.display().to_string();
        // Names of a group are made of the group and the kind.
        let group = ["_tol0", "_tol5", "_tol20", "_straights"]
            .iter()
            .find_map(|kind| name.strip_suffix(kind));
        assert!(own.contains(group.unwrap_or(&name)), "{name} is not tested");
    }
}

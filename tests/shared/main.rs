//! Tests with files from outside the repository: programs, plans and workstations of NIST, and
//! programs that once broke a law; and with Pinocchio, where Python has it.
//!
//! The files are in a folder beside the repository, `../shared`, which a clone does not have. If it
//! is missing, these tests are reported as ignored; every property that they test is also tested on
//! files of the repository. The separate test harness (`libtest-mimic`) is needed because an
//! ordinary test cannot become ignored at run time.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(clippy::print_stdout, reason = "measured values are printed")]
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(dead_code, reason = "helpers that the other tests use")]

#[path = "../suite/canter.rs"]
mod canter;
#[path = "../suite/crcl_client.rs"]
mod crcl_client;
mod crcl_files;
mod dynamics;
mod pddl;
mod plans;
mod programs;
mod repro;
mod workstations;

use std::path::{Path, PathBuf};

use libtest_mimic::{Arguments, Trial};

/// The folder of foreign files.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared")
}

/// A file of it.
fn path(name: &str) -> PathBuf {
    folder().join(name)
}

/// The text of a file of it.
fn text(name: &str) -> String {
    let path = path(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Ignored because it does not hold yet: a seven-joint arm takes longer with 20 mm than with 5 mm.
const NOT_YET: [&str; 1] = ["repro::more_tolerance_is_not_slower"];

macro_rules! trials {
    ($($module:ident::$name:ident)*) => {
        vec![$((concat!(stringify!($module), "::", stringify!($name)), $module::$name as fn())),*]
    };
}

fn main() {
    let tests: Vec<(&str, fn())> = trials! {
        dynamics::efforts_agree_with_pinocchio
        crcl_files::programs_are_read_or_refused_for_a_reason
        crcl_files::commands_are_read
        crcl_files::statuses_are_read
        crcl_files::what_is_written_is_valid
        crcl_files::recorded_conversations_get_the_same_kind_of_answer
        crcl_files::recorded_bytes_are_answered
        programs::sound_programs_have_no_findings
        programs::commands_with_errors
        repro::programs_that_broke_a_law_hold_now
        repro::a_turn_at_the_end_is_planned
        repro::a_move_to_where_the_arm_stands_takes_no_time
        repro::tolerance_zero_is_not_slower_than_straight_moves
        repro::more_tolerance_is_not_slower
        repro::lines_that_can_be_followed_are_not_refused
        repro::every_program_is_used
        workstations::nist_workstations_come_in
        workstations::a_nist_workstation_holds_what_it_says
        plans::the_document_is_read_unchanged
        plans::layouts_agree
        plans::the_documents_oddities_are_found
        plans::the_documents_plan_is_checked
        plans::the_documents_plan_makes_three_kits_in_thought
        pddl::good_plans_reach_their_goal
        pddl::bad_plans_fail_where_they_should
        pddl::verdicts_of_the_command_line
        pddl::the_plan_of_june_2012_runs_on_the_arm
    };
    let arguments = Arguments::from_args();
    let missing = !folder().is_dir();
    // Python with lxml validates what is written; where it is missing nobody else can.
    let alone = !crcl_files::has_validator();
    let without_pinocchio = !dynamics::has_pinocchio();
    let run = |name: &str| match name {
        // Its robots come with the repository; what it needs is Python with pin.
        "dynamics::efforts_agree_with_pinocchio" => !without_pinocchio,
        "crcl_files::what_is_written_is_valid" => !alone,
        name => !NOT_YET.contains(&name),
    };
    let trial = |(name, test): (&str, fn())| {
        Trial::test(name, move || {
            test();
            Ok(())
        })
        .with_ignored_flag((missing && !name.starts_with("dynamics::")) || !run(name))
    };
    let trials = tests.into_iter().map(trial).collect();
    libtest_mimic::run(&arguments, trials).exit();
}

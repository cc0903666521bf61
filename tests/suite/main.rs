//! All system tests as one binary: one link step instead of one per file.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(clippy::print_stdout, reason = "measured values are printed")]

mod arrows;
mod bad_inputs;
mod benchmarks;
mod canter;
mod circles;
mod command_line;
mod control;
mod crcl_client;
mod crcl_crpi;
mod crcl_faults;
mod crcl_guards;
mod crcl_motion;
mod crcl_preemption;
mod crcl_server;
mod crcl_tls;
mod documents;
mod domains;
mod drivers;
mod faults;
mod follow;
mod guards;
mod jogs;
mod killed_plans;
mod kitting_end_to_end;
mod operators;
mod packages;
mod plan_costs;
mod planned_motions;
mod planned_once;
mod plans;
mod replacing;
mod runs;
mod session;
mod shared_memory;
mod snippets;
mod soak;
mod status;
mod streaming;
mod units;
mod world_in_use;

/// Every file of this folder is a module above: otherwise it would never run.
#[test]
fn no_test_file_was_forgotten() {
    let runner = include_str!("main.rs");
    let forgotten = forgotten(
        runner,
        &system_tests::repository::files("tests/suite", "rs").unwrap(),
    );
    assert!(
        forgotten.is_empty(),
        "add to tests/suite/main.rs: {forgotten:?}"
    );
}

/// The names of `files` that `runner` has no `mod` line for.
fn forgotten(runner: &str, files: &[std::path::PathBuf]) -> Vec<String> {
    files
        .iter()
        .map(|file| file.file_stem().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "main" && !runner.lines().any(|line| line == format!("mod {name};")))
        .collect()
}

/// The check above fires.
#[test]
fn a_forgotten_test_file_is_seen() {
    let files = ["main.rs".into(), "here.rs".into(), "lost.rs".into()];
    assert_eq!(forgotten("mod here;\n", &files), ["lost"]);
}

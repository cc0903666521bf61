//! The bridge to ROS 2 against a DDS of others, and its messages against other readers of them.
//!
//! Without Python, Cyclone DDS or rosbags these tests are reported as ignored, with the reason. The
//! scripts are in `ros2/tests`; engines, arms and bridges are processes of their own.
#![allow(clippy::print_stdout, reason = "measured values are printed")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use libtest_mimic::{Arguments, Failed, Trial};
use system_tests::{domain, python};

/// Scripts of `ros2/tests` with their arguments, and the Python package and the header that each needs.
const SCRIPTS: [(&str, &[&str], &str, &str); 4] = [
    ("page", &[], "json", ""),
    ("golden", &["check"], "rosbags", ""),
    ("cyclone", &[], "cyclonedds", ""),
    (
        "fastdds",
        &[],
        "rosbags",
        "fastdds/dds/domain/DomainParticipant.hpp",
    ),
];

fn main() {
    let mut arguments = Arguments::from_args();
    // Engines and their threads want the processors to themselves.
    arguments.test_threads = Some(1);
    let mut trials = vec![
        Trial::test("without_the_program", without_the_program),
        Trial::test("arguments_reach_the_program", arguments_reach_the_program),
        Trial::test("without_an_engine", without_an_engine),
    ];
    for (script, words, package, header) in SCRIPTS {
        let missing = python::has(package, package)
            .and_then(|()| has_header(header))
            .err();
        if let Some(reason) = &missing {
            eprintln!("{reason}: ros2/tests/{script}.py is ignored");
        }
        let trial = Trial::test(format!("{script}.py"), move || run(script, words));
        trials.push(trial.with_ignored_flag(missing.is_some()));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

/// Whether a header of Fast DDS is installed, where one is needed; the reason if not.
fn has_header(header: &str) -> Result<(), String> {
    let path = Path::new("/usr/include").join(header);
    if header.is_empty() || path.is_file() {
        return Ok(());
    }
    Err(format!(
        "there is no {} (apt-get install libfastrtps-dev)",
        path.display()
    ))
}

fn run(script: &str, words: &[&str]) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().display().to_string();
    let words = if words.is_empty() {
        &[path.as_str()]
    } else {
        words
    };
    let (canter, bridge) = (
        env!("CARGO_BIN_EXE_canter-under-test"),
        env!("CARGO_BIN_EXE_canter-ros2-under-test"),
    );
    let programs = [
        ("CANTER_COMMAND", canter.to_owned()),
        ("CANTER_ROS2_COMMAND", bridge.to_owned()),
    ];
    let said = python::run(&format!("ros2/tests/{script}.py"), words, programs)?;
    println!("{said}");
    Ok(())
}

/// `canter serve ros2` with these folders as its path.
fn serve(path: &Path, words: &[&str]) -> std::process::Output {
    let folder = tempfile::tempdir().unwrap();
    // Not beside a canter-ros2 that cargo may have built.
    let canter = folder.path().join("canter");
    fs::copy(env!("CARGO_BIN_EXE_canter-under-test"), &canter).unwrap();
    let mut command = Command::new(canter);
    let command = domain::join(&mut command)
        .args(["serve", "ros2"])
        .args(words);
    command.env("PATH", path).output().unwrap()
}

/// Where the program is not installed, the command says how to get it.
fn without_the_program() -> Result<(), Failed> {
    let empty = tempfile::tempdir()?;
    let ran = serve(empty.path(), &["--arm", "a/b"]);
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!(ran.status.code(), Some(4), "{said}");
    assert!(said.contains("canter-ros2 is not installed"), "{said}");
    assert!(said.contains("cargo install --path ros2"), "{said}");
    Ok(())
}

/// All arguments, help too, are those of the program.
fn arguments_reach_the_program() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    symlink(
        env!("CARGO_BIN_EXE_canter-ros2-under-test"),
        folder.path().join("canter-ros2"),
    )?;
    let help = serve(folder.path(), &["--help"]);
    let said = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(
        said.contains("--retime") && said.contains("--network"),
        "{said}"
    );
    let wrong = serve(folder.path(), &["--program", "pick-it=x.canon"]);
    assert_eq!(wrong.status.code(), Some(2));
    let missing = serve(folder.path(), &["--program", "pick=none.canon"]);
    assert_eq!(missing.status.code(), Some(3));
    Ok(())
}

/// Without an engine the bridge says so and joins no graph.
fn without_an_engine() -> Result<(), Failed> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_canter-ros2-under-test"));
    let ran = domain::join(&mut command)
        .args(["--arm", "no/engine"])
        .output()?;
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!(ran.status.code(), Some(4), "{said}");
    assert!(said.contains("no/engine"), "{said}");
    Ok(())
}

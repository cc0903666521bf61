//! Many cells over Zenoh: rights, faults and the commands, with the outside client of Zenoh.
//!
//! Without Python or `eclipse-zenoh` these tests are reported as ignored, with the reason. The scripts
//! are in `fleet/tests`; routers, cells and engines are processes of their own.
#![allow(clippy::print_stdout, reason = "measured values are printed")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::process::Command;

use libtest_mimic::{Arguments, Failed, Trial};
use system_tests::repository::root;
use system_tests::{domain, python};

/// Scripts of `fleet/tests`.
const SCRIPTS: [&str; 4] = ["rights", "faults", "top", "page"];

fn main() {
    let mut arguments = Arguments::from_args();
    // Engines and their threads want the processors to themselves.
    arguments.test_threads = Some(1);
    let mut trials = vec![
        Trial::test(
            "the_command_is_built_without_it",
            the_command_is_built_without_it,
        ),
        Trial::test("wrong_arguments", wrong_arguments),
    ];
    let missing = python::has("zenoh", "eclipse-zenoh==1.10.2").err();
    if let Some(reason) = &missing {
        eprintln!("{reason}: the scripts of fleet/tests are ignored");
    }
    for script in SCRIPTS {
        let trial = Trial::test(format!("{script}.py"), move || run(script));
        trials.push(trial.with_ignored_flag(missing.is_some()));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

fn run(script: &str) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let (canter, fleet) = (
        env!("CARGO_BIN_EXE_canter-under-test"),
        env!("CARGO_BIN_EXE_canter-fleet-under-test"),
    );
    let programs = [
        ("CANTER_COMMAND", canter.to_owned()),
        ("CANTER_FLEET_COMMAND", fleet.to_owned()),
    ];
    let script = format!("fleet/tests/{script}.py");
    println!("{}", python::run(&script, [folder.path()], programs)?);
    Ok(())
}

/// The crates of the network are not among those of `canter`.
fn the_command_is_built_without_it() -> Result<(), Failed> {
    let crates = |package: &str| -> Result<String, Failed> {
        let ran = Command::new(env!("CARGO"))
            .args([
                "tree",
                "--offline",
                "--locked",
                "--edges",
                "normal,build",
                "--prefix",
                "none",
            ])
            .args(["--package", package])
            .current_dir(root())
            .output()?;
        let why = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(ran.status.success(), "{why}");
        Ok(String::from_utf8_lossy(&ran.stdout).into_owned())
    };
    let has = |tree: &str, name: &str| tree.lines().any(|line| line.starts_with(name));
    let (command, fleet) = (crates("cli")?, crates("canter-fleet")?);
    for name in ["zenoh v", "tokio v", "ratatui v"] {
        assert!(has(&fleet, name), "{name} is not in canter-fleet");
        assert!(!has(&command, name), "{name} is in canter");
    }
    for transport in ["quic", "udp", "ws", "serial", "unixsock_stream", "vsock"] {
        let name = format!("zenoh-link-{transport} v");
        assert!(!has(&fleet, &name), "{name} is in canter-fleet");
    }
    Ok(())
}

/// What is wrong is said before there is any link.
fn wrong_arguments() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let none = folder.path().join("none").display().to_string();
    let cases: [(&[&str], i32, &str); 5] = [
        (&["list", "--all", "--keys", &none], 3, "is no file"),
        (&["router", "--keys", &none], 3, "router.json5"),
        (
            &["list", "--all", "--keys", &none, "--router", "tcp/x:1"],
            2,
            "tls/HOST:PORT",
        ),
        (&["keys", &none, "--viewer", "a b"], 2, "letters, digits"),
        (&["stop", "--keys", &none], 2, "required"),
    ];
    for (words, code, part) in cases {
        let mut command = Command::new(env!("CARGO_BIN_EXE_canter-fleet-under-test"));
        let ran = domain::join(&mut command).args(words).output()?;
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert_eq!(ran.status.code(), Some(code), "{words:?}: {said}");
        assert!(said.contains(part), "{words:?}: {said}");
    }
    Ok(())
}

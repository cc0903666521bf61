//! Runs the command line as a process.

use std::ffi::OsStr;
use std::io::Write;
use std::process::{Command, Stdio};

/// What a finished process left.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// The command with these arguments, in the root folder of the repository, without colours.
pub(crate) fn command<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_canter-under-test"));
    system_tests::domain::join(&mut command)
        .args(arguments)
        .current_dir(system_tests::repository::root())
        .env("NO_COLOR", "1")
        .env_remove("CANTER_LOG")
        .stdin(Stdio::null());
    command
}

/// Runs `canter` with these arguments and an empty standard input.
pub(crate) fn canter<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Ran {
    ran(command(arguments).output().unwrap())
}

/// Runs `canter` with `input` as standard input.
pub(crate) fn canter_reading<S: AsRef<OsStr>>(
    arguments: impl IntoIterator<Item = S>,
    input: &[u8],
) -> Ran {
    let mut child = command(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A command that refuses early closes its input; this is not an error here.
    let _ = child.stdin.take().unwrap().write_all(input);
    ran(child.wait_with_output().unwrap())
}

/// What a process left.
pub(crate) fn ran(output: std::process::Output) -> Ran {
    Ran {
        code: output.status.code().unwrap(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

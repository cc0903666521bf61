use std::env;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::Context;
use ipc::Arm;

use crate::exit::Exit;
use crate::failure::Failure;

/// A live view as a process of our own, ended when this is dropped. The arm waits for nothing in it.
#[derive(Debug)]
pub(crate) struct ViewProcess {
    child: Child,
}

impl ViewProcess {
    /// Starts `canter view` for an arm, with the objects of a world if one is given; it prints its
    /// address to standard error.
    ///
    /// # Errors
    /// [`Exit::Internal`] when the process cannot be started.
    pub(crate) fn start(arm: &Arm, world: Option<&Path>) -> Result<Self, Failure> {
        let program = env::current_exe().context("cannot find the program's own file");
        let child = program.and_then(|program| {
            let mut command = Command::new(program);
            command.arg("view");
            if let Some(world) = world {
                command.arg("--world").arg(world);
            }
            command
                .args(["--until-end-of-input", "--arm"])
                .arg(arm.to_string())
                .arg("--domain")
                .arg(arm.domain().directory())
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .process_group(0)
                .spawn()
                .context("cannot start the live view")
        });
        let child = child.map_err(|cause| Failure::new(Exit::Internal, cause))?;
        Ok(Self { child })
    }
}

impl Drop for ViewProcess {
    fn drop(&mut self) {
        // The end of its input ends it; it holds nothing that could be lost.
        if let Some(mut input) = self.child.stdin.take() {
            let _ = input.write_all(b"q");
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

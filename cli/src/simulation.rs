use std::env;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::Context;
use ipc::Arm;

use crate::exit::Exit;
use crate::failure::Failure;

/// How long the driver may take to end when it is asked to.
const PATIENCE: Duration = Duration::from_secs(3);

/// The simulated driver as a process of our own, ended when this is dropped.
///
/// It is in a process group of its own, so that Ctrl-C reaches the engine only, which then stops
/// the arm with the driver's help. If we die, the end of its standard input tells it.
#[derive(Debug)]
pub(crate) struct Simulation {
    child: Child,
}

impl Simulation {
    /// Starts `canter driver sim` for an arm.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when the process cannot be started.
    pub(crate) fn start(robot: &str, arm: &Arm) -> Result<Self, Failure> {
        let program = env::current_exe().context("cannot find the program's own file");
        let child = program.and_then(|program| {
            Command::new(program)
                .args([
                    "driver",
                    "sim",
                    "--until-end-of-input",
                    "--robot",
                    robot,
                    "--arm",
                ])
                .arg(arm.to_string())
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .process_group(0)
                .spawn()
                .context("cannot start the simulated driver")
        });
        let child = child.map_err(|cause| Failure::new(Exit::NoPeer, cause))?;
        Ok(Self { child })
    }

    fn end(&mut self) {
        // A byte asks for an end now; the end of the input alone would leave the driver time to
        // stop the arm by itself. One that is gone already needs neither.
        if let Some(mut input) = self.child.stdin.take() {
            let _ = input.write_all(b"q");
        }
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            sleep(Duration::from_millis(5));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        self.end();
    }
}

use std::env;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use ipc::Arm;

use crate::exit::Exit;
use crate::failure::Failure;

/// How long the driver may take to end when it is asked to.
const PATIENCE: Duration = Duration::from_secs(3);

/// Which simulation moves the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind<'a> {
    /// The built-in servos.
    Servos {
        /// A wall, as its option is written.
        wall: Option<&'a str>,
    },
    /// MuJoCo, in this Python.
    Mujoco {
        /// The Python with its packages.
        python: &'a str,
    },
}

/// A simulated driver as a child process, ended when this is dropped.
///
/// It is in a separate process group, so that Ctrl-C reaches only the engine, which then stops the
/// arm through the driver. If this process dies, the driver notices the end of its standard input.
#[derive(Debug)]
pub(crate) struct Simulation {
    child: Child,
}

impl Simulation {
    /// Starts `canter driver sim` or `canter driver mujoco` for an arm and waits for it: Python
    /// starts slowly or ends if packages are missing, and another driver may have the arm.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when the process cannot be started or ends at once.
    pub(crate) fn start(kind: Kind<'_>, robot: &str, arm: &Arm) -> Result<Self, Failure> {
        let program = env::current_exe().context("cannot find the program's own file");
        let child = program.and_then(|program| {
            let mut command = Command::new(program);
            command.arg("driver");
            match kind {
                Kind::Servos { wall: None } => command.arg("sim"),
                Kind::Servos { wall: Some(wall) } => {
                    command.args(["sim", &format!("--wall={wall}")])
                }
                Kind::Mujoco { python } => command.args(["mujoco", "--python", python]),
            };
            command
                .args(["--until-end-of-input", "--robot", robot, "--arm"])
                .arg(arm.to_string())
                .arg("--domain")
                .arg(arm.domain().directory())
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .process_group(0)
                .spawn()
                .context("cannot start the simulated driver")
        });
        let child = child.map_err(|cause| Failure::new(Exit::NoPeer, cause))?;
        let mut simulation = Self { child };
        simulation.wait_until_ready()?;
        Ok(simulation)
    }

    /// Waits for the line that a driver says when it is there.
    fn wait_until_ready(&mut self) -> Result<(), Failure> {
        let Some(output) = self.child.stdout.take() else {
            return Ok(());
        };
        let mut line = String::new();
        let read = BufReader::new(output).read_line(&mut line);
        if read.is_ok_and(|length| length > 0) {
            return Ok(());
        }
        // It has printed the reason on standard error.
        Err(Failure::new(
            Exit::NoPeer,
            anyhow!("the simulated driver did not start"),
        ))
    }

    fn end(&mut self) {
        // A byte asks the driver to end now; after the end of the input alone, the driver would
        // first wait and stop the arm by itself. A driver that has ended needs neither.
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

use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

use anyhow::anyhow;
use clap::Args;

use crate::exit::Exit;
use crate::failure::Failure;

/// The program that serves ROS 2.
const PROGRAM: &str = "canter-ros2";

/// Let ROS 2 drive the arm of a running engine, as a trajectory controller of MoveIt
///
/// Starts the program `canter-ros2`, which is installed beside `canter` or found on the path, with all
/// arguments that follow; `--help` lists them.
#[derive(Args, Debug)]
#[command(disable_help_flag = true)]
pub(crate) struct ServeRos2 {
    /// Arguments of canter-ros2
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "ARGUMENTS"
    )]
    arguments: Vec<OsString>,
}

impl ServeRos2 {
    /// Becomes the program; returns only where that is not possible.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let program = beside().unwrap_or_else(|| PathBuf::from(PROGRAM));
        let cause = Command::new(&program).args(&self.arguments).exec();
        let error = if cause.kind() == io::ErrorKind::NotFound {
            anyhow!(
                "{PROGRAM} is not installed: it is a program of its own, because it brings many crates; \
                 `cargo install --path ros2` builds it (docs/ros2.md)"
            )
        } else {
            anyhow!("cannot start {}: {cause}", program.display())
        };
        Err(Failure::new(Exit::NoPeer, error))
    }
}

/// The program beside this one.
fn beside() -> Option<PathBuf> {
    let own = std::env::current_exe().ok()?;
    let path = own.with_file_name(PROGRAM);
    path.is_file().then_some(path)
}

use std::fs::{self, DirBuilder};
use std::io::{self, Read, Write};
use std::os::unix::fs::DirBuilderExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

use anyhow::{Context, anyhow};
use clap::Args;
use planner::robot::Robot;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::robot::RobotOption;

/// The Python files of `drivers/python`.
const SOURCES: [(&str, &str); 7] = [
    (
        "mujoco_driver.py",
        include_str!("../../../../drivers/python/mujoco_driver.py"),
    ),
    (
        "canter_driver/__init__.py",
        include_str!("../../../../drivers/python/canter_driver/__init__.py"),
    ),
    (
        "canter_driver/driver.py",
        include_str!("../../../../drivers/python/canter_driver/driver.py"),
    ),
    (
        "canter_driver/limiter.py",
        include_str!("../../../../drivers/python/canter_driver/limiter.py"),
    ),
    (
        "canter_driver/link.py",
        include_str!("../../../../drivers/python/canter_driver/link.py"),
    ),
    (
        "canter_driver/domain.py",
        include_str!("../../../../drivers/python/canter_driver/domain.py"),
    ),
    (
        "canter_driver/messages.py",
        include_str!("../../../../drivers/python/canter_driver/messages.py"),
    ),
];

/// Run a MuJoCo simulation as the driver of an arm until Ctrl-C
///
/// Builds the model from the robot's URDF and follows setpoints with computed torque. Needs a
/// Python with `pip install mujoco iceoryx2==0.9.3`.
#[derive(Args, Debug)]
pub(super) struct Mujoco {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    arm: ArmOption,
    /// Python to run it with
    #[arg(long, value_name = "PYTHON", default_value = "python3")]
    python: String,
    /// Show the robot in a window
    #[arg(long)]
    viewer: bool,
    /// End soon after standard input ends
    #[arg(long, hide = true)]
    until_end_of_input: bool,
}

impl Mujoco {
    /// Drives until a signal, or until its starter asks for the end.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let stop = super::asked_to_end(self.until_end_of_input)?;
        let folder = Folder::new(&robot).map_err(|cause| Failure::new(Exit::Internal, cause))?;
        let child = self.spawn(&robot, &folder.0)?;
        let status = wait(child, &stop)?;
        if status.success() || stop.load(Ordering::Relaxed) {
            return Ok(Exit::Done);
        }
        Err(Failure::new(
            Exit::NoPeer,
            anyhow!("the MuJoCo driver in {} ended: {status}", self.python),
        ))
    }

    fn spawn(&self, robot: &Robot, folder: &Path) -> Result<Child, Failure> {
        let arm = self.arm.open()?;
        let mut command = Command::new(&self.python);
        command
            .env(ipc::DOMAIN_VARIABLE, arm.domain().directory())
            .arg(folder.join("mujoco_driver.py"))
            .arg(arm.to_string())
            .arg(folder.join("robot.urdf"))
            .arg("--until-end-of-input")
            .arg(format!("--joints={}", robot.joint_names().join(",")));
        let lists = [
            ("home", &robot.home),
            ("velocity", &robot.joints.velocity),
            ("acceleration", &robot.joints.acceleration),
            ("jerk", &robot.joints.jerk),
        ];
        for (name, values) in lists {
            let words: Vec<String> = values.iter().map(f64::to_string).collect();
            command.arg(format!("--{name}={}", words.join(",")));
        }
        if self.viewer {
            command.arg("--viewer");
        }
        // A separate process group: Ctrl-C reaches this process, which asks the other to end.
        let child = command.stdin(Stdio::piped()).process_group(0).spawn();
        child
            .with_context(|| format!("cannot start {}", self.python))
            .map_err(|cause| Failure::new(Exit::NoPeer, cause))
    }
}

/// Waits for Python to end; asks it to end when `stop` becomes true.
fn wait(mut child: Child, stop: &AtomicBool) -> io::Result<ExitStatus> {
    let mut input = child.stdin.take();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if stop.load(Ordering::Relaxed)
            && let Some(mut input) = input.take()
        {
            // It may have ended already.
            let _ = input.write_all(b"q");
        }
        sleep(Duration::from_millis(20));
    }
}

/// A folder of this process with the Python files and the robot, removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(robot: &Robot) -> anyhow::Result<Self> {
        let mut noise = [0; 8];
        fs::File::open("/dev/urandom")?.read_exact(&mut noise)?;
        let name = format!("canter-mujoco-{:016x}", u64::from_ne_bytes(noise));
        let path = std::env::temp_dir().join(name);
        // Fails if the name exists.
        let made = DirBuilder::new().mode(0o700).create(&path);
        made.with_context(|| format!("cannot make {}", path.display()))?;
        let folder = Self(path);
        let write = |name: &str, text: &str| {
            let file = folder.0.join(name);
            fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))
        };
        fs::create_dir(folder.0.join("canter_driver"))?;
        for (name, text) in SOURCES {
            write(name, text)?;
        }
        write("robot.urdf", &robot.urdf)?;
        Ok(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed is left to the system's clean-up of temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}

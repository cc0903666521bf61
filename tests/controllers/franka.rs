//! The driver of Franka arms against franka-sim, with the limits and the rules for lost packets of
//! its maker enforced.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use crate::canter::{Ran, canter, command};
use crate::robot_folder::{MASSES, with_masses};
use crate::watch::Watch;

/// Why there is no controller, or nothing if there is one.
pub(crate) fn missing() -> Option<String> {
    let ran = Command::new(python())
        .args(["-c", "import franka_sim, mujoco"])
        .stderr(Stdio::null())
        .status();
    match ran {
        Ok(status) if status.success() => None,
        Ok(_) => Some(format!("{} has no franka-sim==1.1.7", python())),
        Err(error) => Some(format!("no {}: {error}", python())),
    }
}

/// The Python that has the controller.
fn python() -> String {
    std::env::var("CANTER_FRANKA_PYTHON").unwrap_or("python3".to_owned())
}

/// The controller of an arm, as a process group.
pub(crate) struct Controller {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    pub(crate) port: u16,
    folder: tempfile::TempDir,
}

/// What the controller noted of the commands since it was last asked.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// Largest acceleration (rad/s2) and jerk (rad/s3) of a joint.
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
    /// Commands that it took, those of them that were late, and cycles that it had to fill itself.
    pub(crate) taken: u64,
    pub(crate) late: u64,
    pub(crate) missed: u64,
    /// The masses that it was told (kg).
    pub(crate) loads: Vec<f64>,
    /// How far a command was beyond the speed that is allowed where the arm was (rad/s); less than 0: never.
    pub(crate) over: f64,
    /// Each time that the measured speed was beyond its limit: the longest of the steps of the simulated arm before it
    /// (periods), or the most commands that one of them took.
    pub(crate) swings: Vec<f64>,
}

impl Controller {
    /// Starts it on a port of its own and waits until it listens.
    pub(crate) fn start() -> Self {
        let port = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
            .port();
        let folder = tempfile::tempdir().unwrap();
        let (child, input, output) = Self::spawn(port, folder.path());
        Self {
            child,
            input,
            output,
            port,
            folder,
        }
    }

    fn spawn(port: u16, folder: &std::path::Path) -> (Child, ChildStdin, BufReader<ChildStdout>) {
        let serve = system_tests::repository::root().join("drivers/franka/tests/serve.py");
        let log = std::fs::File::create(folder.join("log")).unwrap();
        // With priority where that is allowed: the simulation must keep its millisecond.
        let priority = Command::new("chrt").args(["-f", "60", "true"]).status();
        let mut spawned = match priority {
            Ok(status) if status.success() => {
                let mut command = Command::new("chrt");
                command.args(["-f", "60"]).arg(python());
                command
            }
            _ => Command::new(python()),
        };
        let mut child = spawned
            .arg(serve)
            .arg(port.to_string())
            .arg(folder)
            .arg("0.04")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(log)
            .process_group(0)
            .spawn()
            .unwrap();
        let input = child.stdin.take().unwrap();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        output.read_line(&mut line).unwrap();
        assert_eq!(line, "ready\n", "the controller did not start");
        (child, input, output)
    }

    pub(crate) fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    pub(crate) fn restart(&mut self) {
        self.kill();
        (self.child, self.input, self.output) = Self::spawn(self.port, self.folder.path());
    }

    /// What it noted since it was last asked.
    pub(crate) fn record(&mut self) -> Record {
        writeln!(self.input, "record").unwrap();
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        let told: serde_json::Value = serde_json::from_str(&line).unwrap();
        let list = |name: &str| {
            let values = told[name].as_array().unwrap();
            values.iter().map(|value| value.as_f64().unwrap()).collect()
        };
        Record {
            loads: list("loads"),
            swings: list("swings"),
            over: told["over"].as_f64().unwrap(),
            acceleration: told["acceleration"].as_f64().unwrap(),
            jerk: told["jerk"].as_f64().unwrap(),
            taken: told["taken"].as_u64().unwrap(),
            late: told["late"].as_u64().unwrap(),
            missed: told["missed"].as_u64().unwrap(),
        }
    }

    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.kill();
    }
}

/// The driver, ended when dropped.
pub(crate) struct Driver(pub(crate) Child);

impl Driver {
    pub(crate) fn start(arm: &str, port: u16) -> Self {
        let address = format!("127.0.0.1:{port}");
        let words = [
            "driver",
            "franka",
            "--robot",
            "fr3",
            "--arm",
            arm,
            "--address",
        ];
        let child = command(words.iter().copied().chain([&address[..]]))
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self(child)
    }

    /// Kills `this` and starts another one.
    pub(crate) fn start_again(this: &mut Self, arm: &str, port: u16) -> Self {
        let _ = this.0.kill();
        let _ = this.0.wait();
        Self::start(arm, port)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An arm name that no other test uses.
pub(crate) fn arm() -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    format!(
        "franka{}/{}",
        std::process::id(),
        COUNT.fetch_add(1, Ordering::Relaxed)
    )
}

pub(crate) fn run(arm: &str) -> Ran {
    run_of("examples/pick_and_place.canon", arm)
}

pub(crate) fn run_of(program: &str, arm: &str) -> Ran {
    canter([
        "run", program, "--robot", "fr3", "--driver", "external", "--arm", arm,
    ])
}

/// How many runs the environment asks for; two without.
fn runs() -> usize {
    let text = std::env::var("CANTER_FRANKA_RUNS").unwrap_or_default();
    text.parse().unwrap_or(2)
}

/// The example with the gripper and an object of 40 mm: no reflex.
pub(crate) fn pick_and_place() {
    let mut controller = Controller::start();
    let arm = arm();
    let _driver = Driver::start(&arm, controller.port);
    many(&mut controller, || run(&arm), &arm);
}

/// A smooth path of 100 poses: no reflex.
pub(crate) fn a_smooth_path_of_a_hundred_poses() {
    let mut controller = Controller::start();
    let arm = arm();
    let _driver = Driver::start(&arm, controller.port);
    let file = tempfile::Builder::new()
        .suffix(".canon")
        .tempfile()
        .unwrap();
    let pose = |number: u32| {
        let turn = core::f64::consts::TAU * f64::from(number) / 99.0;
        let (x, y) = (420.0 + 60.0 * (2.0 * turn).sin(), 180.0 * turn.sin());
        let z = 320.0 + 50.0 * (3.0 * turn).cos();
        format!("{{{{{x:.2}, {y:.2}, {z:.2}}}, {{0,0,-1}}, {{1,0,0}}}}")
    };
    let poses: Vec<String> = (1..100).map(pose).collect();
    let program = format!(
        "InitCanon()\nSetLengthUnits(\"mm\")\nSetRelativeSpeed(60)\nSetRelativeAcceleration(50)\n\
         SetIntermediatePointTolerance(3)\nSetEndPointTolerance(0.5)\nMoveTo({})\n\
         MoveSmoothlyTo({{{}}}, 99)\nEndCanon(0)\n",
        pose(0),
        poses.join(",\n")
    );
    std::fs::write(file.path(), program).unwrap();
    let path = file.path().to_str().unwrap();
    many(&mut controller, || run_of(path, &arm), &arm);
}

/// The maker's largest acceleration (rad/s2) and jerk (rad/s3) of a joint.
pub(crate) const LIMITS: [f64; 2] = [10.0, 5000.0];

/// Runs that all must succeed without a reflex; prints what the controller noted and how late the arm was.
fn many(controller: &mut Controller, run: impl Fn() -> Ran, arm: &str) {
    let watch = Watch::start(arm);
    for number in 0..runs() {
        let ran = run();
        assert_eq!(ran.code, 0, "run {number}: {ran:?}\n{}", controller.log());
    }
    let seen = watch.end();
    let record = controller.record();
    println!("{} runs: {record:?}", runs());
    println!("{seen}");
    let log = controller.log();
    assert!(!log.contains("violation"), "{log}");
    let peaks = [record.acceleration, record.jerk];
    assert!(
        peaks.iter().zip(LIMITS).all(|(peak, most)| *peak <= most),
        "{record:?}"
    );
}

/// A simulated arm with no step longer than this (periods), nor with two commands, has kept its time.
const IN_TIME: f64 = 1.2;

/// Joints jogged at full speed to an end of their ranges, where the controller allows less and less: it objects to no
/// command, no command is faster than is allowed where the arm is, and the arm itself is not faster. On a busy machine the
/// simulated arm gets two commands in one step and swings: its speed counts where the simulation has kept its time.
/// `CANTER_FRANKA_ENDS` takes all joints and both directions instead of three.
pub(crate) fn fast_to_the_ends() {
    let mut controller = Controller::start();
    let arm = arm();
    let _driver = Driver::start(&arm, controller.port);
    let words = [
        "engine", "--robot", "fr3", "--driver", "external", "--arm", &arm,
    ];
    let engine = command(words).stdout(Stdio::null()).spawn().unwrap();
    let mut engine = system_tests::killed::Killed(engine);
    let start = Instant::now();
    while canter(["status", "--arm", &arm]).code != 0 {
        assert!(start.elapsed() < Duration::from_secs(20), "no engine");
        std::thread::sleep(Duration::from_millis(200));
    }
    let all: Vec<String> = (1..=7)
        .flat_map(|joint| [format!("j{joint}=1"), format!("j{joint}=-1")])
        .collect();
    let few = ["j2=1", "j5=-1", "j7=1"].map(str::to_owned).to_vec();
    let every = std::env::var_os("CANTER_FRANKA_ENDS").is_some();
    let mut reached = 0;
    for axis in if every { all } else { few } {
        let ran = canter(["jog", &axis, "--seconds", "3", "--arm", &arm]);
        let (log, record) = (controller.log(), controller.record());
        let refused = "joint_motion_generator_velocity_limits_violation";
        assert!(!log.contains(refused), "{axis}: {ran:?}\n{log}");
        assert!(record.over <= 0.0, "{axis}: {record:?}\n{log}");
        // What the log calls `joint_velocity_violation`.
        let in_time = record.swings.iter().any(|longest| *longest < IN_TIME);
        assert!(!in_time, "{axis}: {record:?}\n{log}");
        println!("{axis}: {record:?}");
        reached += usize::from(ran.code == 0);
        if ran.code != 0 {
            // A busy machine misses cycles: that ends a jog, and is not what this is about.
            println!("{axis}: {}", ran.stderr);
            canter(["recover", "--arm", &arm]);
        }
    }
    println!("{reached} ends reached");
    assert!(reached > 0, "{}", controller.log());
    let _ = canter(["shutdown", "--arm", &arm]);
    let _ = engine.0.wait();
}

/// Driver and controller are killed in motion: the engine names what happened, and the next run works
/// without a restart of anything that lives.
pub(crate) fn kills_and_restarts() {
    let mut controller = Controller::start();
    let arm = arm();
    let driver = Driver::start(&arm, controller.port);
    // The controller is killed: the driver lives, and connects again.
    let begin = || {
        let program = "examples/pick_and_place.canon";
        let words = [
            "run", program, "--robot", "fr3", "--driver", "external", "--arm", &arm,
        ];
        command(words)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let ran = begin();
    wait_for_motion(&arm);
    controller.kill();
    let ran = ran.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!(ran.status.code(), Some(7), "{said}");
    let named = said.contains("the connection is lost") || said.contains("sent nothing");
    assert!(named, "{said}");
    controller.restart();
    let ran = run(&arm);
    assert_eq!(
        ran.code,
        0,
        "after the controller was killed: {ran:?}\n{}",
        controller.log()
    );
    // The driver is killed: the controller lives.
    let ran = begin();
    wait_for_motion(&arm);
    drop(driver);
    let ran = ran.wait_with_output().unwrap();
    assert_eq!(ran.status.code(), Some(7));
    let _driver = Driver::start(&arm, controller.port);
    let ran = run(&arm);
    assert_eq!(
        ran.code,
        0,
        "after the driver was killed: {ran:?}\n{}",
        controller.log()
    );
}

/// The robot's folder has masses: the controller is told that of the mounted end effector, between two
/// motions of its own, and the program runs through.
pub(crate) fn the_controller_is_told_the_payload() {
    let mut controller = Controller::start();
    let arm = arm();
    let _driver = Driver::start(&arm, controller.port);
    let folder = with_masses("fr3");
    let robot = folder.path().to_str().unwrap();
    let program = "examples/pick_and_place.canon";
    let words = [
        "run", program, "--robot", robot, "--driver", "external", "--arm", &arm,
    ];
    let ran = canter(words);
    assert_eq!(ran.code, 0, "{ran:?}\n{}", controller.log());
    assert_eq!(controller.record().loads, [MASSES[0]]);
}

/// The simulated arm itself follows a small motion from the pose of its start: its joints 1 and 3 have one axis
/// there, and its servo swung by itself between them, with all of its torque.
pub(crate) fn the_simulated_servo_is_stable() {
    let folder = tempfile::tempdir().unwrap();
    let script = system_tests::repository::root().join("drivers/franka/tests/servo.py");
    let ran = Command::new(python())
        .arg(script)
        .arg(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    let behind: f64 = said.trim().parse().unwrap_or(f64::NAN);
    assert!(behind < 5e-4, "{behind} rad behind: {ran:?}");
}

/// `canter driver test` on it: nothing fails; what only a simulation can do is skipped.
pub(crate) fn the_driver_conforms() {
    let controller = Controller::start();
    let arm = arm();
    let _driver = Driver::start(&arm, controller.port);
    let ran = canter(["driver", "test", "--arm", &arm]);
    println!("{}", ran.stdout);
    assert_eq!(ran.code, 0, "{}\n{}", ran.stdout, controller.log());
}

/// Waits until a joint moves with more than 0.05 rad/s.
pub(crate) fn wait_for_motion(arm: &str) {
    let observer = ipc::Observer::open(&system_tests::domain::arm(arm)).unwrap();
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        match observer.next_state() {
            Some(state) if state.velocity.iter().any(|speed| speed.abs() > 0.05) => return,
            Some(_) => {}
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    panic!("{arm} does not move");
}

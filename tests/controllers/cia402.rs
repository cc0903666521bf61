//! The driver of CiA 402 drives against a stand-in for six of them, on a pair of virtual network
//! interfaces in a network namespace that each test makes.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use crate::canter::{Ran, canter, command};

/// The robot: any with six joints.
const ROBOT: &str = "irb120";

/// The word that makes this program the stand-in.
pub(crate) const STAND_IN: &str = "--drives-stand-in";

/// Counts of a revolution of each motor, and its gear.
const COUNTS: f64 = 1_048_576.0;
const GEARS: [f64; 6] = [121.0, -101.0, 81.0, 50.0, -51.0, 50.0];
const ZEROS: [f64; 6] = [0.0, 1e6, -2e6, 0.0, 12_345.0, 0.0];

/// Why there can be no network, or nothing if there can.
pub(crate) fn missing() -> Option<String> {
    Net::new().err()
}

/// A network namespace with two interfaces that are connected, removed when dropped.
struct Net(String);

impl Net {
    fn new() -> Result<Self, String> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("canter-{}-{number}", std::process::id());
        let ip = |words: &str| {
            let ran = Command::new("ip").args(words.split(' ')).output();
            let output = ran.map_err(|error| format!("no command ip: {error}"))?;
            if output.status.success() {
                return Ok(());
            }
            let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
            Err(format!("no right to make a network namespace: {said}"))
        };
        ip(&format!("netns add {name}"))?;
        let net = Self(name);
        let inside = |words: &str| ip(&format!("-n {} {words}", net.0));
        inside("link add bus type veth peer name drives")?;
        inside("link set bus up")?;
        inside("link set drives up")?;
        Ok(net)
    }

    /// A command that runs inside.
    fn inside(&self, command: &Command) -> Command {
        let mut outer = Command::new("ip");
        outer.args(["netns", "exec", &self.0]);
        outer.arg(command.get_program()).args(command.get_args());
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => outer.env(name, value),
                None => outer.env_remove(name),
            };
        }
        if let Some(folder) = command.get_current_dir() {
            outer.current_dir(folder);
        }
        outer.stdin(Stdio::null());
        outer
    }
}

impl Drop for Net {
    fn drop(&mut self) {
        let _ = Command::new("ip").args(["netns", "del", &self.0]).status();
    }
}

/// The robot's folder with a margin, as every arm needs whose bus has its own clock, and the file of
/// its drives.
fn robot() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let from = system_tests::repository::root().join("robots").join(ROBOT);
    for name in ["robot.urdf", "robot.toml"] {
        std::fs::copy(from.join(name), folder.path().join(name)).unwrap();
    }
    let file = folder.path().join("robot.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let margin = "\n[joints.margin]\nvelocity = 0.9\nacceleration = 0.8\njerk = 0.5\n";
    std::fs::write(file, text + margin).unwrap();
    let mut drives = String::new();
    for (place, (gear, zero)) in GEARS.iter().zip(ZEROS).enumerate() {
        drives.push_str(&format!(
            "[[drive]]\nplace = {place}\ncounts = {COUNTS}\ngear = {gear}\nzero = {zero}\nfollowing_error = 0.02\n"
        ));
    }
    std::fs::write(folder.path().join("drives.toml"), drives).unwrap();
    folder
}

/// The stand-in.
struct Drives {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Drives {
    fn start(net: &Net, clocks: &str) -> Self {
        let mut own = Command::new(std::env::current_exe().unwrap());
        own.args([STAND_IN, "drives", clocks]);
        let home = planner::robot::load(ROBOT).unwrap().home;
        for (joint, angle) in home.iter().enumerate() {
            let scale = COUNTS * GEARS[joint] / core::f64::consts::TAU;
            own.arg(scale.to_string());
            own.arg((ZEROS[joint] + angle * scale).to_string());
        }
        let mut child = net
            .inside(&own)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let input = child.stdin.take().unwrap();
        let mut drives = Self {
            output: BufReader::new(child.stdout.take().unwrap()),
            child,
            input,
        };
        assert_eq!(drives.line(), "ready");
        drives
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        assert!(self.output.read_line(&mut line).unwrap() > 0, "it ended");
        line.trim().to_owned()
    }

    fn ask(&mut self, words: &str) -> String {
        writeln!(self.input, "{words}").unwrap();
        self.line()
    }

    fn numbers(&mut self, words: &str) -> Vec<f64> {
        let line = self.ask(words);
        line.split(' ').map(|word| word.parse().unwrap()).collect()
    }

    /// Drives that are enabled, and that rest.
    fn enabled_and_resting(&mut self) -> [f64; 2] {
        let numbers = self.numbers("state");
        [numbers[0], numbers[1]]
    }

    /// Waits until no drive is enabled and all rest.
    fn wait_for_rest(&mut self) {
        let start = Instant::now();
        while self.enabled_and_resting() != [0.0, 6.0] {
            assert!(start.elapsed() < Duration::from_secs(10), "drives move");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Drives {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Drives, driver and arm; ended when dropped.
struct Cell {
    driver: Child,
    drives: Drives,
    arm: String,
    folder: tempfile::TempDir,
    program: tempfile::NamedTempFile,
    net: Net,
}

impl Cell {
    fn start(name: &str, clocks: &str) -> Self {
        let net = Net::new().unwrap();
        let drives = Drives::start(&net, clocks);
        let folder = robot();
        let arm = format!("bus{}/{name}", std::process::id());
        let driver = driver(&net, &folder, &arm);
        // The drives have no gripper: the program's motions only.
        let program = tempfile::Builder::new()
            .suffix(".canon")
            .tempfile()
            .unwrap();
        let from = system_tests::repository::root().join("examples/pick_and_place.canon");
        let text = std::fs::read_to_string(from).unwrap();
        let moves = text.lines().filter(|line| !line.contains("Gripper"));
        std::fs::write(program.path(), moves.collect::<Vec<_>>().join("\n")).unwrap();
        Self {
            driver,
            drives,
            arm,
            folder,
            program,
            net,
        }
    }

    fn words(&self) -> [&str; 8] {
        [
            "run",
            self.program.path().to_str().unwrap(),
            "--robot",
            self.folder.path().to_str().unwrap(),
            "--driver",
            "external",
            "--arm",
            &self.arm,
        ]
    }

    fn run(&self) -> Ran {
        canter(self.words())
    }

    /// The arm moves; what comes then is up to the test.
    fn begin(&self) -> Child {
        let mut command = command(self.words());
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = child.spawn().unwrap();
        let observer = ipc::Observer::open(&system_tests::domain::arm(&self.arm)).unwrap();
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(60) {
            match observer.next_state() {
                Some(state) if state.velocity.iter().any(|speed| speed.abs() > 0.5) => {
                    return child;
                }
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        }
        panic!("no motion: {}", said(&child.wait_with_output().unwrap()));
    }

    /// A named value of the driver's newest state.
    fn sensor(&self, name: &str) -> f64 {
        let observer = ipc::Observer::open(&system_tests::domain::arm(&self.arm)).unwrap();
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(10) {
            let Some(state) = observer.next_state() else {
                std::thread::sleep(Duration::from_millis(1));
                continue;
            };
            let sensors = &state.sensors[..state.sensor_count as usize];
            let mut named = sensors
                .iter()
                .filter(|sensor| ipc::text_of(&sensor.name) == name);
            return named.next().unwrap().value;
        }
        panic!("no state of {}", self.arm);
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn driver(net: &Net, folder: &tempfile::TempDir, arm: &str) -> Child {
    let drives = folder.path().join("drives.toml");
    let words = [
        "driver",
        "cia402",
        "--robot",
        folder.path().to_str().unwrap(),
        "--arm",
        arm,
        "--interface",
        "bus",
        "--drives",
        drives.to_str().unwrap(),
    ];
    let mut inside = net.inside(&command(words));
    inside.stdout(Stdio::null()).spawn().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The largest acceleration and jerk of the robot's limits (rad/s², rad/s³).
fn limits() -> [f64; 2] {
    let joints = planner::robot::load(ROBOT).unwrap().joints.of_the_maker();
    [&joints.acceleration, &joints.jerk].map(|list| list.iter().copied().fold(0.0, f64::max))
}

/// Checks the targets that the drives got since the last look. Counts are whole numbers: in a
/// difference of the third order that is a jerk of its own.
fn keeps_limits(drives: &mut Drives) -> Vec<f64> {
    let numbers = drives.numbers("look");
    let [acceleration, jerk] = limits();
    let count = core::f64::consts::TAU / (COUNTS * 50.0);
    assert!(
        numbers[1] <= acceleration * 1.01 + 4.0 * count / 1e-6,
        "{} of {acceleration} rad/s2",
        numbers[1]
    );
    assert!(
        numbers[2] <= jerk * 1.05 + 8.0 * count / 1e-9,
        "{} of {jerk} rad/s3",
        numbers[2]
    );
    numbers
}

/// How many cycles the environment asks for.
fn cycles() -> f64 {
    let text = std::env::var("CANTER_CIA402_CYCLES").unwrap_or_default();
    text.parse().unwrap_or(4000.0)
}

/// Programs run through, and each cycle has its working counter.
fn programs(name: &str, clocks: &str) -> Vec<f64> {
    let mut cell = Cell::start(name, clocks);
    let mut runs = 0;
    while runs == 0 || cell.sensor("bus_cycles") < cycles() {
        let ran = cell.run();
        assert_eq!(ran.code, 0, "run {runs}: {ran:?}");
        runs += 1;
        cell.drives.wait_for_rest();
    }
    let numbers = keeps_limits(&mut cell.drives);
    let (all, bad, lost) = (
        cell.sensor("bus_cycles"),
        cell.sensor("bad_working_counters"),
        cell.sensor("lost_frames"),
    );
    println!(
        "{runs} runs, {all} cycles, {bad} bad working counters, {lost} lost frames; largest acceleration {:.2} rad/s2, jerk {:.0} rad/s3",
        numbers[1], numbers[2]
    );
    assert_eq!(bad, 0.0, "bad working counters in {all} cycles");
    numbers
}

/// Drives that follow at the arrival of the process data.
pub(crate) fn programs_without_clocks() {
    let _numbers = programs("free", "none");
}

/// Drives with distributed clocks, whose reference goes 2e-5 faster than ours, the others up to 1.2e-4: the frames pass in the middle
/// between two pulses.
pub(crate) fn programs_by_the_clock_of_the_drives() {
    let mut cell = Cell::start("clocks", "clocks");
    let ran = cell.run();
    assert_eq!(ran.code, 0, "{ran:?}");
    cell.drives.wait_for_rest();
    let _since_start = keeps_limits(&mut cell.drives);
    let ran = cell.run();
    assert_eq!(ran.code, 0, "{ran:?}");
    let numbers = keeps_limits(&mut cell.drives);
    let (bad, error) = (
        cell.sensor("bad_working_counters"),
        cell.sensor("clock_error"),
    );
    println!(
        "{} cycles, {bad} bad working counters, {:.0} us from the middle in the mean, at the end {:.0} us",
        numbers[0],
        numbers[3] * 1e-3,
        error * 1e6
    );
    assert_eq!(bad, 0.0);
    assert!(numbers[3] < 1e5, "{} ns from the middle", numbers[3]);
}

/// A drive fails in the middle: all stop within their limits, the joint is named with the drive's
/// code, and the next run clears the fault.
pub(crate) fn a_drive_that_fails_stops_all() {
    let mut cell = Cell::start("fails", "none");
    let child = cell.begin();
    assert_eq!(cell.drives.ask("fail 2 28961"), "done");
    let output = child.wait_with_output().unwrap();
    let words = said(&output);
    assert_eq!(output.status.code(), Some(7), "{words}");
    assert!(words.contains("0x7121"), "{words}");
    assert!(words.contains("joint 3"), "{words}");
    cell.drives.wait_for_rest();
    let _numbers = keeps_limits(&mut cell.drives);
    let ran = cell.run();
    assert_eq!(ran.code, 0, "after the fault: {ran:?}");
    assert_eq!(cell.drives.numbers("state")[2], 1.0, "resets");
}

/// A drive that is slow: its following error stops all, and is named.
pub(crate) fn a_slow_drive_is_named() {
    let mut cell = Cell::start("slow", "none");
    assert_eq!(cell.drives.ask("slow 1 4"), "done");
    let ran = cell.run();
    assert_eq!(ran.code, 7, "{ran:?}");
    assert!(ran.stderr.contains("following error"), "{ran:?}");
    assert!(ran.stderr.contains("joint 2"), "{ran:?}");
    cell.drives.wait_for_rest();
    let _numbers = keeps_limits(&mut cell.drives);
    assert_eq!(cell.drives.ask("slow 1 400"), "done");
    let ran = cell.run();
    assert_eq!(ran.code, 0, "after the following error: {ran:?}");
}

/// The cable between the third and the fourth drive is cut: the others stop within their limits; when
/// it is mended the driver brings the bus up again by itself.
pub(crate) fn a_cut_cable_is_mended() {
    let mut cell = Cell::start("cut", "none");
    let child = cell.begin();
    assert_eq!(cell.drives.ask("cut 3"), "done");
    let output = child.wait_with_output().unwrap();
    let words = said(&output);
    assert_eq!(output.status.code(), Some(7), "{words}");
    assert!(words.contains("place 3"), "{words}");
    cell.drives.wait_for_rest();
    let _numbers = keeps_limits(&mut cell.drives);
    assert_eq!(cell.drives.ask("mend"), "done");
    // The operator tries until the bus is up.
    let start = Instant::now();
    loop {
        let ran = cell.run();
        if ran.code == 0 {
            return;
        }
        assert_eq!(ran.code, 4, "{ran:?}");
        assert!(start.elapsed() < Duration::from_secs(30), "{ran:?}");
    }
}

/// The driver is killed in the middle: the drives' watchdogs stop them, and another driver goes on.
pub(crate) fn the_watchdog_stops_the_drives() {
    let mut cell = Cell::start("killed", "none");
    let child = cell.begin();
    cell.driver.kill().unwrap();
    cell.driver.wait().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", said(&output));
    cell.drives.wait_for_rest();
    cell.driver = driver(&cell.net, &cell.folder, &cell.arm);
    let start = Instant::now();
    loop {
        let ran = cell.run();
        if ran.code == 0 {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(30), "{ran:?}");
    }
}

/// What does not fit is refused in words: a drive that is not there, a file with an unknown key.
pub(crate) fn what_does_not_fit_is_refused_in_words() {
    let mut cell = Cell::start("refused", "none");
    cell.driver.kill().unwrap();
    cell.driver.wait().unwrap();
    let file = cell.folder.path().join("drives.toml");
    let good = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, good.replace("place = 5", "place = 7")).unwrap();
    cell.driver = driver(&cell.net, &cell.folder, &cell.arm);
    let start = Instant::now();
    loop {
        let ran = cell.run();
        assert_eq!(ran.code, 4, "{ran:?}");
        if ran.stderr.contains("place 7") {
            assert!(ran.stderr.contains("6 devices"), "{ran:?}");
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(30), "{ran:?}");
    }
    std::fs::write(&file, good.replace("counts", "count")).unwrap();
    let mut refused = driver(&cell.net, &cell.folder, "refused/other");
    assert_eq!(refused.wait().unwrap().code(), Some(2));
}

/// `canter doctor --driver cia402` counts the drives and measures the way of its frames.
pub(crate) fn the_doctor_measures_the_bus() {
    let net = Net::new().unwrap();
    let _drives = Drives::start(&net, "none");
    let words = "doctor --driver cia402 --interface bus --seconds 0.1";
    let output = net.inside(&command(words.split(' '))).output().unwrap();
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    let frames = lines.lines().find(|line| line.contains("EtherCAT frames"));
    println!("{}", frames.unwrap());
    assert!(
        frames.unwrap().contains("frames to 6 devices: 0 without"),
        "{lines}"
    );
    assert!(lines.contains("network interface"), "{lines}");
    // Whether the right is granted is the machine's affair.
    assert!(lines.contains("SCHED_FIFO 80"), "{lines}");
}

/// `canter driver test` on it: nothing fails.
pub(crate) fn the_driver_conforms() {
    let cell = Cell::start("conforms", "none");
    let ran = canter(["driver", "test", "--arm", &cell.arm]);
    println!("{}", ran.stdout);
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
}

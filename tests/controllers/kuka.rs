//! The driver of KUKA arms against the echo server of RSIPI, which plays the controller's end of RSI
//! and checks every answer.

use std::io::{BufRead, BufReader, Write};
use std::net::UdpSocket;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use crate::canter::{canter, command};

/// The robot: any with six joints, because the controller has no model.
const ROBOT: &str = "irb120";

/// Its folder with a margin, as every arm needs whose controller has its own clock.
fn robot() -> tempfile::TempDir {
    let margin = "\n[joints.margin]\nvelocity = 0.9\nacceleration = 0.8\njerk = 0.5\n";
    crate::robot_folder::changed(ROBOT, |text| text + margin)
}

/// Why there is no controller, or nothing if there is one.
pub(crate) fn missing() -> Option<String> {
    let ran = Command::new(python())
        .args(["-c", "import RSIPI.rsi_echo_server"])
        .current_dir(std::env::temp_dir())
        .stderr(Stdio::null())
        .status();
    match ran {
        Ok(status) if status.success() => None,
        Ok(_) => Some(format!("{} has no RSIPI==0.3.0", python())),
        Err(error) => Some(format!("no {}: {error}", python())),
    }
}

/// The Python that has the controller.
fn python() -> String {
    std::env::var("CANTER_RSI_PYTHON").unwrap_or("python3".to_owned())
}

/// How many programs the environment asks for; two without.
fn runs() -> usize {
    let text = std::env::var("CANTER_RSI_RUNS").unwrap_or_default();
    text.parse().unwrap_or(2)
}

struct Controller {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    _folder: tempfile::TempDir,
}

impl Controller {
    fn start(port: u16, degrees: &str) -> Self {
        let root = system_tests::repository::root();
        let folder = tempfile::tempdir().unwrap();
        // With priority where that is allowed: its cycle must not stand still for tens of milliseconds.
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
            .arg(root.join("drivers/kuka/tests/serve.py"))
            .arg(root.join("drivers/kuka/controller/CanterRsi_Ethernet.xml"))
            .args([&port.to_string(), degrees])
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let input = child.stdin.take().unwrap();
        let mut controller = Self {
            output: BufReader::new(child.stdout.take().unwrap()),
            child,
            input,
            _folder: folder,
        };
        while controller.line() != "ready" {}
        controller
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        let read = self.output.read_line(&mut line).unwrap();
        assert!(read > 0, "the controller has ended");
        line.trim().to_owned()
    }

    /// The answer to a question; between them RSIPI says on the same output which answers came late.
    fn ask(&mut self, words: &str) -> String {
        writeln!(self.input, "{words}").unwrap();
        loop {
            let line = self.line();
            if !line.starts_with('[') {
                return line;
            }
        }
    }

    /// Late or invalid answers, and cycles.
    fn count(&mut self) -> (u64, u64) {
        let line = self.ask("count");
        let mut numbers = line.split(' ').map(|word| word.parse().unwrap());
        (numbers.next().unwrap(), numbers.next().unwrap())
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Driver(Child);

impl Driver {
    fn start(arm: &str, port: u16, robot: &str) -> Self {
        let listen = format!("127.0.0.1:{port}");
        let words = [
            "driver", "kuka", "--robot", robot, "--arm", arm, "--listen", &listen,
        ];
        Self(command(words).stdout(Stdio::null()).spawn().unwrap())
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn free_port() -> u16 {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.local_addr().unwrap().port()
}

/// Home of the robot in degrees, with commas.
fn home() -> String {
    let robot = planner::robot::load(ROBOT).unwrap();
    let words = robot
        .home
        .iter()
        .map(|angle| angle.to_degrees().to_string());
    words.collect::<Vec<_>>().join(",")
}

/// Waits until a joint has moved by 0.05 rad: RSI tells no speeds.
fn wait_for_motion(arm: &str) {
    let observer = ipc::Observer::open(&system_tests::domain::arm(arm)).unwrap();
    let start = Instant::now();
    let mut first = None;
    while start.elapsed() < Duration::from_secs(60) {
        let Some(state) = observer.next_state() else {
            std::thread::sleep(Duration::from_millis(1));
            continue;
        };
        let first = first.get_or_insert(state.position);
        let pairs = first.iter().zip(state.position);
        if pairs.into_iter().any(|(a, b)| (a - b).abs() > 0.05) {
            return;
        }
    }
    panic!("{arm} does not move");
}

/// Programs run through, and the controller counts its late answers; then the cable is pulled for a
/// second: the run ends and says so, and the next one works.
pub(crate) fn programs_and_a_pulled_cable() {
    let (port, arm) = (free_port(), format!("kuka{}/rsi", std::process::id()));
    let folder = robot();
    let robot = folder.path().to_str().unwrap();
    let _driver = Driver::start(&arm, port, robot);
    let mut controller = Controller::start(port, &home());
    let program = "examples/pick_and_place.canon";
    let words = [
        "run", program, "--robot", robot, "--driver", "external", "--arm", &arm,
    ];
    // The echo server has no gripper: the program's motions only.
    let moves = tempfile::Builder::new()
        .suffix(".canon")
        .tempfile()
        .unwrap();
    let text = std::fs::read_to_string(system_tests::repository::root().join(program)).unwrap();
    let without: Vec<&str> = text
        .lines()
        .filter(|line| !line.contains("Gripper"))
        .collect();
    std::fs::write(moves.path(), without.join("\n")).unwrap();
    let mut words = words;
    words[1] = moves.path().to_str().unwrap();
    for number in 0..runs() {
        let ran = canter(words);
        assert_eq!(ran.code, 0, "run {number}: {ran:?}");
    }
    let (late, cycles) = controller.count();
    println!("{late} late answers in {cycles} cycles");
    assert!(late * 100 <= cycles, "{late} of {cycles}");
    let running = command(words)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_motion(&arm);
    assert_eq!(controller.ask("drop 1"), "back");
    let ran = running.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert_eq!(ran.status.code(), Some(7), "{said}");
    assert!(
        said.contains("RSI") || said.contains("sent nothing"),
        "{said}"
    );
    // A real controller has ended RSI by then, and the operator starts the program again. The echo
    // server goes on for ever, with angles against its first start.
    drop(controller);
    let _controller = Controller::start(port, &home());
    let ran = canter(words);
    assert_eq!(ran.code, 0, "after the cable was pulled: {ran:?}");
}

/// `canter driver test` on it: nothing fails; what a real arm cannot do is skipped.
pub(crate) fn the_driver_conforms() {
    let (port, arm) = (free_port(), format!("kuka{}/conforms", std::process::id()));
    let folder = robot();
    let robot = folder.path().to_str().unwrap();
    let _driver = Driver::start(&arm, port, robot);
    let _controller = Controller::start(port, &home());
    let ran = canter(["driver", "test", "--arm", &arm]);
    println!("{}", ran.stdout);
    assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
}

//! Faults done to real processes: what the driver received is the witness.
//!
//! Each test starts an engine and a driver as processes of their own, does something to one of
//! them, and reads the driver's log: no setpoint ever breaks a limit of a joint, whatever dies.

use std::thread;
use std::time::{Duration, Instant};

<<<<<<< HEAD
use crate::scene::{Line, PATIENCE, Scene, assert_within_limits, read, rest_error};
=======
use system_tests::servo_arm::{JOINTS, limits};

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// A process that ends with the test.
struct Peer {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Peer {
    fn start(words: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_servo-peer"))
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (send, lines) = channel();
        let input = child.stdin.take();
        for stream in [
            Box::new(child.stdout.take().unwrap()) as Box<dyn std::io::Read + Send>,
            Box::new(child.stderr.take().unwrap()),
        ] {
            let send = send.clone();
            thread::spawn(move || {
                for line in BufReader::new(stream).lines().map_while(Result::ok) {
                    if send.send(line).is_err() {
                        return;
                    }
                }
            });
        }
        Self {
            child,
            input,
            lines,
        }
    }

    /// Waits for a line with `text` in it.
    fn wait_for(&self, text: &str) -> String {
        let end = Instant::now() + PATIENCE;
        let mut seen = Vec::new();
        while let Ok(line) = self
            .lines
            .recv_timeout(end.saturating_duration_since(Instant::now()))
        {
            if line.contains(text) {
                return line;
            }
            seen.push(line);
        }
        panic!(
            "no line with {text:?}; the last were {:?}",
            &seen[seen.len().saturating_sub(5)..]
        );
    }

    fn say(&mut self, line: &str) {
        writeln!(self.input.as_mut().unwrap(), "{line}").unwrap();
    }

    fn signal(&self, signal: i32) {
        system_tests::signal::send(&self.child, signal);
    }
}

/// An arm of its own for a test, with a driver that writes a log.
struct Scene {
    arm: String,
    folder: tempfile::TempDir,
}

impl Scene {
    fn new(name: &str) -> Self {
        let arm = format!("fault-{}/{name}", std::process::id());
        Self {
            arm,
            folder: tempfile::tempdir().unwrap(),
        }
    }

    fn log(&self, number: u32) -> PathBuf {
        self.folder.path().join(format!("{number}.csv"))
    }

    fn driver(&self, number: u32) -> Peer {
        Peer::start(&["driver", &self.arm, self.log(number).to_str().unwrap()])
    }

    fn engine(&self) -> Peer {
        Peer::start(&["engine", &self.arm])
    }

    /// Both, with the arm on its way.
    fn moving(&self) -> (Peer, Peer) {
        let driver = self.driver(0);
        let engine = self.engine();
        engine.wait_for("Started { command: 1");
        thread::sleep(Duration::from_millis(300));
        (engine, driver)
    }
}

/// One line of the driver's log.
#[derive(Clone, Debug)]
struct Line {
    received_ns: u64,
    session: u64,
    tick: u64,
    setpoint: [[f64; JOINTS]; 3],
    joints: [f64; JOINTS],
}

fn read(path: &Path) -> Vec<Line> {
    let text = std::fs::read_to_string(path).unwrap();
    // A kill may cut the last line.
    let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
    whole
        .lines()
        .map(|line| {
            let words: Vec<&str> = line.split(',').collect();
            let number = |at: usize| words[at].parse::<f64>().unwrap();
            let row = |first: usize| core::array::from_fn(|joint| number(first + joint));
            Line {
                received_ns: words[0].parse().unwrap(),
                session: words[1].parse().unwrap(),
                tick: words[3].parse().unwrap(),
                setpoint: [row(5), row(5 + JOINTS), row(5 + 2 * JOINTS)],
                joints: row(5 + 3 * JOINTS),
            }
        })
        .collect()
}

/// No setpoint breaks velocity, acceleration or jerk against the one before in its session, with
/// the periods between them counted; returns how many were compared.
fn assert_within_limits(lines: &[Line]) -> usize {
    let limits = limits();
    let mut compared = 0;
    for pair in lines.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        let [p1, v1, a1] = after.setpoint;
        if before.session != after.session {
            // A new session begins where the arm is.
            for (setpoint, joint) in p1.iter().zip(after.joints) {
                assert!(
                    (setpoint - joint).abs() < 1e-3,
                    "a session began with a jump"
                );
            }
            continue;
        }
        let [p0, _, a0] = before.setpoint;
        let elapsed = (after.tick - before.tick) as f64 * 0.001;
        for joint in 0..JOINTS {
            let moved = (p1[joint] - p0[joint]).abs() / elapsed;
            let jerk = (a1[joint] - a0[joint]).abs() / elapsed;
            assert!(moved <= limits.velocity[joint] * 1.0001, "{moved} rad/s");
            assert!(v1[joint].abs() <= limits.velocity[joint] * 1.0001);
            assert!(a1[joint].abs() <= limits.acceleration[joint] * 1.0001);
            assert!(
                jerk <= limits.jerk[joint] * 1.0001,
                "{jerk} rad/s3 over {elapsed} s"
            );
        }
        compared += 1;
    }
    compared
}

/// The largest distance of the joints from the setpoints at rest at the end of a log.
fn rest_error(lines: &[Line]) -> f64 {
    let last = lines.last().unwrap();
    let [position, velocity, _] = last.setpoint;
    assert!(
        velocity.iter().all(|speed| speed.abs() < 1e-9),
        "the last setpoint moves"
    );
    position
        .iter()
        .zip(last.joints)
        .map(|(setpoint, joint)| (setpoint - joint).abs())
        .fold(0.0, f64::max)
}
>>>>>>> main

#[test]
fn kill_the_engine() {
    let scene = Scene::new("kill-engine");
    let (mut engine, _driver) = scene.moving();
    engine.child.kill().unwrap();
    engine.child.wait().unwrap();
    // The driver stops within watchdog and brake, and latches; a new engine syncs to where it is.
    thread::sleep(Duration::from_millis(600));
    let again = scene.engine();
    again.wait_for("ready");
    again.wait_for("Started { command: 0");
    thread::sleep(Duration::from_millis(200));
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);
    let sessions: Vec<u64> = lines.iter().map(|line| line.session).collect();
    assert_ne!(sessions.first(), sessions.last());
}

#[test]
fn kill_the_driver_and_attach_another() {
    let scene = Scene::new("kill-driver");
    let (mut engine, mut driver) = scene.moving();
    driver.child.kill().unwrap();
    driver.child.wait().unwrap();
    engine.wait_for("DriverLost");
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);

    let _other = scene.driver(1);
    thread::sleep(Duration::from_millis(300));
    engine.say("recover");
    engine.wait_for("Recovered");
    engine.wait_for("Finished");
    thread::sleep(Duration::from_millis(300));
    let lines = read(&scene.log(1));
    assert!(assert_within_limits(&lines) > 500);
}

#[test]
fn stop_the_engine_process_for_300_ms() {
    let scene = Scene::new("stop-engine");
    let (mut engine, _driver) = scene.moving();
    engine.signal(libc::SIGSTOP);
    thread::sleep(Duration::from_millis(300));
    engine.signal(libc::SIGCONT);
    let fault = engine.wait_for("Faulted");
    assert!(
        fault.contains("Stalled") || fault.contains("DriverFault"),
        "{fault}"
    );
    // It does not go on by itself.
    thread::sleep(Duration::from_millis(500));
    let stopped = read(&scene.log(0)).len();
    engine.say("recover");
    engine.wait_for("Recovered");
    engine.wait_for("Finished");
    let lines = read(&scene.log(0));
    assert!(lines.len() > stopped);
    // What a latched driver received is what it did not follow; the sessions are what counts.
    assert_within_limits(&lines);
}

#[test]
fn stop_the_driver_process_for_300_ms() {
    let scene = Scene::new("stop-driver");
    let (mut engine, driver) = scene.moving();
    driver.signal(libc::SIGSTOP);
    engine.wait_for("DriverLost");
    thread::sleep(Duration::from_millis(300));
    driver.signal(libc::SIGCONT);
    thread::sleep(Duration::from_millis(700));
    engine.say("recover");
    engine.wait_for("Recovered");
    engine.wait_for("Finished");
    let lines = read(&scene.log(0));
    assert_within_limits(&lines);
}

#[test]
fn a_second_engine_is_refused_by_name() {
    let scene = Scene::new("second");
    let (_engine, _driver) = scene.moving();
    let mut second = scene.engine();
    let line = second.wait_for("taken");
    assert!(
        line.contains("engine of") && line.contains("process"),
        "{line}"
    );
    assert_eq!(second.child.wait().unwrap().code(), Some(4));
    let mut other = scene.driver(7);
    assert!(other.wait_for("taken").contains("driver"));
    assert_eq!(other.child.wait().unwrap().code(), Some(4));
}

/// A hundred kills leave nothing behind but what the next start cleans up: each start cleans up
/// after the one before, and the last is cleaned up here.
#[test]
fn a_hundred_kills_leak_nothing() {
    let scene = Scene::new("leak");
    let mut most = 0;
    for _ in 0..100 {
        let mut driver = scene.driver(0);
        let start = Instant::now();
        while !scene.log(0).exists() && start.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(1));
        }
        driver.child.kill().unwrap();
        driver.child.wait().unwrap();
        std::fs::remove_file(scene.log(0)).unwrap();
        most = most.max(ipc::survey().dead);
    }
    assert!(most < 20, "{most} dead processes at a time");
    let start = Instant::now();
    while ipc::survey().dead > 0 && start.elapsed() < PATIENCE {
        ipc::cleanup();
        thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(ipc::survey().dead, 0);
}

/// A hog of the processors at a higher priority: either every period is made in time to go on, or
/// the fault latches; no setpoint breaks a limit either way.
#[test]
fn a_hog_of_the_processors() {
    let scene = Scene::new("hog");
    let (engine, _driver) = scene.moving();
    let stop = std::sync::atomic::AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                // Where the user may not, the hog has an ordinary priority.
                ipc::urge(ipc::Urgency {
                    priority: 90,
                    processor: None,
                    lock_memory: false,
                    low_latency: false,
                });
                let end = Instant::now() + Duration::from_millis(400);
                while Instant::now() < end && !stop.load(std::sync::atomic::Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
    });
    drop(engine);
    thread::sleep(Duration::from_millis(400));
    let lines = read(&scene.log(0));
    assert!(assert_within_limits(&lines) > 1000);
    assert!(lines.last().unwrap().received_ns > 0);
}

/// An engine that leaves says goodbye: the driver rests where the last setpoint is.
#[test]
fn at_rest_the_joints_are_at_the_setpoint() {
    let scene = Scene::new("rest");
    let (engine, driver) = scene.moving();
    driver.signal(0);
    engine.wait_for("Finished { command: 1");
    drop(engine);
    let lines = read(&scene.log(0));
    let resting: Vec<Line> = lines
        .iter()
        .take_while(|line| line.tick < 40)
        .cloned()
        .collect();
    assert!(rest_error(&resting[..1]) < 1e-6);
}

/// A planner that dies in the middle of a command: the arm stops on the path, without a fault.
#[test]
fn a_starved_planner_stops_the_arm() {
    let scene = Scene::new("starved");
    let (mut engine, _driver) = scene.moving();
    engine.say("starve");
    let started = engine.wait_for("Started { command: 4000000000");
    assert!(!started.is_empty());
    // What is at hand lasts 3 s; the nearer its end, the slower the arm.
    let start = Instant::now();
    let lines = loop {
        thread::sleep(Duration::from_millis(500));
        let lines = read(&scene.log(0));
        let [_, velocity, _] = lines.last().unwrap().setpoint;
        if start.elapsed() > Duration::from_secs(3) && velocity.iter().all(|v| v.abs() < 1e-9) {
            break lines;
        }
        assert!(start.elapsed() < PATIENCE, "{velocity:?}");
    };
    assert!(assert_within_limits(&lines) > 1000);
    assert!(rest_error(&lines) < 1e-3);
}

/// Both are killed while the arm moves: what they left is no obstacle to the next two.
#[test]
fn left_over_segments_are_cleaned_up() {
    let scene = Scene::new("left-over");
    for number in 0..3 {
        let mut driver = scene.driver(number);
        let mut engine = scene.engine();
        engine.wait_for("Started { command: 0");
        thread::sleep(Duration::from_millis(300));
        for peer in [&mut engine, &mut driver] {
            peer.child.kill().unwrap();
            peer.child.wait().unwrap();
        }
        assert!(assert_within_limits(&read(&scene.log(number))) > 50);
    }
    let start = Instant::now();
    while ipc::survey().dead > 0 && start.elapsed() < PATIENCE {
        ipc::cleanup();
        thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(ipc::survey().dead, 0);
}

//! An engine and a driver as separate processes, and what the driver received.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use system_tests::servo_arm::{JOINTS, limits};

/// How long a test waits for something that must come.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A process that ends with the test.
pub(crate) struct Peer {
    pub(crate) child: Child,
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
    pub(crate) fn start(words: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_servo-peer"));
        let mut child = system_tests::domain::join(&mut command)
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
    pub(crate) fn wait_for(&self, text: &str) -> String {
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

    pub(crate) fn say(&mut self, line: &str) {
        writeln!(self.input.as_mut().unwrap(), "{line}").unwrap();
    }

    pub(crate) fn signal(&self, signal: i32) {
        system_tests::signal::send(&self.child, signal);
    }
}

/// A separate arm for a test, with a driver that writes a log.
pub(crate) struct Scene {
    arm: String,
    folder: tempfile::TempDir,
}

impl Scene {
    pub(crate) fn new(name: &str) -> Self {
        let arm = format!("fault-{}/{name}", std::process::id());
        Self {
            arm,
            folder: tempfile::tempdir().unwrap(),
        }
    }

    pub(crate) fn log(&self, number: u32) -> PathBuf {
        self.folder.path().join(format!("{number}.csv"))
    }

    pub(crate) fn driver(&self, number: u32) -> Peer {
        Peer::start(&["driver", &self.arm, self.log(number).to_str().unwrap()])
    }

    pub(crate) fn engine(&self) -> Peer {
        Peer::start(&["engine", &self.arm])
    }

    /// A driver that does something wrong.
    pub(crate) fn hostile(&self, kind: &str) -> Peer {
        Peer::start(&["hostile", &self.arm, self.log(0).to_str().unwrap(), kind])
    }

    /// Both, with the arm moving.
    pub(crate) fn moving(&self) -> (Peer, Peer) {
        let driver = self.driver(0);
        let engine = self.engine();
        engine.wait_for("Started { command: 1");
        thread::sleep(Duration::from_millis(300));
        (engine, driver)
    }
}

/// One line of the driver's log.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) received_ns: u64,
    pub(crate) session: u64,
    pub(crate) sequence: u64,
    pub(crate) tick: u64,
    pub(crate) setpoint: [[f64; JOINTS]; 3],
    pub(crate) joints: [f64; JOINTS],
}

pub(crate) fn read(path: &Path) -> Vec<Line> {
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
                sequence: words[2].parse().unwrap(),
                tick: words[3].parse().unwrap(),
                setpoint: [row(5), row(5 + JOINTS), row(5 + 2 * JOINTS)],
                joints: row(5 + 3 * JOINTS),
            }
        })
        .collect()
}

/// No setpoint breaks velocity, acceleration or jerk against the one before in its session, with
/// the periods between them counted; returns how many were compared.
pub(crate) fn assert_within_limits(lines: &[Line]) -> usize {
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
pub(crate) fn rest_error(lines: &[Line]) -> f64 {
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

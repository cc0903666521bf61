//! An engine with its view, to be looked at.

use std::io::{BufRead, BufReader};
use std::process::{ChildStderr, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use system_tests::killed::Killed;

use crate::canter::{canter, command};

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(90);

/// A process that is killed when a test is over.
pub(crate) struct Peer {
    pub(crate) child: Killed,
    stderr: BufReader<ChildStderr>,
}

impl Peer {
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let mut child = command(arguments)
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        Self {
            child: Killed(child),
            stderr,
        }
    }

    /// The next line on standard error that has `mark`, from there on.
    pub(crate) fn line(&mut self, mark: &str) -> String {
        let end = Instant::now() + PATIENCE;
        let mut line = String::new();
        while Instant::now() < end {
            line.clear();
            assert!(
                self.stderr.read_line(&mut line).unwrap() > 0,
                "it ended without {mark}"
            );
            if let Some(at) = line.find(mark) {
                return line[at..].trim().to_owned();
            }
        }
        panic!("no line with {mark}")
    }
}

/// An engine and the view of its arm.
pub(crate) struct Scene {
    pub(crate) arm: String,
    pub(crate) engine: Peer,
    view: Peer,
    pub(crate) hand: String,
    pub(crate) watch: String,
    /// Where viewers of other programs connect.
    pub(crate) viewer: String,
}

impl Scene {
    pub(crate) fn start(name: &str) -> Self {
        Self::of(name, "ur5e")
    }

    /// The same with another robot.
    pub(crate) fn of(name: &str, robot: &str) -> Self {
        let arm = if name.contains('/') {
            name.to_owned()
        } else {
            format!("browser{}/{name}", std::process::id())
        };
        let mut engine = Peer::start(&["engine", "--robot", robot, "--arm", &arm]);
        engine.line("engine of ");
        let mut view = Peer::start(&["view", "--arm", &arm, "--port", "0"]);
        let (hand, watch) = (view.line("http://"), view.line("http://"));
        let viewer = view.line("ws://");
        Self {
            arm,
            engine,
            view,
            hand,
            watch,
            viewer,
        }
    }

    /// The number of the view's process.
    pub(crate) fn view_process(&self) -> u32 {
        self.view.child.id()
    }

    /// The port of the view.
    pub(crate) fn port(&self) -> u16 {
        let rest = self.hand.trim_start_matches("http://127.0.0.1:");
        rest.split('/').next().unwrap().parse().unwrap()
    }

    /// The engine's own report.
    pub(crate) fn status(&self) -> Value {
        let ran = canter(["status", "--json", "--arm", &self.arm]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        serde_json::from_str(&ran.stdout).unwrap()
    }
}

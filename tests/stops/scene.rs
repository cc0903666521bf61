//! An engine that moves an arm, and the load beside it (a busy planner, a full pipe, busy clients).

use std::io::Write;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use ipc::{Arm, Client, Verb};
use system_tests::signal;

/// The load during the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Burden {
    /// Nothing.
    Idle,
    /// The planner works on a list of 2000 poses.
    Planner,
    /// Standard output is a full pipe that nobody reads.
    Output,
    /// Two clients ask for the status as fast as they can.
    Flood,
    /// `canter status --watch` runs.
    Watch,
}

impl Burden {
    pub(crate) const ALL: [Self; 5] = [
        Self::Idle,
        Self::Planner,
        Self::Output,
        Self::Flood,
        Self::Watch,
    ];
}

/// How long an engine may take to be there.
const PATIENCE: Duration = Duration::from_secs(60);

/// An engine, its program and its load; all end when this is dropped.
pub(crate) struct Scene {
    pub(crate) arm: Arm,
    burden: Burden,
    engine: Child,
    others: Vec<Child>,
    ends: Arc<AtomicBool>,
    _reader: Option<OwnedFd>,
}

impl Drop for Scene {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        for child in self.others.iter_mut().chain([&mut self.engine]) {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn canter() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_canter-under-test"));
    command
        .current_dir(system_tests::repository::root())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    system_tests::domain::join(&mut command);
    command
}

impl Scene {
    /// An engine with a long motion.
    pub(crate) fn engine(burden: Burden) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("stops/arm{number}");
        let mut command = canter();
        command.args(["engine", "--robot", "ur5e", "--arm", &name]);
        let mut reader = None;
        if burden == Burden::Output {
            let (end, writer) = full_pipe();
            reader = Some(end);
            command.stdout(writer);
        }
        let engine = command.spawn().unwrap();
        let mut scene = Self {
            arm: system_tests::domain::arm(&name),
            burden,
            engine,
            others: Vec::new(),
            ends: Arc::new(AtomicBool::new(false)),
            _reader: reader,
        };
        scene.submit();
        scene.load(&name);
        scene
    }

    /// Sends the program as soon as the engine is there.
    fn submit(&self) {
        let poses = if self.burden == Burden::Planner {
            2000
        } else {
            0
        };
        let end = Instant::now() + PATIENCE;
        let client = Client::open(&self.arm, "stops").unwrap();
        loop {
            let answer = client.ask(
                Verb::Submit {
                    format: "text".to_owned(),
                    name: "stops".to_owned(),
                    program: program(poses),
                },
                Duration::from_secs(10),
            );
            match answer {
                Ok(answer) if answer.accepted => return,
                Ok(answer) => panic!("{}", answer.message),
                Err(error) => assert!(Instant::now() < end, "{error}"),
            }
            sleep(Duration::from_millis(20));
        }
    }

    /// What the engine says of itself.
    pub(crate) fn status(&self) -> String {
        let client = Client::open(&self.arm, "stops").unwrap();
        format!("{:?}", client.ask(Verb::Status, Duration::from_secs(3)))
    }

    fn load(&mut self, name: &str) {
        match self.burden {
            Burden::Watch => {
                let watch = canter()
                    .args(["status", "--watch", "--arm", name])
                    .spawn()
                    .unwrap();
                self.others.push(watch);
            }
            Burden::Flood => {
                for _ in 0..2 {
                    let (arm, ends) = (self.arm.clone(), Arc::clone(&self.ends));
                    std::thread::spawn(move || {
                        let client = Client::open(&arm, "flood").unwrap();
                        while !ends.load(Ordering::Relaxed) {
                            // The engine may just be ending.
                            let _ = client.ask(Verb::Status, Duration::from_millis(50));
                        }
                    });
                }
            }
            _ => {}
        }
    }

    /// Until when the load is certain to act and the motion to last.
    pub(crate) fn episode(&self) -> Instant {
        let seconds = match self.burden {
            // The planner begins with the list when the slow move has begun.
            Burden::Planner => 8,
            _ => 40,
        };
        Instant::now() + Duration::from_secs(seconds)
    }

    pub(crate) fn interrupt(&self) {
        signal::send(&self.engine, libc::SIGINT);
    }

    pub(crate) fn wait_for_the_end(&mut self) {
        let end = Instant::now() + PATIENCE;
        while self.engine.try_wait().unwrap().is_none() {
            assert!(Instant::now() < end, "the engine does not end");
            sleep(Duration::from_millis(2));
        }
    }
}

/// A straight move of more than two minutes, back and forth, and after it a list of poses.
fn program(poses: usize) -> String {
    let mut text = "InitCanon()\nSetRelativeSpeed(100)\n\
        MoveTo({{400, -200, 400}, {0,0,-1}, {1,1,0}})\nSetAbsoluteSpeed(40)\n"
        .to_owned();
    for _ in 0..if poses == 0 { 20 } else { 2 } {
        text.push_str(
            "MoveStraightTo({{400, 200, 400}, {0,0,-1}, {1,1,0}})\n\
             MoveStraightTo({{400, -200, 400}, {0,0,-1}, {1,1,0}})\n",
        );
    }
    if poses > 0 {
        text.push_str("SetIntermediatePointTolerance(5)\nMoveSmoothlyTo({\n");
        for index in 0..poses {
            let turn = index as f64 / 40.0 * std::f64::consts::TAU;
            let up = 400.0 - 80.0 * index as f64 / poses as f64;
            let comma = if index + 1 == poses { "" } else { "," };
            text.push_str(&format!(
                "{{{{{:.3}, {:.3}, {up:.3}}}, {{0,0,-1}}, {{1,1,0}}}}{comma}\n",
                400.0 + 60.0 * turn.sin(),
                -200.0 + 60.0 * (1.0 - turn.cos()),
            ));
        }
        text.push_str(&format!("}}, {poses})\n"));
    }
    text.push_str("EndCanon(0)\n");
    text
}

/// A pipe that takes nothing: it is full and nobody reads. Its reader, and the end to write to.
fn full_pipe() -> (OwnedFd, Stdio) {
    let mut ends = [0; 2];
    #[expect(unsafe_code, reason = "the standard library's pipe has no size")]
    // SAFETY: the array has room for two numbers; what comes back is ours alone.
    let (reader, writer) = unsafe {
        assert_eq!(libc::pipe2(ends.as_mut_ptr(), libc::O_CLOEXEC), 0);
        libc::fcntl(ends[1], libc::F_SETPIPE_SZ, 4096);
        (OwnedFd::from_raw_fd(ends[0]), OwnedFd::from_raw_fd(ends[1]))
    };
    let mut file = std::fs::File::from(writer);
    #[expect(unsafe_code, reason = "the standard library does not show the flag")]
    // SAFETY: the file is open; the calls take numbers only.
    unsafe {
        let flags = libc::fcntl(file.as_raw_fd(), libc::F_GETFL);
        libc::fcntl(file.as_raw_fd(), libc::F_SETFL, flags | libc::O_NONBLOCK);
        while file.write(&[b'x'; 512]).is_ok() {}
        libc::fcntl(file.as_raw_fd(), libc::F_SETFL, flags);
    }
    (reader, Stdio::from(file))
}

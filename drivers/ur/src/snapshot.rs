//! What the threads of the driver tell each other.

use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, Ordering};

use driver_kit::{Outputs, RobotFault};
use ipc::Payload;

use crate::rtde::{Cycle, Version};

/// What the thread that answers the controller does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// No connection with the controller.
    Disconnected,
    /// States come; the program does not run.
    Idle,
    /// The program follows the references.
    Moving,
    /// The program has ended by itself.
    Faulted,
}

/// One state of the robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Snapshot {
    pub(crate) phase: Phase,
    /// When it was received (ns of `CLOCK_MONOTONIC`); 0 before the first.
    pub(crate) received_ns: u64,
    pub(crate) cycle: Cycle,
    /// How far the commands are behind the newest reference (s).
    pub(crate) delay: f64,
    pub(crate) fault: Option<RobotFault>,
    /// Why there is no connection.
    pub(crate) reason: [u8; 96],
    /// The connection is refused for good, and not only lost.
    pub(crate) refused: bool,
}

impl Default for Snapshot {
    fn default() -> Self {
        Self {
            phase: Phase::Disconnected,
            received_ns: 0,
            cycle: Cycle::default(),
            delay: 0.0,
            fault: None,
            reason: [0; 96],
            refused: false,
        }
    }
}

/// What the kit wants.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wish {
    /// Get the arm ready and start the program; with the number of the request.
    Begin(u32),
    /// End the program.
    End,
    /// The arm carries something else.
    Carry(Payload),
    /// Set outputs.
    Set(Outputs),
}

/// How a request to begin goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Notice {
    /// The number of the request.
    pub(crate) number: u32,
    /// It cannot be done.
    pub(crate) refused: bool,
    /// What it waits for, or why it cannot be done.
    pub(crate) reason: [u8; 128],
}

/// The connection of a program on the robot.
pub(crate) struct Connection {
    pub(crate) stream: TcpStream,
}

/// A message of the controller about an error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Alarm {
    /// Number and argument, as in C204A3; 0 for an error of the program.
    pub(crate) code: i32,
    pub(crate) argument: i32,
    pub(crate) text: [u8; 80],
}

/// The newest modes of the controller, and what ends.
#[derive(Debug, Default)]
pub(crate) struct Modes {
    pub(crate) connected: AtomicBool,
    pub(crate) robot: AtomicI32,
    pub(crate) safety: AtomicI32,
    pub(crate) runtime: AtomicU32,
    /// Major, minor and bugfix in 16 bits each.
    version: AtomicU64,
    /// This machine's address as the controller sees it, IPv4.
    pub(crate) local: AtomicU32,
    /// The program shall end.
    pub(crate) ending: AtomicBool,
    /// The program follows.
    pub(crate) moving: AtomicBool,
    /// The driver ends.
    pub(crate) stop: AtomicBool,
}

impl Modes {
    pub(crate) fn take(&self, cycle: &Cycle) {
        self.robot.store(cycle.robot_mode, Ordering::Relaxed);
        self.safety.store(cycle.safety_mode, Ordering::Relaxed);
        self.runtime.store(cycle.runtime_state, Ordering::Relaxed);
        self.connected.store(true, Ordering::Relaxed);
    }

    pub(crate) fn set_version(&self, version: Version) {
        let bits = |number: u32| u64::from(number) & 0xffff;
        let packed = bits(version.major) << 32 | bits(version.minor) << 16 | bits(version.bugfix);
        self.version.store(packed, Ordering::Relaxed);
    }

    pub(crate) fn version(&self) -> Version {
        let packed = self.version.load(Ordering::Relaxed);
        let number = |shift: u32| (packed >> shift & 0xffff) as u32;
        Version {
            major: number(32),
            minor: number(16),
            bugfix: number(0),
        }
    }
}

//! What the thread that owns the arm tells the kit, and what the kit tells it.

use driver_kit::RobotFault;
use franka::{RobotMode, RobotState};
use ipc::Payload;

use crate::JOINTS;

/// What the thread that owns the arm does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// No connection with the arm.
    Disconnected,
    /// Connected, no motion.
    Idle,
    /// Recovering from an error, or starting the motion.
    Starting,
    /// Follows the references.
    Moving,
    /// The motion has ended with an error.
    Faulted,
}

/// One state of the arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Snapshot {
    pub(crate) phase: Phase,
    pub(crate) mode: RobotMode,
    /// When it was received (ns of `CLOCK_MONOTONIC`); 0 before the first.
    pub(crate) received_ns: u64,
    /// The arm's own time (ns).
    pub(crate) hardware_ns: u64,
    pub(crate) q: [f64; JOINTS],
    pub(crate) dq: [f64; JOINTS],
    pub(crate) tau: [f64; JOINTS],
    /// What the controller commands (rad).
    pub(crate) q_d: [f64; JOINTS],
    /// External force (N) and torque (N m) at the flange, in the base frame.
    pub(crate) wrench: [f64; 6],
    /// Share of the commands that arrived in time.
    pub(crate) success_rate: f64,
    /// How far the commands are behind the newest reference (s).
    pub(crate) delay: f64,
    /// How many payloads the controller was told.
    pub(crate) carried: u32,
    pub(crate) fault: Option<RobotFault>,
    /// Why there is no connection, or why the motion did not start.
    pub(crate) reason: [u8; 96],
}

impl Default for Snapshot {
    fn default() -> Self {
        Self {
            phase: Phase::Disconnected,
            mode: RobotMode::Other,
            received_ns: 0,
            hardware_ns: 0,
            q: [0.0; JOINTS],
            dq: [0.0; JOINTS],
            tau: [0.0; JOINTS],
            q_d: [0.0; JOINTS],
            wrench: [0.0; 6],
            success_rate: 0.0,
            delay: 0.0,
            carried: 0,
            fault: None,
            reason: [0; 96],
        }
    }
}

impl Snapshot {
    /// Takes over what the arm measures.
    pub(crate) fn take(&mut self, state: &RobotState, now_ns: u64) {
        self.mode = state.robot_mode;
        self.received_ns = now_ns;
        self.hardware_ns = state.time.as_millis().saturating_mul(1_000_000);
        (self.q, self.dq, self.tau) = (state.q, state.dq, state.tau_J);
        self.q_d = state.q_d;
        self.wrench = state.O_F_ext_hat_K;
        self.success_rate = state.control_command_success_rate;
    }
}

/// What the kit wants of the thread.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wish {
    /// Recover from errors and start the motion.
    Begin,
    /// End the motion.
    End,
    /// The arm carries something else; the number counts them.
    Carry(Payload, u32),
}

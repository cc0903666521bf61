//! The drives of all joints in a session: enabled, following, stopped.

use driver_kit::{Measured, Resampler, RobotFault, TimedReferences};
use ipc::{MAX_JOINTS, bytes_of};

use crate::process_data::Said;
use crate::snapshot::{Phase, Snapshot};
use crate::{Drive, DriveState, control_word};

/// How long the drives may take until they follow (s), for how long all must be enabled before, and
/// half the length of a pulse that clears faults (s).
const PATIENCE: f64 = 10.0;
const SETTLED: f64 = 0.005;
const PULSE: f64 = 0.02;

/// How long a stop, or the end of a motion, may take (s).
const STOP: f64 = 10.0;

/// Time constant of the measured speed (s).
const SPEED: f64 = 0.005;

/// The bit of the statusword that says that a drive does not follow, in this mode.
const FOLLOWING_ERROR: u16 = 1 << 13;

/// The error code of a following error.
const FOLLOWING_ERROR_CODE: u16 = 0x8611;

/// What a drive is told in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Told {
    /// Controlword.
    pub(crate) control: u16,
    /// Target position (counts).
    pub(crate) target: i32,
}

/// All joints.
#[derive(Debug)]
pub(crate) struct Axes {
    drives: Vec<Drive>,
    resampler: Resampler,
    cycle: f64,
    /// Time in the present phase, and since the last joint was not enabled (s).
    time: f64,
    settled: f64,
    measured: bool,
}

impl Axes {
    pub(crate) fn new(drives: Vec<Drive>, resampler: Resampler, cycle: f64) -> Self {
        Self {
            drives,
            resampler,
            cycle,
            time: 0.0,
            settled: 0.0,
            measured: false,
        }
    }

    /// The bus was brought up again: where the joints are is not known yet.
    pub(crate) fn forget(&mut self) {
        self.measured = false;
    }

    /// Notes what the drives say, `passed` cycles after the last time.
    pub(crate) fn measure(&mut self, said: &[Said], passed: f64, to: &mut Snapshot) {
        let time = passed * self.cycle;
        let share = 1.0 - (-time / SPEED).exp();
        for (joint, (drive, said)) in self.drives.iter().zip(said).enumerate() {
            let position = drive.to_angle(said.position);
            let before = to.joints[joint];
            let speed = (position - before.position) / time;
            to.joints[joint] = Measured {
                position,
                velocity: if self.measured {
                    before.velocity + (speed - before.velocity) * share
                } else {
                    0.0
                },
                effort: drive.torque.unwrap_or(0.0) * f64::from(said.torque) / 1000.0,
            };
            if !self.measured {
                to.commanded[joint] = position;
            }
        }
        self.measured = true;
    }

    /// One cycle: what the drives shall do. `wish` is the session that the engine wants, 0 for none.
    pub(crate) fn cycle(
        &mut self,
        said: &[Said],
        (wish, passed): (u32, f64),
        rows: &mut dyn FnMut() -> Option<TimedReferences<MAX_JOINTS>>,
        now: &mut Snapshot,
    ) {
        self.time += passed * self.cycle;
        self.look(said, now);
        self.change_phase(said, wish, now);
        let joints = self.drives.len();
        while let Some(row) = rows() {
            if now.phase == Phase::Following {
                self.resampler.push(row.at_ns, &row.joints[..joints]);
            }
        }
        let moves = matches!(now.phase, Phase::Following | Phase::Stopping);
        if moves {
            let command = self.resampler.next(passed * self.cycle);
            for (to, from) in now.commanded.iter_mut().zip(command) {
                *to = from.position;
            }
            now.delay = self.resampler.delay();
        }
        let drives = said.iter().enumerate().take(joints);
        for (joint, said) in drives {
            // A drive that does not follow is told where it is, so that it need not jump.
            if DriveState::of(said.status) != DriveState::Enabled {
                now.commanded[joint] = now.joints[joint].position;
            }
        }
    }

    /// What each drive is told.
    pub(crate) fn tell(&self, said: &[Said], now: &Snapshot) -> [Told; MAX_JOINTS] {
        let enable = matches!(
            now.phase,
            Phase::Enabling | Phase::Following | Phase::Stopping
        );
        let reset = now.phase == Phase::Enabling && !((self.time / PULSE) as u64).is_multiple_of(2);
        let mut told = [Told::default(); MAX_JOINTS];
        for (joint, (drive, said)) in self.drives.iter().zip(said).enumerate() {
            let state = DriveState::of(said.status);
            // During a stop no drive is enabled that is not.
            let enable = enable && (now.phase != Phase::Stopping || state == DriveState::Enabled);
            told[joint] = Told {
                control: control_word(state, enable, reset),
                target: drive.to_counts(now.commanded[joint]),
            };
        }
        told
    }

    /// How long the present phase lasts (s).
    pub(crate) fn time(&self) -> f64 {
        self.time
    }

    /// The bus has failed: all joints that can be reached stop.
    pub(crate) fn fail(&mut self, fault: RobotFault, now: &mut Snapshot) {
        match now.phase {
            Phase::Following => {
                self.resampler.stop();
                self.enter(Phase::Stopping, now);
            }
            Phase::Enabling => self.enter(Phase::Faulted, now),
            Phase::Stopping if now.fault.is_none() => self.resampler.stop(),
            _ => return,
        }
        now.fault = Some(fault);
    }

    /// Looks for a drive that does not follow any more.
    fn look(&mut self, said: &[Said], now: &mut Snapshot) {
        if now.phase != Phase::Following && (now.phase != Phase::Stopping || now.fault.is_some()) {
            return;
        }
        let lost = |said: &Said| {
            DriveState::of(said.status) != DriveState::Enabled || said.status & FOLLOWING_ERROR != 0
        };
        if let Some(joint) = said.iter().position(lost) {
            let fault = fault(joint, &said[joint]);
            self.fail(fault, now);
        }
    }

    fn change_phase(&mut self, said: &[Said], wish: u32, now: &mut Snapshot) {
        match now.phase {
            Phase::Connecting | Phase::Down => self.enter(Phase::Idle, now),
            Phase::Idle | Phase::Faulted if wish != 0 && wish != now.session => {
                now.session = wish;
                now.fault = None;
                self.settled = 0.0;
                self.enter(Phase::Enabling, now);
            }
            Phase::Enabling if wish != now.session => self.enter(Phase::Idle, now),
            Phase::Enabling => self.enable(said, now),
            Phase::Following if wish != now.session => {
                // The kit has braked; the rest of the way is still to be followed.
                self.enter(Phase::Stopping, now);
            }
            Phase::Stopping if self.resampler.is_resting() || self.time > STOP => {
                let next = match now.fault {
                    Some(_) => Phase::Faulted,
                    None => Phase::Idle,
                };
                self.enter(next, now);
            }
            _ => {}
        }
    }

    /// Waits until all drives are enabled.
    fn enable(&mut self, said: &[Said], now: &mut Snapshot) {
        let off = |said: &Said| {
            let mode = said
                .mode
                .is_some_and(|mode| mode != crate::process_data::POSITION_MODE);
            DriveState::of(said.status) != DriveState::Enabled || mode
        };
        let Some(joint) = said.iter().position(off) else {
            self.settled += self.cycle;
            if self.settled >= SETTLED {
                self.resampler.begin(&now.commanded[..self.drives.len()]);
                self.enter(Phase::Following, now);
            }
            return;
        };
        self.settled = 0.0;
        let state = DriveState::of(said[joint].status).words();
        now.reason = bytes_of(&format!("joint {}: {state}", joint + 1));
        if self.time > PATIENCE {
            now.fault = Some(fault(joint, &said[joint]));
            self.enter(Phase::Faulted, now);
        }
    }

    fn enter(&mut self, phase: Phase, now: &mut Snapshot) {
        self.time = 0.0;
        now.phase = phase;
    }
}

/// The fault of a drive, in words.
fn fault(joint: usize, said: &Said) -> RobotFault {
    let state = DriveState::of(said.status);
    let text = match (state, said.error) {
        (DriveState::Enabled, _) | (_, FOLLOWING_ERROR_CODE) => {
            format!(
                "following error of the drive, error code {:#06x}",
                said.error
            )
        }
        (_, 0) => format!("the drive left operation: {}", state.words()),
        (_, error) => format!("{}, error code {error:#06x}", state.words()),
    };
    RobotFault::new(Some(joint as u32), u32::from(said.error), &text)
}

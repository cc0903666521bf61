//! The robot of `driver-kit`: passes everything to the threads that own the connections.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use driver_kit::{
    About, Command, DriverError, Inputs, Measured, Measurement, Outputs, OwnThread, Readiness,
    Robot, RobotFault, Sensors, TimedReferences,
};
use ipc::{GRIPPER, Payload, ToolAction, ToolCommand, ToolStatus, text_of};
use rtrb::{Consumer, Producer, RingBuffer};
use scheduling::now_ns;

use crate::control_thread::{ControlThread, Rings};
use crate::cycle_thread::CycleThread;
use crate::snapshot::{Modes, Notice, Phase, Snapshot, Wish};
use crate::{JOINTS, UrOptions, words};

/// Room of the rings between the threads: a quarter of a second.
const RING: usize = 256;

/// A state that is older counts as none (ns).
const OLD: u64 = 50_000_000;

/// From a setpoint that is sent to the arm that moves by it, without the smoothing of `servoj` (s).
const ANSWER: f64 = 0.01;

/// The controller commands rest when it commands the same twice, to this difference (rad).
const RESTS: f64 = 1e-6;

/// An arm of Universal Robots.
#[derive(Debug)]
pub struct Ur {
    about: About,
    options: UrOptions,
    modes: Arc<Modes>,
    rows: Producer<TimedReferences<JOINTS>>,
    wishes: Producer<Wish>,
    snapshots: Consumer<Snapshot>,
    notices: Consumer<Notice>,
    /// The newest state.
    now: Snapshot,
    notice: Option<Notice>,
    /// Counts the requests to begin, and whether the last one is being carried out.
    requests: u32,
    begun: bool,
    /// What the controller commanded when it was last asked (rad): a motion begins at rest.
    held: [f64; JOINTS],
    /// When the gripper has done its last order (ns), and its status then.
    gripper: (u64, ToolStatus),
    _threads: [OwnThread; 2],
}

impl Ur {
    /// Opens the ports and starts the threads; they connect when the robot answers.
    ///
    /// # Errors
    /// [`DriverError`] for options that do not fit together, or a port that is taken.
    pub fn new(options: UrOptions) -> Result<Self, DriverError> {
        let about = about(&options)?;
        let modes = Arc::new(Modes::default());
        let (rows, rows_out) = RingBuffer::new(RING);
        let (wishes, wishes_out) = RingBuffer::new(64);
        let (snapshots_in, snapshots) = RingBuffer::new(RING);
        let (notices_in, notices) = RingBuffer::new(RING);
        let (connections_in, connections) = RingBuffer::new(2);
        let (alarms_in, alarms) = RingBuffer::new(16);
        let rings = Rings {
            wishes: wishes_out,
            notices: notices_in,
            connections: connections_in,
            alarms: alarms_in,
        };
        let control = ControlThread::new(options.clone(), Arc::clone(&modes), rings).map_err(
            |(address, cause)| DriverError::Port {
                address,
                cause: cause.to_string(),
            },
        )?;
        let cycle = CycleThread {
            options: options.clone(),
            about: about.clone(),
            rows: rows_out,
            connections,
            alarms,
            snapshots: snapshots_in,
            snapshot: Snapshot::default(),
            modes: Arc::clone(&modes),
        };
        let cycle = OwnThread::start_real_time("ur", cycle.options.priority, move || cycle.run())?;
        // Without the second thread the first shall end: it is waited for.
        let control = OwnThread::start("ur-control", move || control.run())
            .inspect_err(|_| modes.stop.store(true, Ordering::Relaxed))?;
        Ok(Self {
            about,
            options,
            modes,
            rows,
            wishes,
            snapshots,
            notices,
            now: Snapshot::default(),
            notice: None,
            requests: 0,
            begun: false,
            held: [f64::NAN; JOINTS],
            gripper: (0, ToolStatus::Unknown),
            _threads: [cycle, control],
        })
    }

    fn look(&mut self) {
        while let Ok(snapshot) = self.snapshots.pop() {
            self.now = snapshot;
        }
        while let Ok(notice) = self.notices.pop() {
            self.notice = Some(notice);
        }
    }

    fn wish(&mut self, wish: Wish) {
        // The ring is empty but for the last moment; a wish that finds no room is asked for again.
        let _ = self.wishes.push(wish);
    }

    /// The program follows: ready when the controller holds the arm still.
    fn when_resting(&mut self) -> Readiness {
        let now = self.now.cycle.target_q;
        let pairs = self.held.iter().zip(now);
        let rests = pairs
            .into_iter()
            .all(|(held, now)| (held - now).abs() < RESTS);
        self.held = now;
        if rests {
            Readiness::Ready
        } else {
            Readiness::Wait("the arm comes to rest".to_owned())
        }
    }
}

/// What the kit must know.
fn about(options: &UrOptions) -> Result<About, DriverError> {
    let about = About {
        name: "ur".to_owned(),
        lock_step: false,
        periods_ns: [500_000, 10_000_000],
        own_clock: true,
        real: true,
        delay_ns: ((options.delay + options.lookahead + ANSWER) * 1e9) as u64,
        ..options.about.clone()
    };
    about.check()?;
    options.check()?;
    about.check_joints(JOINTS)?;
    Ok(about)
}

impl Robot for Ur {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn begin(&mut self) -> Readiness {
        self.look();
        if self.now.phase == Phase::Disconnected {
            self.begun = false;
            let (address, reason) = (&self.options.address, text_of(&self.now.reason));
            return match self.now.refused {
                true => Readiness::NotReady(reason),
                false => Readiness::Wait(format!("no connection with {address}: {reason}")),
            };
        }
        if !self.begun {
            if self.now.phase == Phase::Moving {
                return Readiness::Wait("the last program ends".to_owned());
            }
            self.begun = true;
            self.requests = self.requests.wrapping_add(1);
            self.held = [f64::NAN; JOINTS];
            self.wish(Wish::Begin(self.requests));
            return Readiness::Wait("getting the robot ready".to_owned());
        }
        if self.now.phase == Phase::Moving {
            return self.when_resting();
        }
        let number = self.requests;
        match self.notice.filter(|notice| notice.number == number) {
            Some(notice) if notice.refused => {
                self.begun = false;
                Readiness::NotReady(text_of(&notice.reason))
            }
            Some(notice) => Readiness::Wait(text_of(&notice.reason)),
            None => Readiness::Wait("getting the robot ready".to_owned()),
        }
    }

    fn end(&mut self) {
        self.begun = false;
        self.wish(Wish::End);
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        self.look();
        let cycle = &self.now.cycle;
        for (index, joint) in joints.iter_mut().enumerate().take(JOINTS) {
            *joint = Measured {
                position: cycle.actual_q[index],
                velocity: cycle.actual_qd[index],
                ..Measured::default()
            };
        }
        let silent = now_ns().saturating_sub(self.now.received_ns) > OLD;
        if silent || self.now.phase == Phase::Disconnected {
            return Measurement::Unknown;
        }
        Measurement::At {
            measured_ns: self.now.received_ns,
            hardware_ns: (cycle.timestamp * 1e9) as u64,
        }
    }

    fn commanded(&self, joints: &mut [f64]) -> bool {
        joints
            .iter_mut()
            .zip(self.now.cycle.target_q)
            .for_each(|(to, from)| *to = from);
        self.now.received_ns > 0
    }

    fn follow(&mut self, command: &Command<'_>) {
        if self.now.phase != Phase::Moving {
            return;
        }
        // A full ring has a controller that is silent: that is a fault of its own.
        let _ = self.rows.push(command.into());
    }

    fn speed_scaling(&self) -> f64 {
        let cycle = &self.now.cycle;
        if self.now.phase == Phase::Moving && cycle.runtime_state == words::PLAYING {
            (cycle.speed_scaling * cycle.speed_fraction).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }

    fn act(&mut self, tool: usize, order: &ToolCommand) {
        let Some(gripper) = self.options.gripper.filter(|_| tool == GRIPPER) else {
            return;
        };
        let (on, status) = match ToolAction::from_number(order.action) {
            Some(ToolAction::Open) => (0, ToolStatus::Open),
            Some(ToolAction::Close) => (1, ToolStatus::Closed),
            // It has two positions and no ends to find.
            _ => {
                self.gripper = (0, ToolStatus::Failed);
                return;
            }
        };
        self.wish(Wish::Set(Outputs {
            digital: on << gripper.output,
            digital_mask: 1 << gripper.output,
            ..Outputs::default()
        }));
        let time = (gripper.time * 1e9) as u64;
        self.gripper = (now_ns() + time, status);
    }

    fn tool_status(&self, tool: usize) -> ToolStatus {
        if tool != GRIPPER {
            return ToolStatus::Unknown;
        }
        let (until, status) = self.gripper;
        if now_ns() < until {
            ToolStatus::Moving
        } else {
            status
        }
    }

    fn carry(&mut self, payload: &Payload) {
        self.wish(Wish::Carry(*payload));
    }

    fn set_outputs(&mut self, outputs: &Outputs) {
        self.wish(Wish::Set(*outputs));
    }

    fn inputs(&self) -> Inputs {
        let mut inputs = Inputs {
            digital: self.now.cycle.inputs,
            ..Inputs::default()
        };
        inputs.analogue[..2].copy_from_slice(&self.now.cycle.analogue);
        inputs
    }

    fn sensors(&self, sensors: &mut Sensors) {
        const NAMES: [&str; 6] = [
            "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z",
        ];
        for (name, value) in NAMES.iter().zip(self.now.cycle.force) {
            sensors.push(name, value);
        }
        sensors.push("delay", self.now.delay);
    }

    fn fault(&self) -> Option<RobotFault> {
        self.now.fault
    }
}

impl Drop for Ur {
    fn drop(&mut self) {
        self.modes.stop.store(true, Ordering::Relaxed);
    }
}

//! The robot of `driver-kit`: passes everything to the thread that owns the arm.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use driver_kit::{
    About, Command, DriverError, Measured, Measurement, OwnThread, Readiness, Resampler,
    ResamplerOptions, Robot, RobotFault, Sensors, TimedReferences, host, speed_share,
};
use franka::RobotMode;
use ipc::{GRIPPER, Payload, ToolCommand, ToolFeedback, ToolStatus, text_of};
use rtrb::{Consumer, Producer, RingBuffer};
use scheduling::now_ns;

use crate::arm_thread::ArmThread;
use crate::gripper::Hand;
use crate::snapshot::{Phase, Snapshot, Wish};
use crate::{FrankaOptions, JOINTS};

/// Room of the rings between the two threads: a quarter of a second.
const RING: usize = 256;

/// Shares of the maker's accelerations and jerks that a plan may use.
const PLANNED: [f64; 2] = [0.9, 0.6];

/// The controller commands rest when it commands the same twice, to this difference (rad).
const RESTS: f64 = 2e-6;

/// A state that is older counts as none (ns).
const OLD: u64 = 20_000_000;

/// A Franka arm.
#[derive(Debug)]
pub struct Franka {
    about: About,
    address: String,
    /// How far the arm shall be behind the setpoints (s).
    delay: f64,
    rows: Producer<TimedReferences<JOINTS>>,
    wishes: Producer<Wish>,
    snapshots: Consumer<Snapshot>,
    /// The newest state.
    now: Snapshot,
    /// Whether a motion was asked for and has not begun yet.
    starting: bool,
    /// Whether the motion was told to end and has not ended yet.
    ending: bool,
    /// How many payloads the thread was given.
    carried: u32,
    /// What the controller commanded when it was last asked (rad): a motion begins at rest.
    held: [f64; JOINTS],
    hand: Option<Hand>,
    stop: Arc<AtomicBool>,
    _thread: OwnThread,
}

impl Franka {
    /// Starts the threads of the arm; they connect when the arm answers.
    ///
    /// # Errors
    /// [`DriverError`] for options that do not fit together.
    pub fn new(options: FrankaOptions) -> Result<Self, DriverError> {
        let about = about(&options)?;
        let shares = [options.share; 3];
        let limits = ResamplerOptions::of_shares(&options.about, options.delay, 1e-3, shares);
        let resampler = Resampler::new(&about, limits)?;
        let (rows, rows_out) = RingBuffer::new(RING);
        let (wishes, wishes_out) = RingBuffer::new(16);
        let (snapshots_in, snapshots) = RingBuffer::new(RING);
        let stop = Arc::new(AtomicBool::new(false));
        let hand = options
            .gripper
            .map(|gripper| Hand::start(host(&options.address), gripper));
        let (address, delay) = (options.address.clone(), options.delay);
        let thread = ArmThread {
            options,
            resampler,
            rows: rows_out,
            wishes: wishes_out,
            snapshots: snapshots_in,
            snapshot: Snapshot::default(),
            payload: None,
            stop: Arc::clone(&stop),
            arrivals: None,
        };
        let thread =
            OwnThread::start_real_time("franka", thread.options.priority, move || thread.run())?;
        Ok(Self {
            about,
            address,
            delay,
            rows,
            wishes,
            snapshots,
            now: Snapshot::default(),
            starting: false,
            ending: false,
            carried: 0,
            held: [0.0; JOINTS],
            hand,
            stop,
            _thread: thread,
        })
    }

    fn look(&mut self) {
        while let Ok(snapshot) = self.snapshots.pop() {
            self.now = snapshot;
        }
    }

    /// Says whether there was room: the ring is empty but for the last moment.
    fn wish(&mut self, wish: Wish) -> bool {
        self.wishes.push(wish).is_ok()
    }

    /// Why a motion cannot start in the arm's mode.
    fn objection(&self) -> Option<&'static str> {
        match self.now.mode {
            RobotMode::UserStopped => Some("the user stop is pressed: release it"),
            RobotMode::Guiding => Some("the arm is guided by hand: let go of the buttons"),
            RobotMode::Other => {
                Some("the arm is not in execution: in Desk, unlock the joints and activate FCI")
            }
            _ => None,
        }
    }
}

/// What the kit must know. Plans must keep less than the maker's limits: the rest is for the
/// resampler, which catches up with the controller's clock.
fn about(options: &FrankaOptions) -> Result<About, DriverError> {
    let share = |values: &[f64], share: f64| values.iter().map(|value| value * share).collect();
    let about = About {
        acceleration: share(&options.about.acceleration, PLANNED[0]),
        jerk: share(&options.about.jerk, PLANNED[1]),
        name: "franka".to_owned(),
        lock_step: false,
        periods_ns: [500_000, 10_000_000],
        own_clock: true,
        real: true,
        delay_ns: (options.delay * 1e9) as u64,
        ..options.about.clone()
    };
    about.check()?;
    about.check_joints(JOINTS)?;
    DriverError::check_value("share", options.share, true)?;
    Ok(about)
}

impl Robot for Franka {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn begin(&mut self) -> Readiness {
        self.look();
        let silent = now_ns().saturating_sub(self.now.received_ns) > OLD;
        if silent && self.now.phase != Phase::Disconnected && self.now.phase != Phase::Starting {
            // The thread finds out soon whether the connection is lost.
            return Readiness::Wait("the arm sends nothing".to_owned());
        }
        self.ending &= self.now.phase == Phase::Moving;
        if self.ending {
            return Readiness::Wait("the last motion ends".to_owned());
        }
        match self.now.phase {
            Phase::Moving => {
                self.starting = false;
                let pairs = self.held.iter().zip(self.now.q_d);
                let rests = pairs
                    .into_iter()
                    .all(|(held, now)| (held - now).abs() < RESTS);
                self.held = self.now.q_d;
                return match rests {
                    true => Readiness::Ready,
                    false => Readiness::Wait("the arm comes to rest".to_owned()),
                };
            }
            Phase::Disconnected => {
                self.starting = false;
                let (address, reason) = (&self.address, text_of(&self.now.reason));
                return Readiness::Wait(format!("no connection with {address}: {reason}"));
            }
            Phase::Starting => return Readiness::Wait("starting the motion".to_owned()),
            Phase::Idle | Phase::Faulted => {}
        }
        if let Some(reason) = self.objection() {
            self.starting = false;
            return Readiness::NotReady(reason.to_owned());
        }
        if self.starting && self.now.phase == Phase::Faulted && self.now.fault.is_some() {
            // The motion was asked for and did not start.
            self.starting = false;
            let text = self.now.fault.map(|fault| text_of(&fault.text));
            return Readiness::NotReady(text.unwrap_or_default());
        }
        if !self.starting {
            self.starting = true;
            // A fault of before is over when the thread has taken the wish.
            self.now.fault = None;
            // What was not told before counts no more: the engine tells it again.
            self.carried = self.now.carried;
            // One that finds no room is asked for again.
            let _ = self.wish(Wish::Begin);
        }
        Readiness::Wait(match self.now.mode {
            RobotMode::Reflex => "recovering from an error".to_owned(),
            _ => "starting the motion".to_owned(),
        })
    }

    fn end(&mut self) {
        self.starting = false;
        self.ending = true;
        let _ = self.wish(Wish::End);
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        self.look();
        let now = &self.now;
        for (index, joint) in joints.iter_mut().enumerate().take(JOINTS) {
            *joint = Measured {
                position: now.q[index],
                velocity: now.dq[index],
                effort: now.tau[index],
            };
        }
        if now_ns().saturating_sub(now.received_ns) > OLD {
            return Measurement::Unknown;
        }
        Measurement::At {
            measured_ns: now.received_ns,
            hardware_ns: now.hardware_ns,
        }
    }

    fn commanded(&self, joints: &mut [f64]) -> bool {
        joints
            .iter_mut()
            .zip(self.now.q_d)
            .for_each(|(to, from)| *to = from);
        self.now.received_ns > 0
    }

    fn follow(&mut self, command: &Command<'_>) {
        if self.now.phase != Phase::Moving {
            return;
        }
        // A full ring has a thread that does not run: the controller says so itself.
        let _ = self.rows.push(command.into());
    }

    fn act(&mut self, tool: usize, order: &ToolCommand) {
        if let (GRIPPER, Some(hand)) = (tool, &self.hand) {
            hand.act(order);
        }
    }

    fn tool(&self, tool: usize) -> ToolFeedback {
        match (tool, &self.hand) {
            (GRIPPER, Some(hand)) => hand.feedback(),
            _ => ToolFeedback {
                status: ToolStatus::Unknown as u32,
                ..ToolFeedback::default()
            },
        }
    }

    fn carry(&mut self, payload: &Payload) {
        let number = self.carried + 1;
        if self.wish(Wish::Carry(*payload, number)) {
            self.carried = number;
        }
    }

    fn speed_scaling(&self) -> f64 {
        let busy = matches!(self.now.phase, Phase::Moving | Phase::Starting);
        if busy && self.now.carried < self.carried {
            // The controller takes a payload between two motions only: the arm rests meanwhile.
            return 0.0;
        }
        if self.now.phase != Phase::Moving {
            return 1.0;
        }
        let silent = now_ns().saturating_sub(self.now.received_ns) as f64 * 1e-9;
        speed_share(self.now.delay + silent - self.delay)
    }

    fn sensors(&self, sensors: &mut Sensors) {
        const NAMES: [&str; 6] = [
            "force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z",
        ];
        for (name, value) in NAMES.iter().zip(self.now.wrench) {
            sensors.push(name, value);
        }
        sensors.push("success_rate", self.now.success_rate);
        sensors.push("delay", self.now.delay);
    }

    fn fault(&self) -> Option<RobotFault> {
        self.now.fault
    }
}

impl Drop for Franka {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

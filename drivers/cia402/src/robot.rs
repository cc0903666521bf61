//! The robot of `driver-kit`: passes everything to the thread that is the master of the bus.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use driver_kit::{
    About, Command, DriverError, Measured, Measurement, OwnThread, Readiness, Resampler,
    ResamplerOptions, Robot, RobotFault, Sensors, TimedReferences, speed_share,
};
use ipc::{MAX_JOINTS, text_of};
use rtrb::{Consumer, Producer, RingBuffer};
use scheduling::now_ns;

use crate::Cia402Options;
use crate::axes::Axes;
use crate::bus_thread::BusThread;
use crate::snapshot::{Phase, Snapshot};

/// Room of the rings between the two threads.
const RING: usize = 256;

/// After so many cycles without process data the arm is unknown.
const UNKNOWN: f64 = 5.0;

/// An arm of CiA 402 drives.
#[derive(Debug)]
pub struct Cia402 {
    about: About,
    cycle: f64,
    /// How far the targets shall be behind the setpoints (s).
    delay: f64,
    rows: Producer<TimedReferences<MAX_JOINTS>>,
    snapshots: Consumer<Snapshot>,
    /// The newest cycle.
    now: Snapshot,
    wish: Arc<AtomicU32>,
    /// The session that an engine asked for, and the number of the last one.
    session: Option<u32>,
    sessions: u32,
    stop: Arc<AtomicBool>,
    _thread: OwnThread,
}

impl Cia402 {
    /// Starts the thread that brings up the bus.
    ///
    /// # Errors
    /// [`DriverError`] for options that do not fit together.
    pub fn new(options: Cia402Options) -> Result<Self, DriverError> {
        options.check()?;
        let about = about(&options)?;
        let shares = [options.share; 3];
        let limits = ResamplerOptions::of_shares(&about, options.delay, options.cycle, shares);
        let resampler = Resampler::new(&about, limits)?;
        let (rows, rows_out) = RingBuffer::new(RING);
        let (snapshots_in, snapshots) = RingBuffer::new(RING);
        let (stop, wish) = (
            Arc::new(AtomicBool::new(false)),
            Arc::new(AtomicU32::new(0)),
        );
        let (cycle, delay) = (options.cycle, options.delay);
        let thread = BusThread {
            axes: Axes::new(options.drives.clone(), resampler, cycle),
            options,
            rows: rows_out,
            wish: Arc::clone(&wish),
            snapshots: snapshots_in,
            snapshot: Snapshot::default(),
            stop: Arc::clone(&stop),
        };
        let thread =
            OwnThread::start_real_time("ethercat", thread.options.priority, move || thread.run())?;
        Ok(Self {
            about,
            cycle,
            delay,
            rows,
            snapshots,
            now: Snapshot::default(),
            wish,
            session: None,
            sessions: 0,
            stop,
            _thread: thread,
        })
    }

    fn look(&mut self) {
        while let Ok(snapshot) = self.snapshots.pop() {
            self.now = snapshot;
        }
    }
}

/// What the kit must know.
fn about(options: &Cia402Options) -> Result<About, DriverError> {
    let about = About {
        name: "cia402".to_owned(),
        lock_step: false,
        periods_ns: [500_000, 20_000_000],
        own_clock: true,
        real: true,
        delay_ns: ((options.delay + 2.0 * options.cycle) * 1e9) as u64,
        ..options.about.clone()
    };
    about.check()?;
    Ok(about)
}

impl Robot for Cia402 {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn begin(&mut self) -> Readiness {
        self.look();
        match self.now.phase {
            Phase::Connecting => return Readiness::Wait("bringing up the bus".to_owned()),
            Phase::Down => return Readiness::NotReady(text_of(&self.now.reason)),
            _ => {}
        }
        let mine = self.session.filter(|session| *session == self.now.session);
        match (mine, self.now.phase) {
            (Some(_), Phase::Following) => return Readiness::Ready,
            (Some(_), Phase::Faulted) => {
                let fault = self.now.fault.unwrap_or(RobotFault::new(None, 0, ""));
                let text = text_of(&fault.text);
                self.session = None;
                return Readiness::NotReady(match fault.joint {
                    u32::MAX => text,
                    joint => format!("joint {}: {text}", joint + 1),
                });
            }
            _ => {}
        }
        if self.session.is_none() {
            self.sessions = self.sessions.wrapping_add(1).max(1);
            self.session = Some(self.sessions);
            self.wish.store(self.sessions, Ordering::Relaxed);
        }
        Readiness::Wait(format!(
            "enabling the drives: {}",
            text_of(&self.now.reason)
        ))
    }

    fn end(&mut self) {
        self.session = None;
        self.wish.store(0, Ordering::Relaxed);
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        self.look();
        joints
            .iter_mut()
            .zip(self.now.joints)
            .for_each(|(to, from)| *to = from);
        let silent = now_ns().saturating_sub(self.now.received_ns) as f64 * 1e-9;
        if silent > UNKNOWN * self.cycle {
            return Measurement::Unknown;
        }
        Measurement::At {
            measured_ns: self.now.received_ns,
            hardware_ns: 0,
        }
    }

    fn commanded(&self, joints: &mut [f64]) -> bool {
        joints
            .iter_mut()
            .zip(self.now.commanded)
            .for_each(|(to, from)| *to = from);
        self.now.received_ns > 0
    }

    fn follow(&mut self, command: &Command<'_>) {
        if self.now.phase != Phase::Following {
            return;
        }
        // A full ring has a bus that stands still: that is a fault of its own.
        let _ = self.rows.push(command.into());
    }

    fn speed_scaling(&self) -> f64 {
        if self.now.phase != Phase::Following {
            return 1.0;
        }
        let silent = now_ns().saturating_sub(self.now.received_ns) as f64 * 1e-9;
        speed_share(self.now.delay + silent - self.delay - self.cycle)
    }

    fn sensors(&self, sensors: &mut Sensors) {
        sensors.push("bus_cycles", self.now.cycles as f64);
        sensors.push("bad_working_counters", self.now.bad_counters as f64);
        sensors.push("lost_frames", self.now.lost_frames as f64);
        sensors.push("clock_error", self.now.clock_error);
    }

    fn fault(&self) -> Option<RobotFault> {
        let session = self.session?;
        if self.now.session != session {
            return None;
        }
        self.now.fault
    }
}

impl Drop for Cia402 {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

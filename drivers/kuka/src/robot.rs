//! The robot of `driver-kit`: passes everything to the thread that owns the socket.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use driver_kit::{
    About, Command, DriverError, Measured, Measurement, OwnThread, Readiness, Resampler,
    ResamplerOptions, Robot, RobotFault, Sensors, TimedReferences, speed_share,
};
use rtrb::{Consumer, Producer, RingBuffer};
use scheduling::now_ns;

use crate::socket_thread::{Snapshot, SocketThread};
use crate::telegram::Telegram;
use crate::{JOINTS, KukaOptions};

/// Room of the rings between the two threads.
const RING: usize = 256;

/// After so many cycles without a telegram the arm is unknown, and RSI has ended.
const UNKNOWN: f64 = 5.0;
const ENDED: f64 = 25.0;

/// After so many telegrams the length of a cycle is known.
const LEARNT: u64 = 500;

/// A KUKA arm.
#[derive(Debug)]
pub struct Kuka {
    about: About,
    options: KukaOptions,
    rows: Producer<TimedReferences<JOINTS>>,
    snapshots: Consumer<Snapshot>,
    /// The newest telegram.
    now: Snapshot,
    follow: Arc<AtomicBool>,
    /// The connection whose motion an engine asked for.
    session: Option<u32>,
    stop: Arc<AtomicBool>,
    _thread: OwnThread,
}

impl Kuka {
    /// Opens the port and starts the thread; the controller connects when its program runs.
    ///
    /// # Errors
    /// [`DriverError`] for options that do not fit together, or a port that is taken.
    pub fn new(options: KukaOptions) -> Result<Self, DriverError> {
        let about = about(&options)?;
        let shares = [options.share; 3];
        let limits =
            ResamplerOptions::of_shares(&options.about, options.delay, options.cycle, shares);
        let resampler = Resampler::new(&about, limits.clone())?;
        let fail = |cause: std::io::Error| DriverError::Port {
            address: options.listen.clone(),
            cause: cause.to_string(),
        };
        let socket = UdpSocket::bind(&options.listen).map_err(fail)?;
        let patience = Some(Duration::from_millis(50));
        socket.set_read_timeout(patience).map_err(fail)?;
        let (rows, rows_out) = RingBuffer::new(RING);
        let (snapshots_in, snapshots) = RingBuffer::new(RING);
        let (stop, follow) = (
            Arc::new(AtomicBool::new(false)),
            Arc::new(AtomicBool::new(false)),
        );
        let thread = SocketThread {
            options: options.clone(),
            socket,
            about: about.clone(),
            limits,
            resampler,
            cycle: options.cycle,
            rows: rows_out,
            follow: Arc::clone(&follow),
            snapshots: snapshots_in,
            snapshot: Snapshot::default(),
            origin: [0.0; JOINTS],
            stop: Arc::clone(&stop),
        };
        let thread =
            OwnThread::start_real_time("kuka", thread.options.priority, move || thread.run())?;
        Ok(Self {
            about,
            options,
            rows,
            snapshots,
            now: Snapshot::default(),
            follow,
            session: None,
            stop,
            _thread: thread,
        })
    }

    fn look(&mut self) {
        while let Ok(snapshot) = self.snapshots.pop() {
            self.now = snapshot;
        }
    }

    /// How many cycles ago the last telegram came.
    fn silence(&self) -> f64 {
        let silent = now_ns().saturating_sub(self.now.received_ns) as f64 * 1e-9;
        silent / self.options.cycle
    }
}

/// What the kit must know.
fn about(options: &KukaOptions) -> Result<About, DriverError> {
    let about = About {
        name: "kuka".to_owned(),
        lock_step: false,
        periods_ns: [500_000, 12_000_000],
        own_clock: true,
        real: true,
        delay_ns: ((options.delay + 2.0 * options.cycle) * 1e9) as u64,
        ..options.about.clone()
    };
    about.check()?;
    about.check_joints(JOINTS)?;
    DriverError::check_value("cycle", options.cycle, true)?;
    DriverError::check_value("share", options.share, true)?;
    Ok(about)
}

impl Robot for Kuka {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn begin(&mut self) -> Readiness {
        self.look();
        if self.now.received_ns == 0 || self.silence() > ENDED {
            let listen = &self.options.listen;
            return Readiness::Wait(format!(
                "no telegram of the controller on {listen}: start CanterRsi.src in T1 or AUT"
            ));
        }
        if self.now.cycles < LEARNT {
            return Readiness::Wait("measuring the controller's cycle".to_owned());
        }
        if self.session == Some(self.now.connections) && self.now.follows {
            return Readiness::Ready;
        }
        self.session = Some(self.now.connections);
        self.follow.store(true, Ordering::Relaxed);
        Readiness::Wait("starting with the next cycle".to_owned())
    }

    fn end(&mut self) {
        self.session = None;
        self.follow.store(false, Ordering::Relaxed);
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        self.look();
        let Telegram { angles, ipoc, .. } = self.now.telegram;
        for (joint, angle) in joints.iter_mut().zip(angles) {
            *joint = Measured {
                position: angle,
                ..Measured::default()
            };
        }
        if self.silence() > UNKNOWN {
            return Measurement::Unknown;
        }
        Measurement::At {
            measured_ns: self.now.received_ns,
            hardware_ns: ipoc.saturating_mul(1_000_000),
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
        if !self.now.follows {
            return;
        }
        // A full ring has a controller that is silent: that is a fault of its own.
        let _ = self.rows.push(command.into());
    }

    fn speed_scaling(&self) -> f64 {
        if !self.now.follows {
            return 1.0;
        }
        let silent = now_ns().saturating_sub(self.now.received_ns) as f64 * 1e-9;
        speed_share(self.now.delay + silent - self.options.delay - self.options.cycle)
    }

    fn sensors(&self, sensors: &mut Sensors) {
        sensors.push("late_answers", f64::from(self.now.telegram.late));
    }

    fn fault(&self) -> Option<RobotFault> {
        let session = self.session?;
        if self.now.connections != session {
            return Some(RobotFault::new(
                None,
                2,
                "RSI was switched off and on again",
            ));
        }
        (self.silence() > ENDED).then(|| {
            RobotFault::new(
                None,
                1,
                "RSI has ended: no telegram of the controller any more",
            )
        })
    }
}

impl Drop for Kuka {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

//! Control and status of the real-time thread: atomics that it reads and writes in each period.

use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::Arc;

use nalgebra::SVector;

use super::control::Control;
use super::histogram::Histogram;
use super::orders::{NoFault, Orders, Steering};

/// Where the arm is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured<const N: usize> {
    /// Measured positions (rad).
    pub position: SVector<f64, N>,
    /// Measured velocities (rad/s).
    pub velocity: SVector<f64, N>,
    /// Positions of the last setpoint (rad).
    pub setpoint: SVector<f64, N>,
    /// Share of the planned speed.
    pub time_scaling: f64,
    /// Whether the last setpoint rests.
    pub resting: bool,
    /// Whether nothing is left to execute.
    pub idle: bool,
    /// Whether a fault is latched.
    pub faulted: bool,
    /// Whether a pause or stop holds the arm.
    pub held: bool,
    /// Statuses of gripper and tool changer, as [`ipc::ToolStatus`] numbers.
    pub tools: [u32; 2],
    /// Share of the planned speed that the arm asks for.
    pub speed_asked: f64,
    /// The current command, or the last one.
    pub command: u32,
    /// Planned time since its start (s).
    pub path_time: f64,
}

/// How many periods there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Setpoints published.
    pub published: u64,
    /// Periods that came too late and were left out.
    pub skipped: u64,
    /// Periods in all: published and skipped.
    pub ticks: u64,
    /// Setpoints that iceoryx2 did not take.
    pub unsent: u64,
    /// Events and samples that were not read in time.
    pub lost_reports: u64,
    /// Setpoints that the driver missed, by its own count.
    pub driver_missed: u64,
}

/// The numbers that both sides see.
#[derive(Debug)]
pub(super) struct Shared<const N: usize> {
    /// What is asked for.
    pub(super) orders: Arc<Orders>,
    epoch: AtomicU32,
    /// Number of events reported, and how many of them the planner had seen when it had nothing
    /// more to do.
    reported: AtomicU64,
    answered: AtomicU64,
    version: AtomicU32,
    position: [AtomicU64; N],
    velocity: [AtomicU64; N],
    setpoint: [AtomicU64; N],
    time_scaling: AtomicU64,
    flags: AtomicU32,
    tools: [AtomicU32; 2],
    speed_asked: AtomicU64,
    command: AtomicU32,
    path_time: AtomicU64,
    pub(super) published: AtomicU64,
    pub(super) skipped: AtomicU64,
    pub(super) unsent: AtomicU64,
    pub(super) lost_reports: AtomicU64,
    pub(super) driver_missed: AtomicU64,
    pub(super) latency: Histogram,
    pub(super) work: Histogram,
    pub(super) state_age: Histogram,
}

impl<const N: usize> Shared<N> {
    pub(super) fn new() -> Self {
        let zeros = || core::array::from_fn(|_| AtomicU64::new(0));
        Self {
            orders: Arc::new(Orders::default()),
            epoch: AtomicU32::new(0),
            reported: AtomicU64::new(0),
            answered: AtomicU64::new(0),
            version: AtomicU32::new(0),
            position: zeros(),
            velocity: zeros(),
            setpoint: zeros(),
            time_scaling: AtomicU64::new(0),
            flags: AtomicU32::new(0),
            tools: [AtomicU32::new(0), AtomicU32::new(0)],
            speed_asked: AtomicU64::new(1.0_f64.to_bits()),
            command: AtomicU32::new(0),
            path_time: AtomicU64::new(0),
            published: AtomicU64::new(0),
            skipped: AtomicU64::new(0),
            unsent: AtomicU64::new(0),
            lost_reports: AtomicU64::new(0),
            driver_missed: AtomicU64::new(0),
            latency: Histogram::new(),
            work: Histogram::new(),
            state_age: Histogram::new(),
        }
    }

    pub(super) fn epoch(&self) -> u32 {
        self.epoch.load(Ordering::Acquire)
    }

    /// Begins a new epoch: segments of the old one are dropped.
    pub(super) fn new_epoch(&self) -> u32 {
        self.epoch.fetch_add(1, Ordering::AcqRel).wrapping_add(1)
    }

    /// Counts an event that the planner must see.
    pub(super) fn count_report(&self) {
        self.reported.fetch_add(1, Ordering::AcqRel);
    }

    /// Sets that the planner has seen `events` and has nothing more to do; `None`: it has something
    /// to do.
    pub(super) fn answer(&self, events: Option<u64>) {
        self.answered
            .store(events.unwrap_or(u64::MAX), Ordering::Release);
    }

    /// Whether the planner has seen all events and has nothing more to do.
    pub(super) fn is_settled(&self) -> bool {
        self.answered.load(Ordering::Acquire) == self.reported.load(Ordering::Acquire)
    }

    /// Publishes the position of the arm; only the real-time thread calls it.
    pub(super) fn write(&self, now: &Measured<N>) {
        let version = self.version.load(Ordering::Relaxed);
        self.version
            .store(version.wrapping_add(1), Ordering::Relaxed);
        core::sync::atomic::fence(Ordering::Release);
        store(&self.position, &now.position);
        store(&self.velocity, &now.velocity);
        store(&self.setpoint, &now.setpoint);
        self.time_scaling
            .store(now.time_scaling.to_bits(), Ordering::Relaxed);
        self.speed_asked
            .store(now.speed_asked.to_bits(), Ordering::Relaxed);
        self.command.store(now.command, Ordering::Relaxed);
        self.path_time
            .store(now.path_time.to_bits(), Ordering::Relaxed);
        let flags = [now.resting, now.idle, now.faulted];
        let bits = flags
            .iter()
            .enumerate()
            .fold(0, |bits, (at, flag)| bits | u32::from(*flag) << at);
        self.flags.store(bits, Ordering::Relaxed);
        for (to, from) in self.tools.iter().zip(now.tools) {
            to.store(from, Ordering::Relaxed);
        }
        self.version
            .store(version.wrapping_add(2), Ordering::Release);
    }

    /// Reads the position of the arm; a reader that collides with the writer tries again.
    pub(super) fn read(&self) -> Measured<N> {
        let load = |from: &[AtomicU64; N]| {
            SVector::from_fn(|joint, _| {
                let bits = from
                    .get(joint)
                    .map_or(0, |from| from.load(Ordering::Relaxed));
                f64::from_bits(bits)
            })
        };
        loop {
            let before = self.version.load(Ordering::Acquire);
            let flags = self.flags.load(Ordering::Relaxed);
            let now = Measured {
                position: load(&self.position),
                velocity: load(&self.velocity),
                setpoint: load(&self.setpoint),
                time_scaling: f64::from_bits(self.time_scaling.load(Ordering::Relaxed)),
                resting: flags & 1 != 0,
                idle: flags & 2 != 0,
                faulted: flags & 4 != 0,
                held: self.orders.asked().holds(),
                tools: self
                    .tools
                    .each_ref()
                    .map(|tool| tool.load(Ordering::Relaxed)),
                speed_asked: f64::from_bits(self.speed_asked.load(Ordering::Relaxed)),
                command: self.command.load(Ordering::Relaxed),
                path_time: f64::from_bits(self.path_time.load(Ordering::Relaxed)),
            };
            core::sync::atomic::fence(Ordering::Acquire);
            if before.is_multiple_of(2) && self.version.load(Ordering::Relaxed) == before {
                return now;
            }
            std::thread::yield_now();
        }
    }
}

/// Stores the numbers of the joints. Compiled once: in a period each line of code may come from another cache.
#[inline(never)]
fn store<const N: usize>(to: &[AtomicU64; N], from: &SVector<f64, N>) {
    for (to, from) in to.iter().zip(from.as_slice()) {
        to.store(from.to_bits(), Ordering::Relaxed);
    }
}

/// A handle for control and for the position of the arm. Cheap to clone, usable from any thread.
#[derive(Clone, Debug)]
pub struct Remote<const N: usize> {
    pub(super) shared: Arc<Shared<N>>,
}

impl<const N: usize> Remote<N> {
    /// Gives an order, which acts in the next period. Returns the number of the order, for
    /// [`super::Progress::has`].
    pub fn control(&self, control: Control) -> u32 {
        self.steering().control(control)
    }

    /// Asks for a new session with the driver, which clears the fault that is latched now and drops
    /// everything that was pushed. The answer is an event: [`super::Event::Recovered`], or
    /// [`super::Event::Faulted`] again. Returns the number of the fault.
    ///
    /// # Errors
    /// [`NoFault`]; the request then has no later effect.
    pub fn recover(&self) -> Result<u32, NoFault> {
        self.steering().recover()
    }

    /// The part of it that knows no joints.
    pub fn steering(&self) -> Steering {
        Steering {
            orders: Arc::clone(&self.shared.orders),
        }
    }

    /// Where the arm is.
    pub fn measured(&self) -> Measured<N> {
        self.shared.read()
    }

    /// How many periods there were.
    pub fn counters(&self) -> Counters {
        let load = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let shared = &self.shared;
        let (published, skipped) = (load(&shared.published), load(&shared.skipped));
        Counters {
            published,
            skipped,
            ticks: published + skipped,
            unsent: load(&shared.unsent),
            lost_reports: load(&shared.lost_reports),
            driver_missed: load(&shared.driver_missed),
        }
    }

    /// How late the thread woke up (ns).
    pub fn latency(&self) -> &Histogram {
        &self.shared.latency
    }

    /// How long the work of a period took (ns).
    pub fn work(&self) -> &Histogram {
        &self.shared.work
    }

    /// Age of the newest state when a setpoint was made (ns).
    pub fn state_age(&self) -> &Histogram {
        &self.shared.state_age
    }
}

//! The thread that is the master of the bus.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use driver_kit::{RobotFault, TimedReferences, pause};
use ethercrab::{
    Command, MainDevice, MainDeviceConfig, PduStorage, RegisterAddress, RetryBehaviour,
    SubDeviceState, Timeouts,
};
use ipc::{MAX_JOINTS, bytes_of};
use rtrb::{Consumer, Producer};
use scheduling::{now_ns, sleep_until_ns};

use crate::Cia402Options;
use crate::axes::Axes;
use crate::bring_up::{Bus, bring_up};
use crate::bus_error::BusError;
use crate::group::Exchanged;
use crate::process_data::Said;
use crate::pump::Pump;
use crate::snapshot::{Phase, Snapshot};

/// Frames that are under way at most, and the data of one (bytes).
const FRAMES: usize = 16;
const DATA: usize = 1400;

/// Time between two tries to bring up the bus.
const AGAIN: Duration = Duration::from_millis(500);

/// The request of a device's first state.
const INIT: u16 = 1;

/// Frames that read the reference clock while the bus is brought up.
const CLOCK_FRAMES: u32 = 1000;

/// How long the drives may take to switch off at the end (s).
const OFF: f64 = 1.0;

/// Cycles in a row with a wrong working counter after which the bus has failed; the same for frames that
/// did not come back in this share of a cycle, as a share of the drives' watchdog.
const BAD: u32 = 3;
const SILENT: f64 = 0.5;
const BACK: f64 = 0.8;

/// How fast the cycle is drawn to the drives' clock: share of its error in a cycle, and at most this
/// share of a cycle.
const DRAW: f64 = 1.0 / 16.0;
const DRAW_MOST: f64 = 0.02;

/// Everything that the thread owns.
pub(crate) struct BusThread {
    pub(crate) options: Cia402Options,
    pub(crate) axes: Axes,
    pub(crate) rows: Consumer<TimedReferences<MAX_JOINTS>>,
    /// The session that the engine wants; 0 for none.
    pub(crate) wish: Arc<AtomicU32>,
    pub(crate) snapshots: Producer<Snapshot>,
    pub(crate) snapshot: Snapshot,
    pub(crate) stop: Arc<AtomicBool>,
}

impl BusThread {
    /// Until the driver ends: brings the bus up, serves it, brings it up again.
    pub(crate) fn run(mut self) {
        while !self.ends() {
            // The library has assertions about what devices send (decision 0133).
            let served = catch_unwind(AssertUnwindSafe(|| self.serve()));
            let reason = match served {
                Ok(BusError::Ends) => return,
                Ok(error) => error.to_string(),
                Err(_) => "a device sent what the EtherCAT library does not know".to_owned(),
            };
            self.lose(&reason);
            pause(AGAIN, || self.ends());
        }
    }

    fn ends(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The bus is down: during a session that is a fault.
    fn lose(&mut self, reason: &str) {
        self.snapshot.reason = bytes_of(reason);
        let used = !matches!(
            self.snapshot.phase,
            Phase::Connecting | Phase::Down | Phase::Idle
        );
        if used && self.snapshot.fault.is_none() {
            self.snapshot.fault = Some(RobotFault::new(None, 0, reason));
        }
        self.snapshot.phase = Phase::Down;
        while self.rows.pop().is_ok() {}
        self.send();
    }

    fn send(&mut self) {
        // A full ring has a kit that does not run; the newest will come.
        let _ = self.snapshots.push(self.snapshot);
    }

    /// Brings the bus up and serves it until it fails; returns why.
    fn serve(&mut self) -> BusError {
        let options = self.options.clone();
        let storage = PduStorage::<FRAMES, { PduStorage::element_size(DATA) }>::new();
        let Ok((tx, rx, frames)) = storage.try_split() else {
            return BusError::Ends;
        };
        let mut pump = match Pump::open(&options.interface, (tx, rx)) {
            Ok(pump) => pump,
            Err(error) => return error,
        };
        // The pump has the time of each frame.
        let timeouts = Timeouts {
            pdu: Duration::MAX,
            ..Timeouts::default()
        };
        let config = MainDeviceConfig {
            dc_static_sync_iterations: CLOCK_FRAMES,
            retry_behaviour: RetryBehaviour::None,
        };
        let master = MainDevice::new(frames, timeouts, config);
        match bring_up(&mut pump, &master, &options) {
            Ok(bus) => {
                let mut cycles = Cycles {
                    cycle_ns: (options.cycle * 1e9) as u64,
                    full: bus.group.full_counter(&master),
                    next_ns: now_ns(),
                    bad: 0,
                };
                self.axes.forget();
                let ended = loop {
                    if let Err(error) = self.cycle(&mut pump, &master, &bus, &mut cycles) {
                        break error;
                    }
                };
                if matches!(ended, BusError::Ends) {
                    // Without process data the drives would report their watchdog.
                    let to_init = Command::bwr(RegisterAddress::AlControl.into());
                    let sent = to_init.ignore_wkc().send(&master, INIT);
                    let _ = pump.run(sent, Duration::from_millis(20));
                }
                ended
            }
            Err(error) => error,
        }
    }

    /// One cycle of the bus.
    ///
    /// # Errors
    /// Why it cannot go on.
    fn cycle<'a>(
        &mut self,
        pump: &mut Pump<'_>,
        master: &'a MainDevice<'a>,
        bus: &Bus,
        cycles: &mut Cycles,
    ) -> Result<(), BusError> {
        let passed = cycles.wait();
        let patience = Duration::from_secs_f64(self.options.cycle * BACK);
        let exchanged = match pump.run(bus.group.exchange(master), patience) {
            Ok(Ok(exchanged)) => Ok(exchanged),
            Ok(Err(cause)) => Err(BusError::Bus {
                what: "cannot exchange process data",
                cause,
            }),
            Err(error @ BusError::Silent { .. }) => Err(error),
            Err(error) => return Err(error),
        };
        self.snapshot.cycles += 1;
        let failed = self.judge(&exchanged, cycles, bus.group.len());
        if let Some(error) = &failed {
            let fault = RobotFault::new(self.joint_of(error), 0, &error.to_string());
            self.axes.fail(fault, &mut self.snapshot);
        }
        let mut said = [Said::default(); MAX_JOINTS];
        let joints = self.options.drives.len();
        self.read(master, bus, &mut said);
        if exchanged.is_ok() {
            self.snapshot.received_ns = now_ns();
            self.axes
                .measure(&said[..joints], passed, &mut self.snapshot);
        }
        let ends = self.ends();
        let wish = if ends || failed.is_some() {
            0
        } else {
            self.wish.load(Ordering::Relaxed)
        };
        let rows = &mut self.rows;
        self.axes.cycle(
            &said[..joints],
            (wish, passed),
            &mut || rows.pop().ok(),
            &mut self.snapshot,
        );
        self.write(master, bus, &said);
        self.send();
        let rests = matches!(self.snapshot.phase, Phase::Idle | Phase::Faulted);
        match failed {
            Some(error) if rests => Err(error),
            None if ends && rests && (self.is_off(&said[..joints]) || self.axes.time() > OFF) => {
                Err(BusError::Ends)
            }
            _ => Ok(()),
        }
    }

    /// Whether no drive is enabled any more.
    fn is_off(&self, said: &[Said]) -> bool {
        said.iter()
            .all(|said| crate::DriveState::of(said.status) != crate::DriveState::Enabled)
    }

    /// Counts bad cycles, learns the drives' clock; returns what has failed.
    fn judge(
        &mut self,
        exchanged: &Result<Exchanged, BusError>,
        cycles: &mut Cycles,
        devices: usize,
    ) -> Option<BusError> {
        let interface = self.options.interface.clone();
        let exchanged = match exchanged {
            Ok(exchanged) => exchanged,
            Err(_) => {
                self.snapshot.lost_frames += 1;
                cycles.bad += 1;
                let most = SILENT * self.options.watchdog / self.options.cycle;
                return (f64::from(cycles.bad) >= most).then_some(BusError::Silent { interface });
            }
        };
        if let Some(offset) = exchanged.offset_ns {
            self.snapshot.clock_error = cycles.draw(offset);
        }
        let states = exchanged.states.iter().take(devices);
        let away = states
            .into_iter()
            .position(|state| *state != SubDeviceState::Op);
        if exchanged.working_counter == cycles.full && away.is_none() {
            cycles.bad = 0;
            return None;
        }
        if exchanged.working_counter != cycles.full {
            self.snapshot.bad_counters += 1;
        }
        cycles.bad += 1;
        if cycles.bad < BAD {
            return None;
        }
        let place = away.unwrap_or(0);
        let state = match exchanged.states.get(place) {
            Some(SubDeviceState::None) | None => "it does not answer".to_owned(),
            Some(SubDeviceState::Op) => format!(
                "working counter {} instead of {}",
                exchanged.working_counter, cycles.full
            ),
            Some(state) => state.to_string(),
        };
        Some(BusError::LeftOperation { place, state })
    }

    /// The joint of a device that has failed.
    fn joint_of(&self, error: &BusError) -> Option<u32> {
        let BusError::LeftOperation { place, .. } = error else {
            return None;
        };
        let mut drives = self.options.drives.iter();
        drives
            .position(|drive| drive.place == *place)
            .map(|joint| joint as u32)
    }

    fn read<'a>(&self, master: &'a MainDevice<'a>, bus: &Bus, said: &mut [Said; MAX_JOINTS]) {
        let drives = self.options.drives.iter().zip(&bus.layouts);
        for (said, (drive, layout)) in said.iter_mut().zip(drives) {
            let read = bus
                .group
                .with(master, drive.place, |inputs, _| layout.read(inputs));
            *said = read.unwrap_or_default();
        }
    }

    fn write<'a>(&self, master: &'a MainDevice<'a>, bus: &Bus, said: &[Said; MAX_JOINTS]) {
        let told = self
            .axes
            .tell(&said[..self.options.drives.len()], &self.snapshot);
        let drives = self.options.drives.iter().zip(&bus.layouts);
        for (told, (drive, layout)) in told.iter().zip(drives) {
            let _there = bus.group.with(master, drive.place, |_, outputs| {
                layout.write(outputs, told.control, told.target);
            });
        }
    }
}

/// The time of the cycles.
struct Cycles {
    cycle_ns: u64,
    /// The working counter when all devices take part.
    full: u16,
    next_ns: u64,
    /// Bad cycles in a row.
    bad: u32,
}

impl Cycles {
    /// Waits for the next cycle; returns how many have passed.
    fn wait(&mut self) -> f64 {
        self.next_ns += self.cycle_ns;
        let late = now_ns().saturating_sub(self.next_ns) / self.cycle_ns;
        // Cycles that were slept through are gone.
        self.next_ns += late * self.cycle_ns;
        sleep_until_ns(self.next_ns);
        1.0 + late as f64
    }

    /// Draws the cycle to the drives' clock, so that frames pass in the middle between two pulses;
    /// returns how far they are from there (s).
    fn draw(&mut self, offset_ns: u64) -> f64 {
        let cycle = self.cycle_ns as f64;
        let error = (offset_ns as f64 - cycle / 2.0).rem_euclid(cycle);
        let error = if error > cycle / 2.0 {
            error - cycle
        } else {
            error
        };
        let most = DRAW_MOST * cycle;
        let step = (error * DRAW).clamp(-most, most);
        self.next_ns = self.next_ns.saturating_add_signed(-(step as i64));
        error * 1e-9
    }
}

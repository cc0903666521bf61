//! Brings the devices of the bus from their start to operation.

use std::time::{Duration, Instant};

use ethercrab::error::{Error, MailboxError};
use ethercrab::std::ethercat_now;
use ethercrab::subdevice_group::{DcConfiguration, HasDc, NoDc, Op, PreOp};
use ethercrab::{
    DcSupport, DcSync, MainDevice, RegisterAddress, SubDevice, SubDeviceRef, SubDeviceState,
};

use crate::bus_error::BusError;
use crate::group::{Devices, Exchanged, Group};
use crate::process_data::{INPUTS, Layout, OUTPUTS, POSITION_MODE};
use crate::pump::Pump;
use crate::{Cia402Options, Clocks, Drive};

/// How long no frame may come while the bus is brought up, and how long the devices may take to
/// operation.
const PATIENCE: Duration = Duration::from_millis(200);
const START: Duration = Duration::from_secs(5);

/// The first pulse of the drives' clock is so long after it was set up.
const FIRST_PULSE: Duration = Duration::from_millis(100);

/// Watchdogs count in 100 µs: the divider of the 25 MHz clock less 2.
const DIVIDER: u16 = 2498;
const WATCHDOG_UNIT: f64 = 1e-4;

/// Entries of a mapping that are read at most.
const ENTRIES: usize = 32;

/// A bus in operation.
pub(crate) struct Bus {
    pub(crate) group: Group,
    /// Where the objects of each joint's drive are.
    pub(crate) layouts: Vec<Layout>,
}

/// A drive that is being set up.
struct Setup<'p, 'a, 'd> {
    pump: &'p mut Pump<'a>,
    device: SubDeviceRef<'d, &'d SubDevice>,
    /// From 1.
    joint: usize,
}

/// Brings all devices to operation.
///
/// # Errors
/// What is missing or refused, with joint or place.
pub(crate) fn bring_up<'a>(
    pump: &mut Pump<'_>,
    master: &'a MainDevice<'a>,
    options: &Cia402Options,
) -> Result<Bus, BusError> {
    let found = pump.run(master.init_single_group(ethercat_now), PATIENCE)?;
    let mut devices: Devices<PreOp, NoDc> = found.map_err(bus("cannot find the devices"))?;
    if devices.is_empty() {
        let interface = options.interface.clone();
        return Err(BusError::Nobody { interface });
    }
    let mut layouts = Vec::new();
    for (index, drive) in options.drives.iter().enumerate() {
        let device = devices
            .subdevice(master, drive.place)
            .map_err(|_| BusError::Missing {
                joint: index + 1,
                place: drive.place,
                found: devices.len(),
            })?;
        let mut setup = Setup {
            pump,
            device,
            joint: index + 1,
        };
        layouts.push(setup.whole(drive, options)?);
    }
    let clocked = options.clocks == Clocks::Auto && set_clocks(&mut devices, master, options);
    let group = if clocked {
        start_clocked(pump, master, devices, options.cycle)?
    } else {
        start_free(pump, master, devices)?
    };
    wait_for_operation(pump, master, &group, options.cycle)?;
    Ok(Bus { group, layouts })
}

fn bus(what: &'static str) -> impl FnOnce(Error) -> BusError {
    move |cause| BusError::Bus { what, cause }
}

impl Setup<'_, '_, '_> {
    /// Everything that a drive is told before operation; returns where its objects are.
    fn whole(&mut self, drive: &Drive, options: &Cia402Options) -> Result<Layout, BusError> {
        let kind: u32 = self.read(0x1000, 0, "cannot read its device type 0x1000")?;
        if kind & 0xFFFF != 402 {
            return Err(BusError::NotADrive {
                joint: self.joint,
                name: self.device.name().to_owned(),
                found: kind,
            });
        }
        let modes = self.read::<u32>(0x6502, 0, "cannot read its modes 0x6502");
        if modes.is_ok_and(|modes| modes & 0x80 == 0) {
            return Err(BusError::NoPosition { joint: self.joint });
        }
        self.map(0x1C12, 0x1600, &OUTPUTS)?;
        self.map(0x1C13, 0x1A00, &INPUTS)?;
        self.write(0x6060, 0, POSITION_MODE, "cannot set its mode 0x6060")?;
        self.set_cycle(options)?;
        if let Some(window) = drive.following_error {
            let counts = (window * drive.scale().abs()).round() as u32;
            self.write(0x6065, 0, counts, "cannot set its following error 0x6065")?;
        }
        let watchdog = (options.watchdog / WATCHDOG_UNIT).round() as u16;
        self.register(RegisterAddress::WatchdogDivider, DIVIDER)?;
        self.register(RegisterAddress::SyncManagerWatchdog, watchdog)?;
        let (outputs, inputs) = (self.mapping(0x1C12)?, self.mapping(0x1C13)?);
        Layout::find(&outputs, &inputs).map_err(|object| BusError::Mapping {
            joint: self.joint,
            object,
        })
    }

    /// Maps our objects; a drive whose mapping is fixed keeps its own.
    fn map(&mut self, assignment: u16, data: u16, entries: &[u32]) -> Result<(), BusError> {
        let what = "cannot map its process data";
        let fixed = self.write_if_taken(assignment, 0, 0_u8, what)?
            && self.write_if_taken(data, 0, 0_u8, what)?;
        if !fixed {
            return Ok(());
        }
        let mut taken = 0_u8;
        for entry in entries {
            // What a drive cannot map is left out; what we need is looked for afterwards.
            taken += u8::from(self.write_if_taken(data, taken + 1, *entry, what)?);
        }
        self.write(data, 0, taken, what)?;
        self.write(assignment, 1, data, what)?;
        self.write(assignment, 0, 1_u8, what)
    }

    /// The entries of all process data of one direction.
    fn mapping(&mut self, assignment: u16) -> Result<Vec<u32>, BusError> {
        let what = "cannot read the mapping of its process data";
        let mut entries = Vec::new();
        let lists: u8 = self.read(assignment, 0, what)?;
        for list in 1..=lists {
            let data: u16 = self.read(assignment, list, what)?;
            let count: u8 = self.read(data, 0, what)?;
            for entry in 1..=count {
                if entries.len() < ENTRIES {
                    entries.push(self.read(data, entry, what)?);
                }
            }
        }
        Ok(entries)
    }

    /// Tells the drive how long a cycle is; a drive that finds out by itself need not take it.
    fn set_cycle(&mut self, options: &Cia402Options) -> Result<(), BusError> {
        let what = "cannot set its interpolation time 0x60C2";
        for exponent in [-3_i8, -4, -5, -6] {
            let units = options.cycle * 10_f64.powi(-i32::from(exponent));
            if units <= 255.0 && (units - units.round()).abs() < 1e-6 && units >= 0.5 {
                let _taken = self.write_if_taken(0x60C2, 1, units.round() as u8, what)?
                    && self.write_if_taken(0x60C2, 2, exponent, what)?;
                break;
            }
        }
        if options.clocks == Clocks::Auto && has_clock(&self.device) {
            // By the pulse of its clock; drives that need no word for it do not have it.
            let _taken = self.write_if_taken(0x1C32, 1, 2_u16, what)?;
        }
        Ok(())
    }

    fn read<T>(&mut self, index: u16, sub: u8, what: &'static str) -> Result<T, BusError>
    where
        T: ethercrab::EtherCrabWireReadSized,
    {
        let read = self.pump.run(self.device.sdo_read(index, sub), PATIENCE)?;
        read.map_err(|cause| self.refused(what, cause))
    }

    fn write<T>(
        &mut self,
        index: u16,
        sub: u8,
        value: T,
        what: &'static str,
    ) -> Result<(), BusError>
    where
        T: ethercrab::EtherCrabWireWrite,
    {
        let written = self.device.sdo_write(index, sub, value);
        let written = self.pump.run(written, PATIENCE)?;
        written.map_err(|cause| self.refused(what, cause))
    }

    /// Whether the drive takes a value that it need not take.
    fn write_if_taken<T>(
        &mut self,
        index: u16,
        sub: u8,
        value: T,
        what: &'static str,
    ) -> Result<bool, BusError>
    where
        T: ethercrab::EtherCrabWireWrite,
    {
        match self.write(index, sub, value, what) {
            Ok(()) => Ok(true),
            Err(BusError::Drive {
                cause: Error::Mailbox(MailboxError::Aborted { .. }),
                ..
            }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn register(&mut self, register: RegisterAddress, value: u16) -> Result<(), BusError> {
        let written = self.device.register_write(register, value);
        let written = self.pump.run(written, PATIENCE)?;
        let what = "cannot set its watchdog";
        written
            .map(|_: u16| ())
            .map_err(|cause| self.refused(what, cause))
    }

    fn refused(&self, what: &'static str, cause: Error) -> BusError {
        BusError::Drive {
            joint: self.joint,
            what,
            cause,
        }
    }
}

/// Whether a device has a clock that gives pulses.
fn has_clock(device: &SubDevice) -> bool {
    matches!(device.dc_support(), DcSupport::Bits32 | DcSupport::Bits64)
}

/// Chooses the pulse for each drive that has a clock; returns whether there is one.
fn set_clocks<'a>(
    devices: &mut Devices<PreOp, NoDc>,
    master: &'a MainDevice<'a>,
    options: &Cia402Options,
) -> bool {
    let mut any = false;
    for (place, mut device) in devices.iter_mut(master).enumerate() {
        let drives = options.drives.iter().any(|drive| drive.place == place);
        if drives && has_clock(&device) {
            device.set_dc_sync(DcSync::Sync0);
            any = true;
        }
    }
    any
}

fn start_clocked<'a>(
    pump: &mut Pump<'_>,
    master: &'a MainDevice<'a>,
    devices: Devices<PreOp, NoDc>,
    cycle: f64,
) -> Result<Group, BusError> {
    let cycle = Duration::from_secs_f64(cycle);
    let clocks = DcConfiguration {
        start_delay: FIRST_PULSE,
        sync0_period: cycle,
        sync0_shift: cycle / 2,
    };
    let started = async {
        let devices = devices.into_pre_op_pdi(master).await?;
        let devices = devices.configure_dc_sync(master, clocks).await?;
        devices.request_into_op(master).await
    };
    let started: Result<Devices<Op, HasDc>, Error> = pump.run(started, PATIENCE)?;
    let started = started.map_err(bus("cannot start the devices with their clocks"));
    Ok(Group::Clocked(started?))
}

fn start_free<'a>(
    pump: &mut Pump<'_>,
    master: &'a MainDevice<'a>,
    devices: Devices<PreOp, NoDc>,
) -> Result<Group, BusError> {
    let started = async {
        let devices = devices.into_safe_op(master).await?;
        devices.request_into_op(master).await
    };
    let started: Result<Devices<Op, NoDc>, Error> = pump.run(started, PATIENCE)?;
    Ok(Group::Free(
        started.map_err(bus("cannot start the devices"))?,
    ))
}

/// Exchanges process data until all devices are in operation.
fn wait_for_operation<'a>(
    pump: &mut Pump<'_>,
    master: &'a MainDevice<'a>,
    group: &Group,
    cycle: f64,
) -> Result<(), BusError> {
    let begun = Instant::now();
    loop {
        let exchanged = pump.run(group.exchange(master), PATIENCE)?;
        let exchanged: Exchanged = exchanged.map_err(bus("cannot exchange process data"))?;
        let states = exchanged.states.iter().take(group.len());
        let Some(place) = states
            .into_iter()
            .position(|state| *state != SubDeviceState::Op)
        else {
            return Ok(());
        };
        if begun.elapsed() > START {
            let state = exchanged.states[place].to_string();
            return Err(BusError::NotOperational { place, state });
        }
        std::thread::sleep(Duration::from_secs_f64(cycle));
    }
}

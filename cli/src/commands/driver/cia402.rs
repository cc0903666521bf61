use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use driver_cia402::{Cia402Options, Clocks, read_drives};

use super::{about, until_signal};
use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::input;
use crate::robot::RobotOption;

/// Drive an arm of CiA 402 drives on EtherCAT until Ctrl-C
///
/// This process is the master of the bus. Nothing moves before an engine starts. Read
/// docs/drivers/cia402.md before the first start.
#[derive(Args, Debug)]
pub(super) struct Cia402 {
    #[command(flatten)]
    robot: RobotOption,
    #[command(flatten)]
    arm: ArmOption,
    /// Network interface of the bus, for example eth1
    #[arg(long, value_name = "INTERFACE")]
    interface: String,
    /// File with place, counts and gear of each joint's drive
    #[arg(long, value_name = "FILE")]
    drives: PathBuf,
    /// Cycle of the bus, ms
    #[arg(long, value_name = "MS", default_value_t = 1.0)]
    cycle: f64,
    /// How far the targets are behind the setpoints, ms; four cycles where not given
    #[arg(long, value_name = "MS")]
    delay: Option<f64>,
    /// Share of the joints' limits that the targets keep
    #[arg(long, value_name = "SHARE", default_value_t = 0.97)]
    share: f64,
    /// After this time without process data a drive leaves operation by itself, ms; twenty cycles
    /// where not given
    #[arg(long, value_name = "MS")]
    watchdog: Option<f64>,
    /// Whether the drives' distributed clocks are used
    #[arg(long, value_enum, default_value = "auto")]
    clocks: Clock,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Clock {
    /// Where a drive has one
    Auto,
    /// Not used
    Off,
}

impl Cia402 {
    /// Drives until a signal.
    pub(super) fn run(&self) -> Result<Exit, Failure> {
        let robot = self.robot.load()?;
        let arm = self.arm.open()?;
        let about = about(&robot);
        let ranges: Vec<[f64; 2]> = about
            .lower
            .iter()
            .zip(&about.upper)
            .map(|(lower, upper)| [*lower, *upper])
            .collect();
        let text = input::text(&self.drives)?;
        let drives = read_drives(&text, &ranges)
            .with_context(|| self.drives.display().to_string())
            .map_err(|cause| Failure::new(Exit::Usage, cause))?;
        let options = Cia402Options {
            cycle: self.cycle * 1e-3,
            delay: self.delay.unwrap_or(4.0 * self.cycle) * 1e-3,
            share: self.share,
            watchdog: self.watchdog.unwrap_or(20.0 * self.cycle) * 1e-3,
            clocks: match self.clocks {
                Clock::Auto => Clocks::Auto,
                Clock::Off => Clocks::Off,
            },
            ..Cia402Options::new(&self.interface, about, drives)
        };
        until_signal(|how, stop| driver_cia402::run(&arm, options, how, stop))
    }
}

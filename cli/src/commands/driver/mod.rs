//! Drivers: one file per kind of driver, and the test of any driver.

mod cia402;
mod franka;
mod kuka;
mod mujoco;
mod sim;
mod test;
mod ur;

use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::{Args, Subcommand};
use driver_franka::{About, EndSpeeds, RunOptions};
use driver_sim::{DriverError, DriverReport};
use ipc::IpcError;
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// How long a driver continues when the process that started it has ended: enough for its watchdog
/// to stop the arm.
const FAREWELL: Duration = Duration::from_secs(2);

/// Drivers: run one, or test one
///
/// A driver is the process that moves an arm: it reads setpoints from shared memory and publishes
/// measured states.
#[derive(Args, Debug)]
pub(crate) struct Driver {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Sim(sim::Sim),
    Mujoco(mujoco::Mujoco),
    Franka(franka::Franka),
    Ur(ur::Ur),
    Kuka(kuka::Kuka),
    Cia402(cia402::Cia402),
    Test(test::Test),
}

impl Driver {
    /// Runs the driver that was chosen, or the test.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match &self.what {
            What::Sim(sim) => sim.run(),
            What::Mujoco(mujoco) => mujoco.run(),
            What::Franka(franka) => franka.run(),
            What::Ur(ur) => ur.run(),
            What::Kuka(kuka) => kuka.run(),
            What::Cia402(cia402) => cia402.run(),
            What::Test(test) => test.run(),
        }
    }
}

/// A flag that a signal sets, and with `until_end_of_input` the starter too.
fn asked_to_end(until_end_of_input: bool) -> Result<Arc<AtomicBool>, Failure> {
    let stop = driver_sim::asked_to_end().map_err(|cause| Failure::new(Exit::Internal, cause))?;
    if until_end_of_input {
        end_with_input(Arc::clone(&stop));
    }
    Ok(stop)
}

/// Sets `stop` when standard input brings a byte, or some time after it ended because the starter
/// has ended.
fn end_with_input(stop: Arc<AtomicBool>) {
    thread::spawn(move || {
        if io::stdin().read_exact(&mut [0]).is_err() {
            thread::sleep(FAREWELL);
        }
        stop.store(true, Ordering::Relaxed);
    });
}

/// Drives an arm until a signal, and tells what the run came to.
fn until_signal(
    drive: impl FnOnce(&RunOptions, &AtomicBool) -> Result<DriverReport, DriverError>,
) -> Result<Exit, Failure> {
    let stop = asked_to_end(false)?;
    let report = drive(&RunOptions::default(), &stop).map_err(failure)?;
    tell(&report, true);
    Ok(Exit::Done)
}

/// The maker's limits of a robot folder, for a driver.
fn about(robot: &Robot) -> About {
    let joints = robot.joints.of_the_maker();
    About {
        model: ipc::model_hash(robot.urdf.as_bytes()),
        lower: joints.lower.iter().map(|value| value.max(-1e3)).collect(),
        upper: joints.upper.iter().map(|value| value.min(1e3)).collect(),
        velocity: joints.velocity,
        acceleration: joints.acceleration,
        jerk: joints.jerk,
        end_speeds: joints.ends.map(|ends| EndSpeeds {
            lower: ends.lower,
            upper: ends.upper,
            deceleration: ends.deceleration,
            offset: ends.offset,
        }),
        ..About::default()
    }
}

/// Tells what a run of a driver came to; `counts` tells its periods too.
fn tell(report: &DriverReport, counts: bool) {
    if let Some(warning) = &report.warning {
        tracing::warn!("{warning}");
    }
    if let Some(braked) = &report.braked {
        output::note(braked);
    }
    if counts {
        output::note(&format!(
            "{} periods in {} sessions, {} without a new setpoint",
            report.periods, report.sessions, report.missed
        ));
    }
}

fn failure(error: DriverError) -> Failure {
    let exit = match &error {
        DriverError::Ipc(IpcError::BadArmName { .. }) => Exit::Usage,
        DriverError::Ipc(_) => Exit::NoPeer,
        _ => Exit::Usage,
    };
    Failure::new(exit, error)
}

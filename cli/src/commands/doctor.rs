use std::io::{self, Read, Write};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use clap::Args;
use engine::doctor::{Check, DoctorOptions, Health, examine};
use ipc::{Domain, IpcError};
use serde_json::json;

use super::doctor_driver::{self, DriverName};
use crate::client::DomainOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::rate;
use crate::output;

/// How long reading the segments may take.
const PROBE: Duration = Duration::from_secs(10);

/// Check what the servo loop needs of this machine, and say how to correct problems
///
/// Checks the kernel, the rights, shared memory and what dead processes left there (which it
/// removes); measures wake-up delays at the servo period and a round trip through shared memory.
/// With --arm it opens a session with the driver, with --robot it compares limits. The exit code is
/// 1 when something does not work, 0 with warnings.
#[derive(Args, Debug)]
pub(crate) struct Doctor {
    /// Open a session with the driver of this arm, which must have no engine
    #[arg(long, value_name = "CELL/ARM")]
    arm: Option<String>,
    #[command(flatten)]
    domain: DomainOption,
    /// Check the limits of this robot: shipped name or folder
    #[arg(short, long, value_name = "R")]
    robot: Option<String>,
    /// Check what the driver of a real arm needs: network latency and loss, ports, priority, firewall
    #[arg(long, value_enum, value_name = "NAME")]
    driver: Option<DriverName>,
    /// With --driver: address of the arm's controller
    #[arg(long, value_name = "ADDRESS", requires = "driver")]
    address: Option<String>,
    /// With --driver cia402: network interface of the bus
    #[arg(long, value_name = "INTERFACE", requires = "driver")]
    interface: Option<String>,
    /// Servo rate to measure at
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = rate)]
    rate: f64,
    /// How long to measure wake-ups, s
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    seconds: f64,
    /// Remove all segments and lists of the domain, if they are damaged. Refused while a process
    /// uses them
    #[arg(long)]
    repair: bool,
    /// Read the segments, which may crash this process
    #[arg(long, hide = true)]
    probe: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Doctor {
    /// Makes all checks.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let domain = self.domain.open()?;
        if self.repair {
            return repair(&domain);
        }
        if self.probe {
            return probe(&domain);
        }
        let damage = probe_apart(&domain)?;
        let driver = self.arm.as_deref().map(|arm| domain.arm(arm));
        let driver = driver.transpose()?;
        let robot = self.robot.as_deref().map(crate::robot::load).transpose()?;
        let for_driver = self.for_driver()?;
        let mut checks = examine(&DoctorOptions {
            rate_hz: self.rate,
            wake_up: Duration::from_secs_f64(self.seconds),
            driver,
            robot,
            damage,
            ..DoctorOptions::new(domain)
        });
        checks.extend(for_driver);
        let healthy = checks.iter().all(|check| check.health != Health::Fail);
        if self.json {
            output::json(&json!({"healthy": healthy, "checks": checks}))?;
        } else {
            print(&checks)?;
        }
        Ok(if healthy { Exit::Done } else { Exit::Refused })
    }
}

impl Doctor {
    /// The checks for a driver.
    fn for_driver(&self) -> Result<Vec<Check>, Failure> {
        let Some(driver) = self.driver else {
            return Ok(Vec::new());
        };
        let (place, option) = match driver {
            DriverName::Cia402 => (&self.interface, "--interface"),
            _ => (&self.address, "--address"),
        };
        let missing = || Failure::new(Exit::Usage, anyhow!("--driver {driver:?} needs {option}"));
        let place = place.as_deref().ok_or_else(missing)?;
        Ok(doctor_driver::examine(driver, place))
    }
}

/// Empties the domain.
fn repair(domain: &Domain) -> Result<Exit, Failure> {
    let place = domain.directory().display();
    match ipc::repair(domain) {
        Ok(count) => {
            output::note(&format!("{place}: {count} segments and files removed"));
            Ok(Exit::Done)
        }
        Err(error @ IpcError::InUse { .. }) => Err(Failure::new(Exit::Refused, error)),
        Err(error) => Err(error.into()),
    }
}

/// Reads all data of processes and services.
fn probe(domain: &Domain) -> Result<Exit, Failure> {
    ipc::look_at_services(domain)?;
    ipc::count_nodes(domain)?;
    ipc::remove_dead_nodes(domain)?;
    Ok(Exit::Done)
}

/// The same in a separate process, which may crash or hang; returns the problem, if any.
fn probe_apart(domain: &Domain) -> Result<Option<String>, Failure> {
    let program = std::env::current_exe().context("cannot find the program's own file");
    let mut child = Command::new(program.map_err(|cause| Failure::new(Exit::Internal, cause))?)
        .args(["doctor", "--probe", "--domain"])
        .arg(domain.directory())
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    let end = Instant::now() + PROBE;
    let status = loop {
        match child.try_wait()? {
            Some(status) => break Some(status),
            None if Instant::now() < end => sleep(Duration::from_millis(5)),
            None => break None,
        }
    };
    let Some(status) = status else {
        child.kill()?;
        child.wait()?;
        return Ok(Some(format!("no end after {} s", PROBE.as_secs())));
    };
    let mut said = String::new();
    if let Some(mut stream) = child.stderr.take() {
        stream.read_to_string(&mut said)?;
    }
    let last = said.lines().last().unwrap_or_default();
    Ok((!status.success()).then(|| format!("{status}: {last}")))
}

/// One line per check, and under it how to correct it.
fn print(checks: &[Check]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    for check in checks {
        let health = match check.health {
            Health::Ok => "ok",
            Health::Warn => "warn",
            Health::Fail => "FAIL",
        };
        writeln!(out, "{health:4}  {:27} {}", check.name, check.seen)?;
        if !check.remedy.is_empty() {
            writeln!(out, "{:4}  {:27} -> {}", "", "", check.remedy)?;
        }
    }
    Ok(())
}

/// A length of the measurement in s.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.1..=3600.0).contains(&value) => Ok(value),
        _ => Err("expected s from 0.1 to 3600".to_owned()),
    }
}

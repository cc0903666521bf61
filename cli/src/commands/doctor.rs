use std::io::{self, Write};
use std::time::Duration;

use clap::Args;
use engine::doctor::{Check, DoctorOptions, Health, examine};
use serde_json::json;

use crate::client::DomainOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::host_options::rate;
use crate::output;

/// Look at what the servo loop needs of this machine, and say what would repair it
///
/// Looks at the kernel, the rights, shared memory and what dead processes left there (which it
/// removes), measures wake-ups at the servo period and a round trip through shared memory; with
/// --arm it greets the driver, with --robot it compares limits. The exit code is 1 when something
/// does not work, 0 with warnings.
#[derive(Args, Debug)]
pub(crate) struct Doctor {
    /// Greet the driver of this arm, which must have no engine
    #[arg(long, value_name = "CELL/ARM")]
    arm: Option<String>,
    #[command(flatten)]
    domain: DomainOption,
    /// Look at the limits of this robot: shipped name or folder
    #[arg(short, long, value_name = "R")]
    robot: Option<String>,
    /// Servo rate to measure at
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = rate)]
    rate: f64,
    /// How long to measure wake-ups, s
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    seconds: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Doctor {
    /// Makes all checks.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let domain = self.domain.open()?;
        let driver = self.arm.as_deref().map(|arm| domain.arm(arm));
        let driver = driver.transpose()?;
        let robot = self.robot.as_deref().map(crate::robot::load).transpose()?;
        let checks = examine(&DoctorOptions {
            rate_hz: self.rate,
            wake_up: Duration::from_secs_f64(self.seconds),
            driver,
            robot,
            ..DoctorOptions::new(domain)
        });
        let healthy = checks.iter().all(|check| check.health != Health::Fail);
        if self.json {
            output::json(&json!({"healthy": healthy, "checks": checks}))?;
        } else {
            print(&checks)?;
        }
        Ok(if healthy { Exit::Done } else { Exit::Refused })
    }
}

/// One line a check, and under it what repairs it.
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

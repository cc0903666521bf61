use std::io::{self, Write};
use std::thread::sleep;
use std::time::Duration;

use clap::Args;
use ipc::Verb;
use serde_json::Value;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// How often a watched status is asked for.
const WATCH: Duration = Duration::from_millis(250);

/// Show what an engine is doing
#[derive(Args, Debug)]
pub(crate) struct Status {
    #[command(flatten)]
    arm: ArmOption,
    /// Show it continuously until Ctrl-C or the end of the engine
    #[arg(long)]
    watch: bool,
    /// Print JSON; with --watch one object per line
    #[arg(long)]
    json: bool,
}

impl Status {
    /// Asks the engine, once or again and again.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        loop {
            let body = self.arm.ask(Verb::Status)?.body;
            let status = body.get("status").cloned().unwrap_or(Value::Null);
            let mut out = io::stdout().lock();
            match (self.json, self.watch) {
                (true, false) => output::json_to(&mut out, &status)?,
                (true, true) => writeln!(out, "{status}")?,
                (false, _) => writeln!(out, "{}", text(&status))?,
            }
            if !self.watch {
                return Ok(Exit::Done);
            }
            out.flush()?;
            drop(out);
            sleep(WATCH);
        }
    }
}

/// A status for people.
fn text(status: &Value) -> String {
    let word = |key: &str| status[key].as_str().unwrap_or("none").to_owned();
    let numbers = |key: &str, factor: f64, decimals: usize| {
        let list = status[key]
            .as_array()
            .map(Vec::as_slice)
            .unwrap_or_default();
        let number =
            |value: &Value| format!("{:.decimals$}", value.as_f64().unwrap_or(0.0) * factor);
        list.iter().map(number).collect::<Vec<_>>().join(", ")
    };
    let rate = status["time_scaling"].as_f64().unwrap_or(0.0) * 100.0;
    let held = if status["held"] == true { ", held" } else { "" };
    let cycles = &status["cycles"];
    format!(
        "arm       {} ({}, driver {})\nstate     {}{held}\ncommand   {} at {rate:.0} % speed, {} wait\n\
         fault     {}\njoints    {} rad\npoint     ({}) mm\nperiods   {} published, {} late",
        word("arm"),
        word("robot"),
        word("driver"),
        word("state"),
        word("command"),
        status["queued"],
        word("fault"),
        numbers("joints", 1.0, 4),
        numbers("position_m", 1e3, 1),
        cycles["published"],
        cycles["skipped"],
    )
}

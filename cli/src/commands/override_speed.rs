use clap::Args;
use ipc::ControlAsk;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;

/// Move at a share of the planned speed
///
/// Changes time, never geometry: tolerances hold at every override.
#[derive(Args, Debug)]
pub(crate) struct Override {
    /// Share of the planned speed, 0 to 100
    #[arg(value_parser = percent)]
    percent: f64,
    #[command(flatten)]
    arm: ArmOption,
}

impl Override {
    /// Asks the engine.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let share = self.percent / 100.0;
        self.arm.control(ControlAsk::Override(share), false)
    }
}

fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').parse::<f64>() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err("expected a number from 0 to 100".to_owned()),
    }
}

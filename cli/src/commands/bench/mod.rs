//! `canter bench`: measures trajectory generation on this machine.

mod motion;
mod otg;
mod pose_lists;
mod suite;
mod timing;

use clap::{Args, Subcommand};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::printer::Printer;

/// Measure trajectory generation on this machine
#[derive(Args, Debug)]
pub(crate) struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Motion(motion::Motion),
    Otg(otg::Otg),
    Timing(timing::Timing),
}

impl Bench {
    /// Measures and prints.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        match &self.what {
            What::Motion(bench) => bench.run(printer),
            What::Otg(bench) => bench.run(),
            What::Timing(bench) => bench.run(),
        }
    }
}

/// Random problems: which and how many.
#[derive(Args, Debug)]
struct Problems {
    /// The same number gives the same problems
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Problems of each kind
    #[arg(long, value_name = "N", default_value_t = 1000,
          value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    count: u32,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

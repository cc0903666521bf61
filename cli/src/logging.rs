use std::io::{self, IsTerminal};

use crcl::Look;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::fmt;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

use crate::printer::Printer;
use crate::program::look;

/// The variable that chooses what is logged, e.g. `CANTER_LOG=engine=debug`.
const VARIABLE: &str = "CANTER_LOG";

/// Sends log lines to standard error, warnings and errors unless `CANTER_LOG` says otherwise.
pub(crate) fn start(printer: &Printer) {
    let printer = printer.clone();
    let chosen = std::env::var(VARIABLE)
        .ok()
        .and_then(|text| text.parse().ok());
    let filter = chosen.unwrap_or_else(|| Targets::new().with_default(LevelFilter::WARN));
    let lines = fmt::layer()
        .with_writer(move || printer.clone())
        .with_ansi(look(io::stderr().is_terminal()) == Look::Colour)
        .without_time();
    // A second start in one process keeps the first.
    let _ = tracing_subscriber::registry()
        .with(lines)
        .with(filter)
        .try_init();
    tracing::debug!(version = env!("CARGO_PKG_VERSION"), "canter");
}

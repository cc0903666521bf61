use std::io::{self, IsTerminal};

use crcl::Look;
use tracing_subscriber::EnvFilter;

use crate::printer::Printer;
use crate::program::look;

/// The variable that chooses what is logged, e.g. `CANTER_LOG=engine=debug`.
const VARIABLE: &str = "CANTER_LOG";

/// Sends log lines to standard error, warnings and errors unless `CANTER_LOG` says otherwise.
pub(crate) fn start(printer: &Printer) {
    let printer = printer.clone();
    let filter = EnvFilter::try_from_env(VARIABLE).unwrap_or_else(|_| EnvFilter::new("warn"));
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(move || printer.clone())
        .with_ansi(look(io::stderr().is_terminal()) == Look::Colour)
        .without_time()
        .try_init();
    tracing::debug!(version = env!("CARGO_PKG_VERSION"), "canter");
}

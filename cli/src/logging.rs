use std::io;

use tracing_subscriber::EnvFilter;

/// The variable that chooses what is logged, e.g. `CANTER_LOG=engine=debug`.
const VARIABLE: &str = "CANTER_LOG";

/// Sends log lines to standard error, warnings and errors unless `CANTER_LOG` says otherwise.
pub(crate) fn start() {
    let filter = EnvFilter::try_from_env(VARIABLE).unwrap_or_else(|_| EnvFilter::new("warn"));
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .without_time()
        .try_init();
}

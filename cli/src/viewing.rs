//! Serving a view until somebody ends it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use view::{ReadWorld, Server, ServerOptions, Source};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::printer::Printer;

/// The usual port; another one where it is taken.
const PORT: u16 = 8230;

/// How often to look whether it shall end.
const LOOK: Duration = Duration::from_millis(50);

/// Serves a view until Ctrl-C, or until `ended` says so; with a world, what stands in the workstation
/// is shown as well.
///
/// # Errors
/// The port is taken, or the source cannot be read.
pub(crate) fn serve(
    printer: &Printer,
    (source, world): (Source, Option<ReadWorld>),
    port: Option<u16>,
    ended: impl Fn() -> bool,
) -> Result<Exit, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let moves = matches!(source, Source::Arm(_));
    let server = Server::start(source, ServerOptions { port: chosen(port) })?;
    if let Some(read) = world {
        server.show_world(read)?;
    }
    printer.note(&format!("canter: {}", server.hand_address()));
    if moves {
        printer.note(&format!(
            "canter: to watch only: {}",
            server.watch_address()
        ));
        printer.note(&format!(
            "canter: for Foxglove, Lichtblick and PlotJuggler: {}",
            server.viewer_address()
        ));
    }
    while !stop.load(Ordering::Relaxed) && !ended() {
        sleep(LOOK);
    }
    Ok(Exit::Done)
}

/// The port that was asked for, the usual one, or a free one where that is taken.
fn chosen(port: Option<u16>) -> u16 {
    let free = |port: u16| std::net::TcpListener::bind(("127.0.0.1", port)).is_ok();
    match port {
        Some(port) => port,
        None if free(PORT) => PORT,
        None => 0,
    }
}

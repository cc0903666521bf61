//! The thread that stops: it waits for no planner and for nobody who serves ROS.

use std::sync::mpsc::{Receiver, Sender};
use std::thread::sleep;
use std::time::{Duration, Instant};

use ipc::{Arm, ControlAsk, ControlClient};

/// How long the engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);

/// How long the arm may take to come to rest.
const REST: Duration = Duration::from_secs(10);

/// How often it is looked at.
const LOOK: Duration = Duration::from_millis(1);

/// A stop that was carried out, or why not.
#[derive(Debug)]
pub(crate) struct Stopped {
    /// Number of the stop.
    pub(crate) serial: u64,
    /// Whether the arm rests.
    pub(crate) result: Result<(), String>,
}

/// Serves stops until nobody can ask for one any more; tells first whether the channel is open.
pub(crate) fn run(
    arm: &Arm,
    (stops, tell): (&Receiver<u64>, &Sender<Stopped>),
    opened: impl FnOnce(Result<(), ipc::IpcError>),
) {
    let client = match ControlClient::open(arm) {
        Ok(client) => client,
        Err(error) => return opened(Err(error)),
    };
    opened(Ok(()));
    while let Ok(serial) = stops.recv() {
        let result = stop(&client);
        // The bridge ends where nobody listens.
        let _ = tell.send(Stopped { serial, result });
    }
}

/// Stops the arm on its path, drops what is queued, and waits until it rests. An arm that an
/// operator stopped stays stopped.
fn stop(client: &ControlClient) -> Result<(), String> {
    ask(client, ControlAsk::Discard { fast: true })?;
    let end = Instant::now() + REST;
    loop {
        let (resting, idle) = ask(client, ControlAsk::Look)?;
        if resting && idle {
            return Ok(());
        }
        if Instant::now() >= end {
            return Err(format!(
                "the arm has not come to rest within {} s",
                REST.as_secs()
            ));
        }
        sleep(LOOK);
    }
}

/// Whether the arm rests and has nothing to do, after what was asked acts.
fn ask(client: &ControlClient, ask: ControlAsk) -> Result<(bool, bool), String> {
    match client.ask(ask, PATIENCE) {
        Ok(answer) if answer.accepted == 1 => Ok((answer.resting == 1, answer.idle == 1)),
        Ok(answer) => Err(answer.reason()),
        Err(error) => Err(error.to_string()),
    }
}

//! The thread that stops: it waits for no planner and no connection.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crcl::xml::CommandState;
use ipc::{Arm, ControlAnswer, ControlAsk, ControlClient};

use crate::cell::Cell;

/// How long the engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);

/// How long the arm may take to come to rest.
const REST: Duration = Duration::from_secs(10);

/// How often it is looked at.
const LOOK: Duration = Duration::from_millis(1);

/// A stop that was asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Number of the StopMotion that waits for it; none for a client that went away.
    pub(crate) serial: Option<u64>,
    /// With all that the joints can do.
    pub(crate) fast: bool,
}

/// Stops the arm on its path and forgets what is queued. An arm that an operator stopped stays
/// stopped.
///
/// # Errors
/// The sentence of an engine that refuses, or why there is no answer.
pub(crate) fn abort(client: &ControlClient, fast: bool) -> Result<ControlAnswer, String> {
    ask(client, ControlAsk::Discard { fast })
}

fn ask(client: &ControlClient, ask: ControlAsk) -> Result<ControlAnswer, String> {
    match client.ask(ask, PATIENCE) {
        Ok(answer) if answer.accepted == 1 => Ok(answer),
        Ok(answer) => Err(answer.reason()),
        Err(error) => Err(error.to_string()),
    }
}

/// Waits until the arm rests and has nothing to do.
///
/// # Errors
/// As [`abort`], or that it does not come to rest.
pub(crate) fn wait_for_rest(client: &ControlClient) -> Result<(), String> {
    let end = Instant::now() + REST;
    loop {
        let now = ask(client, ControlAsk::Look)?;
        if now.resting == 1 && now.idle == 1 {
            return Ok(());
        }
        if Instant::now() >= end {
            let waited = REST.as_secs();
            return Err(format!("the arm has not come to rest within {waited} s"));
        }
        sleep(LOOK);
    }
}

/// Serves stops until nobody can ask for one any more; tells first whether the channel is open.
pub(crate) fn run(
    arm: &Arm,
    cell: &Arc<Cell>,
    stops: &Receiver<Stop>,
    tell: impl FnOnce(Result<(), String>),
) {
    let client = match ControlClient::open(arm) {
        Ok(client) => client,
        Err(error) => return tell(Err(error.to_string())),
    };
    tell(Ok(()));
    while let Ok(stop) = stops.recv() {
        let result = abort(&client, stop.fast).and_then(|_| wait_for_rest(&client));
        let Some(serial) = stop.serial else { continue };
        let mut inner = cell.lock();
        match result {
            // Done also after an error, which stays: the next command but InitCanon is refused.
            Ok(()) => inner.finish(serial, CommandState::Done, None),
            Err(why) => inner.fail(serial, &why),
        }
    }
}

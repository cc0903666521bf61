//! The clauses that are tried in a session of their own.

mod ends;
mod faults;
mod motion;

use ipc::SetpointFlags;

use crate::player::{Player, Trial};

/// A clause and how it is tried.
type Named<F> = (&'static str, F);

/// The clauses in the order they are tried.
pub(crate) const CLAUSES: [Named<Trial>; 18] = [
    ("states come at the rate", Player::rate),
    ("a setpoint of another session is ignored", Player::foreign),
    ("becomes active by holding", Player::holds),
    ("says when it measured", Player::measured),
    ("says what is commanded", Player::commanded),
    (
        "a start elsewhere is not followed and latches",
        Player::starts_elsewhere,
    ),
    ("follows a motion", Player::follows),
    ("the gripper answers", Player::gripper),
    ("silence trips the watchdog and latches", Player::silence),
    ("a new session begins where the arm is", Player::holds),
    ("a jump is not followed and latches", |player| {
        player.spoil(|s| s.position[0] += 0.4)
    }),
    ("a position out of range latches", Player::leaves_range),
    ("a number that is not finite latches", |player| {
        player.spoil(|s| s.position[0] = f64::NAN)
    }),
    ("an acceleration beyond any limit latches", |player| {
        player.spoil(|setpoint| setpoint.acceleration[0] = 1e6)
    }),
    ("setpoints that are too old are silence", Player::outdated),
    ("a stop request stops and latches", |player| {
        player.spoil(|setpoint| setpoint.flags |= SetpointFlags::STOP_REQUEST)
    }),
    ("in lock-step one state a setpoint", Player::lock_step),
    ("goodbye ends the session without a fault", Player::goodbye),
];

//! Plays the engine against any driver and reports, clause by clause, whether it follows the
//! protocol of `docs/driver-protocol.md`.
//!
//! The joints move by a few hundredths of a rad; keep away from a real arm nevertheless.

mod clauses;
mod player;

use core::time::Duration;

use ipc::{Arm, Clock, EngineLink, Hello, IpcError, text_of};
use serde::Serialize;

use clauses::CLAUSES;
use player::{NOT_TRIED, PERIOD, Player, Seen, WATCHDOG};

/// Whether a driver follows a clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It does.
    Pass,
    /// It does not.
    Fail,
    /// It has no such part.
    Skip,
}

/// One clause of the protocol with its verdict.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Clause {
    /// The clause's name.
    pub name: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// What was observed.
    pub seen: String,
}

/// The result of testing a driver.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ConformanceReport {
    /// The driver's name.
    pub driver: String,
    /// How many joints it has.
    pub joints: usize,
    /// All clauses, in the order they were tried.
    pub clauses: Vec<Clause>,
}

/// Tests the driver of `arm`. Takes about ten seconds.
///
/// # Errors
/// When there is no driver, or an engine already drives it.
pub fn test_driver(arm: &Arm) -> Result<ConformanceReport, IpcError> {
    let link = EngineLink::open(arm)?;
    let joints = link.joints(Duration::from_secs(3))?;
    let hello = Hello::new(joints, PERIOD, WATCHDOG, Clock::Wall);
    let ack = link.greet(&hello, [Duration::from_secs(3), ipc::READY], |_| {})?;
    let mut player = Player::new(link, hello, ack);
    let mut clauses = vec![judge(
        "handshake",
        Ok(format!("session {:#x}", player.ack.session)),
    )];
    let requests: [(&str, Change); 5] = [
        ("wrong protocol is refused", |hello| hello.protocol += 1),
        ("protocol 1 is refused", |hello| hello.protocol = 1),
        ("wrong layout is refused", |hello| hello.schema ^= 1),
        ("wrong joint count is refused", |hello| hello.joints += 1),
        ("wrong period is refused", |hello| hello.period_ns = 1),
    ];
    clauses.extend(requests.map(|(name, change)| judge(name, player.refuses(change))));
    let period = player.refuses_period();
    clauses.push(judge("a period beyond its longest is refused", period));
    let driver = text_of(&player.ack.name);
    clauses.extend(CLAUSES.map(|(name, clause)| judge(name, player.attempt(clause))));
    Ok(ConformanceReport {
        driver,
        joints,
        clauses,
    })
}

/// What makes a request wrong.
type Change = fn(&mut Hello);

/// Converts what was observed into a verdict.
fn judge(name: &'static str, seen: Seen) -> Clause {
    let (verdict, seen) = match seen {
        Ok(seen) => match seen.strip_prefix(NOT_TRIED) {
            Some(reason) => (Verdict::Skip, reason.to_owned()),
            None => (Verdict::Pass, seen),
        },
        Err(seen) => (Verdict::Fail, seen),
    };
    Clause {
        name,
        verdict,
        seen,
    }
}

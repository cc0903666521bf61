//! Silence and setpoints that a driver must not follow.

use core::time::Duration;
use std::time::Instant;

use ipc::{DriverState, Setpoint};

use crate::player::{NOT_TRIED, Player, Seen, WATCHDOG};

impl Player {
    pub(super) fn silence(&mut self) -> Seen {
        self.hold(100);
        let start = Instant::now();
        while !matches!(self.state.driver(), DriverState::Fault) {
            self.period(None);
            if start.elapsed() > Duration::from_secs(3) {
                return self.expect(&[DriverState::Fault], "after 3 s of silence ");
            }
        }
        let seen = format!("latched after {} ms; ", start.elapsed().as_millis());
        if start.elapsed() < Duration::from_nanos(WATCHDOG) {
            return Err(format!(
                "{seen}before the watchdog of {} ms",
                WATCHDOG / 1_000_000
            ));
        }
        self.hold(100);
        self.expect(&[DriverState::Fault], &seen)
    }

    /// Setpoints that were sent longer ago than the watchdog, by their own word.
    pub(super) fn outdated(&mut self) -> Seen {
        self.hold(100);
        for _ in 0..100 {
            let mut setpoint = self.setpoint([0.0; 3]);
            setpoint.published_ns = setpoint.published_ns.saturating_sub(2 * WATCHDOG);
            self.period(Some(setpoint));
        }
        let reason = format!("{}; ", self.state.fault_code().reason());
        self.expect(&[DriverState::Stopping, DriverState::Fault], &reason)
    }

    /// Holds, sends one setpoint that is spoilt, holds again: the driver must have latched.
    pub(super) fn spoil(&mut self, change: impl Fn(&mut Setpoint)) -> Seen {
        self.hold(100);
        let mut setpoint = self.setpoint([0.0; 3]);
        change(&mut setpoint);
        self.period(Some(setpoint));
        self.hold(100);
        self.heard()?;
        let reason = format!("{}; ", self.state.fault_code().reason());
        if self.moved() > 0.05 {
            return Err(format!("{reason}it moved by {:.3} rad", self.moved()));
        }
        self.expect(&[DriverState::Stopping, DriverState::Fault], &reason)
    }

    /// A setpoint beyond the end of a joint's range.
    pub(super) fn leaves_range(&mut self) -> Seen {
        let upper = self.ack.upper[0];
        if upper > 100.0 {
            return Ok(format!("{NOT_TRIED}no end of the first joint's range"));
        }
        self.spoil(|setpoint| setpoint.position[0] = upper + 0.1)
    }
}

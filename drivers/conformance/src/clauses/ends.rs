//! Sessions in lock-step, and the end of a session.

use core::time::Duration;
use std::time::Instant;

use ipc::{Clock, DriverState, Hello, IpcError};

use crate::player::{NOT_TRIED, PERIOD, Player, Seen};

impl Player {
    /// A session in step: one state after the handshake, then one for each setpoint.
    pub(super) fn lock_step(&mut self) -> Seen {
        const SETPOINTS: usize = 200;
        self.hold(10);
        self.say_goodbye();
        let hello = Hello {
            clock: Clock::LockStep as u32,
            ..self.hello
        };
        match self
            .link
            .greet(&hello, [Duration::from_secs(2), ipc::READY], |_| {})
        {
            Ok(ack) => self.ack = ack,
            Err(IpcError::Refused { reason, .. }) => {
                return Ok(format!("{NOT_TRIED}no lock-step: {reason}"));
            }
            Err(error) => return Err(error.to_string()),
        }
        self.sequence = 0;
        let start = Instant::now();
        let mut states = self.states_within(Duration::from_secs(2), 1);
        for sent in 0..SETPOINTS {
            if states != sent + 1 {
                return Err(format!("{states} states after {sent} setpoints"));
            }
            let setpoint = self.setpoint([0.0; 3]);
            self.link.send(&setpoint);
            states += self.states_within(Duration::from_secs(1), 1);
        }
        let speed = SETPOINTS as f64 * PERIOD as f64 * 1e-9 / start.elapsed().as_secs_f64();
        states += self.states_within(Duration::from_millis(50), 1000);
        self.say_goodbye();
        let seen = format!(
            "{states} states, the first before {SETPOINTS} setpoints; {speed:.0} x real time"
        );
        if states == SETPOINTS + 1 {
            Ok(seen)
        } else {
            Err(seen)
        }
    }

    pub(super) fn goodbye(&mut self) -> Seen {
        self.hold(50);
        self.say_goodbye();
        let end = Instant::now() + Duration::from_secs(1);
        while Instant::now() < end {
            if let Some(state) = self.link.last_state()
                && state.driver() == DriverState::Disconnected
            {
                return Ok("driver is disconnected".to_owned());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        self.expect(&[DriverState::Disconnected], "")
    }
}

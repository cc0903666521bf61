//! The engine's end of the link to a driver.

use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::port::client::Client;
use iceoryx2::prelude::BackpressureStrategy;

use crate::link_end::{LinkEnd, Role};
use crate::node::Shared;
use crate::{Arm, Hello, HelloAck, IpcError, MAX_JOINTS, Setpoint, State, Verdict, text_of};

/// The engine's place in the link.
const ENGINE: Role = Role {
    name: "engine",
    sends: "setpoint",
    receives: "state",
};

/// Time between two requests to a driver that is getting ready.
const AGAIN: Duration = Duration::from_millis(20);

/// How long the driver is usually given to get ready: brakes open, a program starts.
pub const READY: Duration = Duration::from_secs(60);

/// What a driver answers to a request for a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Greeted {
    /// The session is open.
    Welcome(Box<HelloAck>),
    /// The arm is getting ready: ask again.
    Waits {
        /// The driver's name.
        driver: String,
        /// What it waits for.
        reason: String,
    },
}

/// The engine's end: sends setpoints, receives states, opens sessions. There is one for each arm
/// among all processes. It stays in the thread that opened it.
#[derive(Debug)]
pub struct EngineLink {
    hello: Client<Shared, Hello, (), HelloAck, ()>,
    // Last: the node in it is dropped after all ports.
    end: LinkEnd<Setpoint, State>,
}

impl EngineLink {
    /// Opens the engine's end of `arm`, after cleaning up behind dead processes.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when a running process has it; errors of shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let end = LinkEnd::open(arm, ENGINE)?;
        let hello = end.handshake(|factory| {
            factory
                .client_builder()
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
        })?;
        Ok(Self { hello, end })
    }

    /// How many joints the driver has, from the states that it sends also without a session. Not
    /// for the cycle.
    ///
    /// # Errors
    /// [`IpcError::NoAnswer`] when no state comes within `timeout`.
    pub fn joints(&self, timeout: Duration) -> Result<usize, IpcError> {
        let start = Instant::now();
        while start.elapsed() < timeout {
            match self.next_state() {
                Some(state) if (1..=MAX_JOINTS as u32).contains(&state.joints) => {
                    return Ok(state.joints as usize);
                }
                Some(_) => {}
                None => sleep(Duration::from_millis(1)),
            }
        }
        Err(IpcError::NoAnswer {
            arm: self.arm().to_string(),
            role: "driver",
            waited_ms: timeout.as_millis() as u64,
        })
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        self.end.arm()
    }

    /// Asks the driver for a session and waits up to `timeout` for a driver, and then up to
    /// `patience` until it is ready; `waits` gets what it waits for, again and again. Not for the
    /// cycle.
    ///
    /// # Errors
    /// Those of [`Self::ask`], and [`IpcError::NotReady`] with what the driver waited for.
    pub fn greet(
        &self,
        hello: &Hello,
        [timeout, patience]: [Duration; 2],
        mut waits: impl FnMut(&str),
    ) -> Result<HelloAck, IpcError> {
        let start = Instant::now();
        loop {
            match self.ask(hello, timeout)? {
                Greeted::Welcome(ack) => return Ok(*ack),
                Greeted::Waits { driver, reason } if start.elapsed() > patience => {
                    return Err(IpcError::NotReady {
                        arm: self.arm().to_string(),
                        driver,
                        reason,
                        waited_s: patience.as_secs(),
                    });
                }
                Greeted::Waits { reason, .. } => waits(&reason),
            }
            sleep(AGAIN);
        }
    }

    /// Asks the driver once for a session and waits up to `timeout` for a driver. Not for the
    /// cycle.
    ///
    /// # Errors
    /// [`IpcError::NoAnswer`] without a driver, [`IpcError::Refused`] with the driver's reason,
    /// [`IpcError::BadMessage`] when the answer is invalid.
    pub fn ask(&self, hello: &Hello, timeout: Duration) -> Result<Greeted, IpcError> {
        let end = Instant::now() + timeout;
        let ack = loop {
            if let Some(ack) = self.greet_once(hello, end)? {
                break ack;
            }
            if Instant::now() >= end {
                return Err(IpcError::NoAnswer {
                    arm: self.arm().to_string(),
                    role: "driver",
                    waited_ms: timeout.as_millis() as u64,
                });
            }
        };
        if ack.verdict == Verdict::Wait as u32 {
            return Ok(Greeted::Waits {
                driver: text_of(&ack.name),
                reason: text_of(&ack.reason),
            });
        }
        if ack.verdict != Verdict::Welcome as u32 {
            return Err(IpcError::Refused {
                arm: self.arm().to_string(),
                driver: text_of(&ack.name),
                reason: text_of(&ack.reason),
            });
        }
        let joints = hello.joints as usize;
        ack.check(joints).map_err(|cause| IpcError::BadMessage {
            arm: self.arm().to_string(),
            cause,
        })?;
        Ok(Greeted::Welcome(Box::new(ack)))
    }

    /// Sends one request and waits for its answer; `None` when no driver took it.
    fn greet_once(&self, hello: &Hello, end: Instant) -> Result<Option<HelloAck>, IpcError> {
        let fail = |cause: String| IpcError::Failed {
            service: self.arm().to_string(),
            operation: "the handshake",
            cause,
        };
        let pending = self
            .hello
            .send_copy(*hello)
            .map_err(|cause| fail(format!("{cause:?}")))?;
        if pending.number_of_server_connections() == 0 {
            sleep(Duration::from_millis(2));
            return Ok(None);
        }
        let patience = Instant::now() + Duration::from_millis(200);
        loop {
            let over = Instant::now() >= end.min(patience);
            let answer = pending
                .receive()
                .map_err(|cause| fail(format!("{cause:?}")))?;
            match answer {
                Some(answer) => return Ok(Some(*answer)),
                None if over => return Ok(None),
                None => sleep(Duration::from_micros(200)),
            }
        }
    }

    /// Sends a setpoint; says whether iceoryx2 took it. Does not wait, and does not allocate once
    /// the driver is connected. A slow reader loses its oldest message.
    pub fn send(&self, setpoint: &Setpoint) -> bool {
        self.end.send(setpoint)
    }

    /// The oldest state that was not read yet, unchecked. Does not wait.
    pub fn next_state(&self) -> Option<State> {
        self.end.next()
    }

    /// Writes the oldest state that was not read yet over another one, unchecked; says whether there
    /// was one. What has no meaning in it, as numbers of more joints, stays as it was. Does not wait.
    pub fn take_state(&self, place: &mut State) -> bool {
        self.end.take(place)
    }

    /// The same with the newest state; older ones are dropped.
    pub fn take_last_state(&self, place: &mut State) -> bool {
        self.end.take_last(place)
    }

    /// The newest state, unchecked; older ones are dropped. Does not wait.
    pub fn last_state(&self) -> Option<State> {
        let mut place = State::default();
        self.take_last_state(&mut place).then_some(place)
    }
}

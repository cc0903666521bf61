//! The engine's end of the link to a driver.

use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::port::client::Client;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, Node};

use crate::node::{Shared, exchange, inhabitants, join, topic};
use crate::{Arm, Hello, HelloAck, IpcError, MAX_JOINTS, Setpoint, State, Verdict, room, text_of};

/// The engine's end: sends setpoints, receives states, opens sessions. There is one for each arm
/// among all processes. It stays in the thread that opened it.
#[derive(Debug)]
pub struct EngineLink {
    arm: Arm,
    setpoints: Publisher<Shared, Setpoint, ()>,
    states: Subscriber<Shared, State, ()>,
    hello: Client<Shared, Hello, (), HelloAck, ()>,
    // Last, so that it is dropped after its ports.
    _node: Node<Shared>,
}

impl EngineLink {
    /// Opens the engine's end of `arm`, after cleaning up behind dead processes.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when a running process has it; errors of shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "engine")?;
        let fail = |operation, cause: String| IpcError::Failed {
            service: arm.to_string(),
            operation,
            cause,
        };
        let factory = topic::<Setpoint>(&node, arm, "setpoint")?;
        let setpoints = factory
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .max_loaned_samples(2)
            .create()
            .map_err(|cause| match cause {
                PublisherCreateError::ExceedsMaxSupportedPublishers => IpcError::Taken {
                    arm: arm.to_string(),
                    role: "engine",
                    owner: inhabitants(&factory, &node),
                },
                other => fail("opening the setpoints", format!("{other:?}")),
            })?;
        let states = topic::<State>(&node, arm, "state")?
            .subscriber_builder()
            .create()
            .map_err(|cause| fail("opening the states", format!("{cause:?}")))?;
        let hello = exchange::<Hello, HelloAck>(&node, arm, "hello")?
            .client_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| fail("opening the handshake", format!("{cause:?}")))?;
        room::reserve(arm.domain())?;
        Ok(Self {
            arm: arm.clone(),
            setpoints,
            states,
            hello,
            _node: node,
        })
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
            arm: self.arm.to_string(),
            role: "driver",
            waited_ms: timeout.as_millis() as u64,
        })
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// Asks the driver for a session and waits up to `timeout`. Not for the cycle.
    ///
    /// # Errors
    /// [`IpcError::NoAnswer`] without a driver, [`IpcError::Refused`] with the driver's reason,
    /// [`IpcError::BadMessage`] when the answer is invalid.
    pub fn greet(&self, hello: &Hello, timeout: Duration) -> Result<HelloAck, IpcError> {
        let end = Instant::now() + timeout;
        let ack = loop {
            if let Some(ack) = self.greet_once(hello, end)? {
                break ack;
            }
            if Instant::now() >= end {
                return Err(IpcError::NoAnswer {
                    arm: self.arm.to_string(),
                    role: "driver",
                    waited_ms: timeout.as_millis() as u64,
                });
            }
        };
        if ack.verdict != Verdict::Welcome as u32 {
            return Err(IpcError::Refused {
                arm: self.arm.to_string(),
                driver: text_of(&ack.name),
                reason: text_of(&ack.reason),
            });
        }
        let joints = hello.joints as usize;
        ack.check(joints).map_err(|cause| IpcError::BadMessage {
            arm: self.arm.to_string(),
            cause,
        })?;
        Ok(ack)
    }

    /// Sends one request and waits for its answer; `None` when no driver took it.
    fn greet_once(&self, hello: &Hello, end: Instant) -> Result<Option<HelloAck>, IpcError> {
        let fail = |cause: String| IpcError::Failed {
            service: self.arm.to_string(),
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
    pub fn send(&self, setpoint: Setpoint) -> bool {
        self.setpoints.send_copy(setpoint).is_ok()
    }

    /// The oldest state that was not read yet, unchecked. Does not wait.
    pub fn next_state(&self) -> Option<State> {
        self.states.receive().ok().flatten().map(|sample| *sample)
    }

    /// The newest state, unchecked; older ones are dropped. Does not wait.
    pub fn last_state(&self) -> Option<State> {
        let mut last = None;
        // The number is limited, so a flood of states does not block the cycle.
        for _ in 0..64 {
            match self.next_state() {
                Some(state) => last = Some(state),
                None => break,
            }
        }
        last
    }
}

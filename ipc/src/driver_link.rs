//! The driver's end of the link to an engine.

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::server::Server;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, Node};

use crate::node::{Shared, exchange, inhabitants, join, topic};
use crate::{Arm, Hello, HelloAck, IpcError, Setpoint, State, room};

/// The driver's end: receives setpoints, sends states, answers handshakes. There is one for each
/// arm among all processes. It stays in the thread that opened it.
#[derive(Debug)]
pub struct DriverLink {
    arm: Arm,
    states: Publisher<Shared, State, ()>,
    setpoints: Subscriber<Shared, Setpoint, ()>,
    hello: Server<Shared, Hello, (), HelloAck, ()>,
    // Last, so that it is dropped after its ports.
    _node: Node<Shared>,
}

/// A request for a session that waits for its answer.
#[derive(Debug)]
pub struct Greeting {
    /// The request, unchecked.
    pub hello: Hello,
    request: ActiveRequest<Shared, Hello, (), HelloAck, ()>,
}

impl Greeting {
    /// Answers; returns whether iceoryx2 took the answer.
    pub fn answer(self, ack: HelloAck) -> bool {
        self.request.send_copy(ack).is_ok()
    }
}

impl DriverLink {
    /// Opens the driver's end of `arm`, after cleaning up behind dead processes.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when a running process has it; errors of shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "driver")?;
        let fail = |operation, cause: String| IpcError::Failed {
            service: arm.to_string(),
            operation,
            cause,
        };
        let factory = topic::<State>(&node, arm, "state")?;
        let states = factory
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .max_loaned_samples(2)
            .create()
            .map_err(|cause| match cause {
                PublisherCreateError::ExceedsMaxSupportedPublishers => IpcError::Taken {
                    arm: arm.to_string(),
                    role: "driver",
                    owner: inhabitants(&factory, &node),
                },
                other => fail("opening the states", format!("{other:?}")),
            })?;
        let setpoints = topic::<Setpoint>(&node, arm, "setpoint")?
            .subscriber_builder()
            .create()
            .map_err(|cause| fail("opening the setpoints", format!("{cause:?}")))?;
        let hello = exchange::<Hello, HelloAck>(&node, arm, "hello")?
            .server_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| fail("opening the handshake", format!("{cause:?}")))?;
        room::reserve(arm.domain())?;
        Ok(Self {
            arm: arm.clone(),
            states,
            setpoints,
            hello,
            _node: node,
        })
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// A request for a session, if one waits.
    pub fn greeting(&self) -> Option<Greeting> {
        let request = self.hello.receive().ok().flatten()?;
        Some(Greeting {
            hello: *request.payload(),
            request,
        })
    }

    /// Sends a state; says whether iceoryx2 took it. Does not wait.
    pub fn send(&self, state: State) -> bool {
        self.states.send_copy(state).is_ok()
    }

    /// The oldest setpoint that was not read yet, unchecked. Does not wait.
    pub fn next_setpoint(&self) -> Option<Setpoint> {
        self.setpoints
            .receive()
            .ok()
            .flatten()
            .map(|sample| *sample)
    }

    /// The newest setpoint, unchecked; older ones are dropped. Does not wait.
    pub fn last_setpoint(&self) -> Option<Setpoint> {
        let mut last = None;
        // The number is limited, so a flood of setpoints does not block the driver.
        for _ in 0..64 {
            match self.next_setpoint() {
                Some(setpoint) => last = Some(setpoint),
                None => break,
            }
        }
        last
    }
}

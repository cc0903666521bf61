//! The driver's end of the link to an engine.

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::BackpressureStrategy;

use crate::link_end::{LinkEnd, Role};
use crate::node::Shared;
use crate::{Arm, Hello, HelloAck, IpcError, Setpoint, State};

/// The driver's place in the link.
const DRIVER: Role = Role {
    name: "driver",
    sends: "state",
    receives: "setpoint",
};

/// The driver's end: receives setpoints, sends states, answers handshakes. There is one for each
/// arm among all processes. It stays in the thread that opened it.
#[derive(Debug)]
pub struct DriverLink {
    hello: Server<Shared, Hello, (), HelloAck, ()>,
    // Last: the node in it is dropped after all ports.
    end: LinkEnd<State, Setpoint>,
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
        let end = LinkEnd::open(arm, DRIVER)?;
        let hello = end.handshake(|factory| {
            factory
                .server_builder()
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
        })?;
        Ok(Self { hello, end })
    }

    /// The arm.
    pub fn arm(&self) -> &Arm {
        self.end.arm()
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
    pub fn send(&self, state: &State) -> bool {
        self.end.send(state)
    }

    /// The oldest setpoint that was not read yet, unchecked. Does not wait.
    pub fn next_setpoint(&self) -> Option<Setpoint> {
        self.end.next()
    }

    /// Writes the oldest setpoint that was not read yet over another one, unchecked; says whether there
    /// was one. What has no meaning in it, as numbers of more joints, stays as it was. Does not wait.
    pub fn take_setpoint(&self, place: &mut Setpoint) -> bool {
        self.end.take(place)
    }

    /// The same with the newest setpoint; older ones are dropped.
    pub fn take_last_setpoint(&self, place: &mut Setpoint) -> bool {
        self.end.take_last(place)
    }

    /// The newest setpoint, unchecked; older ones are dropped. Does not wait.
    pub fn last_setpoint(&self) -> Option<Setpoint> {
        let mut place = Setpoint::default();
        self.take_last_setpoint(&mut place).then_some(place)
    }
}

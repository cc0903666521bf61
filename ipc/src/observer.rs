//! Reads the messages of an arm from outside: setpoints of the engine and states of the driver.

use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::Node;

use crate::node::{Shared, join, topic};
use crate::{Arm, IpcError, Setpoint, State};

/// Everybody's view of the cyclic messages of an arm. It takes part in nothing: neither engine nor
/// driver waits for it or hears of it. It stays in the thread that opened it.
#[derive(Debug)]
pub struct Observer {
    setpoints: Subscriber<Shared, Setpoint, ()>,
    states: Subscriber<Shared, State, ()>,
    // Last, so that it is dropped after its ports.
    _node: Node<Shared>,
}

impl Observer {
    /// Opens a view of `arm`, whether or not engine and driver are there.
    ///
    /// # Errors
    /// Everything that can go wrong with shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "observer")?;
        let fail = |operation, cause: String| IpcError::Failed {
            service: arm.to_string(),
            operation,
            cause,
        };
        let setpoints = topic::<Setpoint>(&node, arm, "setpoint")?
            .subscriber_builder()
            .create()
            .map_err(|cause| fail("opening the setpoints", format!("{cause:?}")))?;
        let states = topic::<State>(&node, arm, "state")?
            .subscriber_builder()
            .create()
            .map_err(|cause| fail("opening the states", format!("{cause:?}")))?;
        Ok(Self {
            setpoints,
            states,
            _node: node,
        })
    }

    /// The oldest setpoint that was not read yet, unchecked. Does not wait; who reads too seldom
    /// loses the oldest, which shows in their sequence.
    pub fn next_setpoint(&self) -> Option<Setpoint> {
        let sample = self.setpoints.receive().ok().flatten()?;
        Some(*sample)
    }

    /// The oldest state that was not read yet, unchecked. Does not wait.
    pub fn next_state(&self) -> Option<State> {
        let sample = self.states.receive().ok().flatten()?;
        Some(*sample)
    }
}

//! Reads the messages of an arm from outside: setpoints of the engine and states of the driver.

use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::Node;

use crate::node::{Shared, join, topic};
use crate::{Arm, IpcError, Setpoint, State};

/// Reads the cyclic messages of an arm. It has no effect: engine and driver do not wait for it and
/// do not know of it. It stays in the thread that opened it.
#[derive(Debug)]
pub struct Observer {
    setpoints: Subscriber<Shared, Setpoint, ()>,
    states: Subscriber<Shared, State, ()>,
    // Last, so that it is dropped after its ports.
    _node: Node<Shared>,
}

impl Observer {
    /// Opens an observer of `arm`, whether or not engine and driver run.
    ///
    /// # Errors
    /// Errors of shared memory.
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

    /// The oldest setpoint that was not read yet, unchecked. Does not wait; a slow reader loses the
    /// oldest setpoints, which shows in their sequence.
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

//! What both ends of the link between engine and driver have in common.

use core::fmt::Debug;

use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, Node, ZeroCopySend};
use iceoryx2::service::port_factory::request_response::PortFactory;

use crate::message::Message;
use crate::node::{Shared, exchange, inhabitants, join, topic};
use crate::{Arm, Hello, HelloAck, IpcError, room};

/// How many messages are read at once at most. A buffer has an end: whoever floods it does not hold
/// the reader.
const A_LOOK: usize = 64;

/// Which end of the link it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Role {
    /// Its name, shown to those who find it taken.
    pub(crate) name: &'static str,
    /// The topic that this end writes.
    pub(crate) sends: &'static str,
    /// The topic that this end reads.
    pub(crate) receives: &'static str,
}

/// One end of the link: sends messages `S`, receives messages `R`. There is one for each arm and
/// role among all processes.
#[derive(Debug)]
pub(crate) struct LinkEnd<S, R>
where
    S: Debug + ZeroCopySend + 'static,
    R: Debug + ZeroCopySend + 'static,
{
    arm: Arm,
    sender: Publisher<Shared, S, ()>,
    receiver: Subscriber<Shared, R, ()>,
    // Last, so that it is dropped after its ports.
    node: Node<Shared>,
}

impl<S, R> LinkEnd<S, R>
where
    S: Message + Debug + ZeroCopySend + 'static,
    R: Message + Debug + ZeroCopySend + 'static,
{
    /// Opens an end of `arm`, after cleaning up behind dead processes.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when a running process has it; errors of shared memory.
    pub(crate) fn open(arm: &Arm, role: Role) -> Result<Self, IpcError> {
        let node = join(arm, role.name)?;
        let factory = topic::<S>(&node, arm, role.sends)?;
        let sender = factory
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .max_loaned_samples(2)
            .create()
            .map_err(|cause| match cause {
                PublisherCreateError::ExceedsMaxSupportedPublishers => IpcError::Taken {
                    arm: arm.to_string(),
                    role: role.name,
                    owner: inhabitants(&factory, &node),
                },
                other => failed(arm, "opening what is sent", &other),
            })?;
        let receiver = topic::<R>(&node, arm, role.receives)?
            .subscriber_builder()
            .create()
            .map_err(|cause| failed(arm, "opening what is received", &cause))?;
        Ok(Self {
            arm: arm.clone(),
            sender,
            receiver,
            node,
        })
    }

    /// Opens a port of the handshake by `port`, and reserves the memory of the answers.
    ///
    /// # Errors
    /// Errors of shared memory.
    pub(crate) fn handshake<P, E: Debug>(
        &self,
        port: impl FnOnce(&PortFactory<Shared, Hello, (), HelloAck, ()>) -> Result<P, E>,
    ) -> Result<P, IpcError> {
        let factory = exchange::<Hello, HelloAck>(&self.node, &self.arm, "hello")?;
        let port =
            port(&factory).map_err(|cause| failed(&self.arm, "opening the handshake", &cause))?;
        room::reserve(self.arm.domain())?;
        Ok(port)
    }

    /// The arm.
    pub(crate) fn arm(&self) -> &Arm {
        &self.arm
    }

    /// Sends a message; says whether iceoryx2 took it. Does not wait, and does not allocate once
    /// the other end is connected. A slow reader loses its oldest message.
    #[expect(
        unsafe_code,
        reason = "an older message in shared memory is changed in place: decision 0138"
    )]
    pub(crate) fn send(&self, message: &S) -> bool {
        let Ok(mut place) = self.sender.loan_uninit() else {
            return false;
        };
        // SAFETY: the memory has an older message, or the zeros that the kernel gave. A message has
        // only numbers, for which any bytes are a value, and no byte between them.
        let filled = unsafe {
            message.write_over(place.payload_mut().assume_init_mut());
            place.assume_init()
        };
        filled.send().is_ok()
    }

    /// The oldest message that was not read yet, unchecked. Does not wait.
    pub(crate) fn next(&self) -> Option<R> {
        self.receiver.receive().ok().flatten().map(|sample| *sample)
    }

    /// Writes the oldest message that was not read yet over another one, unchecked; says whether there
    /// was one. Does not wait.
    pub(crate) fn take(&self, place: &mut R) -> bool {
        let sample = self.receiver.receive().ok().flatten();
        sample
            .as_deref()
            .map(|message| message.write_over(place))
            .is_some()
    }

    /// Writes the newest message over another one, unchecked; older ones are dropped. Says whether
    /// there was one. Does not wait.
    pub(crate) fn take_last(&self, place: &mut R) -> bool {
        let mut last = None;
        for _ in 0..A_LOOK {
            match self.receiver.receive() {
                Ok(Some(sample)) => last = Some(sample),
                _ => break,
            }
        }
        last.as_deref()
            .map(|message| message.write_over(place))
            .is_some()
    }
}

/// What iceoryx2 refused.
fn failed(arm: &Arm, operation: &'static str, cause: &impl Debug) -> IpcError {
    IpcError::Failed {
        service: arm.to_string(),
        operation,
        cause: format!("{cause:?}"),
    }
}

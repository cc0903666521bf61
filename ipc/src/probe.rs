//! A plain message exchange over iceoryx2, to measure the transport itself.

use core::hint::black_box;

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, Node};

use crate::node::{Shared, join, topic};
use crate::{Arm, IpcError, Setpoint};

/// Plain bytes, as many as a setpoint has.
type Bytes = [u64; size_of::<Setpoint>() / 8];

/// One end of a plain exchange of messages of a setpoint's size: no checks, no protocol. The
/// reference of `canter doctor` and of the benchmarks.
#[derive(Debug)]
pub struct Probe {
    publisher: Publisher<Shared, Bytes, ()>,
    subscriber: Subscriber<Shared, Bytes, ()>,
    _node: Node<Shared>,
}

impl Probe {
    /// Opens the end that asks, or the one that answers.
    ///
    /// # Errors
    /// Errors of shared memory.
    pub fn open(arm: &Arm, asks: bool) -> Result<Self, IpcError> {
        let node = join(arm, "probe")?;
        let (out, back) = if asks {
            ("ping", "pong")
        } else {
            ("pong", "ping")
        };
        let fail = |cause: String| IpcError::Failed {
            service: arm.to_string(),
            operation: "opening the probe",
            cause,
        };
        let publisher = topic::<Bytes>(&node, arm, out)?
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| fail(format!("{cause:?}")))?;
        let subscriber = topic::<Bytes>(&node, arm, back)?
            .subscriber_builder()
            .create()
            .map_err(|cause| fail(format!("{cause:?}")))?;
        Ok(Self {
            publisher,
            subscriber,
            _node: node,
        })
    }

    /// Sends a message full of `number`.
    pub fn send(&self, number: u64) -> bool {
        self.publisher.send_copy([number; _]).is_ok()
    }

    /// The number of the oldest message not read yet; reads the whole message. Does not wait.
    pub fn receive(&self) -> Option<u64> {
        let sample = self.subscriber.receive().ok().flatten()?;
        let bytes: Bytes = *sample;
        black_box(&bytes).first().copied()
    }

    /// The same, but only the number is read: the rest stays in the sender's cache. Does not wait.
    pub fn glance(&self) -> Option<u64> {
        let sample = self.subscriber.receive().ok().flatten()?;
        sample.first().copied()
    }
}

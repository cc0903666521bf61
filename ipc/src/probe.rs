//! A plain message exchange over iceoryx2, to measure the transport itself.

use core::hint::black_box;

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{BackpressureStrategy, Node};

use crate::node::{Shared, join, topic};
use crate::{Arm, IpcError, Setpoint, State};

/// Words of 8 bytes in a setpoint.
const SETPOINT: usize = size_of::<Setpoint>() / 8;
/// Words of 8 bytes in a state.
const STATE: usize = size_of::<State>() / 8;

/// The end that asks: it sends as many bytes as a setpoint has and gets as many as a state has.
pub type AskingProbe = Probe<SETPOINT, STATE>;
/// The end that answers: it gets as many bytes as a setpoint has and sends as many as a state has.
pub type AnsweringProbe = Probe<STATE, SETPOINT>;

/// One end of a plain exchange of messages of `OUT` and `BACK` words: no checks, no protocol. The
/// reference of `canter doctor` and of the benchmarks.
#[derive(Debug)]
pub struct Probe<const OUT: usize, const BACK: usize> {
    publisher: Publisher<Shared, [u64; OUT], ()>,
    subscriber: Subscriber<Shared, [u64; BACK], ()>,
    _node: Node<Shared>,
}

impl AskingProbe {
    /// Opens the end that asks.
    ///
    /// # Errors
    /// Errors of shared memory.
    pub fn asking(arm: &Arm) -> Result<Self, IpcError> {
        Self::open(arm, "ping", "pong")
    }
}

impl AnsweringProbe {
    /// Opens the end that answers.
    ///
    /// # Errors
    /// Errors of shared memory.
    pub fn answering(arm: &Arm) -> Result<Self, IpcError> {
        Self::open(arm, "pong", "ping")
    }
}

impl<const OUT: usize, const BACK: usize> Probe<OUT, BACK> {
    fn open(arm: &Arm, out: &str, back: &str) -> Result<Self, IpcError> {
        let node = join(arm, "probe")?;
        let fail = |cause: String| IpcError::Failed {
            service: arm.to_string(),
            operation: "opening the probe",
            cause,
        };
        let publisher = topic::<[u64; OUT]>(&node, arm, out)?
            .publisher_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| fail(format!("{cause:?}")))?;
        let subscriber = topic::<[u64; BACK]>(&node, arm, back)?
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
        let words: [u64; BACK] = *sample;
        black_box(&words).first().copied()
    }

    /// The same, but only the number is read: the rest stays in the sender's cache. Does not wait.
    pub fn glance(&self) -> Option<u64> {
        let sample = self.subscriber.receive().ok().flatten()?;
        sample.first().copied()
    }
}

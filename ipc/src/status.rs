//! The engine's status report for any process.

use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, Node};
use serde::Serialize;

use crate::node::{Shared, inhabitants, join, text_topic};
use crate::request::LONGEST_ANSWER;
use crate::{Arm, IpcError, room};

/// The engine's status report for any process, as JSON. Write it a few times per second: a new
/// reader gets the next one.
#[derive(Debug)]
pub struct StatusWriter {
    service: String,
    publisher: Publisher<Shared, [u8], ()>,
    _node: Node<Shared>,
}

impl StatusWriter {
    /// Opens the report of `arm` for writing.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when another engine writes it.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "status")?;
        let factory = text_topic(&node, arm, "status")?;
        let publisher = factory
            .publisher_builder()
            .initial_max_slice_len(LONGEST_ANSWER)
            .allocation_strategy(AllocationStrategy::Static)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| match cause {
                PublisherCreateError::ExceedsMaxSupportedPublishers => IpcError::Taken {
                    arm: arm.to_string(),
                    role: "status",
                    owner: inhabitants(&factory, &node),
                },
                other => IpcError::Failed {
                    service: arm.service("status"),
                    operation: "opening the status",
                    cause: format!("{other:?}"),
                },
            })?;
        room::reserve(arm.domain())?;
        Ok(Self {
            service: arm.service("status"),
            publisher,
            _node: node,
        })
    }

    /// Publishes a report.
    ///
    /// # Errors
    /// [`IpcError::Failed`] when it cannot be written or sent.
    pub fn write(&self, report: &impl Serialize) -> Result<(), IpcError> {
        let fail = |cause: String| IpcError::Failed {
            service: self.service.clone(),
            operation: "publishing the status",
            cause,
        };
        let text = serde_json::to_vec(report).map_err(|cause| fail(cause.to_string()))?;
        let sample = self
            .publisher
            .loan_slice_uninit(text.len())
            .map_err(|cause| fail(format!("{cause:?}")))?
            .write_from_slice(&text);
        sample.send().map_err(|cause| fail(format!("{cause:?}")))?;
        Ok(())
    }
}

/// Everybody's view of the engine's report.
#[derive(Debug)]
pub struct StatusReader {
    service: String,
    subscriber: Subscriber<Shared, [u8], ()>,
    _node: Node<Shared>,
}

impl StatusReader {
    /// Opens the report of `arm` for reading.
    ///
    /// # Errors
    /// Errors of shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "status reader")?;
        let service = arm.service("status");
        let subscriber = text_topic(&node, arm, "status")?
            .subscriber_builder()
            .create()
            .map_err(|cause| IpcError::Failed {
                service: service.clone(),
                operation: "opening the status",
                cause: format!("{cause:?}"),
            })?;
        room::reserve(arm.domain())?;
        Ok(Self {
            service,
            subscriber,
            _node: node,
        })
    }

    /// The oldest report that was not read yet. Does not wait.
    ///
    /// # Errors
    /// [`IpcError::BadText`] when it is not JSON.
    pub fn read(&self) -> Result<Option<serde_json::Value>, IpcError> {
        let Some(sample) = self.subscriber.receive().ok().flatten() else {
            return Ok(None);
        };
        let cut = &sample.payload()[..sample.payload().len().min(LONGEST_ANSWER)];
        serde_json::from_slice(cut)
            .map(Some)
            .map_err(|cause| IpcError::BadText {
                service: self.service.clone(),
                cause: cause.to_string(),
            })
    }
}

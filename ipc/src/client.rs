//! The client's end of the client channel.

use core::fmt::Debug;
use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client as Port;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, Node};

use crate::node::{Shared, join, text_exchange};
use crate::request::Received;
use crate::ticket::Ticket;
use crate::{Answer, Arm, Identity, IpcError, Request, RequestId, Verb, room};

/// How long a client waits for the answer of an engine that has taken its request.
const WORD: Duration = Duration::from_secs(3);

/// A request that waits for its answer.
type Pending = PendingResponse<Shared, [u8], (), [u8], ()>;

/// The client's end of the client channel.
#[derive(Debug)]
pub struct Client {
    arm: Arm,
    identity: Identity,
    port: Port<Shared, [u8], (), [u8], ()>,
    _node: Node<Shared>,
}

impl Client {
    /// Opens the channel of `arm` as a client called `name`.
    ///
    /// # Errors
    /// Errors of shared memory.
    pub fn open(arm: &Arm, name: &str) -> Result<Self, IpcError> {
        let node = join(arm, "client")?;
        let port = text_exchange(&node, arm, "client")?
            .client_builder()
            .initial_max_slice_len(4096)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| IpcError::Failed {
                service: arm.service("client"),
                operation: "opening the client channel",
                cause: format!("{cause:?}"),
            })?;
        room::reserve(arm.domain())?;
        let identity = Identity {
            name: name.to_owned(),
            process: std::process::id(),
        };
        Ok(Self {
            arm: arm.clone(),
            identity,
            port,
            _node: node,
        })
    }

    /// Asks and waits for the answer up to `timeout`. Without an answer the request is withdrawn:
    /// it was not executed and will not be.
    ///
    /// # Errors
    /// [`IpcError::NoAnswer`] when no engine took the request, [`IpcError::NoWord`] when the engine
    /// took it and then did not answer for three more seconds, [`IpcError::BadText`] when the
    /// answer cannot be read.
    pub fn ask(&self, ask: Verb, timeout: Duration) -> Result<Answer, IpcError> {
        let id = RequestId::new();
        let ticket = ask
            .can_be_withdrawn()
            .then(|| Ticket::issue(self.arm.domain(), id))
            .transpose()?;
        let request = Request {
            id,
            client: self.identity.clone(),
            ask,
        };
        let pending = self.send(&request)?;
        if let Some(answer) = self.wait(&pending, id, timeout)? {
            return Ok(answer);
        }
        let arm = self.arm.to_string();
        if ticket.is_none_or(Ticket::withdraw) {
            return Err(IpcError::NoAnswer {
                arm,
                role: "engine",
                waited_ms: timeout.as_millis() as u64,
            });
        }
        // It has taken the request, so it runs, or did a moment ago.
        let answer = self.wait(&pending, id, WORD)?;
        answer.ok_or(IpcError::NoWord { arm })
    }

    fn send(&self, request: &Request) -> Result<Pending, IpcError> {
        let text = serde_json::to_vec(request).map_err(|cause| self.failed(&cause))?;
        self.port
            .loan_slice_uninit(text.len())
            .map_err(|cause| self.failed(&cause))?
            .write_from_slice(&text)
            .send()
            .map_err(|cause| self.failed(&cause))
    }

    /// The answer to request `id`; those to others are dropped.
    fn wait(
        &self,
        pending: &Pending,
        id: RequestId,
        timeout: Duration,
    ) -> Result<Option<Answer>, IpcError> {
        let end = Instant::now() + timeout;
        loop {
            // The time is checked before polling: an answer that came just before the end is still
            // read.
            let over = Instant::now() >= end || pending.number_of_server_connections() == 0;
            let answer = pending.receive().map_err(|cause| self.failed(&cause))?;
            match answer {
                Some(answer) => {
                    let read = serde_json::from_slice::<Received>(answer.payload());
                    let received = read.map_err(|cause| IpcError::BadText {
                        service: self.arm.service("client"),
                        cause: cause.to_string(),
                    })?;
                    if received.id == id {
                        return Ok(Some(received.answer));
                    }
                }
                None if over => return Ok(None),
                None => sleep(Duration::from_micros(500)),
            }
        }
    }

    fn failed(&self, cause: &impl Debug) -> IpcError {
        IpcError::Failed {
            service: self.arm.service("client"),
            operation: "asking the engine",
            cause: format!("{cause:?}"),
        }
    }
}

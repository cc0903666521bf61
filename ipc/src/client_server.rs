//! The engine's end of the client channel.

use core::cell::Cell;
use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::port::ReceiveError;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, Node};
use iceoryx2::service::port_factory::server::ServerCreateError;
use serde::Deserialize;

use crate::node::{Shared, inhabitants, join, text_exchange};
use crate::request::LONGEST_ANSWER;
use crate::{Answer, Arm, IpcError, Request, RequestId, room, ticket};

/// The longest request that is read (bytes).
const LONGEST: usize = 16 << 20;

/// Number of requests per turn. No client has more than two of them, so each of sixteen clients is
/// served, however many requests the others send.
const BATCH: usize = 32;

/// How long an answer stays readable when the engine ends: dropping the channel removes it.
const FAREWELL: Duration = Duration::from_millis(200);

/// The engine's end of the client channel. Dropping it waits a moment for the last answer to be
/// read.
#[derive(Debug)]
pub struct ClientServer {
    arm: Arm,
    answered: Cell<Option<Instant>>,
    server: Server<Shared, [u8], (), [u8], ()>,
    _node: Node<Shared>,
}

impl ClientServer {
    /// Opens the channel of `arm` as its engine.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when another engine serves this arm.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "engine for clients")?;
        let factory = text_exchange(&node, arm, "client")?;
        ticket::sweep(arm.domain());
        // All the memory it will ever need: it must not allocate more while the arm moves.
        let server = factory
            .server_builder()
            .initial_max_slice_len(LONGEST_ANSWER)
            .allocation_strategy(AllocationStrategy::Static)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| match cause {
                ServerCreateError::ExceedsMaxSupportedServers => IpcError::Taken {
                    arm: arm.to_string(),
                    role: "engine for clients",
                    owner: inhabitants(&factory, &node),
                },
                other => IpcError::Failed {
                    service: arm.service("client"),
                    operation: "opening the client channel",
                    cause: format!("{other:?}"),
                },
            })?;
        room::reserve(arm.domain())?;
        Ok(Self {
            arm: arm.clone(),
            answered: Cell::new(None),
            server,
            _node: node,
        })
    }

    /// Answers the waiting requests with `handle`, at most two per client and 32 in all; returns
    /// how many there were. A request that cannot be read is refused without calling `handle`; one
    /// that its sender has withdrawn is dropped. Does not wait.
    ///
    /// # Errors
    /// [`IpcError::Failed`] when iceoryx2 could not receive.
    pub fn serve(&self, mut handle: impl FnMut(Request) -> Answer) -> Result<usize, IpcError> {
        let mut batch = Vec::new();
        while batch.len() < BATCH {
            match self.server.receive() {
                Ok(Some(request)) => batch.push(request),
                // As long as these are held, a client with two waiting requests leaves room for
                // others.
                Ok(None) | Err(ReceiveError::ExceedsMaxBorrows) => break,
                // Received requests must be answered first; the next turn finds the error again.
                Err(_) if !batch.is_empty() => break,
                Err(cause) => {
                    return Err(IpcError::Failed {
                        service: self.arm.service("client"),
                        operation: "receiving",
                        cause: format!("{cause:?}"),
                    });
                }
            }
        }
        for request in &batch {
            let Some(text) = self.answer(request.payload(), &mut handle) else {
                continue;
            };
            // A client that has ended needs no answer; full memory is reported to the next one.
            let sent = request.loan_slice_uninit(text.len());
            if sent.is_ok_and(|response| response.write_from_slice(&text).send().is_ok()) {
                self.answered.set(Some(Instant::now()));
            }
        }
        Ok(batch.len())
    }

    /// The answer to a request; `None` if its sender no longer waits for it.
    fn answer(&self, bytes: &[u8], handle: &mut impl FnMut(Request) -> Answer) -> Option<Vec<u8>> {
        if bytes.len() > LONGEST {
            return None;
        }
        match serde_json::from_slice::<Request>(bytes) {
            Ok(request) => {
                let id = request.id;
                if request.ask.can_be_withdrawn() && !ticket::take(self.arm.domain(), id) {
                    return None;
                }
                handle(request).encode(id).ok()
            }
            Err(cause) => {
                let numbered = serde_json::from_slice::<Numbered>(bytes).ok()?;
                let answer = Answer::refuse(format!("cannot read the request: {cause}"));
                answer.encode(numbered.id).ok()
            }
        }
    }
}

/// As much of a request as an answer needs.
#[derive(Deserialize)]
struct Numbered {
    id: RequestId,
}

impl Drop for ClientServer {
    fn drop(&mut self) {
        if let Some(at) = self.answered.get() {
            sleep(FAREWELL.saturating_sub(at.elapsed()));
        }
    }
}

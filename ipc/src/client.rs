//! Requests of operators to a running engine, and its report back.

use core::cell::Cell;
use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::port::client::Client as Port;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::server::Server;

use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, Node};
use iceoryx2::service::port_factory::server::ServerCreateError;
use serde::{Deserialize, Serialize};

use crate::node::{Shared, inhabitants, join, text_exchange, text_topic};
use crate::{Arm, IpcError};

/// The longest request or answer that is read (bytes).
const LONGEST: usize = 16 << 20;

/// What an operator asks of a running engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verb", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Verb {
    /// Execute a program.
    Submit {
        /// `text` or `json`.
        format: String,
        /// The program's name, for messages.
        name: String,
        /// The program.
        program: String,
    },
    /// Stop on the path and stay there until `Resume`.
    Pause,
    /// Go on along the path.
    Resume,
    /// Share of the planned speed.
    Override {
        /// 0..=1.
        share: f64,
    },
    /// Stop on the path.
    Stop {
        /// With all that the joints have, instead of gently.
        fast: bool,
    },
    /// Stop on the path and forget what is queued.
    Abort,
    /// Clear a latched fault and open a new session with the driver.
    Recover,
    /// Move by hand; stops when no further request comes in time.
    Jog {
        /// `joint` or `tool`.
        space: String,
        /// Speeds as shares of the largest, -1..=1: one a joint, or x, y, z, rx, ry, rz of the
        /// tool's own axes; all 0 stops.
        speeds: Vec<f64>,
        /// The arm stops when no further request comes for this long (ms).
        timeout_ms: u64,
    },
    /// Report.
    Status,
    /// What has happened.
    Notes {
        /// Number of the last note that is known; only later ones are asked for.
        since: u64,
    },
    /// Stop on the path and end the engine.
    Shutdown,
}

impl Verb {
    /// Whether only the client that commands the arm may ask this. Stopping, pausing and asking
    /// is everybody's.
    pub fn commands(&self) -> bool {
        matches!(
            self,
            Self::Submit { .. }
                | Self::Resume
                | Self::Override { .. }
                | Self::Recover
                | Self::Jog { .. }
                | Self::Shutdown
        )
    }
}

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// A name a person understands.
    pub name: String,
    /// The process number.
    pub process: u32,
}

/// A request with its sender.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Who asks.
    pub client: Identity,
    /// What for.
    pub ask: Verb,
}

/// The engine's answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Whether the engine does it.
    pub accepted: bool,
    /// One sentence for a person; empty where there is nothing to say.
    pub message: String,
    /// Details for a program.
    pub body: serde_json::Value,
}

impl Answer {
    /// Yes, with details.
    pub fn accept(body: serde_json::Value) -> Self {
        Self {
            accepted: true,
            message: String::new(),
            body,
        }
    }

    /// No, and why.
    pub fn refuse(message: impl Into<String>) -> Self {
        Self {
            accepted: false,
            message: message.into(),
            body: serde_json::Value::Null,
        }
    }
}

/// Which client commands the arm. A commanding client that is dead, or that has let go, makes
/// place for the next.
#[derive(Clone, Debug, Default)]
pub struct Ownership {
    owner: Option<Identity>,
}

impl Ownership {
    /// Whether `request` may be obeyed; takes ownership where nobody has it. `busy` says whether
    /// a program of the owner is still under way: an idle arm belongs to whoever comes.
    ///
    /// # Errors
    /// The refusal, with the owner's name.
    pub fn admit(&mut self, request: &Request, busy: bool) -> Result<(), Answer> {
        if !request.ask.commands() {
            return Ok(());
        }
        match &self.owner {
            Some(owner) if *owner != request.client && busy && is_alive(owner.process) => {
                Err(Answer::refuse(format!(
                    "the arm is commanded by {:?} (process {})",
                    owner.name, owner.process
                )))
            }
            _ => {
                self.owner = Some(request.client.clone());
                Ok(())
            }
        }
    }

    /// Who commands.
    pub fn owner(&self) -> Option<&Identity> {
        self.owner.as_ref()
    }
}

/// Whether a process of this number exists.
fn is_alive(process: u32) -> bool {
    std::path::Path::new("/proc")
        .join(process.to_string())
        .exists()
}

/// How long an answer stays readable when the engine leaves: dropping the channel takes it away.
const FAREWELL: Duration = Duration::from_millis(200);

/// The engine's end of the client channel. Dropping it waits a moment for the last answer to be
/// read.
#[derive(Debug)]
pub struct ClientServer {
    service: String,
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
        let server = factory
            .server_builder()
            .initial_max_slice_len(4096)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
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
        Ok(Self {
            service: arm.service("client"),
            answered: Cell::new(None),
            server,
            _node: node,
        })
    }

    /// Answers one request with `handle`, if one waits; says whether one did. A request that
    /// cannot be read is refused without asking `handle`. Does not wait.
    ///
    /// # Errors
    /// [`IpcError::Failed`] when iceoryx2 could not receive or could not send the answer.
    pub fn serve(&self, handle: impl FnOnce(Request) -> Answer) -> Result<bool, IpcError> {
        let fail = |operation, cause: String| IpcError::Failed {
            service: self.service.clone(),
            operation,
            cause,
        };
        let Some(request) = self
            .server
            .receive()
            .map_err(|cause| fail("receiving", format!("{cause:?}")))?
        else {
            return Ok(false);
        };
        let bytes = request.payload();
        let answer = if bytes.len() > LONGEST {
            Answer::refuse(format!("a request of {} bytes is too long", bytes.len()))
        } else {
            match serde_json::from_slice::<Request>(bytes) {
                Ok(request) => handle(request),
                Err(cause) => Answer::refuse(format!("cannot read the request: {cause}")),
            }
        };
        let text = serde_json::to_vec(&answer)
            .map_err(|cause| fail("writing the answer", cause.to_string()))?;
        let response = request
            .loan_slice_uninit(text.len())
            .map_err(|cause| fail("answering", format!("{cause:?}")))?
            .write_from_slice(&text);
        response
            .send()
            .map_err(|cause| fail("answering", format!("{cause:?}")))?;
        self.answered.set(Some(Instant::now()));
        Ok(true)
    }
}

impl Drop for ClientServer {
    fn drop(&mut self) {
        if let Some(at) = self.answered.get() {
            sleep(FAREWELL.saturating_sub(at.elapsed()));
        }
    }
}

/// An operator's end of the client channel.
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
    /// Everything that can go wrong with shared memory.
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

    /// Asks and waits for the answer up to `timeout`.
    ///
    /// # Errors
    /// [`IpcError::NoAnswer`] without an engine, [`IpcError::BadText`] when the answer cannot be
    /// read.
    pub fn ask(&self, ask: Verb, timeout: Duration) -> Result<Answer, IpcError> {
        let end = Instant::now() + timeout;
        let request = Request {
            client: self.identity.clone(),
            ask,
        };
        let service = || self.arm.service("client");
        let fail = |cause: String| IpcError::Failed {
            service: service(),
            operation: "asking the engine",
            cause,
        };
        let text = serde_json::to_vec(&request).map_err(|cause| fail(cause.to_string()))?;
        let pending = self
            .port
            .loan_slice_uninit(text.len())
            .map_err(|cause| fail(format!("{cause:?}")))?
            .write_from_slice(&text)
            .send()
            .map_err(|cause| fail(format!("{cause:?}")))?;
        loop {
            // Asked before the look: an answer that came just before the end is still read.
            let over = Instant::now() >= end || pending.number_of_server_connections() == 0;
            let answer = pending
                .receive()
                .map_err(|cause| fail(format!("{cause:?}")))?;
            match answer {
                Some(answer) => {
                    return serde_json::from_slice(answer.payload()).map_err(|cause| {
                        IpcError::BadText {
                            service: service(),
                            cause: cause.to_string(),
                        }
                    });
                }
                None if over => break,
                None => sleep(Duration::from_micros(500)),
            }
        }
        let waited_ms = timeout.as_millis() as u64;
        Err(IpcError::NoAnswer {
            arm: self.arm.to_string(),
            role: "engine",
            waited_ms,
        })
    }
}

/// The engine's report to everybody, as JSON. Write it a few times a second: who comes late reads
/// the next one.
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
            .initial_max_slice_len(4096)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
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
    /// Everything that can go wrong with shared memory.
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
        let cut = &sample.payload()[..sample.payload().len().min(LONGEST)];
        serde_json::from_slice(cut)
            .map(Some)
            .map_err(|cause| IpcError::BadText {
                service: self.service.clone(),
                cause: cause.to_string(),
            })
    }
}

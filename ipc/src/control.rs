//! Requests that act on the current motion, on a separate channel.
//!
//! They are small messages of fixed size, so the thread that executes them reads no text and
//! allocates no memory. They are separate from the requests of [`crate::Client`], so no other
//! request delays them.

use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::port::client::Client;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{BackpressureStrategy, Node, ZeroCopySend};
use iceoryx2::service::port_factory::request_response::PortFactory;
use iceoryx2::service::port_factory::server::ServerCreateError;

use crate::node::{ENGINE, Shared, control_exchange, inhabitants, join};
use crate::{Arm, IpcError, PROTOCOL, RequestId, bytes_of, room, text_of};

/// The kind of service of an arm.
const KIND: &str = "control";

/// How long a client sleeps between two looks for its answer.
const LOOK: Duration = Duration::from_micros(100);

/// A request about the current motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ControlAsk {
    /// Say where the motion is.
    Look,
    /// Stop on the path and stay there until `Resume`.
    Pause,
    /// Go on along the path.
    Resume,
    /// Share of the planned speed, 0..=1.
    Override(f64),
    /// Stop on the path.
    Stop {
        /// With all that the joints have, instead of gently.
        fast: bool,
    },
    /// Stop on the path and drop the queue. A pause or stop that is in force is over.
    Abort,
    /// Stop on the path and drop the queue; a pause or stop that is in force stays. For a client
    /// that ends its own motion, and has no right to free an arm that an operator stopped.
    Discard {
        /// With all that the joints have, instead of gently.
        fast: bool,
    },
    /// Clear the latched fault and open a new session with the driver.
    Recover,
}

/// A request on the wire.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.Control.2")]
pub struct ControlRequest {
    /// Protocol version.
    pub protocol: u32,
    /// What is asked, by number.
    pub kind: u32,
    /// Share of the planned speed, where it is about that.
    pub share: f64,
    /// Process number of the client.
    pub process: u32,
    /// For later; 0.
    pub reserved: u32,
    /// When it asked (ns since 1970); with the process number this tells requests apart.
    pub asked_ns: u64,
}

impl ControlRequest {
    /// The message of a request of this process.
    pub fn new(ask: ControlAsk) -> Self {
        let (kind, share) = match ask {
            ControlAsk::Look => (0, 0.0),
            ControlAsk::Pause => (1, 0.0),
            ControlAsk::Resume => (2, 0.0),
            ControlAsk::Override(share) => (3, share),
            ControlAsk::Stop { fast: false } => (4, 0.0),
            ControlAsk::Stop { fast: true } => (5, 0.0),
            ControlAsk::Abort => (6, 0.0),
            ControlAsk::Recover => (7, 0.0),
            ControlAsk::Discard { fast: false } => (8, 0.0),
            ControlAsk::Discard { fast: true } => (9, 0.0),
        };
        let id = RequestId::new();
        Self {
            protocol: PROTOCOL,
            kind,
            share,
            process: id.process,
            reserved: 0,
            asked_ns: id.asked_ns,
        }
    }

    /// What is asked.
    ///
    /// # Errors
    /// The sentence for the client: another protocol, nothing that is known, or a share that is
    /// not within 0 to 1.
    pub fn ask(&self) -> Result<ControlAsk, String> {
        if self.protocol != PROTOCOL {
            return Err(format!(
                "the engine speaks protocol {PROTOCOL}, the request is of protocol {}",
                self.protocol
            ));
        }
        Ok(match self.kind {
            0 => ControlAsk::Look,
            1 => ControlAsk::Pause,
            2 => ControlAsk::Resume,
            3 if (0.0..=1.0).contains(&self.share) => ControlAsk::Override(self.share),
            3 => return Err(format!("an override is 0 to 1, got {}", self.share)),
            4 => ControlAsk::Stop { fast: false },
            5 => ControlAsk::Stop { fast: true },
            6 => ControlAsk::Abort,
            7 => ControlAsk::Recover,
            8 => ControlAsk::Discard { fast: false },
            9 => ControlAsk::Discard { fast: true },
            other => return Err(format!("this engine knows no control {other}")),
        })
    }
}

/// An answer on the wire: what was reached when the order acted.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.Controlled.2")]
pub struct ControlAnswer {
    /// Protocol version.
    pub protocol: u32,
    /// 1 where the engine does it, 0 where it refuses.
    pub accepted: u32,
    /// Whether the arm rests, 0 or 1.
    pub resting: u32,
    /// Whether a pause or stop holds the arm, 0 or 1.
    pub held: u32,
    /// Whether nothing is left to execute, 0 or 1.
    pub idle: u32,
    /// Number of the latched fault, 0 without one.
    pub fault: u32,
    /// Servo period of this report: the first in which the order acted, or a later one.
    pub tick: u64,
    /// Share of the planned speed in that period; 0 at rest.
    pub time_scaling: f64,
    /// Process number of the client that asked.
    pub process: u32,
    /// For later; 0.
    pub reserved: u32,
    /// When it asked, as in the request.
    pub asked_ns: u64,
    /// Why it is refused, UTF-8, filled up with 0.
    pub reason: [u8; 192],
}

impl ControlAnswer {
    /// No, and why.
    pub fn refuse(reason: &str) -> Self {
        Self {
            protocol: PROTOCOL,
            accepted: 0,
            resting: 0,
            held: 0,
            idle: 0,
            fault: 0,
            tick: 0,
            time_scaling: 0.0,
            process: 0,
            reserved: 0,
            asked_ns: 0,
            reason: bytes_of(reason),
        }
    }

    /// Why it is refused.
    pub fn reason(&self) -> String {
        text_of(&self.reason)
    }
}

type Exchange = PortFactory<Shared, ControlRequest, (), ControlAnswer, ()>;

/// The engine's end of the control channel. It stays in the thread that opened it.
#[derive(Debug)]
pub struct ControlServer {
    server: Server<Shared, ControlRequest, (), ControlAnswer, ()>,
    // Last, so that it is dropped after its port.
    _node: Node<Shared>,
}

/// A request that waits for its answer.
#[derive(Debug)]
pub struct Controlled {
    /// The request, unchecked.
    pub request: ControlRequest,
    active: ActiveRequest<Shared, ControlRequest, (), ControlAnswer, ()>,
}

impl Controlled {
    /// Answers, with the number of the request; says whether iceoryx2 took the answer.
    pub fn answer(&self, answer: ControlAnswer) -> bool {
        let numbered = ControlAnswer {
            process: self.request.process,
            asked_ns: self.request.asked_ns,
            ..answer
        };
        self.active.send_copy(numbered).is_ok()
    }
}

impl ControlServer {
    /// Opens the control channel of `arm` as its engine.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when another engine serves this arm.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, ENGINE)?;
        let factory: Exchange = control_exchange(&node, arm, KIND)?;
        let server = factory
            .server_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| match cause {
                ServerCreateError::ExceedsMaxSupportedServers => IpcError::Taken {
                    arm: arm.to_string(),
                    role: ENGINE,
                    owner: inhabitants(&factory, &node),
                },
                other => failed(arm, "opening the control channel", &other),
            })?;
        room::reserve(arm.domain())?;
        Ok(Self {
            server,
            _node: node,
        })
    }

    /// The oldest request that was not read yet. Does not wait.
    pub fn next(&self) -> Option<Controlled> {
        let active = self.server.receive().ok().flatten()?;
        Some(Controlled {
            request: *active.payload(),
            active,
        })
    }
}

/// An operator's end of the control channel.
#[derive(Debug)]
pub struct ControlClient {
    arm: Arm,
    port: Client<Shared, ControlRequest, (), ControlAnswer, ()>,
    // Last, so that it is dropped after its port.
    _node: Node<Shared>,
}

impl ControlClient {
    /// Opens the control channel of `arm`.
    ///
    /// # Errors
    /// Everything that can go wrong with shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let node = join(arm, "control client")?;
        let factory: Exchange = control_exchange(&node, arm, KIND)?;
        let port = factory
            .client_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| failed(arm, "opening the control channel", &cause))?;
        room::reserve(arm.domain())?;
        Ok(Self {
            arm: arm.clone(),
            port,
            _node: node,
        })
    }

    /// Asks and waits for the answer up to `timeout`.
    ///
    /// # Errors
    /// [`IpcError::NoAnswer`] without an engine.
    pub fn ask(&self, ask: ControlAsk, timeout: Duration) -> Result<ControlAnswer, IpcError> {
        let end = Instant::now() + timeout;
        let request = ControlRequest::new(ask);
        let pending = self
            .port
            .send_copy(request)
            .map_err(|cause| failed(&self.arm, "asking the engine", &cause))?;
        loop {
            // Asked before the look: an answer that came just before the end is still read.
            let over = Instant::now() >= end || pending.number_of_server_connections() == 0;
            let answer = pending
                .receive()
                .map_err(|cause| failed(&self.arm, "asking the engine", &cause))?;
            match answer {
                Some(answer)
                    if (answer.process, answer.asked_ns) == (request.process, request.asked_ns) =>
                {
                    return Ok(*answer);
                }
                // An answer to another client.
                Some(_) => {}
                None if over => break,
                None => sleep(LOOK),
            }
        }
        Err(IpcError::NoAnswer {
            arm: self.arm.to_string(),
            role: "engine",
            waited_ms: timeout.as_millis() as u64,
        })
    }
}

fn failed(arm: &Arm, operation: &'static str, cause: &impl core::fmt::Debug) -> IpcError {
    IpcError::Failed {
        service: arm.service(KIND),
        operation,
        cause: format!("{cause:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_comes_over_whole() {
        let asks = [
            ControlAsk::Look,
            ControlAsk::Pause,
            ControlAsk::Resume,
            ControlAsk::Override(0.25),
            ControlAsk::Stop { fast: false },
            ControlAsk::Stop { fast: true },
            ControlAsk::Abort,
            ControlAsk::Recover,
            ControlAsk::Discard { fast: false },
            ControlAsk::Discard { fast: true },
        ];
        for ask in asks {
            assert_eq!(ControlRequest::new(ask).ask(), Ok(ask));
        }
    }

    #[test]
    fn any_bytes_are_a_request_that_is_refused() {
        let good = ControlRequest::new(ControlAsk::Pause);
        for share in [f64::NAN, -0.1, 1.1, f64::INFINITY] {
            assert!(
                ControlRequest::new(ControlAsk::Override(share))
                    .ask()
                    .is_err()
            );
        }
        assert!(ControlRequest { kind: 99, ..good }.ask().is_err());
        let other = ControlRequest {
            protocol: 77,
            ..good
        };
        assert!(other.ask().unwrap_err().contains("77"));
    }
}

//! Listens, and gives each connection a thread of its own.

use std::io::Write;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::Duration;

use crcl::xml::{CommandState, CommandStatus, Status, write_status};
use ipc::Arm;
use thiserror::Error;

use crate::allow::Network;
use crate::arm::Follower;
use crate::cell::{Cell, ConnectionId};
use crate::connection::{Connection, Manners, Ways};
use crate::si::Units;
use crate::stopper::{self, Stop};
use crate::tls::TlsServer;

/// How many connections are served at once.
pub const LARGEST_CROWD: usize = 64;

/// How often the listener looks for a connection.
const LOOK: Duration = Duration::from_millis(5);

/// What happens when a client goes away while its command is under way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenGone {
    /// The arm stops on its path.
    #[default]
    Stop,
    /// The command is executed to its end.
    Finish,
}

/// How a server serves.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// The arm whose engine is to be used.
    pub arm: Arm,
    /// Where to listen.
    pub listen: SocketAddr,
    /// Who may connect besides this machine.
    pub allow: Vec<Network>,
    /// The units of a connection that has not set its own.
    pub units: Units,
    /// Execute commands one after the other; otherwise a move takes the place of the one under way.
    pub queue: bool,
    /// Send a status this often instead of answering GetStatus.
    pub push: Option<Duration>,
    /// What happens when a client goes away while its command is under way.
    pub when_gone: WhenGone,
    /// Encrypts every connection, and lets in whose certificate is known.
    pub tls: Option<TlsServer>,
}

/// Why a server cannot serve.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The address is open to others, and nobody is named who may come.
    #[error("{address} is open to other machines: say who may connect with --allow NETWORK")]
    Open {
        /// The address.
        address: SocketAddr,
    },
    /// The operating system gives no socket.
    #[error("cannot listen at {address}: {cause}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the operating system said.
        cause: std::io::Error,
    },
    /// The operating system gives no thread.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// No engine answers.
    #[error("{0}")]
    Engine(String),
}

/// What a line for the log goes to.
type Log = Arc<dyn Fn(&str) + Send + Sync>;

/// A running server. Dropping it ends it; the engine and what it executes stay.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    ends: Arc<AtomicBool>,
    listener: Option<JoinHandle<()>>,
    /// The two that talk to the engine; they end when no connection is left.
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// Opens the engine's channels and begins to listen. `log` is given one line for everything
    /// that an operator should know: who connects, who goes, why.
    ///
    /// # Errors
    /// [`ServerError`]: no engine, no socket, an open address without `allow`.
    pub fn start(
        config: ServerConfig,
        log: impl Fn(&str) + Send + Sync + 'static,
    ) -> Result<Self, ServerError> {
        let address = config.listen;
        if !address.ip().is_loopback() && config.allow.is_empty() {
            return Err(ServerError::Open { address });
        }
        let failed = |cause| ServerError::Listen { address, cause };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let (ways, threads) = start_threads(&config.arm)?;
        let ends = Arc::new(AtomicBool::new(false));
        let crowd = Crowd {
            config,
            ways,
            ends: Arc::clone(&ends),
            count: Arc::new(AtomicUsize::new(0)),
            log: Arc::new(log),
        };
        let listener = Builder::new()
            .name("crcl listener".to_owned())
            .spawn(move || crowd.listen(&listener))
            .map_err(ServerError::Thread)?;
        Ok(Self {
            address,
            ends,
            listener: Some(listener),
            threads,
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Whether it still listens.
    pub fn is_running(&self) -> bool {
        let listener = self.listener.as_ref();
        listener.is_some_and(|listener| !listener.is_finished())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Release);
        for thread in self
            .listener
            .take()
            .into_iter()
            .chain(self.threads.drain(..))
        {
            // A thread that panicked has already said so.
            let _ = thread.join();
        }
    }
}

/// Starts the two threads that talk to the engine; each opens its own channels.
fn start_threads(arm: &Arm) -> Result<(Ways, Vec<JoinHandle<()>>), ServerError> {
    let cell = Arc::new(Cell::default());
    let (orders, taken) = mpsc::channel();
    let (stops, stopped) = mpsc::channel();
    let (tell, opened) = mpsc::sync_channel(1);
    let (name, shared) = (arm.clone(), Arc::clone(&cell));
    let engine = Builder::new()
        .name("crcl engine".to_owned())
        .spawn(move || match Follower::open(&name, &shared) {
            Ok(follower) => {
                // Whoever asked waits for exactly this answer.
                let _ = tell.send(Ok(()));
                follower.run(&taken);
            }
            Err(error) => {
                let _ = tell.send(Err(error.to_string()));
            }
        })
        .map_err(ServerError::Thread)?;
    let ended = || Err("the thread ended before it began".to_owned());
    opened
        .recv()
        .unwrap_or_else(|_| ended())
        .map_err(ServerError::Engine)?;
    let (name, shared) = (arm.clone(), Arc::clone(&cell));
    let (tell, opened) = mpsc::sync_channel(1);
    let stopper = Builder::new()
        .name("crcl stop".to_owned())
        .spawn(move || {
            let open = |result| {
                let _ = tell.send(result);
            };
            stopper::run(&name, &shared, &stopped, open);
        })
        .map_err(ServerError::Thread)?;
    opened
        .recv()
        .unwrap_or_else(|_| ended())
        .map_err(ServerError::Engine)?;
    let ways = Ways {
        cell,
        orders,
        stops,
    };
    Ok((ways, vec![engine, stopper]))
}

/// The connections.
struct Crowd {
    config: ServerConfig,
    ways: Ways,
    ends: Arc<AtomicBool>,
    count: Arc<AtomicUsize>,
    log: Log,
}

impl Crowd {
    fn listen(&self, listener: &TcpListener) {
        let mut id: ConnectionId = 0;
        let mut threads: Vec<JoinHandle<()>> = Vec::new();
        while !self.ends.load(Ordering::Acquire) {
            let Ok((stream, peer)) = listener.accept() else {
                sleep(LOOK);
                continue;
            };
            threads.retain(|thread| !thread.is_finished());
            if let Err(why) = self.admit(peer.ip()) {
                (self.log)(&format!("{peer} was sent away: {why}"));
                // Without a handshake there are no words for a client with TLS.
                if self.config.tls.is_none() {
                    send_away(&stream, &why);
                }
                continue;
            }
            id += 1;
            (self.log)(&format!("connection {id}: {peer} has come"));
            match self.serve(id, stream) {
                Ok(thread) => threads.push(thread),
                Err(cause) => (self.log)(&format!("connection {id}: {cause}")),
            }
        }
        for thread in threads {
            // A thread that panicked has already said so.
            let _ = thread.join();
        }
    }

    fn admit(&self, peer: IpAddr) -> Result<(), String> {
        let allowed = self.config.allow.iter().any(|network| network.holds(peer));
        if !(peer.to_canonical().is_loopback() || allowed) {
            return Err("this address may not connect".to_owned());
        }
        if self.count.load(Ordering::Acquire) >= LARGEST_CROWD {
            return Err(format!("there are {LARGEST_CROWD} connections already"));
        }
        Ok(())
    }

    fn serve(&self, id: ConnectionId, stream: TcpStream) -> std::io::Result<JoinHandle<()>> {
        stream.set_nonblocking(false)?;
        let manners = Manners {
            units: self.config.units,
            queue: self.config.queue,
            push: self.config.push,
            tls: self.config.tls.clone(),
        };
        let mut connection = Connection::new(id, stream, self.ways.clone(), &manners)?;
        let (ends, log) = (Arc::clone(&self.ends), Arc::clone(&self.log));
        let (ways, when_gone) = (self.ways.clone(), self.config.when_gone);
        let place = Place::take(&self.count);
        Builder::new().name(format!("crcl {id}")).spawn(move || {
            let _place = place;
            let why = connection.run(&|| ends.load(Ordering::Acquire));
            let stopped = when_gone == WhenGone::Stop && leave(&ways, id);
            let note = if stopped { "; its move is stopped" } else { "" };
            log(&format!("connection {id} ends: {why}{note}"));
        })
    }
}

/// One of the places for connections.
struct Place(Arc<AtomicUsize>);

impl Place {
    fn take(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::AcqRel);
        Self(Arc::clone(count))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Stops the arm if a command of this connection is under way; says whether there was one.
fn leave(ways: &Ways, id: ConnectionId) -> bool {
    let mut inner = ways.cell.lock();
    if !(inner.is_working() && inner.owner == id) {
        return false;
    }
    inner.epoch += 1;
    let serial = inner.serial;
    inner.fail(
        serial,
        "the client that commanded has gone; the arm is stopped",
    );
    let stop = Stop {
        serial: None,
        fast: false,
    };
    ways.stops.send(stop).is_ok()
}

/// One status with the reason, and the end.
fn send_away(mut stream: &TcpStream, why: &str) {
    let status = Status {
        command: CommandStatus {
            state: CommandState::Error,
            description: Some(why.to_owned()),
            ..CommandStatus::default()
        },
        ..Status::default()
    };
    // Who does not read it is sent away all the same.
    let _ = stream.set_write_timeout(Some(LOOK));
    let _ = stream.write_all(write_status(&status).as_bytes());
}

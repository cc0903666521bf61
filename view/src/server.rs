//! The server: a thread for each connection, on this machine only.

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::Builder;
use std::time::Duration;

use serde_json::json;

use crate::hand::HandPost;
use crate::preview::{Draft, preview};
use crate::request::Service;
use crate::source::Board;
use crate::{Guard, Source, Token, ViewError, http, live, page, player, scene, socket};

/// How many connections there may be at once.
const MOST: usize = 64;

/// How long a connection may say nothing before it is closed.
const SILENT: Duration = Duration::from_secs(20);

/// How the view is served.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServerOptions {
    /// The port on 127.0.0.1; 0 takes a free one.
    pub port: u16,
}

/// What all threads share.
struct Shared {
    guard: Guard,
    board: Arc<Board>,
    service: Service,
    ends: Arc<AtomicBool>,
    pages: AtomicU64,
    connections: AtomicUsize,
}

/// A view that is served. Dropping it ends it.
pub struct Server {
    guard: Guard,
    ends: Arc<AtomicBool>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server")
            .field("port", &self.guard.port)
            .finish_non_exhaustive()
    }
}

impl Server {
    /// Serves a source until it is dropped.
    ///
    /// # Errors
    /// [`ViewError`]: the port is taken, there are no threads, the source cannot be read.
    pub fn start(source: Source, options: ServerOptions) -> Result<Self, ViewError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, options.port));
        let failed = |cause: std::io::Error| ViewError::Port {
            port: options.port,
            cause: cause.to_string(),
        };
        let listener = listener.map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let guard = Guard {
            port,
            watch: Token::random()?,
            hand: Token::random()?,
        };
        let ends = Arc::new(AtomicBool::new(false));
        let board = Arc::new(Board::default());
        let service = service(source, &board, &ends)?;
        let shared = Arc::new(Shared {
            guard: guard.clone(),
            board,
            service,
            ends: Arc::clone(&ends),
            pages: AtomicU64::new(0),
            connections: AtomicUsize::new(0),
        });
        Builder::new()
            .name("view".to_owned())
            .spawn(move || accept(&listener, &shared))
            .map_err(|cause| ViewError::Thread {
                cause: cause.to_string(),
            })?;
        Ok(Self { guard, ends })
    }

    /// The guard with its tokens.
    #[must_use]
    pub fn guard(&self) -> &Guard {
        &self.guard
    }

    /// The address that opens the view with the pendant.
    #[must_use]
    pub fn hand_address(&self) -> String {
        self.address(&self.guard.hand)
    }

    /// The address that opens the view to watch.
    #[must_use]
    pub fn watch_address(&self) -> String {
        self.address(&self.guard.watch)
    }

    /// The token stands behind the #: browsers keep that to themselves.
    fn address(&self, token: &Token) -> String {
        format!("http://127.0.0.1:{}/#{}", self.guard.port, token.word())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Release);
        // Wakes the thread that waits for connections; where that fails the process ends anyway.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.guard.port));
    }
}

/// Starts what is shown.
fn service(
    source: Source,
    board: &Arc<Board>,
    ends: &Arc<AtomicBool>,
) -> Result<Service, ViewError> {
    let mut service = Service {
        engine: None,
        player: None,
        hand: HandPost::default(),
        robot: Arc::new(Mutex::new(None)),
        planning: Arc::new(AtomicBool::new(false)),
    };
    match source {
        Source::Arm(arm) => {
            service.engine = Some(live::start(&arm, board, &service.robot, ends)?);
        }
        Source::Recording(recorded) => {
            let head = &recorded.head;
            let robot = planner::robot::parse(&head.robot, &head.urdf, &head.robot_toml)?;
            service.robot = Arc::new(Mutex::new(Some(robot)));
            service.player = Some(player::start(*recorded, board, ends)?);
        }
        Source::Program { robot, program } => {
            let [name, form, text] = program;
            board.set_robot(&scene::robot(&robot, "", 1_000_000));
            board.set_program(&json!({"number": 1, "name": name, "form": form, "text": text}));
            let draft = Draft {
                name,
                form,
                text,
                default_length: "mm".to_owned(),
                rate_hz: 1000.0,
                ..Draft::default()
            };
            board.set_preview(&preview(&robot, &draft));
            let start = &robot.home;
            board.set_status(
                &json!({"is": "status", "engine": true, "dry": true, "status": {
                    "robot": robot.name, "arm": "", "state": "preview", "joints": start,
                    "setpoint": start, "idle": true,
                }}),
            );
            service.robot = Arc::new(Mutex::new(Some(*robot)));
        }
    }
    Ok(service)
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.ends.load(Ordering::Acquire) {
            return;
        }
        let Ok(stream) = stream else { continue };
        if shared.connections.fetch_add(1, Ordering::AcqRel) >= MOST {
            shared.connections.fetch_sub(1, Ordering::AcqRel);
            continue;
        }
        let ours = Arc::clone(shared);
        let spawned = Builder::new().name("view page".to_owned()).spawn(move || {
            serve(stream, &ours);
            ours.connections.fetch_sub(1, Ordering::AcqRel);
        });
        if spawned.is_err() {
            shared.connections.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

/// Answers the requests of one connection; one for a WebSocket is its last.
fn serve(mut stream: TcpStream, shared: &Shared) {
    // Both can only fail on a connection that is broken: then the first read tells.
    let _ = stream.set_read_timeout(Some(SILENT));
    let _ = stream.set_write_timeout(Some(SILENT));
    loop {
        let incoming = match http::read(&mut stream) {
            Ok(Some(incoming)) => incoming,
            Ok(None) => return,
            Err(_) => {
                let _ = http::answer(&mut stream, (400, "text/plain"), b"no request\n", false);
                return;
            }
        };
        let visitor = &incoming.visitor;
        if visitor.upgrades {
            return upgrade(stream, &incoming, shared);
        }
        let answered = match shared.guard.admit(visitor) {
            Err(refusal) => {
                tracing::warn!(?refusal, "a request was refused");
                let (status, text) = refusal.answer();
                http::answer(&mut stream, (status, "text/plain"), text.as_bytes(), false)
                    .and(Err(std::io::ErrorKind::PermissionDenied.into()))
            }
            Ok(()) => match page::at(&visitor.path) {
                Some(file) => {
                    http::answer(&mut stream, (200, file.kind), file.body, incoming.stays)
                }
                None => http::answer(
                    &mut stream,
                    (404, "text/plain"),
                    b"no such file\n",
                    incoming.stays,
                ),
            },
        };
        if answered.is_err() || !incoming.stays {
            return;
        }
    }
}

fn upgrade(mut stream: TcpStream, incoming: &http::Incoming, shared: &Shared) {
    let admitted = shared.guard.admit_socket(&incoming.visitor);
    let (access, key) = match (admitted, &incoming.key) {
        (Ok(access), Some(key)) if incoming.visitor.path == "/live" => (access, key),
        (admitted, _) => {
            let (status, text) = match admitted {
                Err(refusal) => {
                    tracing::warn!(?refusal, "a WebSocket was refused");
                    refusal.answer()
                }
                Ok(_) => (400, "no WebSocket is served here"),
            };
            let _ = http::answer(&mut stream, (status, "text/plain"), text.as_bytes(), false);
            return;
        }
    };
    if http::upgrade(&mut stream, key).is_err() {
        return;
    }
    let page = shared.pages.fetch_add(1, Ordering::AcqRel) + 1;
    socket::run(
        stream,
        (page, access),
        (&shared.board, &shared.service),
        &shared.ends,
    );
}

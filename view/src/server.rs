//! The server: a thread for each connection, on this machine only.

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::Builder;
use std::time::Duration;

use planner::robot::Robot;
use serde_json::{Value, json};

use crate::hand::HandPost;
use crate::preview::{Detail, Draft, preview};
use crate::request::Service;
use crate::source::Board;
use crate::{
    Guard, ReadWorld, Source, Token, ViewError, foxglove, http, lists, live, mesh, page, player,
    scene, socket,
};

/// How many connections there may be at once.
const MOST: usize = 64;

/// How long a connection may say nothing before it is closed.
const SILENT: Duration = Duration::from_secs(20);

/// How often the workstation is read again.
const WORLD: Duration = Duration::from_millis(500);

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
    board: Arc<Board>,
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
            look: Token::random()?,
        };
        let ends = Arc::new(AtomicBool::new(false));
        let board = Arc::new(Board::default());
        let service = service(source, &board, &ends)?;
        let shared = Arc::new(Shared {
            guard: guard.clone(),
            board: Arc::clone(&board),
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
        Ok(Self { guard, board, ends })
    }

    /// Shows what stands in the workstation as well, and reads it again twice a second.
    ///
    /// # Errors
    /// [`ViewError::Thread`]: there is no thread for it.
    pub fn show_world(&self, mut read: ReadWorld) -> Result<(), ViewError> {
        let (board, ends) = (Arc::clone(&self.board), Arc::clone(&self.ends));
        let look = move || {
            while !ends.load(Ordering::Acquire) {
                if let Some(world) = read() {
                    board.set_world(&world);
                }
                std::thread::sleep(WORLD);
            }
        };
        let spawned = Builder::new().name("view world".to_owned()).spawn(look);
        spawned.map(|_| ()).map_err(|cause| ViewError::Thread {
            cause: cause.to_string(),
        })
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

    /// The address of the live data for Foxglove, Lichtblick and PlotJuggler.
    #[must_use]
    pub fn viewer_address(&self) -> String {
        let (port, token) = (self.guard.port, self.guard.look.word());
        format!("ws://127.0.0.1:{port}{}?t={token}", foxglove::PATH)
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
        lists: Vec::new(),
    };
    match source {
        Source::Arm(arm) => {
            service.engine = Some(live::start(&arm, board, &service.robot, ends)?);
        }
        Source::Recording { recorded, folder } => {
            let head = &recorded.head;
            let mut robot = planner::robot::parse(&head.robot, &head.urdf, &head.robot_toml)?;
            robot.folder = folder;
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
                detail: Detail::Plots,
                ..Draft::default()
            };
            board.set_status(&at_rest(Some(&robot)));
            board.set_preview(&preview(&robot, &draft));
            service.robot = Arc::new(Mutex::new(Some(*robot)));
        }
        Source::Lists { robot, lists } => {
            if let Some(robot) = &robot {
                board.set_robot(&scene::robot(robot, "", 1_000_000));
            }
            board.set_status(&at_rest(robot.as_deref()));
            board.set_lists(&lists::table(&lists));
            service.lists = lists;
            service.robot = Arc::new(Mutex::new(robot.map(|robot| *robot)));
        }
    }
    Ok(service)
}

/// The status where nothing moves: what is shown was planned only.
fn at_rest(robot: Option<&Robot>) -> Value {
    let home = robot.map(|robot| &robot.home);
    json!({"is": "status", "engine": true, "dry": true, "status": {
        "robot": robot.map(|robot| &robot.name), "arm": "", "state": "preview", "joints": home,
        "setpoint": home, "idle": true,
    }})
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
        let answered = answer(&mut stream, &incoming, shared);
        if answered.is_err() || !incoming.stays {
            return;
        }
    }
}

/// Answers one request that asks for a file.
fn answer(
    stream: &mut TcpStream,
    incoming: &http::Incoming,
    shared: &Shared,
) -> std::io::Result<()> {
    let path = &incoming.visitor.path;
    let is_mesh = path.starts_with(mesh::PATH);
    let admitted = if is_mesh {
        shared.guard.admit_reader(&incoming.visitor)
    } else {
        shared.guard.admit(&incoming.visitor)
    };
    if let Err(refusal) = admitted {
        tracing::warn!(?refusal, "a request was refused");
        let (status, text) = refusal.answer();
        http::answer(stream, (status, "text/plain"), text.as_bytes(), false)?;
        return Err(std::io::ErrorKind::PermissionDenied.into());
    }
    if let Some(file) = page::at(path) {
        return http::answer(stream, (200, file.kind), file.body, incoming.stays);
    }
    let found = is_mesh.then(|| shared.service.mesh(path)).flatten();
    match found {
        Some(bytes) => {
            let kind = "application/octet-stream";
            http::answer(stream, (200, kind), &bytes, incoming.stays)
        }
        None => http::answer(
            stream,
            (404, "text/plain"),
            b"no such file\n",
            incoming.stays,
        ),
    }
}

fn upgrade(mut stream: TcpStream, incoming: &http::Incoming, shared: &Shared) {
    let visitor = &incoming.visitor;
    let refuse = |mut stream: TcpStream, (status, text): (u16, &str)| {
        // Whoever is refused may have gone.
        let _ = http::answer(&mut stream, (status, "text/plain"), text.as_bytes(), false);
    };
    let admitted = match visitor.path.as_str() {
        foxglove::PATH => shared.guard.admit_viewer(visitor).map(|()| None),
        _ => shared.guard.admit_socket(visitor).map(Some),
    };
    let access = match admitted {
        Ok(access) => access,
        Err(refusal) => {
            tracing::warn!(?refusal, "a WebSocket was refused");
            return refuse(stream, refusal.answer());
        }
    };
    let protocol = match (access, visitor.path.as_str()) {
        (None, _) => foxglove::protocol(visitor.protocols.as_deref()),
        (_, "/live") => Some("canter"),
        _ => None,
    };
    let (Some(protocol), Some(key)) = (protocol, &incoming.key) else {
        return refuse(stream, (400, "no WebSocket of this kind is served here"));
    };
    if http::upgrade(&mut stream, key, protocol).is_err() {
        return;
    }
    let Some(access) = access else {
        return foxglove::run(stream, &shared.board, &shared.ends);
    };
    let page = shared.pages.fetch_add(1, Ordering::AcqRel) + 1;
    socket::run(
        stream,
        (page, access),
        (&shared.board, &shared.service),
        &shared.ends,
    );
}

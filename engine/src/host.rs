//! A session that serves clients: other processes that command, monitor or stop the arm.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crcl::ReadOptions;
use ipc::{Answer, Arm, ClientServer, Identity, IpcError, Ownership, StatusWriter, Verb};
use planner::robot::Robot;
use serde_json::{Value, json};
use servo::{Control, ExecutorError};

use crate::control::ControlThread;
use crate::session::{Jog, JogSpace, Note, Session, SessionConfig, SessionError};

/// Time between two status reports.
const REPORT: Duration = Duration::from_millis(100);

/// How many notes are kept for clients that ask.
const KEPT: usize = 512;

/// How long the notes of one answer may be together (bytes).
const NOTES: usize = ipc::LONGEST_ANSWER * 3 / 4;

/// The channels of an arm's clients: only one engine per arm can have them.
#[derive(Debug)]
pub struct ClientChannels {
    requests: ClientServer,
    status: StatusWriter,
}

impl ClientChannels {
    /// Opens the channels of `arm`. Do so before opening a session with the driver.
    ///
    /// # Errors
    /// [`IpcError::Taken`] when another engine has the arm; errors of shared memory.
    pub fn open(arm: &Arm) -> Result<Self, IpcError> {
        let (requests, status) = (ClientServer::open(arm)?, StatusWriter::open(arm)?);
        Ok(Self { requests, status })
    }
}

/// A running session with its clients and its driver: a `D` that ends the driver when it is
/// dropped.
///
/// Fields are dropped in this order: the session stops the arm while the driver still runs.
#[derive(Debug)]
pub struct Host<D> {
    /// The arm.
    pub arm: Arm,
    /// The session.
    pub session: Session,
    _control: ControlThread,
    channels: ClientChannels,
    reported: Option<Instant>,
    ownership: Ownership,
    notes: VecDeque<Value>,
    count: u64,
    shutdown: bool,
    _driver: D,
}

impl<D> Host<D> {
    /// Starts a session on the arm of the channels.
    ///
    /// # Errors
    /// As [`Session::start`]; the driver is ended again.
    pub fn start(
        channels: ClientChannels,
        robot: &Robot,
        config: &SessionConfig,
        driver: D,
    ) -> Result<Self, SessionError> {
        let session = Session::start(robot, config)?;
        let control =
            ControlThread::start(&config.arm, session.steering()).map_err(ExecutorError::from)?;
        Ok(Self {
            arm: config.arm.clone(),
            session,
            _control: control,
            channels,
            reported: None,
            ownership: Ownership::default(),
            notes: VecDeque::new(),
            count: 0,
            shutdown: false,
            _driver: driver,
        })
    }

    /// Reserves the arm for this process: other clients may stop it, but not command it.
    pub fn own(&mut self, name: &str) {
        let client = Identity {
            name: name.to_owned(),
            process: std::process::id(),
        };
        self.ownership.give(client);
    }

    /// Whether a client has asked for the end.
    pub fn is_shut_down(&self) -> bool {
        self.shutdown
    }

    /// Serves clients, reports, and waits a short time for the next note.
    ///
    /// # Errors
    /// [`IpcError`] when shared memory fails.
    pub fn turn(&mut self) -> Result<Option<Note>, IpcError> {
        // One batch per turn, so that a flood of requests does not delay signals. A client that
        // cannot be reached, or a report that cannot be sent, must not end the control of a moving
        // arm.
        if let Err(error) = self.serve() {
            tracing::debug!("{error}");
        }
        if self.reported.is_none_or(|at| at.elapsed() >= REPORT) {
            self.reported = Some(Instant::now());
            if let Err(error) = self.channels.status.write(&self.session.status()) {
                tracing::debug!("{error}");
            }
        }
        let note = self.session.note(Duration::from_millis(5));
        if let Some(note) = &note {
            self.count += 1;
            self.notes
                .push_back(json!({"number": self.count, "note": note}));
            if self.notes.len() > KEPT {
                self.notes.pop_front();
            }
        }
        Ok(note)
    }

    fn serve(&mut self) -> Result<usize, IpcError> {
        let Self {
            session,
            channels,
            ownership,
            notes,
            count,
            shutdown,
            ..
        } = self;
        channels.requests.serve(|request| {
            let status = session.status();
            // Any client that may stop a motion may resume it; only the owner decides what is
            // executed.
            let free = matches!(request.ask, Verb::Resume | Verb::Override { .. });
            if !free && let Err(refusal) = ownership.admit(&request, !status.idle) {
                return refusal;
            }
            match request.ask {
                Verb::Status => Answer::accept(json!({"status": status, "last_note": *count})),
                Verb::Notes { since } => later(notes, since),
                Verb::Shutdown => {
                    *shutdown = true;
                    Answer::accept(Value::Null)
                }
                Verb::Submit {
                    format,
                    name,
                    program,
                } => submit(session, &format, &name, &program),
                Verb::Jog {
                    space,
                    speeds,
                    timeout_ms,
                } => jog(session, &space, speeds, timeout_ms),
                ask => control(session, &ask),
            }
        })
    }
}

/// The notes after number `since`, as many as one answer holds; the client asks again for more.
fn later(notes: &VecDeque<Value>, since: u64) -> Answer {
    let mut room = NOTES;
    let later = notes
        .iter()
        .filter(|note| note["number"].as_u64() > Some(since));
    let page = later.map_while(|note| {
        let length = note.to_string().len();
        let first = room == NOTES;
        let fits = room.checked_sub(length);
        room = fits.unwrap_or(0);
        match fits {
            Some(_) => Some(note.clone()),
            None if first => Some(cut(note)),
            None => None,
        }
    });
    Answer::accept(json!({"notes": page.collect::<Vec<_>>()}))
}

/// A note whose long texts are cut.
fn cut(note: &Value) -> Value {
    const LONGEST_TEXT: usize = 500;
    let mut note = note.clone();
    for value in note["note"]
        .as_object_mut()
        .into_iter()
        .flat_map(serde_json::Map::values_mut)
    {
        if let Some(text) = value.as_str()
            && text.chars().count() > LONGEST_TEXT
        {
            let kept: String = text.chars().take(LONGEST_TEXT).collect();
            *value = Value::String(format!("{kept} (cut)"));
        }
    }
    note
}

/// Takes a program of a client: all its commands or none.
fn submit(session: &Session, format: &str, name: &str, program: &str) -> Answer {
    let read = match format {
        "text" => crcl::text::read,
        "json" => crcl::json::read,
        other => return Answer::refuse(format!("a program is text or json, not {other:?}")),
    };
    let reading = read(program, &ReadOptions::default());
    if reading.has_errors() {
        let source = crcl::Source::new(name, program);
        let text = crcl::render(
            &reading.findings,
            reading.omitted,
            &source,
            (crcl::Look::Plain, 100),
        );
        return Answer::refuse(text.trim_end());
    }
    match session.submit(reading.program.commands) {
        Ok(ids) => Answer::accept(json!({
            "first": ids.first(),
            "last": ids.last(),
            "commands": ids.len(),
        })),
        Err(full) => Answer::refuse(full.to_string()),
    }
}

/// Jogs for as long as the client sends requests.
fn jog(session: &Session, space: &str, speeds: Vec<f64>, timeout_ms: u64) -> Answer {
    let space = match space {
        "joint" => JogSpace::Joint,
        "tool" => JogSpace::Tool,
        other => return Answer::refuse(format!("a jog is in joint or tool space, not {other:?}")),
    };
    let timeout = Duration::from_millis(timeout_ms);
    match session.jog(Jog {
        space,
        speeds,
        timeout,
    }) {
        Ok(()) => Answer::accept(Value::Null),
        Err(error) => Answer::refuse(error.to_string()),
    }
}

/// Executes requests that act on the current motion, for clients that do not use the control
/// channel.
fn control(session: &Session, ask: &Verb) -> Answer {
    let control = match ask {
        Verb::Pause => Control::Pause,
        Verb::Resume => Control::Resume,
        Verb::Override { share } if (0.0..=1.0).contains(share) => Control::Override(*share),
        Verb::Override { share } => {
            return Answer::refuse(format!("an override is 0 to 1, got {share}"));
        }
        Verb::Stop { fast } => Control::Stop { fast: *fast },
        Verb::Abort => Control::Abort,
        Verb::Recover => {
            return match session.recover() {
                Ok(_) => Answer::accept(Value::Null),
                Err(error) => Answer::refuse(error.to_string()),
            };
        }
        _ => return Answer::refuse("this engine cannot do that"),
    };
    session.control(control);
    Answer::accept(Value::Null)
}

//! A long-running engine: one session on one arm, commanded by clients over shared memory.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use ipc::{Answer, ClientServer, IpcError, Ownership, Request, StatusWriter, Verb};
use serde::Serialize;
use thiserror::Error;

use crate::executor::Control;
use crate::robot::Robot;
use crate::session::{Note, Session, SessionConfig, SessionError, Status};

/// How many notes a report carries, so that a client that reads now and then misses none.
const KEPT: usize = 64;
/// Time between two reports when nothing happens.
const REPORT_EVERY: Duration = Duration::from_millis(50);

/// Why a server cannot start.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The client channel: another engine serves this arm, or shared memory cannot be used.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The session with the driver.
    #[error(transparent)]
    Session(#[from] SessionError),
}

/// A note with its number, counted from 1 over the life of the server.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NumberedNote {
    /// The number.
    pub number: u64,
    /// What happened.
    #[serde(flatten)]
    pub note: Note,
}

/// What clients read: where the engine is, and the last things that happened.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this form.
    pub schema: u32,
    /// Where the session is.
    pub status: Status,
    /// The last notes, oldest first.
    pub notes: VecDeque<NumberedNote>,
}

/// What one turn of the server came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Turn {
    /// What happened, for the console.
    pub notes: Vec<Note>,
    /// Whether a client asked the engine to end, or the session has ended.
    pub over: bool,
}

/// A running engine for clients.
#[derive(Debug)]
pub struct Server {
    session: Session,
    clients: ClientServer,
    writer: StatusWriter,
    owner: Ownership,
    notes: VecDeque<NumberedNote>,
    count: u64,
    reported: Option<Instant>,
}

impl Server {
    /// Opens the client channel, then a session with the driver.
    ///
    /// # Errors
    /// [`ServerError`]: another engine on the same arm, no driver, a driver that refuses.
    pub fn open(robot: &Robot, config: &SessionConfig) -> Result<Self, ServerError> {
        let clients = ClientServer::open(&config.arm)?;
        let writer = StatusWriter::open(&config.arm)?;
        let session = Session::start(robot, config)?;
        let notes = VecDeque::with_capacity(KEPT);
        let owner = Ownership::default();
        Ok(Self { session, clients, writer, owner, notes, count: 0, reported: None })
    }

    /// The session.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Answers waiting clients, waits a little for something to happen, and reports.
    ///
    /// # Errors
    /// [`IpcError`] when shared memory fails.
    pub fn turn(&mut self) -> Result<Turn, IpcError> {
        let mut turn = Turn::default();
        while self.answer(&mut turn)? {}
        let mut wait = Duration::from_millis(2);
        while let Some(note) = self.session.note(wait) {
            wait = Duration::ZERO;
            let closed = note == Note::Closed;
            self.keep(note.clone());
            turn.notes.push(note);
            if closed {
                turn.over = true;
                break;
            }
        }
        let due = self.reported.is_none_or(|last| last.elapsed() >= REPORT_EVERY);
        if due || !turn.notes.is_empty() {
            self.writer.write(&self.report())?;
            self.reported = Some(Instant::now());
        }
        Ok(turn)
    }

    /// What clients read.
    #[must_use]
    pub fn report(&self) -> Report {
        Report { schema: 1, status: self.session.status(), notes: self.notes.clone() }
    }

    fn keep(&mut self, note: Note) {
        self.count += 1;
        if self.notes.len() == KEPT {
            self.notes.pop_front();
        }
        self.notes.push_back(NumberedNote { number: self.count, note });
    }

    fn answer(&mut self, turn: &mut Turn) -> Result<bool, IpcError> {
        let Self { session, clients, owner, count, .. } = self;
        let mut over = false;
        let report = Report { schema: 1, status: session.status(), notes: self.notes.clone() };
        let served = clients.serve(|request| {
            let busy = !report.status.idle;
            if let Err(refusal) = owner.admit(&request, busy) {
                return refusal;
            }
            over |= request.ask == Verb::Shutdown;
            obey(session, &request, &report, *count)
        })?;
        turn.over |= over;
        Ok(served)
    }
}

fn obey(session: &Session, request: &Request, report: &Report, count: u64) -> Answer {
    let control = |control| {
        session.control(control);
        Answer::accept(serde_json::Value::Null)
    };
    match &request.ask {
        Verb::Submit { format, program, .. } => submit(session, format, program, count),
        Verb::Pause => control(Control::Pause),
        Verb::Resume => control(Control::Resume),
        Verb::Override { share } if (0.0..=1.0).contains(share) => {
            control(Control::Override(*share))
        }
        Verb::Override { share } => {
            Answer::refuse(format!("the override must be 0 to 1 of the planned speed, got {share}"))
        }
        Verb::Stop { fast } => control(Control::Stop { fast: *fast }),
        Verb::Abort => control(Control::Abort),
        Verb::Recover => {
            session.recover();
            Answer::accept(serde_json::Value::Null)
        }
        Verb::Status => match serde_json::to_value(report) {
            Ok(body) => Answer::accept(body),
            Err(cause) => Answer::refuse(format!("the status cannot be written: {cause}")),
        },
        Verb::Shutdown => Answer::accept(serde_json::Value::Null),
        other => Answer::refuse(format!("this engine does not know how to {other:?}")),
    }
}

/// Takes a program whole or not at all.
fn submit(session: &Session, format: &str, program: &str, count: u64) -> Answer {
    let options = crcl::ReadOptions::default();
    // A client that has a program as JSON writes it as text, which loses nothing.
    if format != "text" {
        return Answer::refuse(format!("a program is sent as \"text\", got {format:?}"));
    }
    let reading = crcl::text::read(program, &options);
    if let Some(first) = reading.findings.iter().find(|finding| finding.is_error()) {
        let (line, column) = crcl::Source::new("program", program).position(first.span.start);
        return Answer::refuse(format!("{line}:{column}: {}", first.message));
    }
    match session.submit(reading.program.commands) {
        // `after` tells the client which notes are about its commands.
        Ok(ids) => Answer::accept(serde_json::json!({ "ids": ids, "after": count })),
        Err(full) => Answer::refuse(full.to_string()),
    }
}

//! A session that serves clients: other processes that command, monitor or stop the arm.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use ipc::{Answer, Arm, ClientServer, Identity, IpcError, Ownership, StatusWriter, Verb};
use planner::robot::Robot;
use serde_json::{Value, json};
use servo::ExecutorError;

use crate::asked;
use crate::control::ControlThread;
use crate::flight::{Flight, FlightOptions, Recorded};
use crate::once::TakenOnce;
use crate::session::{Note, RunSample, Session, SessionConfig, SessionError, Status};
use crate::texts::Texts;
pub use crate::texts::{GivenProgram, length_word};

/// Time between two status reports.
const REPORT: Duration = Duration::from_millis(100);

/// How many notes are kept for clients that ask.
const KEPT: usize = 512;

/// How many samples wait for [`Host::samples`] at most: ten minutes at 1 kHz.
const WAITING: usize = 600_000;

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
    once: TakenOnce,
    notes: VecDeque<Value>,
    count: u64,
    shutdown: bool,
    texts: Texts,
    rate_hz: f64,
    default_length: &'static str,
    flight: Option<Flight>,
    /// Where the last fault was recorded, in words.
    recorded: Option<String>,
    samples: Vec<RunSample>,
    /// What ends with the engine: its driver, a view.
    pub company: D,
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
        let control = ControlThread::start(&config.arm, session.steering(), config.rate_hz)
            .map_err(ExecutorError::from)?;
        Ok(Self {
            arm: config.arm.clone(),
            session,
            _control: control,
            channels,
            reported: None,
            ownership: Ownership::default(),
            once: TakenOnce::new(),
            notes: VecDeque::new(),
            count: 0,
            shutdown: false,
            texts: Texts::new(robot),
            rate_hz: config.rate_hz,
            default_length: length_word(config.default_length),
            flight: None,
            recorded: None,
            samples: Vec::new(),
            company: driver,
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

    /// Records from now on. The session must have been started with its samples kept.
    ///
    /// # Errors
    /// The file of the recording cannot be written.
    pub fn record(
        &mut self,
        robot: &Robot,
        options: &FlightOptions,
    ) -> Result<(), recorder::RecorderError> {
        let recorded = Recorded {
            robot,
            arm: &self.arm,
            session: &self.session,
            rate_hz: self.rate_hz,
            default_length: self.default_length,
        };
        self.flight = Some(Flight::new(recorded, options)?);
        Ok(())
    }

    /// Tells clients and recordings which program was given; `certificate` is what was proved of
    /// its moves, as JSON, where that is known.
    pub fn tell_program(&mut self, program: GivenProgram, certificate: Option<String>) {
        if let Some(flight) = &mut self.flight {
            flight.program(&program, certificate);
        }
        self.texts.give(program);
    }

    /// What was recorded since the last call, for one reader; what is too old is forgotten.
    #[must_use]
    pub fn samples(&mut self) -> Vec<RunSample> {
        self.take_samples();
        std::mem::take(&mut self.samples)
    }

    /// Ends the session and then the recording, whose summary it gives. The driver ends with the
    /// host.
    ///
    /// # Errors
    /// The file of the recording cannot be written.
    pub fn close(&mut self) -> Result<Option<recorder::Summary>, recorder::RecorderError> {
        self.session.close();
        self.take_samples();
        self.flight.take().map_or(Ok(None), Flight::close)
    }

    fn take_samples(&mut self) {
        let fresh = self.session.samples();
        if let Some(flight) = &mut self.flight {
            flight.samples(&fresh);
        }
        if self.samples.len() > WAITING {
            self.samples.clear();
        }
        self.samples.extend(fresh);
    }

    /// Where the session is, and where its fault was recorded.
    #[must_use]
    pub fn status(&self) -> Status {
        told(self.session.status(), self.recorded.as_deref())
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
            let status = self.status();
            if let Some(flight) = &mut self.flight {
                flight.count(&status);
            }
            if let Err(error) = self.channels.status.write(&status) {
                tracing::debug!("{error}");
            }
        }
        let mut note = self.session.note(Duration::from_millis(5));
        self.take_samples();
        if let Some(note) = &mut note {
            self.record_note(note);
            self.count += 1;
            self.notes
                .push_back(json!({"number": self.count, "note": note}));
            if self.notes.len() > KEPT {
                self.notes.pop_front();
            }
        }
        Ok(note)
    }

    /// Records what happened. A fault writes the last minute to a file, and its reason names it.
    fn record_note(&mut self, note: &mut Note) {
        let Some(flight) = &mut self.flight else {
            return;
        };
        if let Some(failure) = flight.failure() {
            tracing::warn!("the recording has ended: {failure}");
        }
        flight.note(note);
        match note {
            Note::Faulted { reason, .. } => {
                let words = match flight.fault() {
                    Some(Ok(path)) => format!("the last minute is in {}", path.display()),
                    Some(Err(cause)) => format!("the last minute is lost: {cause}"),
                    None => return,
                };
                reason.push_str("; ");
                reason.push_str(&words);
                self.recorded = Some(words);
            }
            Note::Recovered => self.recorded = None,
            _ => {}
        }
    }

    fn serve(&mut self) -> Result<usize, IpcError> {
        let Self {
            session,
            channels,
            ownership,
            once,
            notes,
            count,
            shutdown,
            texts,
            flight,
            recorded,
            default_length,
            rate_hz,
            ..
        } = self;
        channels.requests.serve(|request| {
            if let Some(answer) = once.answer(&request.ask) {
                return answer;
            }
            let status = told(session.status(), recorded.as_deref());
            if let Err(refusal) = ownership.admit(&request, !status.idle) {
                return refusal;
            }
            match request.ask {
                Verb::Status => Answer::accept(json!({
                    "status": status,
                    "last_note": *count,
                    "session": once.session(),
                    "program": texts.program(),
                    "period_ns": (1e9 / *rate_hz).round(),
                })),
                Verb::Text { of, from } => texts.part(&of, from),
                Verb::Notes { since } => later(notes, since, once.session()),
                Verb::Shutdown => {
                    *shutdown = true;
                    Answer::accept(Value::Null)
                }
                verb @ (Verb::Submit { .. } | Verb::SubmitOnce { .. }) => {
                    let start = status.idle.then_some(status.setpoint);
                    let answer = asked::submit(session, &verb);
                    once.keep(&verb, &answer);
                    if let Some(given) = GivenProgram::taken(&answer, &verb, start) {
                        let given = given.in_unit(default_length);
                        if let Some(flight) = flight {
                            flight.program(&given, None);
                        }
                        texts.give(given);
                    }
                    answer
                }
                other => asked::of_session(session, other),
            }
        })
    }
}

/// A status whose fault says where it was recorded.
fn told(mut status: Status, recorded: Option<&str>) -> Status {
    if let (Some(fault), Some(words)) = (&mut status.fault, recorded) {
        fault.push_str("; ");
        fault.push_str(words);
    }
    status
}

/// The notes after number `since`, as many as one answer holds; the client asks again for more.
fn later(notes: &VecDeque<Value>, since: u64, session: &str) -> Answer {
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
    Answer::accept(json!({"notes": page.collect::<Vec<_>>(), "session": session}))
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

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use crcl::ReadOptions;
use engine::dry_run::FailurePolicy;
use engine::executor::{Control, ExecutorError};
use engine::robot::Robot;
use engine::session::{Jog, JogSpace, Note, Session, SessionConfig, SessionError};
use ipc::{Answer, Arm, ClientServer, Clock, Identity, Ownership, StatusWriter, Verb};
use serde_json::{Value, json};

use crate::client::{self, ArmOption};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::simulation::{Kind, Simulation};

/// How often the report for everybody is written.
const REPORT: Duration = Duration::from_millis(100);

/// How many notes are kept for clients that ask.
const KEPT: usize = 512;

/// How long the notes of one answer may be together (bytes).
const NOTES: usize = ipc::LONGEST_ANSWER * 3 / 4;

/// How an engine is started.
#[derive(Args, Debug)]
pub(crate) struct HostOptions {
    #[command(flatten)]
    pub(crate) arm: ArmOption,
    /// Servo rate
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = rate)]
    pub(crate) rate: f64,
    /// Which driver moves the arm
    #[arg(long, value_enum, default_value_t = DriverChoice::Sim)]
    pub(crate) driver: DriverChoice,
    /// Python that runs the MuJoCo driver
    #[arg(long, value_name = "PYTHON", default_value = "python3")]
    python: String,
    /// Go in step with the driver instead of by the clock: faster, and the same every time
    #[arg(long)]
    lock_step: bool,
}

/// What an engine does with a command that it refuses.
#[derive(Args, Debug)]
pub(crate) struct RefusalOption {
    /// What happens when a command cannot be executed
    #[arg(long, value_enum, default_value_t = OnRefusal::Abort)]
    on_refusal: OnRefusal,
}

impl RefusalOption {
    /// The policy that was chosen.
    pub(crate) fn policy(&self) -> FailurePolicy {
        self.on_refusal.into()
    }
}

/// Which driver moves the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DriverChoice {
    /// The built-in simulated servo, started and ended with the engine.
    Sim,
    /// A MuJoCo simulation of the robot's URDF, started and ended with the engine.
    Mujoco,
    /// One that runs already.
    External,
}

/// What happens when a command cannot be executed.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum OnRefusal {
    /// Stop and forget the rest of the program.
    Abort,
    /// The command has no effect; go on with the next.
    Skip,
    /// Stop and wait for the operator.
    Hold,
}

impl From<OnRefusal> for FailurePolicy {
    fn from(choice: OnRefusal) -> Self {
        match choice {
            OnRefusal::Abort => Self::Abort,
            OnRefusal::Skip => Self::Skip,
            OnRefusal::Hold => Self::Hold,
        }
    }
}

impl HostOptions {
    /// Starts driver (if it is ours) and session, opens the channels for clients.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] without a driver or with another engine on the arm; the driver that was
    /// started is ended again.
    pub(crate) fn start(
        &self,
        robot: &Robot,
        place: &str,
        default_length: crcl::LengthUnit,
        on_refusal: FailurePolicy,
    ) -> Result<Host, Failure> {
        let arm = self.arm.open()?;
        // Before the driver: a second engine must not disturb the arm of the first.
        let clients = ClientServer::open(&arm).map_err(client::failure)?;
        let status = StatusWriter::open(&arm).map_err(client::failure)?;
        let simulation = match self.driver {
            DriverChoice::Sim => Some(Kind::Servos),
            DriverChoice::Mujoco => Some(Kind::Mujoco {
                python: &self.python,
            }),
            DriverChoice::External => None,
        };
        let simulation = simulation
            .map(|kind| Simulation::start(kind, place, &arm))
            .transpose()?;
        let mut config = SessionConfig::new(arm.clone());
        config.rate_hz = self.rate;
        config.clock = if self.lock_step {
            Clock::LockStep
        } else {
            Clock::Wall
        };
        config.record = true;
        config.on_refusal = on_refusal;
        config.default_length = default_length;
        let session = Session::start(robot, &config).map_err(failure)?;
        if let Some(warning) = &session.warning {
            tracing::warn!("{warning}");
        }
        Ok(Host {
            arm,
            session,
            clients,
            status,
            reported: None,
            ownership: Ownership::default(),
            notes: VecDeque::new(),
            count: 0,
            shutdown: false,
            _simulation: simulation,
        })
    }
}

/// A fault of the session's start with its exit code.
fn failure(error: SessionError) -> Failure {
    let exit = match &error {
        SessionError::Robot(_) => Exit::Unreadable,
        SessionError::Executor(ExecutorError::Rate { .. } | ExecutorError::Limit { .. }) => {
            Exit::Usage
        }
        SessionError::Executor(_) => Exit::NoPeer,
        _ => Exit::Internal,
    };
    Failure::new(exit, error)
}

/// A running session with its clients and, perhaps, its simulated driver.
///
/// Fields are dropped in this order: the session stops the arm while the driver still lives.
pub(crate) struct Host {
    /// The arm.
    pub(crate) arm: Arm,
    /// The session.
    pub(crate) session: Session,
    clients: ClientServer,
    status: StatusWriter,
    reported: Option<Instant>,
    ownership: Ownership,
    notes: VecDeque<Value>,
    count: u64,
    shutdown: bool,
    _simulation: Option<Simulation>,
}

impl Host {
    /// Takes the arm for this process: other clients may stop it, not command it.
    pub(crate) fn own(&mut self, name: &str) {
        let client = Identity {
            name: name.to_owned(),
            process: std::process::id(),
        };
        self.ownership.give(client);
    }

    /// Whether a client has asked for the end.
    pub(crate) fn is_shut_down(&self) -> bool {
        self.shutdown
    }

    /// Serves clients, reports, and waits a little for the next thing that happens.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when shared memory fails.
    pub(crate) fn turn(&mut self) -> Result<Option<Note>, Failure> {
        // One batch in a turn: whoever floods us does not keep us from the signals.
        self.serve()?;
        if self.reported.is_none_or(|at| at.elapsed() >= REPORT) {
            self.reported = Some(Instant::now());
            self.status
                .write(&self.session.status())
                .map_err(client::failure)?;
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

    fn serve(&mut self) -> Result<usize, Failure> {
        let Self {
            session,
            clients,
            ownership,
            notes,
            count,
            shutdown,
            ..
        } = self;
        let served = clients.serve(|request| {
            let status = session.status();
            // Whoever may stop a motion may let it go on; what is executed stays the owner's.
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
        });
        served.map_err(client::failure)
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

/// Moves by hand for as long as the client goes on asking.
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

/// Passes on what acts on the motion that is under way.
fn control(session: &Session, ask: &Verb) -> Answer {
    match ask {
        Verb::Pause => session.control(Control::Pause),
        Verb::Resume => session.control(Control::Resume),
        Verb::Override { share } if (0.0..=1.0).contains(share) => {
            session.control(Control::Override(*share));
        }
        Verb::Override { share } => {
            return Answer::refuse(format!("an override is 0 to 1, got {share}"));
        }
        Verb::Stop { fast } => session.control(Control::Stop { fast: *fast }),
        Verb::Abort => session.control(Control::Abort),
        Verb::Recover => session.recover(),
        _ => return Answer::refuse("this engine cannot do that"),
    }
    Answer::accept(Value::Null)
}

/// A servo rate in Hz.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (100.0..=4000.0).contains(&value) => Ok(value),
        _ => Err("expected Hz from 100 to 4000".to_owned()),
    }
}

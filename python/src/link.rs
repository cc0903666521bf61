//! A running engine, from outside: requests, control of the motion, the latest state.
//!
//! The channels stay in the threads that open them. One thread asks, one controls the motion, one
//! reads setpoints and states; so no request waits for another of a different kind.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::Builder;
use std::time::{Duration, Instant};

use ipc::{
    Answer, Arm, Client, ControlAnswer, ControlAsk, ControlClient, Domain, IpcError, Observer,
    Setpoint, State, Verb,
};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Field, Raise, argument, internal};
use crate::program::json;
use crate::wait;

/// How often setpoints and states are read: a reader's buffer has 16 periods.
const READ: Duration = Duration::from_millis(4);

/// How often a call that waits looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// A request with the way back.
type Request<Q, A> = (Q, Duration, Sender<Result<A, IpcError>>);

/// The latest messages of an arm.
#[derive(Default)]
struct Latest {
    setpoint: Option<Setpoint>,
    state: Option<State>,
    failure: Option<IpcError>,
}

/// A running engine, from outside.
#[pyclass(frozen, module = "canter._canter")]
pub(crate) struct Link {
    arm: Arm,
    process: u32,
    asks: Mutex<Sender<Request<Verb, Answer>>>,
    controls: Mutex<Sender<Request<ControlAsk, ControlAnswer>>>,
    latest: OnceLock<Arc<Mutex<Latest>>>,
}

/// The domain of a directory, or the user's own.
fn domain(directory: Option<PathBuf>) -> PyResult<Domain> {
    let chosen = Domain::choose(directory.as_deref(), |name| std::env::var_os(name));
    Ok(chosen.map_err(Raise::from)?)
}

/// Names of the arms whose engine runs.
#[pyfunction]
#[pyo3(signature = (directory=None))]
pub(crate) fn engines(py: Python<'_>, directory: Option<PathBuf>) -> PyResult<Vec<String>> {
    let domain = domain(directory)?;
    let found = wait::long(py, "looking for engines", move || ipc::engines(&domain))?;
    Ok(found.map_err(Raise::from)?)
}

/// Serves requests with a channel that is opened at the first one, and anew after a failure: another
/// engine may have come meanwhile.
fn serve<C, Q, A>(
    requests: &Receiver<Request<Q, A>>,
    open: impl Fn() -> Result<C, IpcError>,
    ask: impl Fn(&C, Q, Duration) -> Result<A, IpcError>,
) {
    let mut channel = None;
    while let Ok((request, timeout, tell)) = requests.recv() {
        let answer = match channel.take().map_or_else(&open, Ok) {
            Ok(open) => {
                let answer = ask(&open, request, timeout);
                if answer.is_ok() {
                    channel = Some(open);
                }
                answer
            }
            Err(error) => Err(error),
        };
        // Whoever asked may have given up.
        let _ = tell.send(answer);
    }
}

fn start(name: &str, run: impl FnOnce() + Send + 'static) -> PyResult<()> {
    Builder::new()
        .name(name.to_owned())
        .spawn(run)
        .map(|_| ())
        .map_err(PyErr::from)
}

/// Sends a request to its thread and waits for the answer; Ctrl-C ends the wait.
fn request<Q: Send, A: Send>(
    py: Python<'_>,
    to: &Mutex<Sender<Request<Q, A>>>,
    what: Q,
    timeout: f64,
) -> PyResult<A> {
    if !(0.0..=3600.0).contains(&timeout) {
        return Err(argument(format!(
            "timeout: expected 0 to 3600 s, got {timeout}"
        )));
    }
    let (tell, told) = channel();
    let sent = match to.lock() {
        Ok(to) => to.send((what, Duration::from_secs_f64(timeout), tell)),
        Err(_) => return Err(internal("a request")),
    };
    sent.map_err(|_| internal("a request"))?;
    let told = Mutex::new(told);
    loop {
        let heard = py.detach(|| match told.lock() {
            Ok(told) => told.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match heard {
            Ok(answer) => return Ok(answer.map_err(Raise::from)?),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Err(internal("a request")),
        }
    }
}

impl Link {
    /// Shared memory does not survive a fork: the child would use the channels of its parent.
    fn check_process(&self) -> PyResult<()> {
        if std::process::id() == self.process {
            return Ok(());
        }
        let text = "this arm was opened before the process was forked; open it in the new process, \
                    or start processes with multiprocessing.get_context(\"spawn\")";
        Err(Raise::new("ConnectionFailed", text).into())
    }
}

#[pymethods]
impl Link {
    /// Makes the threads; the channels are opened when they are needed.
    #[new]
    #[pyo3(signature = (arm, directory, name))]
    fn new(arm: &str, directory: Option<PathBuf>, name: String) -> PyResult<Self> {
        let arm = domain(directory)?
            .arm(arm)
            .map_err(|error| argument(&error))?;
        let (asks, asked) = channel::<Request<Verb, Answer>>();
        let (controls, controlled) = channel::<Request<ControlAsk, ControlAnswer>>();
        let of = arm.clone();
        start("canter client", move || {
            serve(&asked, || Client::open(&of, &name), Client::ask);
        })?;
        let of = arm.clone();
        start("canter control", move || {
            serve(&controlled, || ControlClient::open(&of), ControlClient::ask);
        })?;
        Ok(Self {
            arm,
            process: std::process::id(),
            asks: Mutex::new(asks),
            controls: Mutex::new(controls),
            latest: OnceLock::new(),
        })
    }

    /// Name of the arm.
    #[getter]
    fn arm(&self) -> String {
        self.arm.to_string()
    }

    /// Directory of its domain.
    #[getter]
    fn domain(&self) -> PathBuf {
        self.arm.domain().directory().to_owned()
    }

    /// Asks the engine; request and answer are JSON. A refusal is `Refused`.
    fn ask(&self, py: Python<'_>, verb: &str, timeout: f64) -> PyResult<String> {
        self.check_process()?;
        let verb: Verb = serde_json::from_str(verb)
            .map_err(|cause| argument(format!("not a request: {cause}")))?;
        let answer = request(py, &self.asks, verb, timeout)?;
        if answer.accepted {
            Ok(json(&answer.body))
        } else {
            Err(Raise::new("Refused", answer.message)
                .with("arm", Field::Text(self.arm.to_string()))
                .into())
        }
    }

    /// Acts on the current motion: look, pause, resume, override, stop, stop-fast, abort, recover.
    fn control<'py>(
        &self,
        py: Python<'py>,
        kind: &str,
        share: f64,
        timeout: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.check_process()?;
        let ask = match kind {
            "look" => ControlAsk::Look,
            "pause" => ControlAsk::Pause,
            "resume" => ControlAsk::Resume,
            "override" => ControlAsk::Override(share),
            "stop" => ControlAsk::Stop { fast: false },
            "stop-fast" => ControlAsk::Stop { fast: true },
            "abort" => ControlAsk::Abort,
            "recover" => ControlAsk::Recover,
            other => return Err(argument(format!("there is no control {other:?}"))),
        };
        let answer = request(py, &self.controls, ask, timeout)?;
        if answer.accepted != 1 {
            return Err(Raise::new("Refused", answer.reason())
                .with("arm", Field::Text(self.arm.to_string()))
                .into());
        }
        let reached = PyDict::new(py);
        reached.set_item("resting", answer.resting == 1)?;
        reached.set_item("held", answer.held == 1)?;
        reached.set_item("idle", answer.idle == 1)?;
        reached.set_item("fault", answer.fault)?;
        reached.set_item("tick", answer.tick)?;
        reached.set_item("time_scaling", answer.time_scaling)?;
        Ok(reached)
    }

    /// The latest setpoint and state, as dictionaries of arrays; empty where none has come.
    fn latest<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
        self.check_process()?;
        let board = self.board(py)?;
        let Ok(latest) = board.lock() else {
            return Err(internal("reading the arm"));
        };
        if let Some(failure) = &latest.failure {
            return Err(Raise::from(failure.clone()).into());
        }
        let (setpoint, state) = (PyDict::new(py), PyDict::new(py));
        if let Some(found) = &latest.setpoint {
            let joints = found.joints as usize;
            setpoint.set_item("tick", found.tick)?;
            setpoint.set_item("command", found.command)?;
            setpoint.set_item("path_time", found.path_time)?;
            setpoint.set_item("time_scaling", found.time_scaling)?;
            setpoint.set_item("q", list(py, &found.position, joints))?;
            setpoint.set_item("dq", list(py, &found.velocity, joints))?;
            setpoint.set_item("ddq", list(py, &found.acceleration, joints))?;
        }
        if let Some(found) = &latest.state {
            let joints = found.joints as usize;
            state.set_item("sequence", found.sequence)?;
            state.set_item("q", list(py, &found.position, joints))?;
            state.set_item("dq", list(py, &found.velocity, joints))?;
            state.set_item("effort", list(py, &found.effort, joints))?;
        }
        Ok((setpoint, state))
    }
}

fn list<'py>(py: Python<'py>, numbers: &[f64], joints: usize) -> Bound<'py, PyArray1<f64>> {
    let some = &numbers[..joints.min(numbers.len())];
    some.to_vec().into_pyarray(py)
}

impl Link {
    /// Where the latest messages are; the first call starts the thread that reads them, and waits a
    /// moment for them.
    fn board(&self, py: Python<'_>) -> PyResult<Arc<Mutex<Latest>>> {
        if let Some(board) = self.latest.get() {
            return Ok(Arc::clone(board));
        }
        let board = Arc::new(Mutex::new(Latest::default()));
        if self.latest.set(Arc::clone(&board)).is_ok() {
            let (arm, seen) = (self.arm.clone(), Arc::downgrade(&board));
            start("canter observer", move || watch(&arm, &seen))?;
        }
        let end = Instant::now() + Duration::from_millis(500);
        loop {
            let came = match board.lock() {
                Ok(latest) => {
                    latest.failure.is_some() || latest.setpoint.is_some() && latest.state.is_some()
                }
                Err(_) => true,
            };
            if came || Instant::now() >= end {
                return Ok(board);
            }
            py.detach(|| std::thread::sleep(READ));
            py.check_signals()?;
        }
    }
}

/// Reads messages until nobody wants them any more.
fn watch(arm: &Arm, board: &std::sync::Weak<Mutex<Latest>>) {
    let observer = Observer::open(arm);
    while let Some(board) = board.upgrade() {
        let Ok(mut latest) = board.lock() else { return };
        let observer = match &observer {
            Ok(observer) => observer,
            Err(error) => {
                latest.failure = Some(error.clone());
                return;
            }
        };
        while let Some(setpoint) = observer.next_setpoint() {
            latest.setpoint = Some(setpoint);
        }
        while let Some(state) = observer.next_state() {
            latest.state = Some(state);
        }
        drop(latest);
        drop(board);
        std::thread::sleep(READ);
    }
}

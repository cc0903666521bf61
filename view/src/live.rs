//! A running arm: two threads that look on, one that asks and one for what cannot wait.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, sleep};
use std::time::{Duration, Instant};

use ipc::{
    Answer, Arm, Client, ControlAsk, ControlClient, IpcError, Observer, Setpoint, State, Verb,
    whole_text,
};
use nalgebra::Isometry3;
use planner::robot::Robot;
use recorder::{Head, Period, Sample};
use scheduling::{RealTimeRequest, request_real_time};
use serde_json::{Value, json};

use crate::ViewError;
use crate::blocks::{Packer, Row};
use crate::forward::forward;
use crate::preview::{Detail, Draft, preview};
use crate::scene;
use crate::source::Board;

/// How often shared memory is looked at: a reader's buffer has 16 periods.
const LOOK: Duration = Duration::from_millis(4);

/// `SCHED_FIFO` priority of the thread that reads the periods: the lowest but a few.
const PRIORITY: i32 = 5;

/// How often a block goes out.
const BLOCK: Duration = Duration::from_millis(16);

/// How often the engine is asked where it is.
const ASK: Duration = Duration::from_millis(100);

/// How long the engine may take to answer.
const PATIENCE: Duration = Duration::from_millis(1500);

/// How long to wait before an engine that is not there is looked for again.
const AGAIN: Duration = Duration::from_millis(500);

/// A request for the engine, with the way back.
type Ask = (Verb, Sender<Result<Answer, IpcError>>);

/// A request for the motion under way, with the way back.
type Control = (ControlAsk, Sender<Result<(), String>>);

/// The way to the engine, for every page.
#[derive(Clone, Debug)]
pub(crate) struct EngineHandle {
    asks: Sender<Ask>,
    controls: Sender<Control>,
}

impl EngineHandle {
    /// Asks the engine; its words where it refuses.
    pub(crate) fn ask(&self, verb: Verb) -> Result<(), String> {
        let (tell, told) = channel();
        let gone = || "the view is ending".to_owned();
        self.asks.send((verb, tell)).map_err(|_| gone())?;
        match told.recv().map_err(|_| gone())? {
            Ok(answer) if answer.accepted => Ok(()),
            Ok(answer) => Err(answer.message),
            Err(error) => Err(error.to_string()),
        }
    }

    /// Asks something of the motion under way, on a channel of its own.
    pub(crate) fn control(&self, ask: ControlAsk) -> Result<(), String> {
        let (tell, told) = channel();
        let gone = || "the view is ending".to_owned();
        self.controls.send((ask, tell)).map_err(|_| gone())?;
        told.recv().map_err(|_| gone())?
    }
}

/// Starts to look on; gives the way to the engine.
///
/// # Errors
/// There is no thread.
pub(crate) fn start(
    arm: &Arm,
    board: &Arc<Board>,
    known: &Arc<Mutex<Option<Robot>>>,
    ends: &Arc<AtomicBool>,
) -> Result<EngineHandle, ViewError> {
    let (asks, asked) = channel();
    let (controls, controlled) = channel();
    let (robots, robot) = channel();
    let (name, seen, stop) = (arm.clone(), Arc::clone(board), Arc::clone(ends));
    spawn("view stream", move || watch(&name, &robot, &seen, &stop))?;
    let mut talk = Talk {
        arm: arm.clone(),
        board: Arc::clone(board),
        robots,
        known: Arc::clone(known),
        robot: None,
        note: None,
        program: 0,
        planning: Arc::new(AtomicBool::new(false)),
    };
    let stop = Arc::clone(ends);
    spawn("view engine", move || talk.run(&asked, &stop))?;
    let name = arm.clone();
    spawn("view control", move || obey(&name, &controlled))?;
    Ok(EngineHandle { asks, controls })
}

fn spawn(name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), ViewError> {
    let thread = Builder::new().name(name.to_owned()).stack_size(8 << 20);
    thread
        .spawn(run)
        .map(|_| ())
        .map_err(|cause| ViewError::Thread {
            cause: cause.to_string(),
        })
}

/// Passes on what acts on the motion under way. The channel is opened anew for each: a new engine
/// may have come meanwhile.
fn obey(arm: &Arm, controls: &Receiver<Control>) {
    while let Ok((ask, tell)) = controls.recv() {
        let answer = ControlClient::open(arm).and_then(|client| client.ask(ask, PATIENCE));
        let told = match answer {
            Ok(answer) if answer.accepted == 1 => Ok(()),
            Ok(answer) => Err(answer.reason()),
            Err(error) => Err(error.to_string()),
        };
        // A page that has gone needs no answer.
        let _ = tell.send(told);
    }
}

/// The thread that talks with the engine.
struct Talk {
    arm: Arm,
    board: Arc<Board>,
    robots: Sender<(Robot, u64)>,
    /// The robot, for the plans of pages.
    known: Arc<Mutex<Option<Robot>>>,
    robot: Option<Robot>,
    note: Option<u64>,
    program: u64,
    planning: Arc<AtomicBool>,
}

impl Talk {
    fn run(&mut self, asks: &Receiver<Ask>, ends: &AtomicBool) {
        let mut client = None;
        while !ends.load(Ordering::Acquire) {
            if client.is_none() {
                client = Client::open(&self.arm, "canter view").ok();
            }
            let present = client.as_ref().is_some_and(|client| self.look(client));
            if !present {
                client = None;
                self.tell_absent();
            }
            let until = Instant::now() + if present { ASK } else { AGAIN };
            loop {
                let left = until.saturating_duration_since(Instant::now());
                match asks.recv_timeout(left) {
                    Ok((verb, tell)) => {
                        let answer = match &client {
                            Some(client) => client.ask(verb, PATIENCE),
                            None => Err(IpcError::NoAnswer {
                                arm: self.arm.to_string(),
                                role: "engine",
                                waited_ms: 0,
                            }),
                        };
                        // A page that has gone needs no answer.
                        let _ = tell.send(answer);
                    }
                    Err(RecvTimeoutError::Timeout) => break,
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            }
        }
    }

    fn tell_absent(&mut self) {
        self.robot = None;
        (self.note, self.program) = (None, 0);
        let arm = self.arm.to_string();
        let text =
            format!("no engine of {arm} is running: start one with canter engine --arm {arm}");
        self.board
            .set_status(&json!({"is": "status", "engine": false, "reason": text}));
    }

    /// Asks where the engine is; says whether it is there.
    fn look(&mut self, client: &Client) -> bool {
        let ask = |verb: Verb| {
            let answer = client.ask(verb, PATIENCE).ok()?;
            answer.accepted.then_some(answer.body)
        };
        let Some(body) = ask(Verb::Status) else {
            return false;
        };
        let name = body["status"]["robot"].as_str().unwrap_or_default();
        if self.robot.as_ref().is_none_or(|robot| robot.name != name) {
            let texts = (whole(client, "urdf"), whole(client, "robot"));
            let (Some(urdf), Some(toml)) = texts else {
                return false;
            };
            let Ok(mut robot) = planner::robot::parse(name, &urdf, &toml) else {
                return false;
            };
            // Its meshes are there, for the picture.
            let folder = whole(client, "folder").filter(|folder| !folder.is_empty());
            robot.folder = folder.map(PathBuf::from);
            let period_ns = period_of(&body);
            self.board
                .set_robot(&scene::robot(&robot, &self.arm.to_string(), period_ns));
            // The thread of the stream needs the robot for the controlled point.
            let _ = self.robots.send((robot.clone(), period_ns));
            if let Ok(mut known) = self.known.lock() {
                *known = Some(robot.clone());
            }
            self.robot = Some(robot);
        }
        self.board.set_status(&json!({
            "is": "status", "engine": true, "status": body["status"], "program": body["program"],
        }));
        self.read_notes(client, body["last_note"].as_u64().unwrap_or(0));
        let number = body["program"]["number"].as_u64().unwrap_or(0);
        if number != self.program
            && let Some(text) = whole(client, "program")
        {
            self.program = number;
            self.take_program(&body["program"], text);
        }
        true
    }

    fn read_notes(&mut self, client: &Client, last: u64) {
        // Whoever comes late sees the last of them.
        let known = *self.note.get_or_insert(last.saturating_sub(50));
        if last == known {
            return;
        }
        // An engine that is younger than what we know has begun again.
        let since = if last < known { 0 } else { known };
        let Ok(answer) = client.ask(Verb::Notes { since }, PATIENCE) else {
            return;
        };
        for note in answer.body["notes"].as_array().into_iter().flatten() {
            self.note = note["number"].as_u64().or(self.note);
            self.board.add_note(note["note"].clone());
        }
    }

    /// Shows a program that the engine was given, and plans it for the preview.
    fn take_program(&mut self, about: &Value, text: String) {
        let word = |name: &str| about[name].as_str().unwrap_or_default().to_owned();
        let mut program = about.clone();
        program["text"] = Value::String(text.clone());
        self.board.set_program(&program);
        let start = about["start"].as_array();
        let draft = Draft {
            name: word("name"),
            form: word("form"),
            text,
            start: start.map(|list| list.iter().filter_map(Value::as_f64).collect()),
            default_length: word("default_length"),
            rate_hz: 1000.0,
            detail: Detail::Picture,
        };
        let Some(robot) = self.robot.clone() else {
            return;
        };
        if self.planning.swap(true, Ordering::AcqRel) {
            return;
        }
        let (board, planning) = (Arc::clone(&self.board), Arc::clone(&self.planning));
        // Where there is no thread there is no preview.
        let _ = spawn("view preview", move || {
            board.set_preview(&preview(&robot, &draft));
            planning.store(false, Ordering::Release);
        });
    }
}

/// A long text of the engine.
fn whole(client: &Client, of: &str) -> Option<String> {
    let ask = |verb| {
        let answer = client.ask(verb, PATIENCE).ok();
        let taken = answer.filter(|answer| answer.accepted);
        taken.map(|answer| answer.body).ok_or(())
    };
    whole_text(of, ask).ok()
}

/// Length of a period; the setpoints say it better, but come later.
fn period_of(body: &Value) -> u64 {
    body["period_ns"].as_u64().unwrap_or(1_000_000)
}

/// The thread that reads every period. Among other programs it would come too late for some: where
/// that is allowed, it goes before them, and behind the threads of the engine.
fn watch(arm: &Arm, robots: &Receiver<(Robot, u64)>, board: &Board, ends: &AtomicBool) {
    // Where it is refused, periods may be lost: pages count them.
    let _granted = request_real_time(RealTimeRequest {
        priority: PRIORITY,
        processor: None,
        lock_memory: false,
        low_latency: false,
    });
    while !ends.load(Ordering::Acquire) {
        match robots.recv_timeout(AGAIN) {
            Ok((robot, period_ns)) => {
                let (Ok(point), Ok(observer)) = (forward(&robot), Observer::open(arm)) else {
                    continue;
                };
                board.periods.set_head(head(arm, &robot, period_ns));
                let stream = Stream {
                    arm: arm.clone(),
                    observer,
                    samples: Vec::new(),
                    joints: robot.dof(),
                    packer: Packer::new(robot.dof(), period_ns),
                    state: State::default(),
                    point,
                };
                stream.run(robots, board, ends);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// The periods of one engine.
struct Stream {
    arm: Arm,
    observer: Observer,
    /// Whole periods, where a viewer of another program looks on.
    samples: Vec<Sample>,
    joints: usize,
    packer: Packer,
    state: State,
    point: crate::forward::Forward,
}

impl Stream {
    /// Reads until there is another robot: a new engine.
    fn run(mut self, robots: &Receiver<(Robot, u64)>, board: &Board, ends: &AtomicBool) {
        let mut sent = Instant::now();
        while !ends.load(Ordering::Acquire) {
            self.read(board);
            if sent.elapsed() >= BLOCK {
                sent = Instant::now();
                if let Some(block) = self.packer.take() {
                    board.blocks.push(block);
                }
                board.periods.push(std::mem::take(&mut self.samples));
            }
            match robots.try_recv() {
                Ok((robot, period_ns)) if robot.dof() == self.joints => {
                    if let Ok(point) = forward(&robot) {
                        board.periods.set_head(head(&self.arm, &robot, period_ns));
                        self.point = point;
                        self.packer = Packer::new(self.joints, period_ns);
                    }
                }
                Ok(_) => return,
                Err(_) => {}
            }
            sleep(LOOK);
        }
    }

    fn read(&mut self, board: &Board) {
        while let Some(state) = self.observer.next_state() {
            if state.check(self.joints).is_ok() {
                self.state = state;
            }
        }
        while let Some(setpoint) = self.observer.next_setpoint() {
            if setpoint.check(self.joints).is_err() {
                continue;
            }
            let pose = (self.point)(&setpoint.position);
            if board.periods.is_wanted() {
                self.samples.push(self.sample(&setpoint, &pose));
            }
            let list = |values: &[f64]| values.iter().take(self.joints).copied().collect();
            let row = Row {
                tick: setpoint.tick,
                sequence: setpoint.sequence,
                command: setpoint.command,
                path_time: setpoint.path_time,
                time_scaling: setpoint.time_scaling,
                late_us: setpoint.published_ns.saturating_sub(setpoint.tick_ns) as f64 * 1e-3,
                joints: [
                    list(&setpoint.position),
                    list(&setpoint.velocity),
                    list(&setpoint.acceleration),
                    list(&self.state.position),
                ],
                point: pose.translation.vector.into(),
            };
            if let Some(block) = self.packer.push(&row) {
                board.blocks.push(block);
            }
        }
    }

    /// A period as recordings have it.
    fn sample(&self, setpoint: &Setpoint, pose: &Isometry3<f64>) -> Sample {
        let measured = (self.point)(&self.state.position);
        let period = Period {
            tick: setpoint.tick,
            command: setpoint.command,
            path_time: setpoint.path_time,
            time_scaling: setpoint.time_scaling,
            published: [
                &setpoint.position,
                &setpoint.velocity,
                &setpoint.acceleration,
            ],
            measured: &self.state.position,
            tool: scene::list(pose),
            measured_tool: measured.translation.vector.into(),
        };
        Sample::of(&period, self.joints)
    }
}

/// What the periods of an arm are about; wall time is taken from the first of them.
fn head(arm: &Arm, robot: &Robot, period_ns: u64) -> Head {
    Head {
        form: recorder::FORM,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        arm: arm.to_string(),
        robot: robot.name.clone(),
        driver: String::new(),
        joints: robot.joint_names(),
        root_link: robot.model.base_link.clone(),
        period_ns,
        begin_ns: 0,
        workstation_from_base: scene::list(&robot.workstation_from_base),
        start: Vec::new(),
        default_length: "mm".to_owned(),
        reason: "live".to_owned(),
        urdf: robot.urdf.clone(),
        robot_toml: String::new(),
    }
}

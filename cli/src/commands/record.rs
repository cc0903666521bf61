use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Args;
use engine::host::GivenProgram;
use engine::recorded_arm::{RecordedArm, level, pose_numbers};
use ipc::{Observer, Setpoint, State, Verb};
use planner::robot::Robot;
use recorder::{Head, Period, Periods, Recording, Sample, topic};
use serde_json::Value;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::client::ArmOption;
use crate::engine_client::EngineClient;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::forward::{Forward, forward};
use crate::output;
use crate::printer::Printer;
use crate::recorder_options::{RotationOptions, default_name, report};

/// How often shared memory is looked at: a reader's buffer has 16 periods.
const LOOK: Duration = Duration::from_millis(2);

/// How often the engine is asked what happened.
const ASK: Duration = Duration::from_millis(500);

/// How long an engine may be silent before the recording ends.
const SILENCE: Duration = Duration::from_secs(5);

/// Record what an arm is told and does, as MCAP
///
/// Looks on from outside until Ctrl-C or until the engine ends; the arm waits for nothing. Foxglove,
/// Lichtblick, PlotJuggler and Rerun show the file as it is; `canter verify` judges it and `canter
/// replay` shows it. What a kill has cut off is read all the same; `--recover` makes a whole file of
/// it. Periods that came faster than they could be read are counted; `canter engine --record` loses
/// none.
#[derive(Args, Debug)]
pub(crate) struct Record {
    #[command(flatten)]
    arm: ArmOption,
    /// File to write [default: canter-<robot>-<time>.mcap]
    #[arg(long, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    #[command(flatten)]
    rotation: RotationOptions,
    /// End after this time
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Make a whole file of one that was cut off by a kill, and record nothing
    #[arg(long, value_name = "FILE.mcap.part", conflicts_with_all = ["out", "seconds"])]
    recover: Option<PathBuf>,
}

impl Record {
    /// Records until it is told to end.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        if let Some(path) = &self.recover {
            return recover(path);
        }
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let arm = self.arm.open()?;
        let engine = EngineClient::open(&arm, "canter record")?;
        let robot = engine.robot()?;
        let observer = Observer::open(&arm)?;
        let path = self
            .out
            .clone()
            .unwrap_or_else(|| default_name(&robot.name));
        let first = first_setpoint(&observer, robot.dof(), &stop)?;
        let mut watch = Watch {
            head: head(&robot, &arm.to_string(), &first),
            forward: forward(&robot)?,
            joints: robot.dof(),
            observer,
            last: None,
            state: State::default(),
            missed: 0,
            pending: None,
        };
        let recording = Recording::start(&path, watch.head.clone(), self.rotation.rotation())?;
        printer.note(&format!(
            "canter: recording {} into {}",
            arm,
            path.display()
        ));
        let silent = self.follow(&engine, &mut watch, &recording, &stop);
        if silent {
            printer.note("canter: the engine has ended, and so does the recording");
        }
        let summary = recording.close()?;
        report(printer, &summary);
        if watch.missed > 0 {
            printer.note(&format!(
                "canter: {} periods came faster than they could be read",
                watch.missed
            ));
        }
        Ok(Exit::Done)
    }

    /// Records until it is told to end; says whether the engine fell silent.
    fn follow(
        &self,
        engine: &EngineClient,
        watch: &mut Watch,
        recording: &Recording,
        stop: &AtomicBool,
    ) -> bool {
        let mut chronicle = Chronicle::default();
        let (begun, mut asked, mut heard) = (Instant::now(), None::<Instant>, Instant::now());
        let over = || {
            let seconds = begun.elapsed().as_secs_f64();
            self.seconds.is_some_and(|most| seconds >= most)
        };
        while !stop.load(Ordering::Relaxed) && !over() && heard.elapsed() < SILENCE {
            let samples = watch.look();
            if !samples.is_empty() {
                heard = Instant::now();
            }
            recording.put(samples);
            if asked.is_none_or(|at| at.elapsed() >= ASK) {
                asked = Some(Instant::now());
                chronicle.ask(engine, recording, watch.missed);
            }
            sleep(LOOK);
        }
        chronicle.ask(engine, recording, watch.missed);
        heard.elapsed() >= SILENCE
    }
}

/// Makes a whole file of one that was cut off.
fn recover(path: &Path) -> Result<Exit, Failure> {
    let recovered = recorder::recover(path)?;
    let was = match &recovered.cut {
        Some(cause) => format!("it was cut off ({cause})"),
        None => "it was whole".to_owned(),
    };
    output::note(&format!(
        "canter: {} periods of {} are in {}; {was}",
        recovered.samples,
        path.display(),
        recovered.path.display()
    ));
    Ok(Exit::Done)
}

/// Waits for the first setpoint: without an engine in its period there is nothing to record.
fn first_setpoint(
    observer: &Observer,
    joints: usize,
    stop: &AtomicBool,
) -> Result<Setpoint, Failure> {
    let end = Instant::now() + SILENCE;
    while Instant::now() < end && !stop.load(Ordering::Relaxed) {
        if let Some(setpoint) = observer.next_setpoint()
            && setpoint.check(joints).is_ok()
        {
            return Ok(setpoint);
        }
        sleep(LOOK);
    }
    let cause = anyhow::anyhow!(
        "the engine published no setpoint within {} s",
        SILENCE.as_secs()
    );
    Err(Failure::new(Exit::NoPeer, cause))
}

fn head(robot: &Robot, arm: &str, first: &Setpoint) -> Head {
    RecordedArm {
        robot,
        arm: arm.to_owned(),
        driver: String::new(),
        period_ns: first.period_ns,
        tick: first.tick,
        start: first.position.iter().take(robot.dof()).copied().collect(),
        default_length: "mm".to_owned(),
    }
    .head()
}

/// Setpoints and states as they come.
struct Watch {
    observer: Observer,
    head: Head,
    forward: Forward,
    joints: usize,
    last: Option<u64>,
    state: State,
    missed: u64,
    /// A setpoint whose answer may still come.
    pending: Option<Setpoint>,
}

impl Watch {
    /// What came since the last look, oldest first.
    fn look(&mut self) -> Vec<Sample> {
        let mut samples = Vec::new();
        while let Some(setpoint) = self.observer.next_setpoint() {
            if setpoint.check(self.joints).is_err() {
                continue;
            }
            if let Some(before) = self.pending.replace(setpoint) {
                self.read_states(before.sequence);
                samples.push(self.sample(&before));
            }
        }
        samples
    }

    /// Reads states up to the first that answers setpoint `sequence`.
    fn read_states(&mut self, sequence: u64) {
        while self.state.setpoint_sequence < sequence {
            match self.observer.next_state() {
                Some(state) if state.check(self.joints).is_ok() => self.state = state,
                Some(_) => {}
                None => return,
            }
        }
    }

    fn sample(&mut self, setpoint: &Setpoint) -> Sample {
        if let Some(last) = self.last {
            self.missed += setpoint.sequence.saturating_sub(last + 1);
        }
        self.last = Some(setpoint.sequence);
        let pose = (self.forward)(&setpoint.position);
        let measured = (self.forward)(&self.state.position);
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
            tool: pose_numbers(&pose),
            measured_tool: measured.translation.vector.into(),
        };
        Sample::of(&period, self.joints)
    }
}

/// What the engine tells of itself.
#[derive(Default)]
struct Chronicle {
    note: u64,
    program: u64,
    begun: bool,
}

impl Chronicle {
    /// Asks what happened. An engine that does not answer is asked again later.
    fn ask(&mut self, engine: &EngineClient, recording: &Recording, missed: u64) {
        let Ok(body) = engine.ask(Verb::Status) else {
            return;
        };
        if !self.begun {
            // What happened before is not of this recording.
            self.note = body["last_note"].as_u64().unwrap_or(0);
            self.begun = true;
        }
        let number = body["program"]["number"].as_u64().unwrap_or(0);
        if number > self.program
            && let Ok(text) = engine.text("program")
        {
            self.program = number;
            recording.latch(topic::PROGRAM_TOPIC, program(&body["program"], text));
        }
        let count = |name: &str| body["status"]["cycles"][name].as_u64().unwrap_or(0);
        recording.periods(Periods {
            ticks: count("ticks"),
            published: count("published"),
            skipped: count("skipped"),
            driver_missed: count("driver_missed"),
            unrecorded: missed,
        });
        let Ok(body) = engine.ask(Verb::Notes { since: self.note }) else {
            return;
        };
        for note in body["notes"].as_array().into_iter().flatten() {
            self.note = note["number"].as_u64().unwrap_or(self.note);
            let event = note["note"]["event"].as_str().unwrap_or_default();
            let json = note["note"].to_string();
            recording.note(level(event), json.clone(), json);
        }
    }
}

/// A program as recordings have it.
fn program(about: &Value, text: String) -> String {
    let word = |name: &str| about[name].as_str().unwrap_or_default().to_owned();
    let number = |name: &str| about[name].as_u64().unwrap_or(0) as u32;
    let start = about["start"].as_array();
    let given = GivenProgram {
        form: word("form"),
        name: word("name"),
        text,
        first: number("first"),
        last: number("last"),
        start: start.map(|list| list.iter().filter_map(Value::as_f64).collect()),
        default_length: word("default_length"),
    };
    serde_json::to_string(&given).unwrap_or_default()
}

//! The flight recorder of a session: a ring of the last minute that a fault writes to a file, and a
//! recording of all where one is asked for.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use ipc::Arm;
use planner::robot::Robot;
use recorder::{Head, Period, Periods, Recording, Ring, Rotation, Sample, Summary, topic};

use crate::recorded_arm::{RecordedArm, level, pose_numbers, wall_ns};
use crate::session::{Note, RunSample, Session, Status};
use crate::texts::GivenProgram;

/// How long the ring is (s).
const RING_S: f64 = 60.0;

/// How long a fault's file goes on after the fault.
const AFTER: Duration = Duration::from_secs(3);

/// How often periods are counted.
const COUNT: Duration = Duration::from_secs(1);

/// How many files of faults a folder keeps; the oldest go first.
const FAULT_FILES: usize = 20;

/// The longest program or plan that is recorded (bytes).
const LONGEST_TEXT: usize = 32 << 20;

/// What is recorded, and where to.
#[derive(Clone, Debug, Default)]
pub struct FlightOptions {
    /// File of a recording of all; none without.
    pub record: Option<PathBuf>,
    /// When a new file of it begins.
    pub rotation: Rotation,
    /// Folder of the files that faults write; none without.
    pub faults: Option<PathBuf>,
}

/// The session that is recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Recorded<'a> {
    pub(crate) robot: &'a Robot,
    pub(crate) arm: &'a Arm,
    pub(crate) session: &'a Session,
    pub(crate) rate_hz: f64,
    pub(crate) default_length: &'a str,
}

/// The flight recorder of a session.
#[derive(Debug)]
pub(crate) struct Flight {
    head: Head,
    recording: Option<Recording>,
    ring: Ring,
    faults: Option<PathBuf>,
    /// The file of the last fault while it is written.
    after: Option<(Recording, Instant)>,
    notes: Vec<(u8, String, String)>,
    program: Option<String>,
    certificate: Option<String>,
    counted: Instant,
    /// Why the recording ended before its time.
    failure: Option<String>,
}

impl Flight {
    /// A flight recorder of a session.
    ///
    /// # Errors
    /// The file of the recording cannot be written.
    pub(crate) fn new(
        recorded: Recorded<'_>,
        options: &FlightOptions,
    ) -> Result<Self, recorder::RecorderError> {
        let Recorded {
            robot,
            session,
            rate_hz,
            ..
        } = recorded;
        let head = RecordedArm {
            robot,
            arm: recorded.arm.to_string(),
            driver: session.driver.clone(),
            period_ns: (1e9 / rate_hz).round() as u64,
            tick: session.progress().tick,
            start: session.start.clone(),
            default_length: recorded.default_length.to_owned(),
        }
        .head();
        let recording = options
            .record
            .as_deref()
            .map(|path| Recording::start(path, head.clone(), options.rotation))
            .transpose()?;
        Ok(Self {
            recording,
            ring: Ring::new((RING_S * rate_hz) as usize),
            faults: options.faults.clone(),
            after: None,
            notes: Vec::new(),
            program: None,
            certificate: None,
            counted: Instant::now(),
            failure: None,
            head,
        })
    }

    /// Takes samples, oldest first.
    pub(crate) fn samples(&mut self, samples: &[RunSample]) {
        if samples.is_empty() {
            return;
        }
        let samples: Vec<Sample> = samples.iter().map(sample).collect();
        for sample in &samples {
            self.ring.push(*sample);
        }
        if let Some((recording, until)) = &self.after {
            recording.put(samples.clone());
            if Instant::now() >= *until {
                self.end_fault();
            }
        }
        if let Some(recording) = &mut self.recording {
            recording.put(samples);
            if let Some(error) = recording.failure() {
                self.failure = Some(error.to_string());
                self.recording = None;
            }
        }
    }

    /// Why the recording ended before its time; said once.
    pub(crate) fn failure(&mut self) -> Option<String> {
        self.failure.take()
    }

    /// Takes counts of periods, once a second.
    pub(crate) fn count(&mut self, status: &Status) {
        if self.counted.elapsed() < COUNT {
            return;
        }
        self.counted = Instant::now();
        let cycles = status.cycles;
        let periods = Periods {
            ticks: cycles.ticks,
            published: cycles.published,
            skipped: cycles.skipped,
            driver_missed: cycles.driver_missed,
            unrecorded: cycles.lost_reports,
        };
        for recording in self.recordings() {
            recording.periods(periods);
        }
    }

    /// Takes what happened.
    pub(crate) fn note(&mut self, note: &Note) {
        let json = serde_json::to_value(note).unwrap_or_default();
        let level = level(json["event"].as_str().unwrap_or_default());
        let (json, words) = (json.to_string(), note.to_string());
        for recording in self.recordings() {
            recording.note(level, json.clone(), words.clone());
        }
        self.notes.push((level, json, words));
        if self.notes.len() > 256 {
            self.notes.remove(0);
        }
    }

    /// Takes a program, and what was proved of its moves (JSON) where that is known.
    pub(crate) fn program(&mut self, program: &GivenProgram, certificate: Option<String>) {
        if program.text.len() > LONGEST_TEXT {
            return;
        }
        let text = serde_json::to_string(program).unwrap_or_default();
        let certificate = certificate.filter(|text| text.len() <= LONGEST_TEXT);
        for recording in self.recordings() {
            recording.latch(topic::PROGRAM_TOPIC, text.clone());
            if let Some(certificate) = &certificate {
                recording.latch(topic::CERTIFICATE_TOPIC, certificate.clone());
            }
        }
        self.program = Some(text);
        self.certificate = certificate;
    }

    fn recordings(&self) -> impl Iterator<Item = &Recording> {
        let after = self.after.as_ref().map(|(recording, _)| recording);
        self.recording.iter().chain(after)
    }

    /// Writes the ring to a file of its own, which goes on for a moment; gives its name, or why
    /// there is none. Does not wait for the disk but to create the file.
    pub(crate) fn fault(&mut self) -> Option<Result<PathBuf, String>> {
        let folder = self.faults.clone()?;
        self.end_fault();
        Some(self.write_fault(&folder))
    }

    fn write_fault(&mut self, folder: &Path) -> Result<PathBuf, String> {
        fs::create_dir_all(folder)
            .map_err(|cause| format!("cannot make the folder {}: {cause}", folder.display()))?;
        remove_oldest(folder);
        let arm = self.head.arm.replace('/', "-");
        let name = format!("fault-{}-{arm}.mcap", wall_ns() / 1_000_000);
        let path = folder.join(name);
        let head = Head {
            reason: "fault".to_owned(),
            ..self.head.clone()
        };
        let recording = Recording::start(&path, head, Rotation::NEVER);
        let recording = recording.map_err(|error| error.to_string())?;
        if let Some(program) = &self.program {
            recording.latch(topic::PROGRAM_TOPIC, program.clone());
        }
        if let Some(certificate) = &self.certificate {
            recording.latch(topic::CERTIFICATE_TOPIC, certificate.clone());
        }
        recording.put(self.ring.take());
        for (level, json, words) in self.notes.drain(..) {
            recording.note(level, json, words);
        }
        self.after = Some((recording, Instant::now() + AFTER));
        Ok(path)
    }

    /// Ends the file of a fault in a thread of its own: writing it takes a moment.
    fn end_fault(&mut self) {
        if let Some((recording, _)) = self.after.take() {
            // Where there is no thread, it is ended here.
            let _ = std::thread::Builder::new()
                .name("recorder end".to_owned())
                .spawn(move || drop(recording));
        }
    }

    /// Ends the files: the recording's summary, if there is a recording.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn close(mut self) -> Result<Option<Summary>, recorder::RecorderError> {
        // The file of a fault is whole before the process ends.
        drop(self.after.take());
        self.recording.take().map(Recording::close).transpose()
    }
}

/// Leaves room for one more file of a fault.
fn remove_oldest(folder: &Path) {
    let listed = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<_> = listed
        .map(|entry| entry.path())
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("fault-") && name.ends_with(".mcap")
        })
        .collect();
    // The names have their time in them.
    found.sort();
    let surplus = (found.len() + 1).saturating_sub(FAULT_FILES);
    for path in found.iter().take(surplus) {
        // What cannot be removed stays.
        let _ = fs::remove_file(path);
    }
}

fn sample(from: &RunSample) -> Sample {
    let period = Period {
        tick: from.tick,
        command: from.command,
        path_time: from.path_time,
        time_scaling: from.time_scaling,
        published: [&from.q, &from.dq, &from.ddq],
        measured: &from.measured,
        tool: pose_numbers(&from.workstation_from_tool),
        measured_tool: from.measured_pose.translation.vector.into(),
    };
    Sample::of(&period, from.q.len())
}

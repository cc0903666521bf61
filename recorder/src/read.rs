//! Reading a recording, whole or cut off.

use std::fs;
use std::path::Path;

use mcap::MessageStream;
use mcap::read::Options;

use crate::error::unreadable;
use crate::{Head, Periods, RecorderError, Sample, message, topic};

/// Largest file that is read into memory (bytes).
const LARGEST: u64 = 4 << 30;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedNote {
    /// Wall time (ns since 1970).
    pub time_ns: u64,
    /// The note as JSON.
    pub json: String,
}

/// All that a file has.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// What it is about, with the robot's files.
    pub head: Head,
    /// Every period, oldest first.
    pub samples: Vec<Sample>,
    /// What happened.
    pub notes: Vec<RecordedNote>,
    /// Programs, each as JSON with name, form, text and the number of its first command.
    pub programs: Vec<String>,
    /// Plans with their certificates, as JSON.
    pub certificates: Vec<String>,
    /// The last counts of periods.
    pub periods: Option<Periods>,
    /// Messages in all.
    pub messages: u64,
    /// Why the file ends before its end, if it does: it was cut off by a kill.
    pub cut: Option<String>,
}

/// Parts of a recording while it is read.
#[derive(Default)]
struct Parts {
    head: Option<Head>,
    urdf: String,
    robot_toml: String,
    samples: Vec<Sample>,
    notes: Vec<RecordedNote>,
    programs: Vec<String>,
    certificates: Vec<String>,
    periods: Option<Periods>,
    messages: u64,
}

/// Reads a recording. One that was cut off is read as far as it goes.
///
/// # Errors
/// The file cannot be read, or is no recording of Canter.
pub fn read(path: &Path) -> Result<Recorded, RecorderError> {
    let found = fs::metadata(path).map_err(|cause| unreadable(path, cause))?;
    if !found.is_file() || found.len() > LARGEST {
        let cause = format!("expected a regular file of at most {} GiB", LARGEST >> 30);
        return Err(unreadable(path, cause));
    }
    let bytes = fs::read(path).map_err(|cause| unreadable(path, cause))?;
    let (parts, cut) = parse(&bytes).map_err(|cause| foreign(path, cause))?;
    let Some(head) = parts.head else {
        let found = match cut {
            Some(cause) => format!("a file without head ({cause})"),
            None => format!("a file of {} messages without head", parts.messages),
        };
        return Err(foreign(path, found));
    };
    Ok(Recorded {
        head: Head {
            urdf: parts.urdf,
            robot_toml: parts.robot_toml,
            ..head
        },
        samples: parts.samples,
        notes: parts.notes,
        programs: parts.programs,
        certificates: parts.certificates,
        periods: parts.periods,
        messages: parts.messages,
        cut,
    })
}

fn foreign(path: &Path, found: String) -> RecorderError {
    RecorderError::Foreign {
        path: path.to_owned(),
        found,
    }
}

/// The messages up to the end or the first that is broken, and why it ended there.
fn parse(bytes: &[u8]) -> Result<(Parts, Option<String>), String> {
    let whole = bytes.ends_with(mcap::MAGIC) && bytes.len() > mcap::MAGIC.len();
    let stream = MessageStream::new_with_options(bytes, Options::IgnoreEndMagic.into())
        .map_err(|cause| cause.to_string())?;
    let mut parts = Parts::default();
    for message in stream {
        let message = match message {
            Ok(message) => message,
            Err(cause) => return Ok((parts, Some(cause.to_string()))),
        };
        parts.messages += 1;
        let (topic, data) = (message.channel.topic.as_str(), &message.data);
        if parts.take(topic, message.log_time, data).is_none() {
            let number = parts.messages;
            return Err(format!("message {number}, on {topic}, in another form"));
        }
    }
    let cut = (!whole).then(|| "the file has no end".to_owned());
    Ok((parts, cut))
}

impl Parts {
    /// Takes a message; `None` where it is not in its form.
    fn take(&mut self, topic: &str, time_ns: u64, data: &[u8]) -> Option<()> {
        match topic {
            topic::SETPOINT_TOPIC => {
                self.samples.push(message::setpoint_of(data)?);
            }
            topic::STATE_TOPIC => {
                let (tick, measured, point) = message::state_of(data)?;
                if let Some(last) = self.samples.last_mut().filter(|last| last.tick == tick) {
                    (last.measured, last.measured_tool) = (measured, point);
                }
            }
            topic::NOTE_TOPIC => self.notes.push(RecordedNote {
                time_ns,
                json: message::text_of(data)?.to_owned(),
            }),
            topic::PERIODS_TOPIC => self.periods = Some(message::periods_of(data)?),
            topic::HEAD_TOPIC => {
                self.head = Some(serde_json::from_str(message::text_of(data)?).ok()?)
            }
            topic::URDF_TOPIC => message::text_of(data)?.clone_into(&mut self.urdf),
            topic::ROBOT_TOPIC => message::text_of(data)?.clone_into(&mut self.robot_toml),
            topic::PROGRAM_TOPIC => self.programs.push(message::text_of(data)?.to_owned()),
            topic::CERTIFICATE_TOPIC => self.certificates.push(message::text_of(data)?.to_owned()),
            // What is for viewers only.
            _ => {}
        }
        Some(())
    }
}

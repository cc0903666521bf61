//! Reading a recording, whole or cut off.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use mcap::parse_record;
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

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
    /// Whether the file was finished and is not as it was written: a checksum does not fit.
    /// [`Recorded::cut`] has the reason. What could be read all the same is here; each period is as it
    /// was written, and others may be missing.
    pub damaged: bool,
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
    /// Topics by the numbers of their channels.
    topics: BTreeMap<u16, String>,
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
    let (parts, end) = parse(&bytes).map_err(|cause| foreign(path, cause))?;
    let Some(head) = parts.head else {
        let found = match end.cut {
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
        cut: end.cut,
        damaged: end.damaged,
    })
}

/// Where a file ends.
struct End {
    cut: Option<String>,
    damaged: bool,
}

fn foreign(path: &Path, found: String) -> RecorderError {
    RecorderError::Foreign {
        path: path.to_owned(),
        found,
    }
}

/// The messages up to the end or the first broken chunk, and how it ended. The checksum of a chunk is
/// looked at before the first message of it is taken, and those of the whole file at its end.
fn parse(bytes: &[u8]) -> Result<(Parts, End), String> {
    let whole = bytes.ends_with(mcap::MAGIC) && bytes.len() > mcap::MAGIC.len();
    if !bytes.starts_with(mcap::MAGIC) {
        return Err("another kind of file".to_owned());
    }
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true);
    let mut reader = LinearReader::new_with_options(options);
    let (mut parts, mut finished) = (Parts::default(), false);
    let mut rest = bytes;
    let broken = |cause: String| End {
        cut: Some(cause),
        damaged: whole,
    };
    while let Some(event) = reader.next_event() {
        match event {
            Err(cause) => return Ok((parts, broken(cause.to_string()))),
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let (now, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            Ok(LinearReadEvent::Record { opcode, data }) => match parse_record(opcode, data) {
                Err(cause) => return Ok((parts, broken(cause.to_string()))),
                Ok(Record::DataEnd(_)) => finished = true,
                // What stands behind the messages repeats what is known.
                Ok(_) if finished => {}
                Ok(record) => parts.read(record)?,
            },
        }
    }
    let end = End {
        cut: (!whole).then(|| "the file has no end".to_owned()),
        damaged: finished && !whole,
    };
    Ok((parts, end))
}

impl Parts {
    /// Reads a record; those of no message and no channel say nothing here.
    fn read(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Channel(channel) => {
                self.topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => {
                self.messages += 1;
                let number = self.messages;
                let unknown = || format!("message {number} is on no channel");
                let topic = self.topics.get(&header.channel_id).cloned();
                let topic = topic.ok_or_else(unknown)?;
                let taken = self.take(&topic, header.log_time, &data);
                taken.ok_or_else(|| format!("message {number}, on {topic}, in another form"))?;
            }
            _ => {}
        }
        Ok(())
    }

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

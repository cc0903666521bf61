//! One MCAP file that is being written.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, rename};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions};

use crate::error::{created, unwritable};
use crate::live::live_messages;
use crate::topic::{self, TOPICS};
use crate::{Head, Periods, RecorderError, Sample, message};

/// Largest size of a chunk before it is compressed (bytes).
const CHUNK: u64 = 1 << 20;

/// Time between two messages of the slow topics (ns).
const SLOW_NS: u64 = 10_000_000;

/// One file. Until it is finished it has `.part` behind its name.
pub(crate) struct McapFile {
    path: PathBuf,
    part: PathBuf,
    out: mcap::Writer<BufWriter<File>>,
    file: File,
    channels: Vec<u16>,
    sequence: u32,
    last_ns: u64,
    slow_ns: u64,
    written: u64,
}

/// The name of a file that is not finished.
pub(crate) fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

impl McapFile {
    /// Creates the file with its head.
    pub(crate) fn create(path: &Path, head: &Head) -> Result<Self, RecorderError> {
        if path.exists() {
            let path = path.to_owned();
            return Err(RecorderError::Exists { path });
        }
        let part = part_of(path);
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&part)
            .map_err(|cause| created(&part, &cause))?;
        let failed = |cause: mcap::McapError| unwritable(&part, cause);
        let twin = file.try_clone().map_err(|cause| unwritable(&part, cause))?;
        let mut out = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK))
            .profile("ros2")
            .library(format!("canter {}", head.version))
            .create(BufWriter::new(file))
            .map_err(failed)?;
        let mut channels = Vec::with_capacity(TOPICS.len());
        for topic in &TOPICS {
            let schema = topic.schema;
            let id = out
                .add_schema(schema.name, "ros2msg", schema.text.as_bytes())
                .map_err(failed)?;
            let quality = topic.quality.to_owned();
            let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), quality)]);
            let id = out
                .add_channel(id, topic.name, "cdr", &metadata)
                .map_err(failed)?;
            channels.push(id);
        }
        let metadata = Metadata {
            name: "canter".to_owned(),
            metadata: head.metadata(),
        };
        out.write_metadata(&metadata).map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            part: part.clone(),
            out,
            file: twin,
            channels,
            sequence: 0,
            last_ns: 0,
            slow_ns: 0,
            written: 0,
        })
    }

    /// Bytes of messages so far, before compression.
    pub(crate) fn size(&self) -> u64 {
        self.written
    }

    /// Size of the file on the disk so far.
    pub(crate) fn size_on_disk(&self) -> u64 {
        self.file.metadata().map_or(0, |found| found.len())
    }

    fn put(&mut self, name: &str, time_ns: u64, data: &[u8]) -> Result<(), RecorderError> {
        // Readers expect that time does not go back.
        let time = time_ns.max(self.last_ns);
        self.last_ns = time;
        self.sequence = self.sequence.wrapping_add(1);
        self.written += data.len() as u64;
        let place = TOPICS.iter().position(|topic| topic.name == name);
        let channel_id = place.and_then(|place| self.channels.get(place)).copied();
        let header = MessageHeader {
            channel_id: channel_id.unwrap_or_default(),
            sequence: self.sequence,
            log_time: time,
            publish_time: time,
        };
        self.out
            .write_to_known_channel(&header, data)
            .map_err(|cause| unwritable(&self.part, cause))
    }

    /// Writes a text to a topic of texts.
    pub(crate) fn text(
        &mut self,
        topic: &str,
        time_ns: u64,
        text: &str,
    ) -> Result<(), RecorderError> {
        self.put(topic, time_ns, &message::string(text))
    }

    /// Writes what happened, for people and as JSON.
    pub(crate) fn note(
        &mut self,
        time_ns: u64,
        level: u8,
        note: [&str; 2],
    ) -> Result<(), RecorderError> {
        let [json, words] = note;
        self.text(topic::NOTE_TOPIC, time_ns, json)?;
        self.put(
            topic::LOG_TOPIC,
            time_ns,
            &message::log(time_ns, level, words),
        )
    }

    /// Writes counts of periods.
    pub(crate) fn periods(&mut self, time_ns: u64, periods: &Periods) -> Result<(), RecorderError> {
        let data = message::periods(time_ns, periods);
        self.put(topic::PERIODS_TOPIC, time_ns, &data)
    }

    /// Writes a period, and 100 times a second what is for viewers.
    pub(crate) fn sample(&mut self, head: &Head, sample: &Sample) -> Result<(), RecorderError> {
        let time = head.time_of(sample.tick);
        let slow = time >= self.slow_ns;
        if slow {
            self.slow_ns = time + SLOW_NS;
        }
        for (topic, data) in live_messages(head, sample, slow) {
            self.put(topic, time, &data)?;
        }
        Ok(())
    }

    /// Ends the chunk: what was written so far can be read after a kill.
    pub(crate) fn flush(&mut self) -> Result<(), RecorderError> {
        self.out
            .flush()
            .map_err(|cause| unwritable(&self.part, cause))
    }

    /// Waits until the disk has what was flushed.
    pub(crate) fn sync(&self) -> Result<(), RecorderError> {
        self.file
            .sync_data()
            .map_err(|cause| unwritable(&self.part, cause))
    }

    /// Writes index and end, and gives the file its name.
    pub(crate) fn finish(mut self) -> Result<PathBuf, RecorderError> {
        self.out
            .finish()
            .map_err(|cause| unwritable(&self.part, cause))?;
        rename(&self.part, &self.path).map_err(|cause| unwritable(&self.path, cause))?;
        Ok(self.path)
    }
}

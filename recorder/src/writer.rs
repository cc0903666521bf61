//! Files of a recording, one after the other.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};

use crate::file::McapFile;
use crate::topic;
use crate::{Head, Periods, RecorderError, Sample};

/// When a new file begins and how much is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rotation {
    /// Largest size of a file (bytes).
    pub bytes: u64,
    /// Longest time of a file (ns).
    pub age_ns: u64,
    /// How much all files of this recording may have; the oldest go first (bytes).
    pub keep: u64,
}

impl Default for Rotation {
    /// 256 MB or ten minutes a file, 8 GB in all.
    fn default() -> Self {
        Self {
            bytes: 256 << 20,
            age_ns: 600_000_000_000,
            keep: 8 << 30,
        }
    }
}

impl Rotation {
    /// One file, however large.
    pub const NEVER: Self = Self {
        bytes: u64::MAX,
        age_ns: u64::MAX,
        keep: u64::MAX,
    };
}

/// How often the size on the disk is looked at (messages).
const LOOK: u32 = 4096;

/// Writes a recording, in as many files as its [`Rotation`] asks for. It writes in the calling
/// thread: [`crate::Recording`] has a thread of its own.
pub struct Writer {
    path: PathBuf,
    head: Head,
    rotation: Rotation,
    file: McapFile,
    number: u32,
    begun_ns: Option<u64>,
    since_look: u32,
    latched: Vec<(&'static str, String)>,
    finished: VecDeque<(PathBuf, u64)>,
    last_ns: u64,
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl Writer {
    /// Begins a recording at `path`; further files get `-2`, `-3` behind their name.
    ///
    /// # Errors
    /// [`RecorderError::Exists`], or the file cannot be written.
    pub fn create(path: &Path, head: Head, rotation: Rotation) -> Result<Self, RecorderError> {
        let mut writer = Self {
            path: path.to_owned(),
            file: McapFile::create(path, &head)?,
            rotation,
            number: 1,
            begun_ns: None,
            since_look: 0,
            latched: Vec::new(),
            finished: VecDeque::new(),
            last_ns: head.begin_ns,
            head,
        };
        writer.begin()?;
        Ok(writer)
    }

    /// What whoever opens a file must have.
    fn begin(&mut self) -> Result<(), RecorderError> {
        let time = self.last_ns;
        let head = serde_json::to_string(&self.head).unwrap_or_default();
        self.file.text(topic::HEAD_TOPIC, time, &head)?;
        self.file.text(topic::URDF_TOPIC, time, &self.head.urdf)?;
        let robot = &self.head.robot_toml;
        self.file.text(topic::ROBOT_TOPIC, time, robot)?;
        for (topic, text) in &self.latched {
            self.file.text(topic, time, text)?;
        }
        self.file.flush()
    }

    /// Writes a period.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn put(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        let time = self.head.time_of(sample.tick);
        self.last_ns = self.last_ns.max(time);
        let begun = *self.begun_ns.get_or_insert(time);
        self.since_look += 1;
        if self.since_look >= LOOK {
            self.since_look = 0;
            if self.file.size_on_disk() >= self.rotation.bytes {
                self.rotate()?;
            }
        }
        if time.saturating_sub(begun) >= self.rotation.age_ns {
            self.rotate()?;
        }
        self.file.sample(&self.head, sample)
    }

    /// Writes what happened: as JSON and in words. Level 20 is information, 30 a warning, 40 an
    /// error.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn note(&mut self, level: u8, note: [&str; 2]) -> Result<(), RecorderError> {
        self.file.note(self.last_ns, level, note)
    }

    /// Writes counts of periods.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn periods(&mut self, periods: &Periods) -> Result<(), RecorderError> {
        self.file.periods(self.last_ns, periods)
    }

    /// Writes a text that whoever opens a later file must have as well: [`topic::PROGRAM_TOPIC`] or
    /// [`topic::CERTIFICATE_TOPIC`]. Later files get the last one of each topic.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn latch(&mut self, topic: &'static str, text: String) -> Result<(), RecorderError> {
        self.file.text(topic, self.last_ns, &text)?;
        self.latched.retain(|(known, _)| *known != topic);
        self.latched.push((topic, text));
        Ok(())
    }

    /// Ends the chunk: what was written so far can be read after a kill.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn flush(&mut self) -> Result<(), RecorderError> {
        self.file.flush()
    }

    /// Waits until the disk has what was flushed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn sync(&self) -> Result<(), RecorderError> {
        self.file.sync()
    }

    /// Bytes of messages in the file that is being written, before compression.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.file.size()
    }

    fn rotate(&mut self) -> Result<(), RecorderError> {
        self.number += 1;
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let next = self
            .path
            .with_file_name(format!("{stem}-{}.mcap", self.number));
        let next = McapFile::create(&next, &self.head)?;
        let full = std::mem::replace(&mut self.file, next);
        let path = full.finish()?;
        let size = fs::metadata(&path).map_or(0, |found| found.len());
        self.finished.push_back((path, size));
        self.begun_ns = None;
        self.begin()?;
        let kept = |finished: &VecDeque<(PathBuf, u64)>| -> u64 {
            finished.iter().map(|(_, size)| size).sum()
        };
        while kept(&self.finished) > self.rotation.keep {
            let Some((oldest, _)) = self.finished.pop_front() else {
                break;
            };
            // One that was moved away needs no removal.
            let _ = fs::remove_file(oldest);
        }
        Ok(())
    }

    /// Ends the recording; gives the files that are kept, oldest first.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn close(self) -> Result<Vec<PathBuf>, RecorderError> {
        let mut files: Vec<_> = self.finished.into_iter().map(|(path, _)| path).collect();
        files.push(self.file.finish()?);
        Ok(files)
    }
}

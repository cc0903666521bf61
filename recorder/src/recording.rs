//! A recording in a thread of its own.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use crate::{Head, Periods, RecorderError, Rotation, Sample, Writer};

/// How many batches may wait for the thread.
const BATCHES: usize = 1024;

/// How many samples may wait for the thread: a disk may stand still for half a minute at 1 kHz.
const SAMPLES: usize = 32_768;

/// Time between two ends of chunks: what a kill may cost.
const FLUSH: Duration = Duration::from_millis(200);

/// Time between two waits for the disk: what a power cut may cost.
const SYNC: Duration = Duration::from_secs(5);

/// What goes to the thread.
enum Item {
    Samples(Vec<Sample>),
    Note(u8, String, String),
    Periods(Periods),
    Latched(&'static str, String),
}

/// What both sides count.
#[derive(Debug, Default)]
struct Counts {
    waiting: AtomicUsize,
    written: AtomicU64,
    dropped: AtomicU64,
}

/// How a recording ended.
#[derive(Debug)]
pub struct Summary {
    /// The files that are kept, oldest first.
    pub files: Vec<PathBuf>,
    /// Samples written.
    pub written: u64,
    /// Samples that had no room.
    pub dropped: u64,
}

/// A recording in a thread of its own. Nothing here waits for the disk, but [`Recording::close`].
/// A file that cannot be written any more ends the recording, not its caller: [`Recording::failure`]
/// tells.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    sender: Option<SyncSender<Item>>,
    counts: Arc<Counts>,
    thread: Option<JoinHandle<Result<Vec<PathBuf>, RecorderError>>>,
}

impl Recording {
    /// Creates the file and starts the thread.
    ///
    /// # Errors
    /// [`RecorderError::Exists`], the file cannot be written, or there is no thread.
    pub fn start(path: &Path, head: Head, rotation: Rotation) -> Result<Self, RecorderError> {
        let writer = Writer::create(path, head, rotation)?;
        let counts = Arc::new(Counts::default());
        let (sender, items) = sync_channel(BATCHES);
        let seen = Arc::clone(&counts);
        let thread = Builder::new()
            .name("recorder".to_owned())
            .spawn(move || write(writer, &items, &seen))
            .map_err(|cause| RecorderError::Thread {
                cause: cause.to_string(),
            })?;
        Ok(Self {
            path: path.to_owned(),
            sender: Some(sender),
            counts,
            thread: Some(thread),
        })
    }

    /// The first file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Hands over samples, oldest first; those that have no room are dropped and counted. Any number
    /// has room when nothing waits.
    pub fn put(&self, samples: Vec<Sample>) {
        let count = samples.len();
        if count == 0 {
            return;
        }
        let waiting = self.counts.waiting.fetch_add(count, Ordering::AcqRel);
        let has_room = waiting == 0 || waiting + count <= SAMPLES;
        if !(has_room && self.send(Item::Samples(samples))) {
            self.counts.waiting.fetch_sub(count, Ordering::AcqRel);
            self.counts
                .dropped
                .fetch_add(count as u64, Ordering::AcqRel);
        }
    }

    /// Hands over what happened, as JSON and in words. Level 20 is information, 30 a warning, 40 an
    /// error.
    pub fn note(&self, level: u8, json: String, words: String) {
        self.send(Item::Note(level, json, words));
    }

    /// Hands over counts of periods; those of the recorder are added.
    pub fn periods(&self, periods: Periods) {
        let unrecorded = periods.unrecorded + self.dropped();
        self.send(Item::Periods(Periods {
            unrecorded,
            ..periods
        }));
    }

    /// Hands over a text that later files need as well, see [`Writer::latch`].
    pub fn latch(&self, topic: &'static str, text: String) {
        self.send(Item::Latched(topic, text));
    }

    fn send(&self, item: Item) -> bool {
        let sender = self.sender.as_ref();
        sender.is_some_and(|sender| sender.try_send(item).is_ok())
    }

    /// Samples that had no room.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.counts.dropped.load(Ordering::Acquire)
    }

    /// Samples written.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.counts.written.load(Ordering::Acquire)
    }

    /// Whether the thread has ended before its time: the disk is full, or the file is gone. Gives the
    /// reason once.
    pub fn failure(&mut self) -> Option<RecorderError> {
        if !self.thread.as_ref().is_some_and(JoinHandle::is_finished) {
            return None;
        }
        self.sender = None;
        self.thread.take()?.join().ok()?.err()
    }

    /// Writes what waits and ends the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn close(mut self) -> Result<Summary, RecorderError> {
        let files = self.end()?;
        Ok(Summary {
            files,
            written: self.written(),
            dropped: self.dropped(),
        })
    }

    fn end(&mut self) -> Result<Vec<PathBuf>, RecorderError> {
        self.sender = None;
        let Some(thread) = self.thread.take() else {
            return Ok(Vec::new());
        };
        thread.join().unwrap_or_else(|_| {
            let cause = "the recorder's thread panicked".to_owned();
            Err(RecorderError::Thread { cause })
        })
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        // Whoever wants to know of a failure closes it.
        let _ = self.end();
    }
}

fn write(
    mut writer: Writer,
    items: &Receiver<Item>,
    counts: &Counts,
) -> Result<Vec<PathBuf>, RecorderError> {
    let (mut flushed, mut synced) = (Instant::now(), Instant::now());
    let mut changed = false;
    loop {
        let left = FLUSH.saturating_sub(flushed.elapsed());
        match items.recv_timeout(left) {
            Ok(item) => {
                changed = true;
                put(&mut writer, item, counts)?;
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return writer.close(),
        }
        if flushed.elapsed() < FLUSH {
            continue;
        }
        flushed = Instant::now();
        if changed {
            writer.flush()?;
            changed = false;
        }
        if synced.elapsed() >= SYNC {
            writer.sync()?;
            synced = Instant::now();
        }
    }
}

fn put(writer: &mut Writer, item: Item, counts: &Counts) -> Result<(), RecorderError> {
    match item {
        Item::Samples(samples) => {
            for sample in &samples {
                writer.put(sample)?;
            }
            counts.waiting.fetch_sub(samples.len(), Ordering::AcqRel);
            counts
                .written
                .fetch_add(samples.len() as u64, Ordering::AcqRel);
            Ok(())
        }
        Item::Note(level, json, words) => writer.note(level, [&json, &words]),
        Item::Periods(periods) => writer.periods(&periods),
        Item::Latched(topic, text) => writer.latch(topic, text),
    }
}

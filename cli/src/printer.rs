use std::collections::VecDeque;
use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, sleep};
use std::time::{Duration, Instant};

/// How much may wait for a reader in each stream: lines, and bytes.
const ROOM: (usize, usize) = (8192, 1 << 20);

/// Clears the line of a terminal.
const CLEAR: &[u8] = b"\r\x1b[2K";

/// How long the last lines wait for a reader that takes nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// Standard output and standard error of a process that moves an arm: printing never waits.
///
/// Each stream has a bounded queue and a thread that writes. What does not fit, or cannot be
/// written, is dropped and counted; the count is printed in the stream as soon as it is read again,
/// and returned by [`Printer::finish`].
#[derive(Clone, Debug)]
pub(crate) struct Printer {
    out: Arc<Stream>,
    err: Arc<Stream>,
}

/// Which of the two streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    Out,
    Err,
}

/// A stream with what waits for it.
#[derive(Debug)]
struct Stream {
    target: Target,
    queue: Mutex<Queue>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Queue {
    waiting: VecDeque<Vec<u8>>,
    bytes: usize,
    running: bool,
    writing: bool,
    /// The stream cannot be written any more.
    broken: bool,
    written: u64,
    dropped: u64,
    told: u64,
    json: bool,
    /// The bottom of the terminal shows a line that changes.
    clears: bool,
}

impl Printer {
    /// Nothing waits; the threads start with the first line.
    pub(crate) fn new() -> Self {
        let stream = |target| {
            Arc::new(Stream {
                target,
                queue: Mutex::default(),
                changed: Condvar::new(),
            })
        };
        Self {
            out: stream(Target::Out),
            err: stream(Target::Err),
        }
    }

    /// Standard output is JSON, one object per line; the message about dropped lines is JSON too.
    pub(crate) fn expect_json(&self) {
        self.out.lock().json = true;
    }

    /// The bottom of the terminal shows a line that changes: other lines clear it first.
    pub(crate) fn clear_before_lines(&self) {
        self.out.lock().clears = io::stdout().is_terminal();
        self.err.lock().clears = io::stderr().is_terminal();
    }

    /// A line for standard output.
    pub(crate) fn line(&self, text: &str) {
        self.out.push(format!("{text}\n").into_bytes());
    }

    /// Whole lines for standard output.
    pub(crate) fn lines(&self, text: Vec<u8>) {
        self.out.push(text);
    }

    /// A line for standard error.
    pub(crate) fn note(&self, text: &str) {
        self.err.push(format!("{text}\n").into_bytes());
    }

    /// A temporary line of a terminal: dropped without a message if other lines wait.
    pub(crate) fn show(&self, text: &str) {
        let mut queue = self.err.lock();
        if queue.waiting.is_empty() && !queue.writing {
            self.err.put(&mut queue, text.as_bytes().to_vec());
        }
    }

    /// Waits for the readers as long as they read. Returns the number of lines that standard output
    /// lost, and prints it on standard error.
    pub(crate) fn finish(&self) -> u64 {
        let lost = self.out.drain();
        if lost > 0 {
            let lines = if lost == 1 { "line" } else { "lines" };
            self.note(&format!(
                "canter: standard output was not read: {lost} {lines} dropped"
            ));
        }
        self.err.drain();
        lost
    }
}

/// Log lines are printed in the same way.
impl Write for Printer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.err.push(bytes.to_vec());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Stream {
    /// The lock is never held while something is written.
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(self: &Arc<Self>, text: Vec<u8>) {
        let mut queue = self.lock();
        let text = if queue.clears {
            [CLEAR, &text].concat()
        } else {
            text
        };
        let full = queue.waiting.len() >= ROOM.0 || queue.bytes + text.len() > ROOM.1;
        if full || queue.broken {
            queue.dropped += lines(&text);
        } else {
            self.put(&mut queue, text);
        }
    }

    /// Appends; starts the thread with the first.
    fn put(self: &Arc<Self>, queue: &mut Queue, text: Vec<u8>) {
        if !queue.running {
            let stream = Arc::clone(self);
            let started = Builder::new()
                .name("printer".to_owned())
                .spawn(move || stream.write_for_ever());
            if started.is_err() {
                queue.dropped += lines(&text);
                return;
            }
            queue.running = true;
        }
        queue.bytes += text.len();
        queue.waiting.push_back(text);
        self.changed.notify_all();
    }

    /// The thread: it ends with the process.
    fn write_for_ever(&self) {
        loop {
            let mut queue = self.lock();
            queue.writing = false;
            self.changed.notify_all();
            while queue.waiting.is_empty() {
                queue = self
                    .changed
                    .wait(queue)
                    .unwrap_or_else(PoisonError::into_inner);
            }
            let Some(text) = queue.waiting.pop_front() else {
                continue;
            };
            queue.bytes -= text.len();
            queue.writing = true;
            let told = queue.dropped - queue.told;
            queue.told = queue.dropped;
            let json = queue.json;
            drop(queue);
            let word = (told > 0).then(|| word_about(told, json));
            let written = word.map_or(Ok(()), |word| self.write(word.as_bytes()));
            let written = written.and_then(|()| self.write(&text));
            let mut queue = self.lock();
            if written.is_ok() {
                queue.written += 1;
            } else {
                queue.broken = true;
                queue.dropped += lines(&text);
                let left: u64 = queue.waiting.iter().map(|text| lines(text)).sum();
                queue.dropped += left;
                queue.waiting.clear();
                queue.bytes = 0;
            }
        }
    }

    /// Writes all of it, however long that takes; a stream that does not block is asked again.
    fn write(&self, mut text: &[u8]) -> io::Result<()> {
        while !text.is_empty() {
            let written = match self.target {
                Target::Out => {
                    let mut out = io::stdout().lock();
                    out.write(text)
                        .and_then(|count| out.flush().map(|()| count))
                }
                Target::Err => io::stderr().write(text),
            };
            match written {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => text = text.get(count..).unwrap_or_default(),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    sleep(Duration::from_millis(5));
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Waits while the reader reads; returns how many lines were lost in all.
    fn drain(&self) -> u64 {
        let mut queue = self.lock();
        let mut seen = (queue.written, Instant::now());
        while queue.running && (queue.writing || !queue.waiting.is_empty()) {
            if queue.written != seen.0 {
                seen = (queue.written, Instant::now());
            }
            let left = PATIENCE.saturating_sub(seen.1.elapsed());
            if left.is_zero() {
                break;
            }
            let waited = self.changed.wait_timeout(queue, left);
            queue = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let left: u64 = queue.waiting.iter().map(|text| lines(text)).sum();
        queue.dropped + left + u64::from(queue.writing)
    }
}

/// How many lines a text has.
fn lines(text: &[u8]) -> u64 {
    let ends = text.iter().filter(|byte| **byte == b'\n').count();
    ends.max(1) as u64
}

fn word_about(dropped: u64, json: bool) -> String {
    if json {
        format!("{{\"event\":\"dropped\",\"lines\":{dropped}}}\n")
    } else {
        format!("dropped  {dropped} lines that were not read\n")
    }
}

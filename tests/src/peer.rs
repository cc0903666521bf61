//! An engine or a driver as a separate process that a test talks to, signals and kills.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::killed::Killed;

/// How long a test waits for something that must come.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A process in the domain of the test; it ends with the test.
#[derive(Debug)]
pub struct Peer {
    /// The process.
    pub child: Killed,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
}

impl Peer {
    /// Starts a program of the tests (`env!("CARGO_BIN_EXE_...")`) with these arguments.
    ///
    /// # Panics
    /// It cannot be started.
    pub fn start(program: &str, words: &[&str]) -> Self {
        let mut command = Command::new(program);
        let mut child = crate::domain::join(&mut command)
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("a process");
        let (send, lines) = channel();
        let input = child.stdin.take();
        let streams: [Option<Box<dyn Read + Send>>; 2] = [
            child.stdout.take().map(|stream| Box::new(stream) as _),
            child.stderr.take().map(|stream| Box::new(stream) as _),
        ];
        for stream in streams.into_iter().flatten() {
            let send = send.clone();
            thread::spawn(move || {
                for line in BufReader::new(stream).lines().map_while(Result::ok) {
                    if send.send(line).is_err() {
                        return;
                    }
                }
            });
        }
        Self {
            child: Killed(child),
            input,
            lines,
        }
    }

    /// The first line with one of the words in it; `None` when none comes within `time`.
    pub fn line_with(&self, words: &[&str], time: Duration) -> Option<String> {
        let end = Instant::now() + time;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let line = self.lines.recv_timeout(left).ok()?;
            if words.iter().any(|word| line.contains(word)) {
                return Some(line);
            }
        }
    }

    /// Waits for a line with `text` in it.
    ///
    /// # Panics
    /// None comes within [`PATIENCE`]; the message has the last lines that came.
    pub fn wait_for(&self, text: &str) -> String {
        let end = Instant::now() + PATIENCE;
        let mut seen = Vec::new();
        let left = || end.saturating_duration_since(Instant::now());
        while let Ok(line) = self.lines.recv_timeout(left()) {
            if line.contains(text) {
                return line;
            }
            seen.push(line);
        }
        let last = &seen[seen.len().saturating_sub(5)..];
        panic!("no line with {text:?}; the last were {last:?}");
    }

    /// Writes a line to its standard input.
    pub fn say(&mut self, line: &str) {
        // One that has ended is found out by what it does not answer.
        let _ = self.input.as_mut().map(|input| writeln!(input, "{line}"));
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: i32) {
        crate::signal::send(&self.child, signal);
    }

    /// Kills it and waits for its end.
    ///
    /// # Panics
    /// It is gone already.
    pub fn kill(&mut self) {
        self.child.kill().expect("a living process");
        self.child.wait().expect("its end");
    }
}

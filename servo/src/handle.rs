//! Starting and ending the real-time thread.

use std::sync::mpsc;
use std::thread::{Builder, JoinHandle};

use super::config::{ExecutorConfig, ExecutorError};
use super::monitor::Monitor;
use super::remote::Remote;
use super::runner::Runner;
use super::segment_sender::SegmentSender;
use super::thread;

/// Stack of the real-time thread (bytes).
const STACK: usize = 4 << 20;

/// A running real-time thread. Dropping it stops the arm on the path, says goodbye to the driver
/// and ends the thread.
#[derive(Debug)]
pub struct Executor<const N: usize> {
    remote: Remote<N>,
    thread: Option<JoinHandle<()>>,
    /// What the operating system refused, in one sentence.
    pub warning: Option<String>,
    /// The driver's name.
    pub driver: String,
}

impl<const N: usize> Executor<N> {
    /// Finds the driver, opens a session, starts the thread. The arm rests where it is.
    ///
    /// # Errors
    /// [`ExecutorError`]: a rate or limit that makes no sense, no driver, a driver that refuses,
    /// another engine on the same arm.
    pub fn start(
        config: ExecutorConfig<N>,
    ) -> Result<(Self, SegmentSender<N>, Monitor<N>), ExecutorError> {
        config.check()?;
        let (runner, sender, remote, monitor) = Runner::new(config.clone());
        let (tell, started) = mpsc::sync_channel(1);
        let thread = Builder::new()
            .name("servo".to_owned())
            .stack_size(STACK)
            .spawn(move || thread::main(&config, runner, &tell))
            .map_err(|cause| ExecutorError::Thread {
                cause: cause.to_string(),
            })?;
        let start = started.recv().unwrap_or_else(|_| {
            Err(ExecutorError::Thread {
                cause: "it ended before it began".to_owned(),
            })
        });
        match start {
            Ok(begun) => {
                let (warning, driver) = (begun.warning, begun.driver);
                let executor = Self {
                    remote,
                    thread: Some(thread),
                    warning,
                    driver,
                };
                Ok((executor, sender, monitor))
            }
            Err(error) => {
                // The thread has ended or is about to; it has reported everything.
                let _ = thread.join();
                Err(error)
            }
        }
    }

    /// Control, and where the arm is.
    pub fn remote(&self) -> Remote<N> {
        self.remote.clone()
    }

    /// Whether the thread still runs.
    pub fn is_running(&self) -> bool {
        self.thread
            .as_ref()
            .is_some_and(|thread| !thread.is_finished())
    }

    /// Stops the arm on the path, says goodbye to the driver and ends the thread.
    pub fn shutdown(mut self) {
        self.end();
    }

    fn end(&mut self) {
        self.remote.steering().shut_down();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has already printed it; there is nothing left to end.
            let _ = thread.join();
        }
    }
}

impl<const N: usize> Drop for Executor<N> {
    fn drop(&mut self) {
        self.end();
    }
}

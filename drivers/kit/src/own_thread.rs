//! A thread that owns a controller.

use std::thread::{Builder, JoinHandle, sleep};
use std::time::Duration;

use scheduling::{RealTimeRequest, request_real_time};

use crate::DriverError;

/// Time between two looks whether a pause shall end.
const LOOK: Duration = Duration::from_millis(10);

/// A thread of a driver, which is waited for when this is dropped. Whoever started it tells it to end
/// before that.
#[derive(Debug)]
pub struct OwnThread(Option<JoinHandle<()>>);

impl OwnThread {
    /// Starts a thread with this name.
    ///
    /// # Errors
    /// [`DriverError::Thread`].
    pub fn start(name: &str, run: impl FnOnce() + Send + 'static) -> Result<Self, DriverError> {
        let started = Builder::new().name(name.to_owned()).spawn(run);
        let thread = started.map_err(|cause| DriverError::Thread {
            cause: cause.to_string(),
        })?;
        Ok(Self(Some(thread)))
    }

    /// Starts a thread with this name and real-time scheduling of a priority, where that is allowed. What is
    /// refused is told by [`run`](crate::run), which asks for the same.
    ///
    /// # Errors
    /// [`DriverError::Thread`].
    pub fn start_real_time(
        name: &str,
        priority: i32,
        run: impl FnOnce() + Send + 'static,
    ) -> Result<Self, DriverError> {
        Self::start(name, move || {
            let _granted = request_real_time(RealTimeRequest {
                priority,
                lock_memory: false,
                low_latency: false,
                ..RealTimeRequest::default()
            });
            run();
        })
    }
}

/// Sleeps, but ends soon after `ends` becomes true: the time between two tries to connect.
pub fn pause(length: Duration, ends: impl Fn() -> bool) {
    let mut waited = Duration::ZERO;
    while waited < length && !ends() {
        sleep(LOOK);
        waited += LOOK;
    }
}

impl Drop for OwnThread {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // A thread that panicked has said so; there is nothing left to end.
            let _ = thread.join();
        }
    }
}

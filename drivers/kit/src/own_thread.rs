//! A thread that owns a controller.

use std::thread::{Builder, JoinHandle};

use crate::DriverError;

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
}

impl Drop for OwnThread {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // A thread that panicked has said so; there is nothing left to end.
            let _ = thread.join();
        }
    }
}

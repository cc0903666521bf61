//! If damaged shared memory crashes the process, it says which directory is damaged and what
//! repairs it.

use std::os::fd::AsFd;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use ipc::Domain;
use signal_hook::consts::SIGBUS;

use crate::exit::Exit;

/// `signal_hook` has no name for this signal, since a handler must not return from it.
const SIGSEGV: i32 = 11;

/// What is said in a handler, made before.
static MESSAGE: OnceLock<String> = OnceLock::new();

/// From now on a crash inside shared memory is reported with a message and the exit code of a
/// missing engine.
pub(crate) fn watch(domain: &Domain) {
    static WATCHED: AtomicBool = AtomicBool::new(false);
    if WATCHED.swap(true, Ordering::Relaxed) {
        return;
    }
    let place = domain.directory().display();
    // Set once, above.
    let _ = MESSAGE.set(format!(
        "canter: shared memory of {place} is damaged or full; end the engines and drivers there, \
         then `canter doctor --repair --domain {place}`\n"
    ));
    for signal in [SIGBUS, SIGSEGV] {
        // SAFETY: the action reads a text that is there, writes it with one system call and ends
        // the process; all of it may be done in a handler, and it does not return.
        #[expect(
            unsafe_code,
            reason = "handlers of these signals are unsafe to register"
        )]
        let registered =
            unsafe { signal_hook_registry::register_signal_unchecked(signal, tell_and_end) };
        // Without a handler the process ends as it did before.
        drop(registered);
    }
}

fn tell_and_end() {
    tell();
    signal_hook::low_level::exit(Exit::NoPeer as i32);
}

/// Prints the text that [`watch`] has prepared, if any; nothing here allocates or locks.
pub(crate) fn tell() {
    if let Some(message) = MESSAGE.get() {
        // A closed standard error cannot be reported.
        let _ = rustix::io::write(std::io::stderr().as_fd(), message.as_bytes());
    }
}

/// Does work that damaged segments may block; after `patience` the process reports it and ends.
pub(crate) fn bounded<T>(patience: Duration, what: impl FnOnce() -> T) -> T {
    let (done, ended) = channel::<()>();
    thread::spawn(move || {
        if ended.recv_timeout(patience) == Err(RecvTimeoutError::Timeout) {
            tell_and_end();
        }
    });
    let result = what();
    drop(done);
    result
}

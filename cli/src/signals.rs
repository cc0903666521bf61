use std::io;
use std::process::exit;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, sleep};
use std::time::Duration;

use engine::session::Session;
use servo::{Control, Steering};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::exit::Exit;
use crate::printer::Printer;

/// How long the rest of the process may take to end after a second signal.
const LAST_PATIENCE: Duration = Duration::from_secs(4);

/// The thread that handles SIGINT, SIGTERM and SIGHUP. It does nothing else, so that they act at
/// once whatever the process is doing.
///
/// The first signal stops the arm on the path, the second as fast as the joints can. If nothing
/// moves, a signal ends the process.
#[derive(Debug)]
pub(crate) struct SignalThread {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    steering: Mutex<Option<Steering>>,
    count: AtomicUsize,
    order: AtomicU32,
}

impl SignalThread {
    /// Takes the signals over; `word` says what a second one does.
    ///
    /// # Errors
    /// The operating system refuses.
    pub(crate) fn start(printer: &Printer, word: &'static str) -> io::Result<Self> {
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
        let shared = Arc::new(Shared {
            steering: Mutex::default(),
            count: AtomicUsize::new(0),
            order: AtomicU32::new(0),
        });
        let (seen, printer) = (Arc::clone(&shared), printer.clone());
        Builder::new().name("signals".to_owned()).spawn(move || {
            for _ in signals.forever() {
                seen.obey(&printer, word);
            }
        })?;
        Ok(Self { shared })
    }

    /// From now on a signal stops this motion.
    pub(crate) fn steer(&self, session: &Session) {
        self.shared.set(Some(session.steering()));
    }

    /// From now on nothing moves: a signal ends the process.
    pub(crate) fn release(&self) {
        self.shared.set(None);
    }

    /// Number of signals; the order to the arm is given before a signal is counted.
    pub(crate) fn count(&self) -> usize {
        self.shared.count.load(Ordering::Acquire)
    }

    /// Whether a signal came and the arm rests because of it.
    pub(crate) fn has_stopped(&self, session: &Session) -> bool {
        let now = session.progress();
        let order = self.shared.order.load(Ordering::Acquire);
        self.count() > 0 && (now.ended || (now.has(order) && now.resting))
    }
}

impl Shared {
    fn set(&self, steering: Option<Steering>) {
        *self.steering.lock().unwrap_or_else(PoisonError::into_inner) = steering;
    }

    fn obey(&self, printer: &Printer, word: &str) {
        let steering = self.steering.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(steering) = &*steering else {
            exit(Exit::Stopped as i32);
        };
        let fast = self.count.load(Ordering::Acquire) > 0;
        let order = steering.control(Control::Stop { fast });
        self.order.store(order, Ordering::Release);
        let before = self.count.fetch_add(1, Ordering::AcqRel);
        if before == 0 {
            printer.note(&format!("canter: stopping on the path; {word}"));
        }
        if before == 1 {
            // Ends the process whatever it waits for; the arm rests by then.
            let last = Builder::new().spawn(|| {
                sleep(LAST_PATIENCE);
                exit(Exit::Stopped as i32);
            });
            if last.is_err() {
                printer.note("canter: no thread to end the process; SIGKILL ends it");
            }
        }
    }
}

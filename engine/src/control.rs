//! The control thread: stop, pause, resume, override, abort and recover from other processes.
//!
//! It does nothing else: it does not plan, print or serve anything that takes time. So an order
//! reaches the real-time thread whatever the other threads do.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use ipc::{Arm, ControlAnswer, ControlAsk, ControlServer, Controlled, IpcError};
use scheduling::{RealTimeRequest, now_ns, request_real_time, sleep_until_ns};
use servo::{Control, Progress, Steering};

/// Time between two polls for requests (ns), at least and at most.
const LOOK_NS: (u64, u64) = (300_000, 3_000_000);

/// Largest number of requests per poll.
const A_LOOK: usize = 32;

/// How long the real-time thread may take to act: many periods.
const PATIENCE: Duration = Duration::from_millis(100);

/// How long a new session with the driver may take.
const RECOVERY: Duration = Duration::from_secs(3);

/// Above ordinary threads, below the real-time thread.
const REAL_TIME: RealTimeRequest = RealTimeRequest {
    priority: 40,
    processor: None,
    lock_memory: false,
    low_latency: false,
};

/// A running control thread. Dropping it ends it.
#[derive(Debug)]
pub struct ControlThread {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ControlThread {
    /// Opens the control channel of `arm` and executes the requests that come through it: the orders act in
    /// the periods of a servo of this rate (Hz).
    ///
    /// # Errors
    /// [`IpcError::Taken`] when another engine serves this arm; errors of shared memory or threads.
    pub fn start(arm: &Arm, steering: Steering, rate_hz: f64) -> Result<Self, IpcError> {
        let ends = Arc::new(AtomicBool::new(false));
        let (tell, opened) = sync_channel(1);
        let (name, stop) = (arm.clone(), Arc::clone(&ends));
        let failed = |cause: String| IpcError::Failed {
            service: arm.to_string(),
            operation: "starting the control thread",
            cause,
        };
        let thread = Builder::new()
            .name("control".to_owned())
            .spawn(move || run((&name, look_ns(rate_hz)), &steering, &stop, &tell))
            .map_err(|cause| failed(cause.to_string()))?;
        match opened.recv() {
            Ok(Ok(())) => Ok(Self {
                ends,
                thread: Some(thread),
            }),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(failed("it ended before it began".to_owned())),
        }
    }
}

impl Drop for ControlThread {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has already said so.
            let _ = thread.join();
        }
    }
}

/// What an answer waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    /// The order of this number acts.
    Order(u32),
    /// The fault of this number is cleared.
    Recovery(u32),
}

/// A request whose order was given.
struct Waiting {
    client: Controlled,
    wanted: Wanted,
    until: Instant,
}

/// Three polls in each period: an order acts in the next one. A slow servo needs no more.
fn look_ns(rate_hz: f64) -> u64 {
    let (least, most) = LOOK_NS;
    let third = 1e9 / (3.0 * rate_hz);
    // What is no number or too large ends at the bounds.
    (third as u64).clamp(least, most)
}

fn run(
    (arm, look_ns): (&Arm, u64),
    steering: &Steering,
    ends: &AtomicBool,
    tell: &SyncSender<Result<(), IpcError>>,
) {
    let server = match ControlServer::open(arm) {
        Ok(server) => server,
        Err(error) => {
            // The caller waits for this answer.
            let _ = tell.send(Err(error));
            return;
        }
    };
    // What is refused here was also refused to the real-time thread, which has reported it.
    let _ = request_real_time(REAL_TIME);
    let _ = tell.send(Ok(()));
    let mut waiting: Vec<Waiting> = Vec::with_capacity(2 * A_LOOK);
    let mut next = now_ns();
    while !ends.load(Ordering::Acquire) {
        for _ in 0..A_LOOK {
            let Some(client) = server.next() else { break };
            if let Some(given) = obey(steering, client) {
                waiting.push(given);
            }
        }
        let progress = steering.progress();
        waiting.retain(|given| !answered(given, &progress));
        next = (next + look_ns).max(now_ns());
        sleep_until_ns(next);
    }
    let progress = steering.progress();
    for given in &waiting {
        // A client that has gone needs no answer.
        given.client.answer(report(&progress));
    }
}

/// Gives the order; what is refused is answered at once.
fn obey(steering: &Steering, client: Controlled) -> Option<Waiting> {
    let order = |control| Ok(Wanted::Order(steering.control(control)));
    let given = match client.request.ask() {
        Ok(ControlAsk::Look) => {
            client.answer(report(&steering.progress()));
            return None;
        }
        Ok(ControlAsk::Pause) => order(Control::Pause),
        Ok(ControlAsk::Resume) => order(Control::Resume),
        Ok(ControlAsk::Override(share)) => order(Control::Override(share)),
        Ok(ControlAsk::Stop { fast }) => order(Control::Stop { fast }),
        Ok(ControlAsk::Abort) => order(Control::Abort),
        Ok(ControlAsk::Discard { fast }) => order(Control::Discard { fast }),
        Ok(ControlAsk::Recover) => steering
            .recover()
            .map(Wanted::Recovery)
            .map_err(|error| error.to_string()),
        Ok(_) => Err("this engine cannot do that".to_owned()),
        Err(reason) => Err(reason),
    };
    match given {
        Ok(wanted) => {
            let patience = match wanted {
                Wanted::Order(_) => PATIENCE,
                Wanted::Recovery(_) => RECOVERY,
            };
            Some(Waiting {
                client,
                wanted,
                until: Instant::now() + patience,
            })
        }
        Err(reason) => {
            client.answer(ControlAnswer::refuse(&reason));
            None
        }
    }
}

/// Answers if the order acts or has taken too long; says whether it did.
fn answered(given: &Waiting, progress: &Progress) -> bool {
    let late = Instant::now() >= given.until;
    let answer = match given.wanted {
        Wanted::Order(order) if progress.has(order) => report(progress),
        Wanted::Recovery(fault) if progress.fault != fault => {
            if progress.fault == 0 {
                report(progress)
            } else {
                ControlAnswer::refuse("the driver opened no session; the fault stays latched")
            }
        }
        _ if progress.ended => ControlAnswer::refuse("the session has ended"),
        Wanted::Order(_) if late => ControlAnswer::refuse(
            "the real-time thread made no period within 100 ms; the order stays and acts in its \
             next one",
        ),
        Wanted::Recovery(_) if late => {
            ControlAnswer::refuse("the arm has not come to rest within 3 s; the order stays")
        }
        _ => return false,
    };
    // A client that has gone needs no answer.
    given.client.answer(answer);
    true
}

/// Where the motion is, as an answer.
fn report(progress: &Progress) -> ControlAnswer {
    ControlAnswer {
        accepted: 1,
        resting: u32::from(progress.resting),
        held: u32::from(progress.held),
        idle: u32::from(progress.idle),
        fault: progress.fault,
        tick: progress.tick,
        time_scaling: progress.time_scaling,
        ..ControlAnswer::refuse("")
    }
}

#[cfg(test)]
mod tests {
    use super::{LOOK_NS, look_ns};

    /// At least three polls in a period, as far as the bounds allow, and never none.
    #[test]
    fn polls_follow_the_period() {
        assert_eq!(look_ns(1000.0), 333_333);
        assert_eq!(look_ns(100.0), LOOK_NS.1);
        assert_eq!(look_ns(4000.0), LOOK_NS.0);
        for rate_hz in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            assert!((LOOK_NS.0..=LOOK_NS.1).contains(&look_ns(rate_hz)));
        }
    }
}

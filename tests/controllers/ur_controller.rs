//! A stand-in for the controller of Universal Robots: RTDE, dashboard server, primary interface, an
//! interpreter for the program that the driver sends, and the law of `servoj`.
//!
//! It is written after the maker's documents, by the same hands as the driver: what both
//! misunderstand it does not find. The test with ur_rtde checks its RTDE from outside.

mod functions;
mod interpreter;
pub(crate) mod motion;
mod servers;
pub(crate) mod state;
mod syntax;

use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{JoinHandle, spawn};
use std::time::Duration;

use interpreter::Halt;
use scheduling::{RealTimeRequest, now_ns, request_real_time, sleep_until_ns};
use state::{PLAYING, STOPPED, Setting, State};

/// Ports: dashboard, primary interface, RTDE.
const PORTS: [u16; 3] = [29999, 30001, 30004];

/// A controller that runs, on an address of its own.
pub(crate) struct Controller {
    pub(crate) address: String,
    state: Arc<Mutex<State>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Controller {
    /// Starts it on a free address of this machine.
    pub(crate) fn start(setting: Setting) -> Self {
        let address = free_address();
        let state = Arc::new(Mutex::new(State::new(setting)));
        let ends = Arc::new(AtomicBool::new(false));
        let at = |port| (address.as_str(), port);
        servers::listen(at(PORTS[0]), &state, &ends, servers::dashboard);
        servers::listen(at(PORTS[1]), &state, &ends, servers::primary);
        servers::listen(at(PORTS[2]), &state, &ends, servers::rtde);
        let (theirs, stop) = (Arc::clone(&state), Arc::clone(&ends));
        let thread = spawn(move || run(&theirs, &stop));
        Self {
            address,
            state,
            ends,
            thread: Some(thread),
        }
    }

    /// What it knows.
    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    /// The operator stops the program on the pendant.
    pub(crate) fn press_stop(&self) {
        // What has ended is dropped without the lock: it waits for its threads.
        let ended = self.state().stop_program();
        drop(ended);
    }

    /// Waits until something is so.
    pub(crate) fn wait(&self, what: &str, is_so: impl Fn(&State) -> bool) {
        let start = std::time::Instant::now();
        while !is_so(&self.state()) {
            assert!(start.elapsed() < Duration::from_secs(30), "never: {what}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        let _ = self.thread.take().unwrap().join();
        self.press_stop();
    }
}

/// An address of this machine whose ports are free.
fn free_address() -> String {
    static COUNT: AtomicU8 = AtomicU8::new(1);
    loop {
        let third = std::process::id() % 250 + 1;
        let fourth = COUNT.fetch_add(1, Ordering::Relaxed);
        let address = format!("127.77.{third}.{fourth}");
        if PORTS
            .iter()
            .all(|port| TcpListener::bind((address.as_str(), *port)).is_ok())
        {
            return address;
        }
    }
}

/// The cycles, by the clock.
fn run(state: &Mutex<State>, ends: &AtomicBool) {
    let _granted = request_real_time(RealTimeRequest {
        priority: 70,
        lock_memory: false,
        low_latency: false,
        ..RealTimeRequest::default()
    });
    let period = (1e9 / state.lock().unwrap().setting.rate) as u64;
    let mut next = now_ns();
    while !ends.load(Ordering::Relaxed) {
        next += period;
        sleep_until_ns(next);
        {
            let mut state = state.lock().unwrap();
            state.cycle();
            servers::send_states(&mut state);
            if state.cycles.is_multiple_of(state.setting.rate as u64 / 10) {
                // The states of the primary interface, which nobody needs here.
                state.send_primary(&[16]);
            }
        }
        run_programs(state);
    }
}

/// Lets the programs run until they wait. They lock the state themselves.
fn run_programs(state: &Mutex<State>) {
    let (program, beside) = {
        let mut state = state.lock().unwrap();
        let plays = state.runtime == PLAYING;
        let program = if plays { state.program.take() } else { None };
        (program, std::mem::take(&mut state.beside))
    };
    if let Some(mut program) = program {
        let went = program.cycle();
        let mut locked = state.lock().unwrap();
        match went {
            // It may have been stopped meanwhile.
            Ok(true) if locked.runtime != STOPPED && locked.program.is_none() => {
                locked.program = Some(program);
            }
            other => {
                if let Err(Halt::Exception(line, text)) = other {
                    locked.exception(line, &text);
                }
                let ended = locked.stop_program();
                drop(locked);
                drop((program, ended));
            }
        }
    }
    for mut program in beside {
        let went = program.cycle();
        let mut state = state.lock().unwrap();
        match went {
            Ok(true) => state.beside.push(program),
            Ok(false) => {}
            Err(Halt::Exception(line, text)) => state.exception(line, &text),
            Err(Halt::Ended) => {}
        }
    }
}

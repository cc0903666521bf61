//! Reads all setpoints of an arm and finds when it became slower.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use ipc::{Arm, Observer};
use kinematics::Chain;

use crate::Taken;

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(20);

/// What is kept of a setpoint.
#[derive(Clone, Copy, Debug)]
struct Seen {
    published_ns: u64,
    sequence: u64,
    time_scaling: f64,
    resting: bool,
    stopping: bool,
    joints: [f64; 6],
}

/// A thread that reads all setpoints.
pub(crate) struct Watch {
    seen: Arc<Mutex<Vec<Seen>>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    chain: Chain<6>,
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

impl Watch {
    pub(crate) fn start(arm: &Arm) -> Self {
        let (seen, ends) = (Arc::default(), Arc::new(AtomicBool::new(false)));
        let (arm, list, stop) = (arm.clone(), Arc::clone(&seen), Arc::clone(&ends));
        let thread = std::thread::spawn(move || read(&arm, &list, &stop));
        let robot = planner::robot::load("ur5e").unwrap();
        let chain = robot.chain::<6>().unwrap();
        Self {
            seen,
            ends,
            thread: Some(thread),
            chain,
        }
    }

    /// Waits until the arm moves at the planned speed; says whether it does.
    #[must_use]
    pub(crate) fn wait_for_speed(&self) -> bool {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            let last = self.seen.lock().unwrap().last().copied();
            if last.is_some_and(|last| last.time_scaling >= 1.0 && !last.resting) {
                return true;
            }
            sleep(Duration::from_millis(1));
        }
        false
    }

    /// Times of a stop that was called at `called` (ns); clears the record. `None` if the arm was
    /// at rest between two commands then, or if setpoints were missed.
    pub(crate) fn taken(&self, called: u64) -> Option<Taken> {
        let end = Instant::now() + PATIENCE;
        loop {
            let rests = {
                let seen = self.seen.lock().unwrap();
                let mut after = seen.iter().filter(|seen| seen.published_ns > called);
                after.clone().count() > 5 && after.next_back().is_some_and(|seen| seen.resting)
            };
            if rests {
                break;
            }
            assert!(Instant::now() < end, "the arm does not rest");
            sleep(Duration::from_millis(1));
        }
        let seen = std::mem::take(&mut *self.seen.lock().unwrap());
        let before = seen.iter().rposition(|seen| seen.published_ns <= called)?;
        if seen[before].resting || seen[before].time_scaling < 1.0 {
            return None;
        }
        let acts = (before + 1..seen.len()).find(|at| seen[*at].stopping)?;
        let slower = (before + 1..seen.len()).find(|at| seen[*at].time_scaling < 1.0)?;
        let rest = (slower..seen.len()).find(|at| seen[*at].resting)?;
        let whole = seen[before..=rest]
            .windows(2)
            .all(|pair| pair[1].sequence == pair[0].sequence + 1);
        if !whole {
            return None;
        }
        let ms = |at: usize| (seen[at].published_ns - called) as f64 * 1e-6;
        let way = |at: usize| self.way(&seen[before..=at]);
        Some(Taken {
            acts_ms: ms(acts),
            effect_ms: ms(slower),
            effect_mm: way(slower),
            rest_ms: ms(rest),
            rest_mm: way(rest),
        })
    }

    /// The distance of the controlled point (mm).
    fn way(&self, seen: &[Seen]) -> f64 {
        let places = seen.iter().map(|seen| {
            let joints = nalgebra::SVector::<f64, 6>::from(seen.joints);
            self.chain.forward(&joints).translation.vector
        });
        let places: Vec<_> = places.collect();
        let steps = places.windows(2).map(|pair| (pair[1] - pair[0]).norm());
        steps.sum::<f64>() * 1e3
    }
}

fn read(arm: &Arm, list: &Mutex<Vec<Seen>>, stop: &AtomicBool) {
    let observer = Observer::open(arm).unwrap();
    while !stop.load(Ordering::Relaxed) {
        while let Some(setpoint) = observer.next_setpoint() {
            let resting = setpoint.flags & ipc::SetpointFlags::HOLD != 0;
            let mut joints = [0.0; 6];
            joints.copy_from_slice(&setpoint.position[..6]);
            list.lock().unwrap().push(Seen {
                published_ns: setpoint.published_ns,
                sequence: setpoint.sequence,
                time_scaling: setpoint.time_scaling,
                resting,
                stopping: setpoint.flags & ipc::SetpointFlags::STOPPING != 0,
                joints,
            });
        }
        sleep(Duration::from_millis(2));
    }
}

//! Reads every setpoint of an arm, to say when it moved and how far.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

use ipc::Observer;
use kinematics::Chain;
use nalgebra::SVector;
use scheduling::now_ns;

/// One setpoint: when it was published (ns), where the controlled point is (m), whether it moves.
#[derive(Clone, Copy)]
struct Row {
    at_ns: u64,
    point: [f64; 3],
    moves: bool,
}

/// A thread that reads the setpoints of a UR5e.
pub(crate) struct Watcher {
    rows: Arc<Mutex<Vec<Row>>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// How an arm came to rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// From the event to the last setpoint that moved (ms).
    pub(crate) after_ms: f64,
    /// Length of the path from the event on (mm).
    pub(crate) went_mm: f64,
}

impl Watcher {
    pub(crate) fn start(arm: &str) -> Self {
        let rows = Arc::new(Mutex::new(Vec::new()));
        let ends = Arc::new(AtomicBool::new(false));
        let (kept, stop) = (Arc::clone(&rows), Arc::clone(&ends));
        let arm = system_tests::domain::arm(arm);
        let robot = planner::robot::load("ur5e").unwrap();
        let chain: Chain<6> = robot.chain_with(robot.mounted).unwrap();
        let thread = spawn(move || {
            // It stays in the thread that opened it.
            let observer = Observer::open(&arm).unwrap();
            while !stop.load(Ordering::Relaxed) {
                while let Some(setpoint) = observer.next_setpoint() {
                    let joints = SVector::<f64, 6>::from_column_slice(&setpoint.position[..6]);
                    kept.lock().unwrap().push(Row {
                        at_ns: setpoint.published_ns,
                        point: chain.forward(&joints).translation.vector.into(),
                        moves: setpoint.velocity.iter().any(|speed| speed.abs() > 1e-9),
                    });
                }
                sleep(Duration::from_millis(2));
            }
        });
        Self {
            rows,
            ends,
            thread: Some(thread),
        }
    }

    /// Waits until nothing has moved for half a second; says when and where it stopped after an
    /// event at `event_ns`.
    pub(crate) fn rest(&self, event_ns: u64) -> Stop {
        let end = Instant::now() + Duration::from_secs(60);
        loop {
            sleep(Duration::from_millis(50));
            let rows = self.rows.lock().unwrap();
            let moving = rows.iter().rposition(|row| row.moves);
            let last = moving
                .map_or(event_ns, |index| rows[index].at_ns)
                .max(event_ns);
            let newest = rows.last().map_or(0, |row| row.at_ns);
            if newest > last + 500_000_000 {
                let after: Vec<&Row> = rows.iter().filter(|row| row.at_ns >= event_ns).collect();
                let length = |pair: &[&Row]| -> f64 {
                    let [from, to] = [pair[0].point, pair[1].point];
                    let squares = (0..3).map(|axis| (to[axis] - from[axis]).powi(2));
                    squares.sum::<f64>().sqrt()
                };
                return Stop {
                    after_ms: (last - event_ns) as f64 * 1e-6,
                    went_mm: after.windows(2).map(length).sum::<f64>() * 1e3,
                };
            }
            assert!(Instant::now() < end, "the jog runs on");
        }
    }

    /// Whether any setpoint since then moved.
    pub(crate) fn moved_since(&self, since_ns: u64) -> bool {
        let rows = self.rows.lock().unwrap();
        rows.iter().any(|row| row.at_ns > since_ns && row.moves)
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to report.
            let _ = thread.join();
        }
    }
}

/// The time of the setpoints.
pub(crate) fn now() -> u64 {
    now_ns()
}

//! Watches an arm in motion from outside: success rate, and how late the arm is behind its setpoints.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use ipc::{Setpoint, State};

/// How many setpoints are kept: those of the last quarter of a second.
const KEPT: usize = 256;

/// A joint moves that is faster (rad/s).
const MOVES: f64 = 0.05;

/// A success rate counts that is of so many cycles: those that a controller counts over.
const CYCLES: u32 = 100;

/// What was seen while the arm moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Least and mean success rate that the controller told, where it tells one.
    rate: [f64; 2],
    /// How late commanded and measured joints were behind the setpoints (s), in the mean of all runs weighted
    /// with the square of the speed.
    delay: [f64; 2],
    states: f64,
}

impl core::fmt::Display for Seen {
    fn fmt(&self, to: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [least, mean] = self.rate;
        let [commanded, measured] = self.delay.map(|delay| delay * 1e3);
        write!(
            to,
            "success rate mean {mean:.4}, least {least:.2}; behind the setpoints: commanded {commanded:.2} ms, \
             measured {measured:.2} ms ({} states)",
            self.states
        )
    }
}

/// A thread that watches.
pub(crate) struct Watch {
    ends: Arc<AtomicBool>,
    thread: JoinHandle<Seen>,
}

impl Watch {
    pub(crate) fn start(arm: &str) -> Self {
        let ends = Arc::new(AtomicBool::new(false));
        let (watched, stop) = (arm.to_owned(), Arc::clone(&ends));
        let thread = std::thread::spawn(move || watch(&watched, &stop));
        Self { ends, thread }
    }

    pub(crate) fn end(self) -> Seen {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

fn watch(arm: &str, ends: &AtomicBool) -> Seen {
    let observer = ipc::Observer::open(&system_tests::domain::arm(arm)).unwrap();
    let (mut setpoints, mut states) = (VecDeque::new(), VecDeque::new());
    let (mut least, mut rates, mut rated) = (1.0_f64, 0.0, 0.0);
    let mut rated_cycles = 0;
    let (mut behind, mut squares, mut count) = ([0.0; 2], 0.0, 0.0);
    while !ends.load(Ordering::Relaxed) {
        while let Some(setpoint) = observer.next_setpoint() {
            setpoints.push_back(setpoint);
            if setpoints.len() > KEPT {
                setpoints.pop_front();
            }
        }
        while let Some(state) = observer.next_state() {
            states.push_back(state);
        }
        // A state waits until the setpoints around its time are there.
        while let Some(state) = states.front().copied() {
            let newest = setpoints.back().map_or(0, |last: &Setpoint| last.tick_ns);
            if newest < state.measured_ns && states.len() < KEPT {
                break;
            }
            states.pop_front();
            // Zero is said where no motion of the controller's runs.
            let rate = success_rate(&state).filter(|rate| *rate > 0.0);
            rated_cycles = rate.map_or(0, |_| rated_cycles + 1);
            if !state.velocity.iter().any(|speed| speed.abs() > MOVES) {
                continue;
            }
            if let Some(rate) = rate.filter(|_| rated_cycles > CYCLES) {
                least = least.min(rate);
                rates += rate;
                rated += 1.0;
            }
            let Some((wanted, speed)) = at(&setpoints, state.measured_ns) else {
                continue;
            };
            count += 1.0;
            for joint in 0..state.joints as usize {
                behind[0] += speed[joint] * (wanted[joint] - state.commanded[joint]);
                behind[1] += speed[joint] * (wanted[joint] - state.position[joint]);
                squares += speed[joint] * speed[joint];
            }
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Seen {
        rate: [least, rates / rated],
        delay: behind.map(|sum| sum / squares),
        states: count,
    }
}

fn success_rate(state: &State) -> Option<f64> {
    let sensors = &state.sensors[..state.sensor_count as usize];
    let rate = sensors
        .iter()
        .find(|sensor| ipc::text_of(&sensor.name) == "success_rate")?;
    Some(rate.value)
}

/// The plan at a time, between two setpoints of neighbouring periods: positions and speeds.
fn at(setpoints: &VecDeque<Setpoint>, now_ns: u64) -> Option<([f64; 16], [f64; 16])> {
    let after = setpoints.partition_point(|setpoint| setpoint.tick_ns <= now_ns);
    let (before, after) = (setpoints.get(after.checked_sub(1)?)?, setpoints.get(after)?);
    if before.session != after.session || after.tick != before.tick + 1 {
        return None;
    }
    let share = (now_ns - before.tick_ns) as f64 / (after.tick_ns - before.tick_ns) as f64;
    let mix = |a: &[f64; 16], b: &[f64; 16]| {
        core::array::from_fn(|joint| a[joint] + (b[joint] - a[joint]) * share)
    };
    Some((
        mix(&before.position, &after.position),
        mix(&before.velocity, &after.velocity),
    ))
}

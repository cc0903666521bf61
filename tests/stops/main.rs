//! How long a stop takes, measured from outside by an observer of the setpoints.
//!
//! A measurement and not a test: it takes long, needs an idle machine and asserts only that every
//! stop acts. `cargo test -p system-tests --release --test stops -- --ignored --nocapture` prints a
//! table; `CANTER_STOPS` says how many stops of each kind, 20 if it is not set.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(clippy::print_stdout, reason = "measured values are printed")]
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]

mod scene;
mod watch;

use std::time::{Duration, Instant};

use ipc::{ControlAsk, ControlClient};
use scene::{Burden, Scene};
use watch::Watch;

/// What one stop took.
#[derive(Clone, Copy, Debug)]
struct Taken {
    /// From the call to the first setpoint on which the order acts (ms).
    acts_ms: f64,
    /// From the call to the first slower setpoint (ms): later if the plan leaves no margin to
    /// brake.
    effect_ms: f64,
    /// The distance of the controlled point in that time (mm).
    effect_mm: f64,
    /// From the call to rest (ms).
    rest_ms: f64,
    /// The distance of the controlled point in that time (mm).
    rest_mm: f64,
}

/// Numbers between 0 and 1, always the same.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn count() -> usize {
    let text = std::env::var("CANTER_STOPS").unwrap_or_default();
    text.parse().unwrap_or(20)
}

/// What is measured: how the arm is stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Stop,
    Fast,
    Pause,
    CtrlC,
}

/// Stops a running engine repeatedly, through the control channel.
fn stops(burden: Burden, way: Way, count: usize) -> Vec<Taken> {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut taken = Vec::new();
    while taken.len() < count {
        let scene = Scene::engine(burden);
        let watch = Watch::start(&scene.arm);
        let client = ControlClient::open(&scene.arm).unwrap();
        let until = scene.episode();
        while taken.len() < count && Instant::now() < until {
            if !watch.wait_for_speed() {
                println!("the arm does not move: {}", scene.status());
                break;
            }
            std::thread::sleep(Duration::from_secs_f64(0.02 + 0.2 * random.next()));
            let ask = match way {
                Way::Pause => ControlAsk::Pause,
                way => ControlAsk::Stop {
                    fast: way == Way::Fast,
                },
            };
            let called = scheduling::now_ns();
            let answer = client.ask(ask, Duration::from_secs(3)).unwrap();
            assert_eq!(answer.accepted, 1, "{}", answer.reason());
            taken.extend(watch.taken(called));
            let resumed = client.ask(ControlAsk::Resume, Duration::from_secs(3));
            assert_eq!(resumed.unwrap().accepted, 1);
        }
    }
    taken
}

/// Interrupts a run, each time another one.
fn interrupts(burden: Burden, count: usize) -> Vec<Taken> {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let mut taken = Vec::new();
    while taken.len() < count {
        let mut scene = Scene::engine(burden);
        let watch = Watch::start(&scene.arm);
        if !watch.wait_for_speed() {
            println!("the arm does not move: {}", scene.status());
            continue;
        }
        std::thread::sleep(Duration::from_secs_f64(0.02 + 0.5 * random.next()));
        let called = scheduling::now_ns();
        scene.interrupt();
        taken.extend(watch.taken(called));
        scene.wait_for_the_end();
    }
    taken
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let at = (share * (values.len() - 1) as f64).ceil() as usize;
    values[at]
}

fn row(burden: Burden, way: Way, taken: &[Taken]) {
    let column = |value: fn(&Taken) -> f64| {
        let mut values: Vec<f64> = taken.iter().map(value).collect();
        [0.5, 0.99, 1.0].map(|share| quantile(&mut values, share))
    };
    let [a50, a99, a100] = column(|taken| taken.acts_ms);
    let [e50, e99, e100] = column(|taken| taken.effect_ms);
    let [m50, m99, m100] = column(|taken| taken.effect_mm);
    let [r50, r99, r100] = column(|taken| taken.rest_ms);
    let [d50, d99, d100] = column(|taken| taken.rest_mm);
    println!(
        "| {burden:?} | {way:?} | {} | {a50:.2} / {a99:.2} / {a100:.2} | {e50:.2} / {e99:.2} / {e100:.2} | {m50:.2} / {m99:.2} / {m100:.2} \
         | {r50:.0} / {r99:.0} / {r100:.0} | {d50:.1} / {d99:.1} / {d100:.1} |",
        taken.len()
    );
}

#[test]
#[ignore = "a measurement of many minutes"]
fn stop_latency() {
    let count = count();
    let only = std::env::var("CANTER_BURDEN").ok();
    println!(
        "| burden | way | stops | the order acts, ms | first slower setpoint, ms | mm | rest, ms | mm |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for burden in Burden::ALL {
        if only
            .as_ref()
            .is_some_and(|only| *only != format!("{burden:?}"))
        {
            continue;
        }
        for way in [Way::Stop, Way::Pause, Way::Fast] {
            row(burden, way, &stops(burden, way, count));
        }
        row(burden, Way::CtrlC, &interrupts(burden, count / 4 + 1));
    }
}

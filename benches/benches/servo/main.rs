//! The servo loop compared with its peers. A 1 kHz period has 1 ms for everything. The goals: a
//! wake-up delay like cyclictest's, a setpoint as fast as a plain message, and 2 % of a core.
//!
//! Each peer is measured in the same run, alternating with Canter. The last lines are `ratio <name>
//! <ours/peer>`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench prints, and may stop"
)]

mod cycle;
mod lock_step;
mod peer;
mod round_trip;
mod statistics;
mod wake_up;

use std::process::Command;
use std::sync::atomic::AtomicBool;

use ipc::{AnsweringProbe, Arm, Domain};
use nalgebra::SVector;
use realtime::{JointLimits, Piece, Sample, Segment};

use cycle::governor;
use lock_step::lock_steps;
use round_trip::{echo_link, echo_probe, ping};
use wake_up::wake_up;

const N: usize = 6;
type Joints = SVector<f64, N>;

/// How many times Canter and a peer are measured alternately.
const ROUNDS: usize = 5;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--peer", "driver", arm] => return driver(arm),
        ["--peer", "probe", arm] => return echo_probe(arm, AnsweringProbe::receive),
        ["--peer", "glance", arm] => return echo_probe(arm, AnsweringProbe::glance),
        ["--peer", "link", arm] => return echo_link(arm),
        _ => {}
    }
    machine();
    let mut ratios = Vec::new();
    // `cargo bench --bench servo -- wake-up` or `-- lock-step` measures that part only.
    let parts = ["wake-up", "ping", "lock-step"];
    let one = words.iter().find(|word| parts.contains(&word.as_str()));
    let asked = |part| one.is_none_or(|one| one == part);
    if asked("wake-up") {
        governor();
        for rate in [1000.0, 2000.0, 4000.0] {
            wake_up(rate, &mut ratios);
        }
    }
    if asked("ping") {
        ping(&mut ratios);
    }
    if asked("lock-step") {
        lock_steps(&mut ratios);
    }
    for (name, ratio) in ratios {
        println!("ratio {name} {ratio:.3}");
    }
}

fn machine() {
    let read = |path| std::fs::read_to_string(path).unwrap_or_default();
    let processor = read("/proc/cpuinfo");
    let model = processor
        .lines()
        .find(|line| line.starts_with("model name"))
        .unwrap_or("unknown");
    let commit = Command::new("git")
        .args(["rev-parse", "--short", "HEAD"])
        .output();
    let commit = commit.map(|out| String::from_utf8_lossy(&out.stdout).into_owned());
    println!(
        "{} | kernel {}",
        model,
        read("/proc/sys/kernel/osrelease").trim()
    );
    println!(
        "load {} | commit {}",
        read("/proc/loadavg").trim(),
        commit.unwrap_or_default().trim()
    );
}

fn arm(name: &str) -> Arm {
    named(&format!("bench-{}/{name}", std::process::id()))
}

/// The arm of this name in the user's domain.
fn named(arm: &str) -> Arm {
    let domain = Domain::choose(None, |name| std::env::var_os(name)).unwrap();
    domain.arm(arm).unwrap()
}

fn limits() -> JointLimits<N> {
    JointLimits {
        lower: Joints::from_element(-6.3),
        upper: Joints::from_element(6.3),
        velocity: Joints::from_element(3.1),
        acceleration: Joints::from_element(15.0),
        jerk: Joints::from_element(200.0),
        ends: None,
    }
}

/// A move of about a second, to or fro.
fn command(index: u32) -> Segment<N> {
    let (from, to) = (Joints::zeros(), Joints::from_element(0.5));
    let (from, to) = if index.is_multiple_of(2) {
        (from, to)
    } else {
        (to, from)
    };
    let piece = Piece::hermite(0.98, &Sample::rest(from), &Sample::rest(to));
    Segment {
        piece,
        command: index,
        last: true,
    }
}

fn driver(arm: &str) {
    let mut options = driver_sim::Options::new(named(arm), N);
    options.velocity = vec![3.1; N];
    static STOP: AtomicBool = AtomicBool::new(false);
    driver_sim::run(options, &STOP).unwrap();
}

//! The servo loop beside its peers. A 1 kHz period has 1 ms for all of it; the goals are a wake-up
//! like cyclictest's, a setpoint that arrives like a bare message, and 2 % of a core.
//!
//! Each peer is measured in the same run, in turns with ours. Last come lines
//! `ratio <name> <ours/peer>`.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench prints, and may stop"
)]

use std::hint::black_box;
use std::process::{Child, Command};
use std::sync::atomic::AtomicBool;
use std::thread::sleep;
use std::time::{Duration, Instant};

use engine::executor::{Control, Event, Executor, ExecutorConfig, Feeder, Remote};
use ipc::{Arm, Clock, DriverLink, EngineLink, Probe, Setpoint, State};
use nalgebra::SVector;
use realtime::{Cycle, Demand, Limits, Manner, Piece, Sample, Segment};

const N: usize = 6;
type Joints = SVector<f64, N>;

/// Setpoints of one wake-up measurement.
const WAKEUPS: u64 = 4000;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--peer", "driver", arm] => return driver(arm),
        ["--peer", "probe", arm] => return echo_probe(arm),
        ["--peer", "link", arm] => return echo_link(arm),
        _ => {}
    }
    machine();
    let mut ratios = Vec::new();
    governor();
    for rate in [1000.0, 2000.0, 4000.0] {
        wake_up(rate, &mut ratios);
    }
    ping(&mut ratios);
    lock_step();
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
    format!("bench-{}/{name}", std::process::id())
        .parse()
        .unwrap()
}

/// Another process of this bench, ended with the value.
struct Peer(Child);

impl Peer {
    fn start(role: &str, arm: &Arm) -> Self {
        let me = std::env::current_exe().unwrap();
        let child = Command::new(me)
            .args(["--peer", role, &arm.to_string()])
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(300));
        Self(child)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn limits() -> Limits<N> {
    Limits {
        lower: Joints::from_element(-6.3),
        upper: Joints::from_element(6.3),
        velocity: Joints::from_element(3.1),
        acceleration: Joints::from_element(15.0),
        jerk: Joints::from_element(200.0),
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
    let mut options = driver_sim::Options::new(arm.parse().unwrap(), N);
    options.velocity = vec![3.1; N];
    static STOP: AtomicBool = AtomicBool::new(false);
    driver_sim::run(options, &STOP).unwrap();
}

/// What the cycle costs when nothing, and when everything, changes.
fn governor() {
    let seven = |value: f64| SVector::<f64, 7>::from_element(value);
    let limits = Limits {
        lower: seven(-9.0),
        upper: seven(9.0),
        velocity: seven(3.1),
        acceleration: seven(15.0),
        jerk: seven(200.0),
    };
    let mut cycle = Box::new(Cycle::<7, 512>::new(seven(0.0), limits, 0.001));
    let (from, to) = (Sample::rest(seven(0.0)), Sample::rest(seven(0.5)));
    let there = Segment {
        piece: Piece::hermite(0.98, &from, &to),
        command: 0,
        last: true,
    };
    let back = Segment {
        piece: Piece::hermite(0.98, &to, &from),
        command: 1,
        last: true,
    };
    for (name, changing) in [("steady", false), ("under changing overrides", true)] {
        let mut times = Vec::new();
        for tick in 0..40_000_u32 {
            if cycle.is_idle() {
                cycle.push(&there);
                cycle.push(&back);
            }
            let demand = match tick / 200 % 4 {
                1 if changing => Demand::Run(0.2),
                2 if changing => Demand::Stop(Manner::Fast),
                _ => Demand::Run(1.0),
            };
            let start = Instant::now();
            black_box(cycle.step(black_box(demand)));
            times.push(start.elapsed().as_nanos() as u64);
        }
        times.sort_unstable();
        println!("cycle of 7 joints, {name}: {}", summary(&times));
    }
}

fn quantile(sorted: &[u64], share: f64) -> u64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

fn summary(sorted: &[u64]) -> String {
    format!(
        "p50 {} ns, p99 {} ns",
        quantile(sorted, 0.5),
        quantile(sorted, 0.99)
    )
}

/// Processor time of this process (s).
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let words: Vec<&str> = text
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .collect();
    let ticks = |at: usize| {
        words
            .get(at)
            .and_then(|word| word.parse::<f64>().ok())
            .unwrap_or(0.0)
    };
    (ticks(11) + ticks(12)) / 100.0
}

/// Moves at a rate in turns with cyclictest: wake-up, work, share of a core.
fn wake_up(rate: f64, ratios: &mut Vec<(String, f64)>) {
    let arm = arm(&format!("wake{rate}"));
    let _driver = Peer::start("driver", &arm);
    let config = ExecutorConfig {
        rate_hz: rate,
        ..ExecutorConfig::new(arm, limits())
    };
    let (executor, mut feeder, mut monitor) = Executor::<N>::start(config).unwrap();
    if let Some(warning) = &executor.warning {
        println!("{warning}");
    }
    let remote = executor.remote();
    let before = (processor_seconds(), Instant::now());
    move_for(&remote, &mut feeder, (WAKEUPS as f64 / rate).max(2.0));
    let share = (processor_seconds() - before.0) / before.1.elapsed().as_secs_f64();
    while let Some(event) = monitor.event() {
        if let Event::Faulted { fault, .. } = event {
            println!("fault: {fault}");
        }
    }
    let counters = remote.counters();
    let ours = (
        remote.latency().quantile(0.5),
        remote.latency().quantile(0.99),
    );
    println!(
        "{rate} Hz: work p50 {} ns, p99 {} ns; wake-up p50 {} ns, p99 {} ns; state age p50 {} ns; \
         {} published, {} skipped; {:.2} % of a core",
        remote.work().quantile(0.5),
        remote.work().quantile(0.99),
        ours.0,
        ours.1,
        remote.state_age().quantile(0.5),
        counters.published,
        counters.skipped,
        share * 100.0
    );
    drop(executor);
    let Some(peer) = cyclictest(rate) else {
        println!("cyclictest is absent (Debian: rt-tests), its ratios are left out");
        return;
    };
    println!(
        "{rate} Hz: cyclictest wake-up p50 {} ns, p99 {} ns",
        peer.0, peer.1
    );
    let suffix = if rate == 1000.0 {
        String::new()
    } else {
        format!("-{}khz", rate / 1000.0)
    };
    ratios.push((
        format!("cyclictest-wakeup-p50{suffix}"),
        ours.0 as f64 / peer.0 as f64,
    ));
    ratios.push((
        format!("cyclictest-wakeup-p99{suffix}"),
        ours.1 as f64 / peer.1 as f64,
    ));
    if rate == 1000.0 {
        ratios.push(("core-share-1khz-of-2-percent".to_owned(), share / 0.02));
    }
}

fn move_for(remote: &Remote<N>, feeder: &mut Feeder<N>, seconds: f64) {
    let end = Instant::now() + Duration::from_secs_f64(seconds);
    let mut next = 0;
    while Instant::now() < end {
        while feeder.room() > 4090 && feeder.push(command(next)).is_ok() {
            next += 1;
        }
        sleep(Duration::from_millis(20));
    }
    remote.control(Control::Pause);
}

/// Median and 99th percentile of cyclictest's wake-up latency at the rate (ns).
fn cyclictest(rate: f64) -> Option<(u64, u64)> {
    let interval = format!("{}", 1e6 / rate);
    let loops = format!("{}", (2.0 * rate).max(WAKEUPS as f64));
    let arguments = [
        "-q", "-m", "-p", "60", "-i", &interval, "-l", &loops, "-h", "20000",
    ];
    let output = Command::new("cyclictest").args(arguments).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let counts: Vec<(u64, u64)> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
        })
        .collect();
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    let quantile = |share: f64| {
        let mut seen = 0;
        let found = counts.iter().find(|(_, count)| {
            seen += count;
            seen as f64 >= share * total as f64
        });
        // Whole microseconds: the middle of the bucket.
        found.map(|(microseconds, _)| microseconds * 1000 + 500)
    };
    Some((quantile(0.5)?, quantile(0.99)?))
}

fn echo_probe(arm: &str) {
    let probe = Probe::open(&arm.parse().unwrap(), false).unwrap();
    loop {
        if let Some(number) = probe.receive() {
            probe.send(number);
        }
        std::hint::spin_loop();
    }
}

fn echo_link(arm: &str) {
    let link = DriverLink::open(&arm.parse().unwrap()).unwrap();
    loop {
        if let Some(setpoint) = link.last_setpoint()
            && setpoint.check(N).is_ok()
        {
            let setpoint_sequence = setpoint.sequence;
            link.send(State {
                joints: N as u32,
                setpoint_sequence,
                ..State::default()
            });
        }
        std::hint::spin_loop();
    }
}

/// Round trips of a checked setpoint and state, in turns with those of bare messages.
fn ping(ratios: &mut Vec<(String, f64)>) {
    const TRIPS: u64 = 20_000;
    let arm = arm("ping");
    let _probe = Peer::start("probe", &arm);
    let probe = Probe::open(&arm, true).unwrap();
    let bare = trips(TRIPS, |number| {
        probe.send(number);
        let end = Instant::now() + Duration::from_secs(1);
        while probe.receive() != Some(number) && Instant::now() < end {
            std::hint::spin_loop();
        }
    });
    drop((probe, _probe));
    let _link = Peer::start("link", &arm);
    let link = EngineLink::open(&arm).unwrap();
    let setpoint = Setpoint {
        joints: N as u32,
        period_ns: 1_000_000,
        watchdog_ns: 100_000_000,
        ..Setpoint::default()
    };
    let ours = trips(TRIPS, |sequence| {
        let mut next = setpoint;
        next.sequence = sequence;
        next.published_ns = ipc::now_ns();
        link.send(next);
        let end = Instant::now() + Duration::from_secs(1);
        loop {
            if let Some(state) = link.last_state()
                && state.check(N).is_ok()
                && state.setpoint_sequence == sequence
            {
                break;
            }
            if Instant::now() > end {
                break;
            }
            std::hint::spin_loop();
        }
    });
    println!(
        "round trip of setpoint and state, checked: {}",
        summary(&ours)
    );
    println!(
        "round trip of bare messages of that size: {}",
        summary(&bare)
    );
    ratios.push((
        "iceoryx2-ping-p50".to_owned(),
        quantile(&ours, 0.5) as f64 / quantile(&bare, 0.5) as f64,
    ));
}

fn trips(count: u64, mut trip: impl FnMut(u64)) -> Vec<u64> {
    (1..200).for_each(&mut trip);
    let mut times: Vec<u64> = (200..200 + count)
        .map(|number| {
            let start = Instant::now();
            trip(number);
            start.elapsed().as_nanos() as u64
        })
        .collect();
    times.sort_unstable();
    times
}

/// How much faster than real time the whole chain runs in step with the simulated driver.
fn lock_step() {
    let arm = arm("step");
    let _driver = Peer::start("driver", &arm);
    let config = ExecutorConfig {
        clock: Clock::LockStep,
        ..ExecutorConfig::new(arm, limits())
    };
    let (executor, mut feeder, mut monitor) = Executor::<N>::start(config).unwrap();
    let start = Instant::now();
    (0..60).for_each(|index| feeder.push(command(index)).unwrap());
    let mut done = false;
    while !done && start.elapsed() < Duration::from_secs(60) {
        while let Some(event) = monitor.event() {
            done |= matches!(event, Event::Finished { command: 59, .. });
        }
        sleep(Duration::from_millis(1));
    }
    let ticks = executor.remote().counters().ticks;
    let speed = ticks as f64 * 0.001 / start.elapsed().as_secs_f64();
    println!("lock-step: {ticks} periods of 1 ms, {speed:.0} times real time, done {done}");
}

//! The servo loop compared with its peers. A 1 kHz period has 1 ms for everything. The goals: a
//! wake-up delay like cyclictest's, a setpoint as fast as a plain message, and 2 % of a core.
//!
//! Each peer is measured in the same run, alternating with Canter. The last lines are `ratio <name>
//! <ours/peer>`.
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

use ipc::{Arm, Clock, Domain, DriverLink, EngineLink, Probe, Setpoint, State};
use nalgebra::SVector;
use realtime::{Cycle, Demand, JointLimits, Piece, Sample, Segment, StopCategory};
use servo::{Control, Event, Executor, ExecutorConfig, Histogram, Remote, SegmentSender};

const N: usize = 6;
type Joints = SVector<f64, N>;

/// How many times Canter and a peer are measured alternately, and for how long each (s).
const ROUNDS: usize = 5;
const ROUND_S: f64 = 2.0;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--peer", "driver", arm] => return driver(arm),
        ["--peer", "probe", arm] => return echo_probe(arm, Probe::receive),
        ["--peer", "glance", arm] => return echo_probe(arm, Probe::glance),
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
    lock_steps(&mut ratios);
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

/// Another process of this benchmark, ended when dropped.
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

fn limits() -> JointLimits<N> {
    JointLimits {
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
    let mut options = driver_sim::Options::new(named(arm), N);
    options.velocity = vec![3.1; N];
    static STOP: AtomicBool = AtomicBool::new(false);
    driver_sim::run(options, &STOP).unwrap();
}

/// Cost of the cycle when nothing changes and when everything changes.
fn governor() {
    let seven = |value: f64| SVector::<f64, 7>::from_element(value);
    let limits = JointLimits {
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
                2 if changing => Demand::Stop(StopCategory::Fast),
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

/// Processor time of all threads of this process (s), to the ns.
fn processor_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task")
        .into_iter()
        .flatten()
        .flatten();
    let run = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    tasks.filter_map(run).sum::<f64>() * 1e-9
}

/// Result of one round at a rate: p50 and p99 of wake-up delay and of work (ns), fraction of a
/// core.
struct Round {
    wake_up: (u64, u64),
    work: (u64, u64),
    share: f64,
}

/// A round of Canter, and p50 and p99 (ns) of the peer's round after it, if there is a peer.
type Turn = (Round, Option<(u64, u64)>);

/// Moves at a rate for a while.
fn round(rate: f64, number: usize) -> Round {
    let arm = arm(&format!("wake{rate}-{number}"));
    let _driver = Peer::start("driver", &arm);
    let config = ExecutorConfig {
        rate_hz: rate,
        ..ExecutorConfig::new(arm, limits())
    };
    let (executor, mut sender, mut monitor) = Executor::<N>::start(config).unwrap();
    if let Some(warning) = executor.warning.as_ref().filter(|_| number == 0) {
        println!("{warning}");
    }
    let remote = executor.remote();
    let before = (processor_seconds(), Instant::now());
    move_for(&remote, &mut sender, ROUND_S);
    let share = (processor_seconds() - before.0) / before.1.elapsed().as_secs_f64();
    while let Some(event) = monitor.event() {
        if let Event::Faulted { fault, .. } = event {
            println!("fault: {fault}");
        }
    }
    let both = |histogram: &Histogram| (histogram.quantile(0.5), histogram.quantile(0.99));
    Round {
        wake_up: both(remote.latency()),
        work: both(remote.work()),
        share,
    }
}

/// Rounds alternating with cyclictest at the same rate and priority; each figure is the median of
/// the rounds, each ratio the median of the rounds' ratios.
fn wake_up(rate: f64, ratios: &mut Vec<(String, f64)>) {
    let rounds: Vec<Turn> = (0..ROUNDS)
        .map(|number| (round(rate, number), cyclictest(rate)))
        .collect();
    let middle = |of: &dyn Fn(&Turn) -> Option<f64>| median(rounds.iter().filter_map(of).collect());
    let ns = |of: &dyn Fn(&Round) -> u64| middle(&|(ours, _)| Some(of(ours) as f64));
    let share = middle(&|(ours, _)| Some(ours.share));
    println!(
        "{rate} Hz: work p50 {} ns, p99 {} ns; wake-up p50 {} ns, p99 {} ns; {:.2} % of a core",
        ns(&|ours| ours.work.0),
        ns(&|ours| ours.work.1),
        ns(&|ours| ours.wake_up.0),
        ns(&|ours| ours.wake_up.1),
        share * 100.0
    );
    let peer = |of: &dyn Fn((u64, u64)) -> u64| middle(&|(_, peer)| peer.map(|p| of(p) as f64));
    if rounds.iter().all(|(_, peer)| peer.is_none()) {
        println!("cyclictest is missing (apt install rt-tests): no ratios of wake-ups");
    } else {
        println!(
            "{rate} Hz: cyclictest wake-up p50 {} ns, p99 {} ns",
            peer(&|p| p.0),
            peer(&|p| p.1)
        );
        let suffix = if rate == 1000.0 {
            String::new()
        } else {
            format!("-{}khz", rate / 1000.0)
        };
        let p50 = middle(&|(ours, peer)| peer.map(|p| ours.wake_up.0 as f64 / p.0 as f64));
        let p99 = middle(&|(ours, peer)| peer.map(|p| ours.wake_up.1 as f64 / p.1 as f64));
        ratios.push((format!("cyclictest-wakeup-p50{suffix}"), p50));
        ratios.push((format!("cyclictest-wakeup-p99{suffix}"), p99));
    }
    if rate == 1000.0 {
        ratios.push(("core-share-1khz-of-2-percent".to_owned(), share / 0.02));
    }
}

/// The middle of some numbers.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn move_for(remote: &Remote<N>, sender: &mut SegmentSender<N>, seconds: f64) {
    let end = Instant::now() + Duration::from_secs_f64(seconds);
    let mut next = 0;
    while Instant::now() < end {
        while sender.room() > 4090 && sender.push(command(next)).is_ok() {
            next += 1;
        }
        sleep(Duration::from_millis(20));
    }
    remote.control(Control::Pause);
}

/// Median and 99th percentile of cyclictest's wake-up latency at the rate (ns).
fn cyclictest(rate: f64) -> Option<(u64, u64)> {
    let interval = format!("{}", 1e6 / rate);
    let loops = format!("{}", ROUND_S * rate);
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
        // Whole microseconds: counted as evenly distributed over the bucket.
        found.map(|(microseconds, count)| {
            let over = (seen as f64 - share * total as f64) / *count as f64;
            microseconds * 1000 + (1000.0 * (1.0 - over)) as u64
        })
    };
    Some((quantile(0.5)?, quantile(0.99)?))
}

fn echo_probe(arm: &str, look: fn(&Probe) -> Option<u64>) {
    let probe = Probe::open(&named(arm), false).unwrap();
    loop {
        if let Some(number) = look(&probe) {
            probe.send(number);
        }
        std::hint::spin_loop();
    }
}

fn echo_link(arm: &str) {
    let link = DriverLink::open(&named(arm)).unwrap();
    loop {
        if let Some(setpoint) = link.next_setpoint()
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

/// Round trips of a checked setpoint and state, alternating with those of plain messages of that
/// size: read as a whole, and with only one number read.
fn ping(ratios: &mut Vec<(String, f64)>) {
    let rounds: Vec<[Vec<u64>; 3]> = (0..ROUNDS)
        .map(|number| {
            let arm = arm(&format!("ping{number}"));
            [
                link_trips(&arm),
                probe_trips(&arm, "probe", Probe::receive),
                probe_trips(&arm, "glance", Probe::glance),
            ]
        })
        .collect();
    let middle = |of: &dyn Fn(&[Vec<u64>; 3]) -> f64| median(rounds.iter().map(of).collect());
    let at = |sorted: &[u64], share: f64| quantile(sorted, share) as f64;
    for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
        println!(
            "round trip {name}: setpoint and state, checked {} ns; bare messages of that size, read \
             {} ns, glanced at {} ns",
            middle(&|[ours, _, _]| at(ours, share)),
            middle(&|[_, read, _]| at(read, share)),
            middle(&|[_, _, glance]| at(glance, share)),
        );
        let read = middle(&|[ours, read, _]| at(ours, share) / at(read, share));
        let glance = middle(&|[ours, _, glance]| at(ours, share) / at(glance, share));
        ratios.push((format!("iceoryx2-ping-{name}"), read));
        ratios.push((format!("iceoryx2-glance-{name}"), glance));
    }
}

/// Round trips of a round.
const TRIPS: u64 = 20_000;

fn probe_trips(arm: &Arm, peer: &str, look: fn(&Probe) -> Option<u64>) -> Vec<u64> {
    let _probe = Peer::start(peer, arm);
    let probe = Probe::open(arm, true).unwrap();
    trips(TRIPS, |number| {
        probe.send(number);
        let end = Instant::now() + Duration::from_secs(1);
        while look(&probe) != Some(number) && Instant::now() < end {
            std::hint::spin_loop();
        }
    })
}

fn link_trips(arm: &Arm) -> Vec<u64> {
    let _link = Peer::start("link", arm);
    let link = EngineLink::open(arm).unwrap();
    let setpoint = Setpoint {
        joints: N as u32,
        period_ns: 1_000_000,
        watchdog_ns: 100_000_000,
        ..Setpoint::default()
    };
    trips(TRIPS, |sequence| {
        let mut next = setpoint;
        next.sequence = sequence;
        next.published_ns = scheduling::now_ns();
        link.send(next);
        let end = Instant::now() + Duration::from_secs(1);
        loop {
            if let Some(state) = link.next_state()
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
    })
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

/// How much faster than real time the whole chain runs in lock-step with the simulated driver and
/// with MuJoCo, and the required minimum.
fn lock_steps(ratios: &mut Vec<(String, f64)>) {
    let arm = arm("step");
    let driver = Peer::start("driver", &arm);
    if let Some(speed) = lock_step(&arm, 60) {
        println!("lock-step with the simulated driver: {speed:.0} times real time");
        ratios.push(("lock-step-sim-of-200".to_owned(), 200.0 / speed));
    }
    drop(driver);
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let script = format!("{root}/drivers/python/mujoco_driver.py");
    let urdf = format!("{root}/robots/ur5e/robot.urdf");
    let python = Command::new("python3")
        .args([&script, &arm.to_string(), &urdf])
        .stdout(std::process::Stdio::null())
        .spawn();
    let speed = python.ok().and_then(|child| {
        let mut peer = Peer(child);
        sleep(Duration::from_secs(3));
        let alive = matches!(peer.0.try_wait(), Ok(None));
        if alive { lock_step(&arm, 20) } else { None }
    });
    match speed {
        Some(speed) => {
            println!("lock-step with MuJoCo, UR5e from its URDF: {speed:.1} times real time");
            ratios.push(("lock-step-mujoco-of-25".to_owned(), 25.0 / speed));
        }
        None => println!("python3 with mujoco and iceoryx2 is missing: no lock-step with MuJoCo"),
    }
}

/// How much faster than real time `commands` of about a second run in lock-step with the arm's
/// driver.
fn lock_step(arm: &Arm, commands: u32) -> Option<f64> {
    let config = ExecutorConfig {
        clock: Clock::LockStep,
        ..ExecutorConfig::new(arm.clone(), limits())
    };
    let (executor, mut sender, mut monitor) = Executor::<N>::start(config).ok()?;
    let start = Instant::now();
    (0..commands).for_each(|index| sender.push(command(index)).unwrap());
    while start.elapsed() < Duration::from_secs(60) {
        while let Some(event) = monitor.event() {
            match event {
                Event::Finished { command, .. } if command + 1 == commands => {
                    let ticks = executor.remote().counters().ticks;
                    return Some(ticks as f64 * 0.001 / start.elapsed().as_secs_f64());
                }
                Event::Faulted { fault, .. } => println!("fault: {fault}"),
                _ => {}
            }
        }
        sleep(Duration::from_millis(1));
    }
    None
}

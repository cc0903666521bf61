//! Delay and work of the servo thread's periods, beside cyclictest.

use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use servo::{Control, Event, Executor, ExecutorConfig, Histogram, Remote, SegmentSender};

use crate::peer::Peer;
use crate::statistics::median;
use crate::{N, ROUNDS, arm, command, limits};

/// How long Canter and a peer are measured each time (s).
const ROUND_S: f64 = 2.0;

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
pub(crate) fn wake_up(rate: f64, ratios: &mut Vec<(String, f64)>) {
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

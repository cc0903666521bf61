//! Random operators, clients and faults on one engine, as processes, from a seed: nothing ends
//! without a reason, no limit is exceeded, and afterwards a program runs to its end.
//!
//! `CANTER_OPERATORS_S` sets the length of the long run (s, 1800 by default), `CANTER_SEED` its seed.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::canter::command;
use system_tests::killed::Killed;
use system_tests::signal;

/// How long a client may take to answer. Generous: the machine has other work.
const PATIENCE: Duration = Duration::from_secs(30);

/// How long after an injected fault a fault of engine or driver is explained by it.
const EXPLAINED: Duration = Duration::from_secs(8);

/// Numbers from a seed.
///
/// # Source
/// G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8 (2003).
struct Random(u64);

impl Random {
    /// A number from 0 to `end`, without it.
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

/// A process of the test; what it prints is read at once.
struct Process {
    child: Killed,
    lines: Receiver<String>,
}

impl Process {
    fn start(words: &[&str]) -> Self {
        let mut child = command(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (send, lines) = channel();
        let errors = BufReader::new(child.stderr.take().unwrap()).lines();
        let output = BufReader::new(child.stdout.take().unwrap()).lines();
        let both: [Box<dyn Iterator<Item = _> + Send>; 2] = [Box::new(errors), Box::new(output)];
        for reader in both {
            let send = send.clone();
            std::thread::spawn(move || {
                let lines = reader.map_while(Result::ok);
                // Who listened may have gone.
                lines.for_each(|line| drop(send.send(line)));
            });
        }
        Self {
            child: Killed(child),
            lines,
        }
    }

    fn kill(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// What it printed since the last call.
    fn printed(&self) -> Vec<String> {
        self.lines.try_iter().collect()
    }
}

/// Reads all setpoints and keeps the worst ratio to each limit.
struct Watch {
    ends: Arc<AtomicBool>,
    worst: Arc<Mutex<[f64; 3]>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    fn start(arm: &str) -> Self {
        let robot = planner::robot::load("ur5e").unwrap();
        let limits = robot.joint_limits::<6>();
        let (ends, worst) = (
            Arc::<AtomicBool>::default(),
            Arc::new(Mutex::new([0.0_f64; 3])),
        );
        let (stop, seen, arm) = (ends.clone(), worst.clone(), system_tests::domain::arm(arm));
        let thread = std::thread::spawn(move || {
            let observer = ipc::Observer::open(&arm).unwrap();
            while !stop.load(Ordering::Relaxed) {
                while let Some(setpoint) = observer.next_setpoint() {
                    let mut worst = seen.lock().unwrap();
                    for joint in 0..6 {
                        let q = setpoint.position[joint];
                        let beyond = (q - limits.upper[joint]).max(limits.lower[joint] - q);
                        let speed = setpoint.velocity[joint].abs() / limits.velocity[joint];
                        let change = setpoint.acceleration[joint].abs();
                        let change = change / limits.acceleration[joint];
                        let now = [beyond, speed, change];
                        *worst = std::array::from_fn(|i| worst[i].max(now[i]));
                    }
                }
                sleep(Duration::from_millis(2));
            }
        });
        Self {
            ends,
            worst,
            thread: Some(thread),
        }
    }

    /// Farthest beyond a range (rad), greatest share of the limits of speed and acceleration.
    fn end(mut self) -> [f64; 3] {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
        *self.worst.lock().unwrap()
    }
}

/// One engine with its driver, and what happened to them.
struct Cell {
    arm: String,
    random: Random,
    engine: Process,
    driver: Process,
    engines: usize,
    drivers: usize,
    injected: Instant,
    /// What was done, and how often.
    done: BTreeMap<&'static str, usize>,
    /// How clients ended.
    codes: BTreeMap<String, usize>,
    /// Faults after something was injected, and faults of a machine that stalls.
    faults: [usize; 2],
    broken: Vec<String>,
}

impl Cell {
    fn new(arm: String, seed: u64) -> Self {
        let driver = Process::start(&["driver", "sim", "--robot", "ur5e", "--arm", &arm]);
        let engine = Self::engine(&arm);
        Self {
            random: Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1),
            engine,
            driver,
            arm,
            engines: 1,
            drivers: 1,
            injected: Instant::now(),
            done: BTreeMap::new(),
            codes: BTreeMap::new(),
            faults: [0; 2],
            broken: Vec::new(),
        }
    }

    fn engine(arm: &str) -> Process {
        let words = [
            "engine", "--robot", "ur5e", "--driver", "external", "--json",
        ];
        Process::start(&[&words[..], &["--arm", arm]].concat())
    }

    /// Runs a client to its end; says its exit code.
    fn client(&mut self, words: &[&str]) -> Option<i32> {
        let mut process = Process::start(&[words, &["--arm", &self.arm]].concat());
        drop(process.child.stdin.take());
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            if let Some(status) = process.child.try_wait().unwrap() {
                let code = status.code();
                let name = format!("{} {code:?}", words[0]);
                *self.codes.entry(name).or_default() += 1;
                if !matches!(code, Some(0 | 1 | 3 | 4 | 5 | 6 | 7)) {
                    sleep(Duration::from_millis(50));
                    let said = process.printed();
                    self.broken
                        .push(format!("{words:?} ended with {status}: {said:?}"));
                }
                return code;
            }
            sleep(Duration::from_millis(2));
        }
        self.broken.push(format!("{words:?} does not end"));
        None
    }

    /// One action of an operator, a client or a fault.
    fn act(&mut self) {
        let share = self.random.below(100).to_string();
        let (name, words): (_, Vec<&str>) = match self.random.below(24) {
            0..=5 => (
                "send",
                vec!["send", "examples/pick_and_place.canon", "--no-wait"],
            ),
            6 => ("pause", vec!["pause"]),
            7 => ("stop", vec!["stop"]),
            8 => ("stop --fast", vec!["stop", "--fast"]),
            9..=10 => ("resume", vec!["resume"]),
            11 => ("override", vec!["override", &share]),
            12 => ("abort", vec!["abort"]),
            13 => ("recover", vec!["recover"]),
            14 => ("status", vec!["status", "--json"]),
            15 => ("jog", vec!["jog", "j1=0.2", "--seconds", "0.2"]),
            16 => return self.vanish(),
            17 => return self.refuse(),
            18 => return self.interrupt(),
            19..=21 => return self.stall(),
            22 => return self.kill_engine(),
            _ => return self.kill_driver(),
        };
        *self.done.entry(name).or_default() += 1;
        self.client(&words);
    }

    /// A client that sends or watches, and is killed.
    fn vanish(&mut self) {
        *self.done.entry("client killed").or_default() += 1;
        let words: [&[&str]; 2] = [
            &["send", "examples/pick_and_place.canon"],
            &["status", "--watch"],
        ];
        let words = words[self.random.below(2) as usize];
        let _killed_at_the_end = Process::start(&[words, &["--arm", &self.arm]].concat());
        sleep(Duration::from_millis(self.random.below(300)));
    }

    /// A program that cannot be read.
    fn refuse(&mut self) {
        *self.done.entry("bad program").or_default() += 1;
        let code = self.client(&["send", "tests/data/bad_inputs", "--no-wait"]);
        if code == Some(0) {
            self.broken
                .push("a folder was taken as a program".to_owned());
        }
    }

    /// Ends the engine as Ctrl-C does, in motion or not, and starts another.
    fn interrupt(&mut self) {
        *self.done.entry("engine interrupted").or_default() += 1;
        signal::send(&self.engine.child, libc::SIGINT);
        let end = Instant::now() + PATIENCE;
        while self.engine.child.try_wait().unwrap().is_none() {
            if Instant::now() > end {
                self.broken
                    .push("an interrupted engine does not end".to_owned());
                break;
            }
            sleep(Duration::from_millis(5));
        }
        self.new_engine();
    }

    /// Stops engine or driver for 5 to 1000 ms.
    fn stall(&mut self) {
        *self.done.entry("stall").or_default() += 1;
        let time = Duration::from_millis(5 + self.random.below(996));
        let victim = if self.random.below(2) == 0 {
            &self.engine
        } else {
            &self.driver
        };
        signal::send(&victim.child, libc::SIGSTOP);
        sleep(time);
        signal::send(&victim.child, libc::SIGCONT);
        self.injected = Instant::now();
    }

    fn kill_engine(&mut self) {
        *self.done.entry("engine killed").or_default() += 1;
        self.engine.kill();
        self.new_engine();
    }

    fn new_engine(&mut self) {
        self.explain();
        self.engine = Self::engine(&self.arm);
        self.engines += 1;
        self.injected = Instant::now();
        self.wait_for_engine();
    }

    fn kill_driver(&mut self) {
        *self.done.entry("driver killed").or_default() += 1;
        self.driver.kill();
        sleep(Duration::from_millis(self.random.below(400)));
        let words = ["driver", "sim", "--robot", "ur5e", "--arm", &self.arm];
        self.driver = Process::start(&words);
        self.drivers += 1;
        self.injected = Instant::now();
    }

    /// Waits until the engine answers; starts another where one found no driver that is ready, as
    /// a person would.
    fn wait_for_engine(&mut self) {
        let end = Instant::now() + 2 * PATIENCE;
        while Instant::now() < end {
            if self.client(&["status", "--json"]) == Some(0) {
                return;
            }
            let ended = self.engine.child.try_wait().unwrap();
            if ended.is_some_and(|status| status.code() == Some(4)) {
                sleep(Duration::from_millis(50));
                println!("an engine found no driver: {:?}", self.engine.printed());
                self.engine = Self::engine(&self.arm);
                self.engines += 1;
            }
            sleep(Duration::from_millis(100));
        }
        self.broken.push("a new engine does not answer".to_owned());
    }

    /// Checks that both run, and the faults that the engine reported.
    fn explain(&mut self) {
        for (name, process) in [("engine", &mut self.engine), ("driver", &mut self.driver)] {
            if process
                .child
                .try_wait()
                .unwrap()
                .is_some_and(|status| status.code().is_none())
            {
                continue;
            }
            let faults = process.printed().into_iter();
            let faults = faults.filter(|line| name == "engine" && line.contains("\"faulted\""));
            for line in faults {
                let ours = self.injected.elapsed() < EXPLAINED;
                self.faults[usize::from(!ours)] += 1;
                let fault: Value = serde_json::from_str(&line).unwrap_or_default();
                let text = fault.to_string();
                let stalled = [
                    "stalled",
                    "did not run",
                    "lost",
                    "watchdog",
                    "no state",
                    "late",
                ];
                if !ours && !stalled.iter().any(|word| text.contains(word)) {
                    self.broken.push(format!("nobody did this: {line}"));
                }
            }
        }
    }

    /// Whether engine and driver are still there.
    fn alive(&mut self) {
        self.explain();
        for (name, process) in [("engine", &mut self.engine), ("driver", &mut self.driver)] {
            if let Some(status) = process.child.try_wait().unwrap() {
                let said = process.printed();
                self.broken.push(format!(
                    "the {name} ended by itself with {status}: {said:?}"
                ));
            }
        }
    }

    /// Recovers, drops what is left, and runs a program to its end.
    fn finish(&mut self) {
        for _ in 0..20 {
            self.client(&["recover"]);
            self.client(&["abort"]);
            self.client(&["resume"]);
            self.client(&["override", "100"]);
            sleep(Duration::from_millis(500));
            if self.client(&["send", "examples/pick_and_place.canon"]) == Some(0) {
                return;
            }
        }
        self.broken.push("in the end no program runs".to_owned());
    }
}

fn storm(seconds: f64, seed: u64) {
    let arm = format!("operators{}/{seed}", std::process::id());
    let mut cell = Cell::new(arm, seed);
    let watch = Watch::start(&cell.arm);
    cell.wait_for_engine();
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds && cell.broken.is_empty() {
        cell.act();
        cell.alive();
        sleep(Duration::from_millis(cell.random.below(400)));
    }
    cell.finish();
    let worst = watch.end();
    println!(
        "{:.0} s, seed {seed}: {} engines, {} drivers, {:?}\nclients: {:?}\n{} faults after an \
         injected one, {} of a machine that stalls; beyond the range {:.1e} rad, {:.7} of the \
         speed, {:.7} of the acceleration",
        start.elapsed().as_secs_f64(),
        cell.engines,
        cell.drivers,
        cell.done,
        cell.codes,
        cell.faults[0],
        cell.faults[1],
        worst[0],
        worst[1],
        worst[2]
    );
    assert!(cell.broken.is_empty(), "{:#?}", cell.broken);
    assert!(
        worst[0] <= 1e-9 && worst[1..].iter().all(|share| *share <= 1.0 + 1e-6),
        "{worst:?}"
    );
}

#[test]
fn random_operators_and_faults() {
    storm(12.0, 1);
}

#[test]
#[ignore = "takes half an hour"]
fn random_operators_and_faults_for_long() {
    let number =
        |name: &str, usual: f64| std::env::var(name).map_or(usual, |text| text.parse().unwrap());
    let seed = number("CANTER_SEED", 2.0) as u64;
    storm(number("CANTER_OPERATORS_S", 1800.0), seed);
}

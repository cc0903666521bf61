//! Soak test: programs in a loop by the wall clock; no limit is exceeded, memory does not grow.
//!
//! `CANTER_SOAK_S` sets the length (s, 600 by default), `CANTER_SOAK_BIN` the `canter` to test, for
//! example that of a release build.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// What a process may grow by after its first tenth (KiB): a page here and there, not a leak.
const GROWTH: u64 = 2048;

struct Process(Child);

impl Process {
    fn start(words: &[&str]) -> Self {
        let program = std::env::var("CANTER_SOAK_BIN")
            .unwrap_or_else(|_| env!("CARGO_BIN_EXE_canter-under-test").to_owned());
        let child = system_tests::domain::join(&mut Command::new(program))
            .args(words)
            .current_dir(system_tests::repository::root())
            .stdout(Stdio::piped())
            .stdin(Stdio::piped())
            .spawn()
            .unwrap();
        Self(child)
    }

    /// What is in memory (KiB).
    fn resident(&self) -> u64 {
        let path = format!("/proc/{}/status", self.0.id());
        let text = std::fs::read_to_string(path).unwrap();
        let line = text.lines().find(|line| line.starts_with("VmRSS")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// One `canter`, to its end.
fn run(words: &[&str]) -> String {
    let mut process = Process::start(words);
    drop(process.0.stdin.take());
    let lines = BufReader::new(process.0.stdout.take().unwrap()).lines();
    let text: Vec<String> = lines.map_while(Result::ok).collect();
    let status = process.0.wait().unwrap();
    assert!(status.success(), "{words:?}: {text:?}");
    text.join("\n")
}

#[test]
#[ignore = "takes ten minutes"]
fn programs_in_a_loop() {
    let seconds = std::env::var("CANTER_SOAK_S").map_or(600.0, |text| text.parse().unwrap());
    let arm = format!("soak{}/arm", std::process::id());
    let driver = Process::start(&["driver", "sim", "--robot", "ur5e", "--arm", &arm]);
    let mut engine = Process::start(&[
        "engine", "--robot", "ur5e", "--driver", "external", "--json", "--arm", &arm,
    ]);
    let events = BufReader::new(engine.0.stdout.take().unwrap()).lines();
    let faults = std::thread::spawn(move || {
        let lines = events.map_while(Result::ok);
        let bad = |line: &String| line.contains("\"faulted\"") || line.contains("\"refused\"");
        lines.filter(bad).collect::<Vec<String>>()
    });
    std::thread::sleep(Duration::from_secs(1));
    let start = Instant::now();
    let (mut programs, mut warm) = (0, None);
    while start.elapsed().as_secs_f64() < seconds {
        for program in ["pick_and_place", "inches_and_degrees"] {
            let file = format!("examples/{program}.canon");
            run(&["send", &file, "--arm", &arm]);
            programs += 1;
        }
        if warm.is_none() && start.elapsed().as_secs_f64() > seconds / 10.0 {
            warm = Some((engine.resident(), driver.resident()));
        }
    }
    let (warm_engine, warm_driver) = warm.unwrap();
    let (engine_kib, driver_kib) = (engine.resident(), driver.resident());
    let status: Value = serde_json::from_str(&run(&["status", "--json", "--arm", &arm])).unwrap();
    run(&["shutdown", "--arm", &arm]);
    let faults = faults.join().unwrap();
    println!(
        "{programs} programs in {:.0} s, {} periods, {} late; engine {warm_engine} -> {engine_kib} \
         KiB, driver {warm_driver} -> {driver_kib} KiB; {} faults",
        start.elapsed().as_secs_f64(),
        status["cycles"]["published"],
        status["cycles"]["skipped"],
        faults.len()
    );
    assert!(faults.is_empty(), "{faults:?}");
    assert!(status["fault"].is_null());
    assert!(engine_kib <= warm_engine + GROWTH);
    assert!(driver_kib <= warm_driver + GROWTH);
}

//! What stalls and kills at random moments do to a Franka arm: a measurement, and the law that the next run works
//! without a restart of anything that lives.

use std::collections::BTreeMap;
use std::process::{Child, Stdio};
use std::time::Duration;

use crate::canter::command;
use crate::franka::{Controller, Driver, arm, run_of, wait_for_motion};

/// What happens to the system in motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Harm {
    /// A process stands still for so many milliseconds.
    StopEngine(u64),
    StopDriver(u64),
    KillEngine,
    KillDriver,
    KillController,
}

const HARMS: [Harm; 11] = [
    Harm::StopEngine(5),
    Harm::StopDriver(5),
    Harm::StopEngine(15),
    Harm::StopDriver(15),
    Harm::StopEngine(30),
    Harm::StopDriver(30),
    Harm::StopEngine(100),
    Harm::StopDriver(100),
    Harm::KillEngine,
    Harm::KillDriver,
    Harm::KillController,
];

/// So often a run is tried again after a harm.
const TRIES: usize = 2;

/// How many trials of each kind the environment asks for (`CANTER_FRANKA_TRIALS`); none without.
pub(crate) fn count() -> usize {
    let text = std::env::var("CANTER_FRANKA_TRIALS").unwrap_or_default();
    text.parse().unwrap_or(0)
}

/// Why there are no trials, or nothing if there are some.
pub(crate) fn unasked() -> Option<String> {
    let reason = "CANTER_FRANKA_TRIALS says how many trials of stalls and kills; none by default";
    (count() == 0).then(|| reason.to_owned())
}

/// Which kinds the environment asks for (`CANTER_FRANKA_HARM`, a part of their names); all without.
fn is_asked_for(harm: Harm) -> bool {
    let text = std::env::var("CANTER_FRANKA_HARM").unwrap_or_default();
    format!("{harm:?}").contains(&text)
}

/// An arm with everything that belongs to it.
struct Cell {
    controller: Controller,
    driver: Driver,
    arm: String,
    /// The state of the random numbers.
    random: u64,
}

/// What the trials of a kind led to.
#[derive(Default)]
struct Outcome {
    ends: BTreeMap<String, usize>,
    /// After how many tries the next run worked.
    tries: BTreeMap<usize, usize>,
    peaks: [f64; 2],
}

/// Each kind so often as the environment asks for.
pub(crate) fn stalls_and_kills() {
    let (controller, arm) = (Controller::start(), arm());
    let driver = Driver::start(&arm, controller.port);
    let mut cell = Cell {
        controller,
        driver,
        arm,
        random: 0x9e37_79b9_7f4a_7c15,
    };
    for harm in HARMS.into_iter().filter(|harm| is_asked_for(*harm)) {
        let mut outcome = Outcome::default();
        let mut done = 0;
        while done < count() {
            done += cell.trial(harm, count() - done, &mut outcome);
        }
        println!(
            "{harm:?}, {done} times: {:?}; next run after tries: {:?}; peaks {:.3} rad/s2, {:.0} rad/s3",
            outcome.ends, outcome.tries, outcome.peaks[0], outcome.peaks[1]
        );
    }
}

impl Cell {
    /// A number from 0 to 1.
    fn chance(&mut self) -> f64 {
        // xorshift64: S. G. Marsaglia, "Xorshift RNGs", 2003.
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn pause(&mut self, least: f64, most: f64) {
        let time = least + (most - least) * self.chance();
        std::thread::sleep(Duration::from_secs_f64(time));
    }

    /// One run in which it happens, once or, if the run goes on, more often; returns how often.
    fn trial(&mut self, harm: Harm, most: usize, outcome: &mut Outcome) -> usize {
        let program = "examples/pick_and_place.canon";
        let words = [
            "run", program, "--robot", "fr3", "--driver", "external", "--arm", &self.arm,
        ];
        let mut engine = command(words)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        wait_for_motion(&self.arm);
        let mut times = 0;
        while times < most.min(6) {
            self.pause(0.1, 1.5);
            if engine.try_wait().unwrap().is_some() {
                break;
            }
            self.harm(harm, &mut engine);
            times += 1;
        }
        let ran = engine.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        let mut named = said
            .lines()
            .filter(|line| line.contains("error") || line.contains("fault"));
        let last = named.next_back().or(said.lines().next_back());
        let last = last.unwrap_or_default();
        // Without the name of the recording, which differs.
        let last = last
            .split("; the last minute")
            .next()
            .unwrap_or("")
            .to_owned();
        let end = match ran.status.code() {
            Some(0) => "finished".to_owned(),
            code => format!("{code:?} {last}"),
        };
        *outcome.ends.entry(end).or_default() += 1;
        if harm == Harm::KillController {
            self.controller.restart();
        } else {
            let record = self.controller.record();
            outcome.peaks[0] = outcome.peaks[0].max(record.acceleration);
            outcome.peaks[1] = outcome.peaks[1].max(record.jerk);
        }
        if ran.status.code() != Some(0) {
            *outcome.tries.entry(self.next_run(harm)).or_default() += 1;
        }
        times
    }

    fn harm(&mut self, harm: Harm, engine: &mut Child) {
        let stop = |child: &Child, milliseconds: u64| {
            system_tests::signal::send(child, libc::SIGSTOP);
            std::thread::sleep(Duration::from_millis(milliseconds));
            system_tests::signal::send(child, libc::SIGCONT);
        };
        match harm {
            Harm::StopEngine(milliseconds) => stop(engine, milliseconds),
            Harm::StopDriver(milliseconds) => stop(&self.driver.0, milliseconds),
            Harm::KillEngine => engine.kill().unwrap(),
            Harm::KillDriver => {
                self.driver =
                    Driver::start_again(&mut self.driver, &self.arm, self.controller.port);
            }
            Harm::KillController => self.controller.kill(),
        }
    }

    /// Runs until one works; returns how many it took.
    fn next_run(&self, harm: Harm) -> usize {
        let mut said = Vec::new();
        for number in 1..=TRIES {
            let ran = run_of("examples/pick_and_place.canon", &self.arm);
            if ran.code == 0 {
                for said in said {
                    println!("    {harm:?}, next run: {said}");
                }
                return number;
            }
            said.push(ran.stderr);
        }
        panic!("after {harm:?}: {said:?}\n{}", self.controller.log());
    }
}

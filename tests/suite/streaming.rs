//! A long smooth move begins after its first window: its setpoints are those of the dry run, nothing
//! starves, and it can be stopped while it is planned.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::time::{Duration, Instant};

use crcl::{LengthUnit, Located, ReadOptions};
use engine::session::{Note, RunSample, Session, SessionConfig};
use ipc::Clock;
use planner::controller::Controller;
use planner::robot::{Robot, load};
use servo::Control;
use system_tests::driver_thread::{DriverThread, options_of};

/// Lists from this length on are planned in windows.
const LONG: usize = 4200;

/// A session with a simulated UR5e.
struct Chain {
    robot: Robot,
    session: Session,
    _driver: DriverThread,
}

impl Chain {
    fn start(name: &str, clock: Clock) -> Self {
        let robot = load("ur5e").unwrap();
        let arm = system_tests::domain::arm(&format!("stream/{name}"));
        let driver = DriverThread::start(options_of(&robot, &arm));
        let mut config = SessionConfig::new(arm);
        config.clock = clock;
        config.record = true;
        Self {
            session: Session::start(&robot, &config).unwrap(),
            robot,
            _driver: driver,
        }
    }

    /// Waits until a command is done or refused; gives the samples since the last call.
    fn wait(&self, last: u32) -> Vec<RunSample> {
        let mut samples = Vec::new();
        for _ in 0..4000 {
            let note = self.session.note(Duration::from_millis(50));
            samples.extend(self.session.samples());
            match note {
                Some(Note::Done { id, .. }) if id == last => {
                    samples.extend(self.session.samples());
                    return samples;
                }
                Some(note @ (Note::Faulted { .. } | Note::Refused { .. })) => panic!("{note}"),
                _ => {}
            }
        }
        panic!("{last} is not done");
    }
}

impl Drop for Chain {
    fn drop(&mut self) {
        self.session.close();
    }
}

fn commands(text: &str) -> Vec<Located> {
    let read = crcl::text::read(text, &ReadOptions::default());
    assert!(!read.has_errors(), "{:?}", read.findings);
    read.program.commands
}

/// One smooth move through `count` poses 1 mm apart, on waves that stay in a field of 0.2 m.
fn waves(count: usize) -> String {
    let mut list = String::new();
    for i in 0..count {
        let a = TAU * (i + 1) as f64 / 300.0;
        let x = 420.0 + 40.0 * (a.cos() - 1.0) + 30.0 * (0.37 * a).sin();
        let (y, z) = (60.0 * a.sin(), 300.0 + 20.0 * (0.21 * a).sin());
        let comma = if i == 0 { "" } else { ", " };
        write!(
            list,
            "{comma}{{{{{x:.6}, {y:.6}, {z:.6}}}, {{0, 0, -1}}, {{1, 0, 0}}}}"
        )
        .unwrap();
    }
    format!("MoveSmoothlyTo({{{list}}}, {count})")
}

const BEFORE: &str = "InitCanon()\nSetRelativeSpeed(100)\nSetRelativeAcceleration(100)\n\
                      SetIntermediatePointTolerance(0.1)\n\
                      MoveTo({{420, 0, 300}, {0, 0, -1}, {1, 0, 0}})";

/// Each setpoint of a move that was planned while it moved is that of the dry run, and the next
/// command begins where it ends.
#[test]
fn windows_are_the_dry_run() {
    let chain = Chain::start("dry_run", Clock::LockStep);
    let text = waves(LONG);
    let all = commands(&format!(
        "{BEFORE}\n{text}\nMoveStraightTo({{{{420, 0, 350}}, {{0, 0, -1}}, {{1, 0, 0}}}})"
    ));
    let mut dry = Controller::<6>::new(&chain.robot, 1000.0, LengthUnit::default()).unwrap();
    let mut steps = Vec::new();
    for located in &all {
        steps.push(dry.step(&located.command).unwrap());
    }
    let ids = chain.session.submit(all).unwrap();
    let samples = chain.wait(*ids.last().unwrap());
    let mut compared = 0;
    for (id, step) in ids.iter().zip(&steps) {
        let Some(planned) = &step.planned else {
            continue;
        };
        let own = samples.iter().filter(|sample| sample.command == *id);
        for sample in own {
            assert_eq!(sample.time_scaling.to_bits(), 1.0_f64.to_bits());
            let wanted = planned.trajectory.sample(sample.path_time);
            for (q, wanted) in sample.q.iter().zip(&wanted.position) {
                assert!((q - wanted).abs() < 1e-9, "{} s", sample.path_time);
            }
            compared += 1;
        }
    }
    let smooth = steps[steps.len() - 2].planned.as_ref().unwrap();
    let certificate = &smooth.certificate;
    assert_eq!(certificate.poses.len(), LONG - 1);
    assert!(certificate.in_order && certificate.peaks.largest() <= 1.0 + 1e-9);
    assert!(compared > 12_000, "{compared} setpoints");
    assert_eq!(chain.session.status().plans, 3);
}

/// An abort while windows are being planned brings the arm to rest and drops the others; the next
/// program begins there.
#[test]
fn a_move_under_way_is_aborted() {
    let chain = Chain::start("abort", Clock::LockStep);
    let mut all = commands(BEFORE);
    all.extend(commands(&waves(3 * LONG)));
    let ids = chain.session.submit(all).unwrap();
    let smooth = *ids.last().unwrap();
    let begun = |note: &Note| matches!(note, Note::Started { id, .. } if *id == smooth);
    while !chain
        .session
        .note(Duration::from_millis(100))
        .is_some_and(|note| begun(&note))
    {}
    chain.session.control(Control::Abort);
    let mut aborted = false;
    for _ in 0..200 {
        match chain.session.note(Duration::from_millis(50)) {
            Some(Note::Aborted { .. }) => aborted = true,
            Some(Note::Done { id, .. }) => assert_ne!(id, smooth),
            Some(note @ Note::Faulted { .. }) => panic!("{note}"),
            _ => {}
        }
        if aborted {
            break;
        }
    }
    assert!(aborted);
    drop(chain.session.samples());
    let ids = chain.session.submit(commands(BEFORE)).unwrap();
    let samples = chain.wait(*ids.last().unwrap());
    let rests = |sample: &RunSample| sample.dq.iter().all(|speed| speed.abs() < 1e-9);
    assert!(
        samples
            .iter()
            .all(|sample| sample.command != smooth || rests(sample))
    );
    let [x, _, z] = chain.session.status().position_m;
    assert!((x - 0.42).abs() < 1e-4 && (z - 0.3).abs() < 1e-4);
}

/// By the clock: the time from the command to the first setpoint that moves, starved periods, memory.
/// `cargo test --release --test suite first_setpoint -- --ignored --nocapture`
#[test]
#[ignore = "minutes by the clock"]
fn first_setpoint() {
    for count in [1_000, 10_000, 100_000] {
        let chain = Chain::start(&format!("first{count}"), Clock::Wall);
        let ids = chain.session.submit(commands(BEFORE)).unwrap();
        chain.wait(*ids.last().unwrap());
        std::thread::sleep(Duration::from_millis(300));
        let smooth = commands(&waves(count));
        let memory = resident();
        drop(chain.session.samples());
        std::thread::sleep(Duration::from_millis(20));
        let taken = chain.session.samples().last().unwrap().tick;
        let clock = Instant::now();
        let ids = chain.session.submit(smooth).unwrap();
        let (mut first, mut slowed, mut most) = (None, 0, memory);
        let (mut last, mut done) = (0.0_f64, false);
        while !done {
            let note = chain.session.note(Duration::from_millis(20));
            done = matches!(note, Some(Note::Done { id, .. }) if id == ids[0]);
            if let Some(note @ (Note::Faulted { .. } | Note::Refused { .. })) = note {
                panic!("{note}");
            }
            for sample in chain.session.samples() {
                if sample.command != ids[0] {
                    continue;
                }
                first.get_or_insert(sample.tick - taken);
                slowed += usize::from(sample.time_scaling < 1.0);
                last = last.max(sample.path_time);
            }
            most = most.max(resident());
            if clock.elapsed() > Duration::from_secs(60) && first.is_some() {
                chain.session.control(Control::Abort);
                break;
            }
        }
        println!(
            "{count} poses: first setpoint after {} ms, {slowed} slowed periods in {last:.1} s of \
             motion, at most {:.1} MB more memory, {:.1} MB at the end",
            first.unwrap(),
            (most - memory) as f64 * 1e-6,
            resident() as f64 * 1e-6 - memory as f64 * 1e-6
        );
    }
}

/// Resident memory of this process, bytes.
fn resident() -> usize {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: usize = statm.split(' ').nth(1).unwrap().parse().unwrap();
    pages * 4096
}

//! The driver's side of the protocol on a virtual clock.
#![allow(clippy::unwrap_used, reason = "tests")]

use driver_sim::{Driver, Options, ToolOptions};
use ipc::{Clock, DriverState, FaultCode, Hello, Setpoint, State, ToolAction, ToolStatus, Verdict};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const PERIOD: u64 = 1_000_000;
const WATCHDOG: u64 = 50_000_000;

/// An engine of two joints and the driver, with one common clock.
struct Pair {
    driver: Driver,
    session: u64,
    sequence: u64,
    now: u64,
    start: [f64; 2],
}

impl Pair {
    fn new(options: Options) -> Self {
        let mut driver = driver_sim::driver(options).unwrap();
        let now = 5_000_000_000;
        let ack = driver.greet(&Hello::new(2, PERIOD, WATCHDOG, Clock::Wall), now);
        assert_eq!(ack.check(2), Ok(()));
        let start = [ack.position[0], ack.position[1]];
        Self {
            driver,
            session: ack.session,
            sequence: 0,
            now,
            start,
        }
    }

    fn setpoint(&mut self, motion: [f64; 3]) -> Setpoint {
        self.sequence += 1;
        let mut setpoint = Setpoint {
            joints: 2,
            session: self.session,
            sequence: self.sequence,
            published_ns: self.now + PERIOD,
            period_ns: PERIOD,
            watchdog_ns: WATCHDOG,
            ..Setpoint::default()
        };
        for joint in 0..2 {
            setpoint.position[joint] = self.start[joint] + motion[0];
            setpoint.velocity[joint] = motion[1];
            setpoint.acceleration[joint] = motion[2];
        }
        setpoint
    }

    fn period(&mut self, setpoint: Option<Setpoint>) -> State {
        self.now += PERIOD;
        if let Some(setpoint) = setpoint {
            self.driver.receive(&setpoint, self.now);
        }
        let state = *self.driver.step(self.now, PERIOD);
        assert_eq!(state.check(2), Ok(()));
        state
    }

    fn follow(&mut self, motion: [f64; 3]) -> State {
        let setpoint = self.setpoint(motion);
        self.period(Some(setpoint))
    }
}

fn options() -> Options {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("domain");
    let arm = ipc::Domain::open(&folder)
        .unwrap()
        .arm("test/virtual")
        .unwrap();
    let mut options = Options::new(arm, 2);
    options.position = vec![0.3, -1.0];
    options
}

/// A smooth motion from rest: position, velocity, acceleration after `t` seconds.
fn swing(t: f64) -> [f64; 3] {
    let (a, w) = (0.5, 3.0_f64);
    [
        a * (w * t - (w * t).sin()) / w,
        a * (1.0 - (w * t).cos()),
        a * w * (w * t).sin(),
    ]
}

#[test]
fn follows_closely() {
    let mut pair = Pair::new(options());
    let mut worst = 0.0_f64;
    for tick in 0..4000 {
        let motion = swing(f64::from(tick) * 0.001);
        let state = pair.follow(motion);
        worst = worst.max((state.position[1] - pair.start[1] - motion[0]).abs());
    }
    assert!(worst < 1e-5, "tracking error {worst} rad");
    assert_eq!(pair.driver.state(), DriverState::Active);
}

#[test]
fn the_first_setpoint_must_be_where_the_arm_is() {
    let mut pair = Pair::new(options());
    pair.follow([0.01, 0.0, 0.0]);
    assert_eq!(pair.driver.fault(), FaultCode::OutOfRange);
}

#[test]
fn silence_goes_on_then_stops_then_latches() {
    let mut pair = Pair::new(options());
    for tick in 0..500 {
        pair.follow(swing(f64::from(tick) * 0.001));
    }
    let moving = swing(0.499)[1];
    let mut previous = pair.driver.step(pair.now, 1).velocity[0];
    let mut previous_slope = None;
    let mut stopped = 0;
    for silence in 1..=1000_u64 {
        let state = pair.period(None);
        if silence <= WATCHDOG / PERIOD {
            assert_eq!(
                state.driver(),
                DriverState::Active,
                "after {silence} periods"
            );
            assert!(state.velocity[0] > 0.8 * moving);
        } else {
            assert!(matches!(
                state.driver(),
                DriverState::Stopping | DriverState::Fault
            ));
            let slope = (state.velocity[0] - previous) / 0.001;
            assert!(slope.abs() < 20.5, "acceleration {slope}");
            if let Some(before) = previous_slope.replace(slope) {
                let jerk: f64 = (slope - before) / 0.001;
                // The servo's answer to a step of the jerk overshoots.
                assert!(jerk.abs() < 2.0 * 500.0, "jerk {jerk}");
            }
            if state.velocity[0].abs() < 1e-6 {
                stopped = silence;
                break;
            }
        }
        previous = state.velocity[0];
    }
    assert!(stopped > 0, "it never stopped");
    for _ in 0..5 {
        pair.period(None);
    }
    let latched = pair.follow(swing(0.5));
    assert_eq!(
        (latched.driver(), latched.fault_code()),
        (DriverState::Fault, FaultCode::Watchdog)
    );
    let after = pair.follow(swing(0.501));
    assert!(
        (after.position[0] - latched.position[0]).abs() < 1e-9,
        "a latched driver moved"
    );

    let ack = pair
        .driver
        .greet(&Hello::new(2, PERIOD, WATCHDOG, Clock::Wall), pair.now);
    assert_eq!(ack.verdict, Verdict::Welcome as u32);
    assert_ne!(ack.session, pair.session);
    assert!((ack.position[0] - after.position[0]).abs() < 1e-9);
}

#[test]
fn a_jump_or_nonsense_stops() {
    for (change, fault) in [
        (0_u8, FaultCode::OutOfRange),
        (1, FaultCode::BadSetpoint),
        (2, FaultCode::BadSetpoint),
        (3, FaultCode::OutOfRange),
    ] {
        let mut pair = Pair::new(options());
        for tick in 0..300 {
            pair.follow(swing(f64::from(tick) * 0.001));
        }
        let mut bad = pair.setpoint(swing(0.3));
        match change {
            0 => bad.position[1] += 0.2,
            1 => bad.velocity[0] = f64::NAN,
            2 => bad.tools[1].action = 17,
            _ => bad.velocity[0] = 11.0,
        }
        pair.period(Some(bad));
        assert_eq!(pair.driver.fault(), fault);
        assert_eq!(pair.driver.state(), DriverState::Stopping);
    }
}

/// A stall of the machine: the engine leaves out periods, the driver reads all waiting setpoints at
/// once. That is not a jump, unless it is further than the time of the watchdog allows.
#[test]
fn setpoints_that_come_together_are_no_jump() {
    let mut pair = Pair::new(options());
    let mut send = |tick: u32, step: bool| {
        let mut setpoint = pair.setpoint(swing(f64::from(tick) * 0.001));
        setpoint.tick = u64::from(tick);
        pair.driver.receive(&setpoint, pair.now);
        if step {
            pair.now += PERIOD;
            pair.driver.step(pair.now, PERIOD);
        }
        pair.driver.state()
    };
    for tick in 0..500 {
        send(tick, true);
    }
    for tick in [501, 502, 540, 541] {
        assert_eq!(send(tick, false), DriverState::Active, "tick {tick}");
    }
    assert_eq!(send(5_000, false), DriverState::Stopping);
}

#[test]
fn refuses_by_name() {
    let mut pair = Pair::new(options());
    let good = Hello::new(2, PERIOD, WATCHDOG, Clock::Wall);
    let mut verdict =
        |hello: Hello| Verdict::from_number(pair.driver.greet(&hello, pair.now).verdict).unwrap();
    assert_eq!(
        verdict(Hello {
            protocol: 9,
            ..good
        }),
        Verdict::WrongProtocol
    );
    assert_eq!(verdict(Hello { schema: 9, ..good }), Verdict::WrongSchema);
    assert_eq!(verdict(Hello { joints: 9, ..good }), Verdict::WrongJoints);
    assert_eq!(
        verdict(Hello {
            period_ns: 9,
            ..good
        }),
        Verdict::WrongPeriod
    );
    assert_eq!(verdict(Hello { clock: 9, ..good }), Verdict::WrongClock);
    pair.follow([0.0; 3]);
    let other = Hello {
        process: good.process + 1,
        ..good
    };
    let ack = pair.driver.greet(&other, pair.now);
    assert_eq!(ack.verdict, Verdict::Busy as u32);
    assert!(ipc::text_of(&ack.reason).contains("canter engine"));
}

#[test]
fn the_gripper_takes_its_time() {
    let gripper = ToolOptions {
        opening: 0.1,
        closing: 0.3,
        ..ToolOptions::default()
    };
    let mut pair = Pair::new(Options {
        gripper: Some(gripper),
        ..options()
    });
    let order = |pair: &mut Pair, number: u32, action: ToolAction| {
        let mut setpoint = pair.setpoint([0.0; 3]);
        setpoint.tools[0].order = number;
        setpoint.tools[0].action = action as u32;
        let state = pair.period(Some(setpoint));
        (
            state.tools[0].order,
            ToolStatus::from_number(state.tools[0].status).unwrap(),
        )
    };
    assert_eq!(order(&mut pair, 0, ToolAction::None), (0, ToolStatus::Open));
    let mut periods = 0;
    while order(&mut pair, 1, ToolAction::Close) != (1, ToolStatus::Closed) {
        periods += 1;
    }
    assert!((300..=302).contains(&periods), "{periods}");
    periods = 0;
    while order(&mut pair, 2, ToolAction::Open) != (2, ToolStatus::Open) {
        periods += 1;
    }
    assert!((100..=102).contains(&periods), "{periods}");
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..ProptestConfig::default() })]

    /// Random bytes as setpoints: no panic, and the arm stays within its limits.
    #[test]
    fn survives_random_setpoints(
        words in prop::collection::vec(any::<u64>(), 40),
        sane_head in any::<bool>(),
    ) {
        let mut pair = Pair::new(options());
        for tick in 0..50 {
            pair.follow(swing(f64::from(tick) * 0.001));
        }
        for chunk in words.chunks(4) {
            let mut bad = pair.setpoint(swing(0.05));
            if !sane_head {
                bad.sequence = chunk[0];
                bad.session = chunk[1];
                bad.period_ns = chunk[2];
            }
            bad.position[(chunk[0] % 2) as usize] = f64::from_bits(chunk[1]);
            bad.velocity[1] = f64::from_bits(chunk[2]);
            bad.flags = chunk[3] as u32;
            let state = pair.period(Some(bad));
            prop_assert!(state.velocity[0].abs() < 2.0 && state.velocity[1].abs() < 2.0);
        }
    }
}

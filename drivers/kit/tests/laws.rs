//! The reference of a robot, in virtual time: whatever is received and whichever process stalls,
//! each joint keeps its limits of range, speed, acceleration and jerk in every period.
#![allow(clippy::unwrap_used, reason = "tests")]

use driver_kit::{About, Command, Driver, Measured, Measurement, Reference, Robot};
use ipc::{Clock, DriverState, FaultCode, Hello, Setpoint, State, Verdict};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const PERIOD: u64 = 1_000_000;
const WATCHDOG: u64 = 50_000_000;
const UPPER: f64 = 1.0;
const SPEED: f64 = 3.0;
const ACCELERATION: f64 = 15.0;
const JERK: f64 = 300.0;

/// A joint that reaches each reference at once, and checks it.
#[derive(Clone, Debug)]
struct Strict(Reference);

impl Robot for Strict {
    fn about(&self) -> About {
        About {
            name: "strict".to_owned(),
            lower: vec![-UPPER],
            upper: vec![UPPER],
            velocity: vec![SPEED],
            acceleration: vec![ACCELERATION],
            jerk: vec![JERK],
            ..About::default()
        }
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        joints[0] = self.0.into();
        Measurement::Now
    }

    fn follow(&mut self, command: &Command<'_>) {
        let (before, now, period) = (self.0, command.joints[0], command.period);
        let change = (now.acceleration - before.acceleration).abs();
        let trapezium = (now.velocity + before.velocity) / 2.0 * period;
        let off = (now.position - before.position - trapezium).abs();
        assert!(now.position.abs() <= UPPER + 1e-6, "{now:?}");
        assert!(now.velocity.abs() <= SPEED * (1.0 + 1e-6), "{now:?}");
        assert!(
            now.acceleration.abs() <= ACCELERATION * (1.0 + 1e-6),
            "{now:?}"
        );
        assert!(change <= JERK * period * (1.0 + 1e-6), "{before:?} {now:?}");
        assert!(
            off <= JERK * period.powi(3) / 12.0 + 1e-8,
            "{before:?} {now:?}"
        );
        self.0 = now;
    }
}

/// Moves from rest to rest as quickly as a quintic keeps the limits, one after the other.
struct Plan(Vec<f64>);

impl Plan {
    fn at(&self, mut time: f64) -> [f64; 3] {
        let mut from = 0.0;
        for to in &self.0 {
            let d: f64 = to - from;
            let speed = 1.875 * d.abs() / SPEED;
            let force = (5.7736 * d.abs() / ACCELERATION).sqrt();
            let duration = speed
                .max(force)
                .max((60.0 * d.abs() / JERK).cbrt())
                .max(1e-3);
            if time < duration {
                let u = time / duration;
                let rest = 1.0 - u;
                return [
                    from + d * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u),
                    d * 30.0 * u * u * rest * rest / duration,
                    d * 60.0 * u * rest * (1.0 - 2.0 * u) / (duration * duration),
                ];
            }
            time -= duration;
            from = *to;
        }
        [from, 0.0, 0.0]
    }
}

/// An engine with a plan, and the driver.
struct Pair {
    driver: Driver<Strict>,
    plan: Plan,
    session: u64,
    sequence: u64,
    /// Now (ns), and how far the plan is (ns).
    now: u64,
    planned: u64,
    waiting: Vec<Setpoint>,
}

impl Pair {
    fn new(goals: &[f64]) -> Self {
        let mut driver = Driver::new(Strict(Reference::rest(0.0))).unwrap();
        let now = 7_000_000_000;
        let ack = driver.greet(&Hello::new(1, PERIOD, WATCHDOG, Clock::Wall), now);
        assert_eq!(ack.verdict, Verdict::Welcome as u32);
        Self {
            driver,
            plan: Plan(goals.to_vec()),
            session: ack.session,
            sequence: 0,
            now,
            planned: 0,
            waiting: Vec::new(),
        }
    }

    fn setpoint(&mut self) -> Setpoint {
        self.sequence += 1;
        let mut setpoint = Setpoint {
            joints: 1,
            session: self.session,
            sequence: self.sequence,
            tick: (self.now - 7_000_000_000) / PERIOD,
            published_ns: self.now,
            tick_ns: self.now,
            period_ns: PERIOD,
            watchdog_ns: WATCHDOG,
            valid: 1,
            ..Setpoint::default()
        };
        let motion = self.plan.at(self.planned as f64 * 1e-9);
        setpoint.position[0] = motion[0];
        setpoint.velocity[0] = motion[1];
        setpoint.acceleration[0] = motion[2];
        setpoint
    }

    /// A period of the engine: its plan continues.
    fn engine(&mut self) {
        self.now += PERIOD;
        self.planned += PERIOD;
        let setpoint = self.setpoint();
        self.waiting.push(setpoint);
        // The channel holds sixteen.
        let more = self.waiting.len().saturating_sub(16);
        self.waiting.drain(..more);
    }

    /// A period of the driver, which reads what waits.
    fn driver(&mut self) -> State {
        for setpoint in std::mem::take(&mut self.waiting) {
            self.driver.receive(&setpoint, self.now + 400_000);
        }
        let state = *self.driver.step(self.now + 400_000, PERIOD);
        assert_eq!(state.check(1), Ok(()));
        state
    }

    fn both(&mut self, periods: u64) -> State {
        (0..periods).fold(State::default(), |_, _| {
            self.engine();
            self.driver()
        })
    }

    /// The engine stalls for some periods; afterwards its plan continues, or jumps to where it
    /// would be.
    fn engine_stands(&mut self, periods: u64, leaps: bool) {
        for _ in 0..periods {
            self.now += PERIOD;
            self.planned += if leaps { PERIOD } else { 0 };
            self.driver();
        }
    }

    /// The driver stalls for some periods, while the engine continues.
    fn driver_stands(&mut self, periods: u64) {
        (0..periods).for_each(|_| self.engine());
    }

    fn reference(&self) -> Reference {
        self.driver.robot().0
    }

    /// After a fault: it stays latched, and the arm comes to rest and stays there.
    fn assert_latched(&mut self, faults: &[FaultCode]) {
        let state = self.both(2000);
        assert_eq!(state.driver(), DriverState::Fault);
        assert!(
            faults.contains(&state.fault_code()),
            "{:?}",
            state.fault_code()
        );
        let rest = self.reference();
        assert_eq!((rest.velocity, rest.acceleration), (0.0, 0.0));
        self.both(100);
        assert_eq!(self.reference(), rest);
    }
}

#[test]
fn undisturbed_setpoints_are_followed_bit_for_bit() {
    let mut pair = Pair::new(&[1.0, -1.0, 0.9, 0.9001, -0.3, 1.0]);
    for _ in 0..8000 {
        pair.engine();
        let sent = pair.waiting[0];
        pair.driver();
        let wanted = [sent.position[0], sent.velocity[0], sent.acceleration[0]];
        let found = pair.reference();
        assert_eq!([found.position, found.velocity, found.acceleration], wanted);
    }
}

/// After a setpoint that comes one period late, the joint is back on the plan within a few periods.
#[test]
fn a_late_setpoint_is_caught_up() {
    let mut pair = Pair::new(&[0.9, -0.9]);
    pair.both(300);
    pair.engine_stands(1, true);
    pair.both(100);
    let wanted = pair.plan.at(pair.planned as f64 * 1e-9);
    assert!((pair.reference().position - wanted[0]).abs() < 1e-6);
    pair.both(3000);
    assert_eq!(pair.reference(), Reference::rest(-0.9));
}

/// The driver stalls for a second in motion: it stops and latches, although new setpoints wait.
#[test]
fn a_stall_of_the_driver_latches() {
    let mut pair = Pair::new(&[1.0, -1.0, 1.0]);
    pair.both(400);
    pair.driver_stands(1000);
    assert_eq!(pair.driver().driver(), DriverState::Stopping);
    pair.assert_latched(&[FaultCode::Stalled]);
}

/// After a stall in motion the driver asks for less speed until it is back on the plan; without one it
/// never does.
#[test]
fn a_driver_that_is_behind_asks_for_less_speed() {
    let mut pair = Pair::new(&[1.0, -1.0, 1.0]);
    for _ in 0..500 {
        assert_eq!(pair.both(1).speed_scaling, 1.0);
    }
    pair.driver_stands(40);
    let least = (0..200).map(|_| pair.both(1).speed_scaling);
    let least = least.fold(1.0, f64::min);
    assert!((0.2..0.9).contains(&least), "{least}");
    assert_eq!(pair.both(1000).speed_scaling, 1.0);
    // Ahead of the plan, after a stall of the engine, it waits for the plan.
    let mut pair = Pair::new(&[1.0, -1.0, 1.0]);
    pair.both(500);
    pair.engine_stands(30, false);
    for _ in 0..400 {
        assert_eq!(pair.both(1).speed_scaling, 1.0);
    }
}

/// The engine is killed at any moment of a move to the end of the range: the driver rests within
/// the range, no later than the watchdog and a stop need.
#[test]
fn a_kill_while_braking_at_the_end_of_the_range() {
    for moment in (10..900).step_by(3) {
        let mut pair = Pair::new(&[1.0, -1.0]);
        pair.both(moment);
        let mut periods = 0;
        while pair.driver.state() != DriverState::Fault {
            pair.engine_stands(1, true);
            periods += 1;
            assert!(periods < 50 + 260 + 10, "{moment}");
        }
        pair.assert_latched(&[FaultCode::Watchdog]);
    }
}

/// One setpoint with an acceleration beyond the limit, then silence: refused, with the joint.
#[test]
fn an_acceleration_beyond_the_limit_is_refused() {
    for (value, refused) in [(1e6, true), (-15.1, true), (15.0, false)] {
        let mut pair = Pair::new(&[0.8]);
        pair.both(200);
        let mut bad = pair.setpoint();
        bad.acceleration[0] = value;
        pair.driver.receive(&bad, pair.now);
        let state = *pair.driver.step(pair.now, PERIOD);
        let fault = pair.driver.fault();
        assert_eq!(
            fault == FaultCode::OutOfRange,
            refused,
            "{value}: {fault:?}"
        );
        assert_eq!(state.fault_joint == 0, refused);
        pair.engine_stands(1000, true);
        assert_eq!(pair.driver.state(), DriverState::Fault);
    }
}

/// Setpoints with an old time stamp count as silence; those from the future are invalid.
#[test]
fn the_age_of_a_setpoint_is_its_own() {
    let mut pair = Pair::new(&[0.8]);
    pair.both(200);
    for _ in 0..60 {
        pair.engine();
        pair.waiting[0].published_ns -= 200_000_000;
        pair.driver();
    }
    pair.assert_latched(&[FaultCode::Watchdog]);
    let mut pair = Pair::new(&[0.8]);
    pair.both(200);
    pair.engine();
    pair.waiting[0].published_ns += 60_000_000;
    pair.driver();
    pair.assert_latched(&[FaultCode::BadSetpoint]);
}

/// A session is asked for while the arm still brakes: the engine waits until it rests.
#[test]
fn a_session_waits_until_the_arm_rests() {
    let mut pair = Pair::new(&[1.0, -1.0]);
    pair.both(300);
    pair.engine_stands(WATCHDOG / PERIOD + 2, false);
    let hello = Hello::new(1, PERIOD, WATCHDOG, Clock::Wall);
    let ack = pair.driver.greet(&hello, pair.now);
    assert_eq!(ack.verdict, Verdict::Wait as u32);
    pair.engine_stands(1000, false);
    let ack = pair.driver.greet(&hello, pair.now);
    assert_eq!(ack.verdict, Verdict::Welcome as u32);
}

/// A driver that is told to end brakes, reports why, and opens no new session.
#[test]
fn a_driver_that_leaves_brakes_first() {
    let mut pair = Pair::new(&[1.0, -1.0]);
    pair.both(300);
    assert!(pair.driver.leave());
    pair.assert_latched(&[FaultCode::Ended]);
    assert!(!pair.driver.leave());
    let ack = pair
        .driver
        .greet(&Hello::new(1, PERIOD, WATCHDOG, Clock::Wall), pair.now);
    assert_eq!(ack.verdict, Verdict::NotReady as u32);
}

/// What happens to the pair.
#[derive(Clone, Copy, Debug)]
enum Event {
    Engine(u64, bool),
    Driver(u64),
    Nonsense([f64; 3]),
}

fn event() -> impl Strategy<Value = Event> {
    let stall = prop_oneof![3 => 1_u64..50, 1 => 51_u64..1000];
    let value = |most: f64| prop_oneof![4 => -most..most, 1 => any::<f64>()];
    prop_oneof![
        3 => (stall.clone(), any::<bool>()).prop_map(|(periods, leaps)| Event::Engine(periods, leaps)),
        3 => stall.prop_map(Event::Driver),
        2 => (value(UPPER), value(SPEED), value(ACCELERATION))
            .prop_map(|(p, v, a)| Event::Nonsense([p, v, a])),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(11), cases: 1500, failure_persistence: None, ..ProptestConfig::default()
    })]

    /// Random moves, also to the ends of the range, with random stalls and invalid setpoints:
    /// [`Strict`] checks each period, and a silence beyond the watchdog always latches the right
    /// fault.
    #[test]
    fn limits_hold_whatever_comes(
        goals in prop::collection::vec(prop_oneof![Just(1.0), Just(-1.0), -1.0..1.0_f64], 1..8),
        events in prop::collection::vec((1_u64..600, event()), 1..6),
    ) {
        let mut pair = Pair::new(&goals);
        pair.both(5);
        for (periods, event) in events {
            pair.both(periods);
            let following = pair.driver.state() == DriverState::Active;
            match event {
                Event::Engine(periods, leaps) => pair.engine_stands(periods, leaps),
                Event::Driver(periods) => {
                    pair.driver_stands(periods);
                    pair.driver();
                }
                Event::Nonsense([position, velocity, acceleration]) => {
                    // Near enough not to be refused as a jump, most of the time.
                    let mut bad = pair.setpoint();
                    bad.position[0] += position * 4e-3;
                    bad.velocity[0] = velocity;
                    bad.acceleration[0] = acceleration;
                    pair.waiting.push(bad);
                    pair.driver();
                }
            }
            let fault = pair.driver.fault();
            match event {
                Event::Engine(silence, _) | Event::Driver(silence) if silence > 50 && following => {
                    let named = [FaultCode::Watchdog, FaultCode::Stalled];
                    prop_assert!(named.contains(&fault), "{event:?}: {fault:?}");
                    pair.assert_latched(&named);
                }
                _ => {}
            }
        }
        pair.both(300);
        pair.engine_stands(1500, true);
        prop_assert_eq!(pair.driver.state(), DriverState::Fault);
    }
}

/// A stall of the engine, without a jump or with one: the joint is on its plan again afterwards.
#[test]
fn the_plan_is_joined_again() {
    for (stall, leaps) in [(5, true), (5, false), (40, true), (40, false)] {
        for moment in [100, 250, 400, 600] {
            let mut pair = Pair::new(&[0.9, -0.9, 0.5]);
            pair.both(moment);
            pair.engine_stands(stall, leaps);
            pair.both(4000);
            assert_eq!(pair.driver.state(), DriverState::Active);
            assert_eq!(
                pair.reference(),
                Reference::rest(0.5),
                "{stall} {leaps} {moment}"
            );
        }
    }
}

//! A session's life with an arm that is not a simulation: it gets ready slowly, refuses clocks and
//! periods, commands something else than it measures, and has faults of its own.
#![allow(clippy::unwrap_used, reason = "tests")]

use driver_kit::{
    About, Command, Driver, Inputs, Measured, Measurement, Outputs, Readiness, Reference, Robot,
    RobotFault, Sensors,
};
use ipc::{
    Clock, DriverFeatures, DriverState, FaultCode, Hello, HelloAck, Payload, Setpoint,
    SetpointFlags, StateFlags, Verdict, text_of,
};

const PERIOD: u64 = 1_000_000;
const WATCHDOG: u64 = 50_000_000;

/// An arm of one joint whose answers a test chooses.
#[derive(Clone, Debug)]
struct Arm {
    waits: u32,
    refuses: bool,
    running: bool,
    measured: f64,
    commanded: f64,
    measurement: Measurement,
    fault: Option<RobotFault>,
    /// Times, references and efforts that it was told to follow.
    told: Vec<(u64, Reference, f64)>,
    carried: Option<Payload>,
    outputs: Option<Outputs>,
    speed: f64,
    own_clock: bool,
}

impl Default for Arm {
    fn default() -> Self {
        Self {
            waits: 0,
            refuses: false,
            running: false,
            measured: 0.2,
            commanded: 0.2004,
            measurement: Measurement::Now,
            fault: None,
            told: Vec::new(),
            carried: None,
            outputs: None,
            speed: 1.0,
            own_clock: true,
        }
    }
}

impl Robot for Arm {
    fn about(&self) -> About {
        About {
            name: "arm".to_owned(),
            lower: vec![-1.0],
            upper: vec![1.0],
            velocity: vec![3.0],
            acceleration: vec![15.0],
            jerk: vec![300.0],
            lock_step: false,
            periods_ns: [500_000, 4_000_000],
            own_clock: self.own_clock,
            real: true,
            delay_ns: 4_000_000,
            ..About::default()
        }
    }

    fn begin(&mut self) -> Readiness {
        if self.refuses {
            return Readiness::NotReady("protective stop: release it on the pendant".to_owned());
        }
        if self.waits > 0 {
            self.waits -= 1;
            return Readiness::Wait("releasing the brakes".to_owned());
        }
        self.running = true;
        // The arm sinks a little when its brakes open.
        self.commanded = 0.2004;
        self.fault = None;
        Readiness::Ready
    }

    fn end(&mut self) {
        self.running = false;
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        joints[0].position = self.measured;
        self.measurement
    }

    fn commanded(&self, joints: &mut [f64]) -> bool {
        joints[0] = self.commanded;
        true
    }

    fn follow(&mut self, command: &Command<'_>) {
        let reference = command.joints[0];
        self.told
            .push((command.at_ns, reference, command.effort[0]));
        if self.fault.is_none() {
            self.commanded = reference.position;
            self.measured = reference.position - 0.0004;
        }
    }

    fn speed_scaling(&self) -> f64 {
        self.speed
    }

    fn carry(&mut self, payload: &Payload) {
        self.carried = Some(*payload);
    }

    fn set_outputs(&mut self, outputs: &Outputs) {
        self.outputs = Some(*outputs);
    }

    fn inputs(&self) -> Inputs {
        Inputs {
            digital: 5,
            analogue: [0.5; 8],
        }
    }

    fn sensors(&self, sensors: &mut Sensors) {
        sensors.push("force_z", 3.5);
        sensors.push("distance", f64::NAN);
    }

    fn fault(&self) -> Option<RobotFault> {
        self.fault
    }
}

/// An engine and a driver on a virtual clock.
struct Pair {
    driver: Driver<Arm>,
    ack: HelloAck,
    now: u64,
    sequence: u64,
    tick: u64,
}

impl Pair {
    fn new(arm: Arm) -> Self {
        let mut pair = Self {
            driver: Driver::new(arm).unwrap(),
            ack: HelloAck::refusal(1, Verdict::Busy, ""),
            now: 7_000_000_000,
            sequence: 0,
            tick: 0,
        };
        pair.greet();
        pair
    }

    fn greet(&mut self) -> Verdict {
        let hello = Hello::new(1, PERIOD, WATCHDOG, Clock::Wall);
        self.ack = self.driver.greet(&hello, self.now);
        (self.sequence, self.tick) = (0, 0);
        Verdict::from_number(self.ack.verdict).unwrap()
    }

    fn setpoint(&mut self, motion: [f64; 3]) -> Setpoint {
        self.sequence += 1;
        let mut setpoint = Setpoint {
            joints: 1,
            session: self.ack.session,
            sequence: self.sequence,
            tick: self.now / PERIOD,
            published_ns: self.now,
            tick_ns: self.now,
            period_ns: PERIOD,
            watchdog_ns: WATCHDOG,
            valid: 1,
            ..Setpoint::default()
        };
        setpoint.position[0] = self.ack.commanded[0] + motion[0];
        setpoint.velocity[0] = motion[1];
        setpoint.acceleration[0] = motion[2];
        setpoint
    }

    fn step(&mut self) -> ipc::State {
        let state = *self.driver.step(self.now + 400_000, PERIOD);
        assert_eq!(state.check(1), Ok(()));
        state
    }

    fn period(&mut self) -> ipc::State {
        self.now += PERIOD;
        let setpoint = self.setpoint([0.0; 3]);
        self.driver.receive(&setpoint, self.now + 10_000);
        self.step()
    }

    fn hold(&mut self, periods: u32) -> ipc::State {
        for _ in 1..periods {
            self.period();
        }
        self.period()
    }
}

#[test]
fn a_session_begins_when_the_arm_is_ready() {
    let mut pair = Pair::new(Arm {
        waits: 3,
        ..Arm::default()
    });
    assert_eq!(pair.ack.verdict, Verdict::Wait as u32);
    assert_eq!(text_of(&pair.ack.reason), "releasing the brakes");
    assert_eq!(pair.ack.session, 0);
    assert_eq!(pair.driver.state(), DriverState::Disconnected);
    assert_eq!([pair.greet(), pair.greet()], [Verdict::Wait; 2]);
    assert_eq!(pair.greet(), Verdict::Welcome);
    assert!(pair.driver.robot().running);
    // It begins where the arm is commanded, not where it is measured.
    assert_eq!((pair.ack.position[0], pair.ack.commanded[0]), (0.2, 0.2004));
    let state = pair.hold(5);
    assert_eq!(state.driver(), DriverState::Active);
    assert_eq!(state.flags & StateFlags::COMMANDED, StateFlags::COMMANDED);
    assert!((state.commanded[0] - state.position[0] - 0.0004).abs() < 1e-12);
    let moved = pair.driver.robot().told.iter();
    assert!(
        moved
            .clone()
            .all(|(_, told, _)| (told.position - 0.2004).abs() < 1e-12 || told.position == 0.2)
    );
    // The end of the session ends the arm too.
    let mut goodbye = pair.setpoint([0.0; 3]);
    goodbye.flags = SetpointFlags::GOODBYE | SetpointFlags::HOLD;
    pair.driver.receive(&goodbye, pair.now);
    assert!(!pair.driver.robot().running);
}

#[test]
fn an_arm_that_gets_ready_for_nobody_is_ended() {
    let mut pair = Pair::new(Arm {
        waits: 1,
        running: true,
        ..Arm::default()
    });
    assert_eq!(pair.ack.verdict, Verdict::Wait as u32);
    for _ in 0..1900 {
        pair.now += PERIOD;
        pair.step();
    }
    assert!(pair.driver.robot().running);
    for _ in 0..200 {
        pair.now += PERIOD;
        pair.step();
    }
    assert!(!pair.driver.robot().running);
}

#[test]
fn what_cannot_be_served_is_refused() {
    let mut pair = Pair::new(Arm {
        refuses: true,
        ..Arm::default()
    });
    assert_eq!(pair.ack.verdict, Verdict::NotReady as u32);
    assert!(text_of(&pair.ack.reason).contains("release it on the pendant"));
    let mut ask = |change: fn(&mut Hello)| {
        let mut hello = Hello::new(1, PERIOD, WATCHDOG, Clock::Wall);
        change(&mut hello);
        let ack = pair.driver.greet(&hello, 1);
        assert_eq!(ack.periods_ns, [500_000, 4_000_000]);
        assert_eq!(ack.features & DriverFeatures::LOCK_STEP, 0);
        (
            Verdict::from_number(ack.verdict).unwrap(),
            text_of(&ack.reason),
        )
    };
    let (verdict, reason) = ask(|hello| hello.clock = Clock::LockStep as u32);
    assert_eq!(verdict, Verdict::WrongClock);
    assert!(reason.contains("cannot be driven in lock-step"), "{reason}");
    let (verdict, reason) = ask(|hello| hello.period_ns = 8_000_000);
    assert_eq!(verdict, Verdict::WrongPeriod);
    assert_eq!(reason, "a period of 8 ms; this arm needs 0.5 to 4 ms");
    let (verdict, reason) = ask(|hello| hello.protocol = 1);
    assert_eq!(verdict, Verdict::WrongProtocol);
    assert!(reason.contains("protocol 1, expected 2"), "{reason}");
}

/// Another engine is refused while the one that drives runs; when that was killed, it waits until the arm rests.
#[test]
fn an_engine_after_one_that_was_killed_waits() {
    let mut ended = std::process::Command::new("true").spawn().unwrap();
    let gone = ended.id();
    assert!(ended.wait().unwrap().success());
    for (owner, expected) in [(1, Verdict::Busy), (gone, Verdict::Wait)] {
        let mut pair = Pair::new(Arm::default());
        let mut hello = Hello::new(1, PERIOD, WATCHDOG, Clock::Wall);
        hello.process = owner;
        pair.ack = pair.driver.greet(&hello, pair.now);
        assert_eq!(pair.ack.verdict, Verdict::Welcome as u32);
        pair.sequence = 0;
        let state = pair.hold(20);
        assert_eq!(state.driver_state, DriverState::Active as u32);
        assert_eq!(pair.greet(), expected);
        let reason = text_of(&pair.ack.reason);
        assert!(reason.contains(&format!("process {owner}")), "{reason}");
    }
}

#[test]
fn a_fault_of_the_hardware_is_told_in_its_words() {
    let mut pair = Pair::new(Arm {
        own_clock: false,
        ..Arm::default()
    });
    pair.hold(20);
    let words = "joint_motion_generator_velocity_discontinuity";
    let mut arm = pair.driver.robot().clone();
    arm.fault = Some(RobotFault::new(Some(0), 17, words));
    (arm.measured, arm.commanded) = (0.25, 0.2501);
    pair.driver.change_robot(|robot| *robot = arm);
    let state = pair.period();
    assert_eq!(state.fault_code(), FaultCode::Hardware);
    assert_eq!((state.fault_joint, state.fault_code), (0, 17));
    assert_eq!(text_of(&state.text), words);
    // The references follow the arm, which has stopped elsewhere.
    let state = pair.period();
    assert_eq!(state.driver(), DriverState::Fault);
    let told = pair.driver.robot().told.last().unwrap().1;
    assert_eq!(told, Reference::rest(0.2501));
    assert!(!pair.driver.robot().running);
    // It is latched, also when the hardware has no fault any more; the operator's word clears it.
    pair.driver.change_robot(|robot| robot.fault = None);
    assert_eq!(pair.hold(50).driver(), DriverState::Fault);
    assert_eq!(pair.greet(), Verdict::Welcome);
    let state = pair.hold(3);
    assert_eq!((state.fault_code, text_of(&state.text).as_str()), (0, ""));
}

/// A controller with a clock of its own is told nothing outside a session: the references are then
/// those of another one, or of no arm at all.
#[test]
fn nothing_is_told_outside_a_session() {
    let mut pair = Pair::new(Arm {
        waits: 1,
        ..Arm::default()
    });
    for _ in 0..50 {
        pair.now += PERIOD;
        pair.step();
    }
    assert!(pair.driver.robot().told.is_empty());
    assert_eq!(pair.greet(), Verdict::Welcome);
    pair.now += PERIOD;
    pair.step();
    assert!(pair.driver.robot().told.is_empty());
    pair.hold(3);
    assert_eq!(pair.driver.robot().told.len(), 3);
    assert_eq!(pair.driver.robot().told[0].1, Reference::rest(0.2004));
}

#[test]
fn a_start_elsewhere_is_refused() {
    let mut pair = Pair::new(Arm::default());
    pair.now += PERIOD;
    let setpoint = pair.setpoint([0.002, 0.0, 0.0]);
    pair.driver.receive(&setpoint, pair.now);
    assert_eq!(pair.driver.fault(), FaultCode::OutOfRange);
}

/// A driver that slept through some periods makes up the references of all of them, with their times.
#[test]
fn every_period_has_its_reference() {
    let mut pair = Pair::new(Arm::default());
    pair.hold(20);
    let before = pair.driver.robot().told.len();
    // The driver sleeps through five periods, two of which bring no setpoint.
    for number in 0..5 {
        pair.now += PERIOD;
        if number != 1 && number != 2 {
            let setpoint = pair.setpoint([0.0; 3]);
            pair.driver.receive(&setpoint, pair.now);
        }
    }
    pair.step();
    // Then the engine sends nothing for a while, in which the driver sleeps again.
    pair.now += 4 * PERIOD;
    pair.step();
    pair.hold(5);
    let told = &pair.driver.robot().told[before - 1..];
    assert_eq!(told.len(), 1 + 5 + 4 + 5);
    for two in told.windows(2) {
        assert_eq!(two[1].0 - two[0].0, PERIOD);
    }
    // A robot without a clock of its own gets one reference in each of its own periods.
    let mut pair = Pair::new(Arm {
        own_clock: false,
        ..Arm::default()
    });
    pair.hold(20);
    let before = pair.driver.robot().told.len();
    pair.now += 4 * PERIOD;
    let state = pair.period();
    assert_eq!(state.driver(), DriverState::Active);
    assert_eq!(pair.driver.robot().told.len(), before + 1);
    let told = &pair.driver.robot().told[before - 1..];
    assert_eq!(told[1].0 - told[0].0, 5 * PERIOD);
}

#[test]
fn everything_else_is_passed_on() {
    let mut pair = Pair::new(Arm {
        speed: f64::NAN,
        measurement: Measurement::Unknown,
        ..Arm::default()
    });
    let state = pair.hold(3);
    assert_eq!(state.flags & StateFlags::UNKNOWN, StateFlags::UNKNOWN);
    assert_eq!(
        state.speed_scaling, 0.0,
        "a share that is no number is no motion"
    );
    assert_eq!(state.sensor("force_z"), Some(3.5));
    assert!(state.sensor("distance").unwrap().is_nan());
    assert_eq!(state.sensor("torque"), None);
    assert_eq!((state.digital_inputs, state.analogue_inputs[7]), (5, 0.5));
    assert!(pair.driver.robot().carried.is_none() && pair.driver.robot().outputs.is_none());
    pair.now += PERIOD;
    let mut setpoint = pair.setpoint([0.0; 3]);
    setpoint.flags = SetpointFlags::EFFORT;
    setpoint.effort[0] = 12.0;
    setpoint.payload.number = 1;
    setpoint.payload.mass = 0.7;
    setpoint.digital_outputs = 2;
    setpoint.digital_mask = 3;
    pair.driver.receive(&setpoint, pair.now);
    pair.step();
    let robot = pair.driver.robot();
    assert_eq!(robot.carried.unwrap().mass, 0.7);
    assert_eq!(robot.outputs.unwrap().digital_mask, 3);
    assert_eq!(robot.told.last().unwrap().2, 12.0);
    // Efforts fade where none come.
    pair.hold(10);
    let faded = pair.driver.robot().told.last().unwrap().2;
    assert!(faded > 5.0 && faded < 8.0, "{faded}");
}

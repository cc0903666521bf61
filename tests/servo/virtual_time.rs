//! The work of the real-time thread on a virtual clock, with an ideal driver: all times are exact.

mod arms;
mod following;
mod orders;
mod payloads;

use ipc::{
    Clock, DriverState, FaultCode, GRIPPER, HelloAck, Setpoint, SetpointFlags, State, ToolAction,
    Verdict,
};
use realtime::{Piece, Sample, Segment};
use servo::{
    Control, Event, ExecutorConfig, Fault, Monitor, Remote, Runner, SegmentSender, Tick, ToolOrder,
};
use system_tests::servo_arm::{JOINTS, executor_config, feed, home, limits, planned};

/// A runner, its handles, and a driver that is always exactly at the last setpoint.
struct Bench {
    runner: Runner<JOINTS>,
    sender: SegmentSender<JOINTS>,
    remote: Remote<JOINTS>,
    monitor: Monitor<JOINTS>,
    state: State,
    tick: u64,
    setpoints: Vec<Setpoint>,
}

impl Bench {
    fn new() -> Self {
        Self::arriving(1e-3)
    }

    /// The same with another tolerance of arriving (rad).
    fn arriving(tolerance: f64) -> Self {
        Self::of(|config| config.arrival.tolerance = tolerance)
    }

    /// The same with another configuration.
    fn of(change: impl Fn(&mut ExecutorConfig<JOINTS>)) -> Self {
        let mut config = executor_config(system_tests::domain::arm("virtual/arm"), Clock::Wall);
        config.record = false;
        change(&mut config);
        let (mut runner, sender, remote, monitor) = Runner::new(config);
        let mut ack = HelloAck::refusal(JOINTS, Verdict::Welcome, "");
        ack.session = 1;
        ack.position[..JOINTS].copy_from_slice(home().as_slice());
        ack.commanded = ack.position;
        runner.open(&ack);
        let mut state = State {
            joints: JOINTS as u32,
            session: 1,
            ..State::default()
        };
        state.position = ack.position;
        state.commanded = ack.position;
        Self {
            runner,
            sender,
            remote,
            monitor,
            state,
            tick: 0,
            setpoints: Vec::new(),
        }
    }

    /// A period, after `skipped` that were left out; `change` modifies the state before it is
    /// received.
    fn period(&mut self, skipped: u64, change: impl Fn(State) -> Option<State>) -> Setpoint {
        self.state.sequence += 1;
        self.state.driver_state = DriverState::Active as u32;
        self.tick += skipped;
        let begin_ns = self.tick * 1_000_000;
        let tick = Tick {
            number: self.tick,
            begin_ns,
            now_ns: begin_ns,
            skipped,
        };
        let state = change(self.state);
        if let Some(state) = state {
            *self.runner.incoming() = state;
        }
        let setpoint = *self.runner.tick(state.is_some(), tick);
        self.state.position = setpoint.position;
        self.state.commanded = setpoint.position;
        self.tick += 1;
        self.setpoints.push(setpoint);
        setpoint
    }

    fn run(&mut self, periods: u64) {
        for _ in 0..periods {
            self.period(0, Some);
        }
    }

    fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.monitor.event()).collect()
    }

    /// Every setpoint keeps the limits against those before it, by finite differences.
    fn assert_smooth(&self) {
        let limits = limits();
        for four in self.setpoints.windows(4) {
            let whole = four.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1);
            for joint in (0..JOINTS).filter(|_| whole) {
                let p = |index: usize| four[index].position[joint];
                let third = (p(3) - p(0) + (p(1) - p(2)) * 3.0) / 1e-9;
                let second = (p(3) - p(2) * 2.0 + p(1)) / 1e-6;
                assert!(
                    third.abs() <= limits.jerk[joint] * (1.0 + 1e-6) + 1e-5,
                    "{third}"
                );
                assert!(second.abs() <= limits.acceleration[joint] * (1.0 + 1e-6) + 1e-8);
            }
        }
    }
}

/// Work that waits when the driver becomes active begins in the same period as work that comes then: in
/// lock-step, where time stands until it comes, how fast the planner is must not change a run.
#[test]
fn work_begins_in_the_same_period_whenever_it_came() {
    let order = ToolOrder::new(1, GRIPPER, ToolAction::Close, 1.0);
    let hand_over = |bench: &mut Bench, tool: bool| {
        if tool {
            bench.sender.tool(order).unwrap();
        } else {
            assert!(feed(&mut bench.sender, 0));
        }
    };
    let begins = |tool: bool, before: u64| {
        let mut bench = Bench::new();
        bench.run(before);
        hand_over(&mut bench, tool);
        bench.run(4 - before);
        let started = bench.events().into_iter().find_map(|event| match event {
            Event::Started { tick, .. } => Some(tick),
            _ => None,
        });
        started.unwrap()
    };
    for tool in [false, true] {
        assert_eq!(begins(tool, 0), begins(tool, 1), "a tool order: {tool}");
    }
}

/// A pause, an override and a fast stop during a move change the time, never the path.
#[test]
fn the_operator_changes_time_only() {
    let mut bench = Bench::new();
    (0..6).for_each(|index| assert!(feed(&mut bench.sender, index)));
    let script = [
        (300, Control::Pause),
        (900, Control::Resume),
        (600, Control::Override(0.3)),
        (1300, Control::Stop { fast: true }),
        (500, Control::Resume),
        (2000, Control::Override(1.0)),
    ];
    for (periods, control) in script {
        bench.run(periods);
        bench.remote.control(control);
    }
    bench.run(6000);
    for setpoint in bench.setpoints.iter().filter(|setpoint| setpoint.tick > 20) {
        let plan = planned(setpoint.command, setpoint.path_time);
        for joint in 0..JOINTS {
            assert!((setpoint.position[joint] - plan[joint]).abs() < 1e-9);
        }
    }
    bench.assert_smooth();
    let events = bench.events();
    let stops = events
        .iter()
        .filter(|event| matches!(event, Event::Stopped { .. }))
        .count();
    assert_eq!(stops, 2);
    assert!(
        events
            .iter()
            .any(|event| matches!(event, Event::Finished { command: 5, .. }))
    );
}

/// How a fault in the middle of a move ends: latched, at rest, on the path; `Resume` has no effect.
fn faulted(change: impl Fn(State) -> Option<State> + Copy, periods: u64) -> Fault {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    bench.run(400);
    for _ in 0..periods {
        bench.period(0, change);
    }
    bench.run(600);
    bench.remote.control(Control::Resume);
    bench.run(200);
    bench.assert_smooth();
    let last = bench.setpoints.last().unwrap();
    assert_ne!(last.flags & SetpointFlags::HOLD, 0, "it still moves");
    let now = bench.remote.measured();
    assert!(now.faulted && now.resting);
    let before = now.setpoint;
    assert!(
        feed(&mut bench.sender, 1),
        "the ring takes it, nobody executes it"
    );
    bench.run(1000);
    assert_eq!(bench.remote.measured().setpoint, before);
    let fault = bench.events().into_iter().find_map(|event| match event {
        Event::Faulted { fault, .. } => Some(fault),
        _ => None,
    });
    fault.expect("a fault was reported")
}

/// The fault that the next state brings about when it is changed like this.
fn fault_of(change: impl Fn(&mut State) + Copy) -> Fault {
    let changed = |mut state: State| {
        change(&mut state);
        Some(state)
    };
    faulted(changed, 1)
}

#[test]
fn a_silent_driver_is_lost() {
    let lost = faulted(|_| None, 150);
    assert!(
        matches!(
            lost,
            Fault::DriverLost {
                silent_ms: 100..=102
            }
        ),
        "{lost}"
    );
    let other = |mut state: State| {
        state.session = 9;
        Some(state)
    };
    let other = faulted(other, 150);
    assert!(matches!(other, Fault::DriverLost { .. }), "{other}");
}

#[test]
fn what_a_driver_may_do_wrong() {
    let bad: [fn(&mut State); 3] = [
        |state| state.position[2] = f64::NAN,
        |state| state.driver_state = 99,
        |state| state.joints = 7,
    ];
    for change in bad {
        let fault = fault_of(change);
        assert!(matches!(fault, Fault::BadState(_)), "{fault}");
    }
    let far = fault_of(|state| state.position[1] += 0.5);
    assert!(
        matches!(far, Fault::Limit(trip) if trip.joint == 1),
        "{far}"
    );
    assert!(
        far.to_string().starts_with("joint 2: following error 0.5"),
        "{far}"
    );
    let stopped = fault_of(|state| {
        state.driver_state = DriverState::Stopping as u32;
        state.fault = FaultCode::Hardware as u32;
        state.fault_joint = 3;
    });
    assert_eq!(
        stopped.to_string(),
        "driver fault at joint 4: a fault of the hardware"
    );
}

/// Late periods are left out and delay the plan: each setpoint is one period of the plan after the
/// last one that was published, however long ago that was.
#[test]
fn late_periods_are_left_out() {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    bench.run(200);
    for skipped in [1, 4, 0, 17, 2] {
        let before = *bench.setpoints.last().unwrap();
        let setpoint = bench.period(skipped, Some);
        let plan = planned(0, setpoint.path_time);
        assert!((setpoint.position[0] - plan[0]).abs() < 1e-9);
        assert!((setpoint.path_time - before.path_time - 0.001).abs() < 1e-9);
        for joint in 0..JOINTS {
            let step = (setpoint.position[joint] - before.position[joint]).abs();
            assert!(
                step <= limits().velocity[joint] * 0.001 * 1.001,
                "{step} rad"
            );
        }
    }
    let counters = bench.remote.counters();
    assert_eq!(
        (counters.published, counters.skipped, counters.ticks),
        (205, 24, 229)
    );
    let before = bench.setpoints.last().unwrap().path_time;
    // Longer than the watchdog: no jump, a latched fault, a stop from where it was.
    let after = bench.period(300, Some);
    assert!(after.path_time - before < 0.0011);
    assert!(bench.remote.measured().faulted);
    let stalled = |event: &Event| {
        matches!(
            event,
            Event::Faulted {
                fault: Fault::Stalled { .. },
                ..
            }
        )
    };
    assert!(bench.events().iter().any(stalled));
}

/// A planner that sends half a command and stops: the arm stops on the path.
#[test]
fn a_starved_planner() {
    let mut bench = Bench::new();
    let goal = home() + (planned(0, 9.0) - home()) * 4.0;
    let whole = Piece::hermite(6.0, &Sample::rest(home()), &Sample::rest(goal));
    let half = Piece {
        duration: 3.0,
        ..whole
    };
    bench
        .sender
        .push(Segment {
            piece: half,
            command: 0,
            last: false,
        })
        .unwrap();
    bench.run(9000);
    bench.assert_smooth();
    let now = bench.remote.measured();
    assert!(now.resting && !now.faulted);
    let last = bench.setpoints.last().unwrap();
    assert!(last.path_time > 2.0 && last.path_time < 3.0);
    assert!((last.position[0] - whole.sample(last.path_time).position[0]).abs() < 1e-9);
}

/// An abort during a move comes to rest on the path and drops the rest; what is pushed after it is
/// executed.
#[test]
fn abort_and_begin_anew() {
    let mut bench = Bench::new();
    (0..4).for_each(|index| assert!(feed(&mut bench.sender, index)));
    bench.run(400);
    bench.remote.control(Control::Abort);
    assert!(
        feed(&mut bench.sender, 0),
        "too late, it belongs to the old program"
    );
    bench.run(1000);
    bench.assert_smooth();
    let aborted = |event: &Event| matches!(event, Event::Aborted { .. });
    assert!(bench.events().iter().any(aborted));
    let here = bench.remote.measured();
    assert!(here.resting && here.idle && !here.faulted);
    bench.sender.renew();
    let back = Piece::hermite(1.0, &Sample::rest(here.setpoint), &Sample::rest(home()));
    bench
        .sender
        .push(Segment {
            piece: back,
            command: 5,
            last: true,
        })
        .unwrap();
    bench.run(1010);
    let finished = |event: &Event| matches!(event, Event::Finished { command: 5, .. });
    assert!(bench.events().iter().any(finished));
    assert!((bench.remote.measured().setpoint - home()).amax() < 1e-12);
}

/// The clock jumps: an hour forward, then back to where it was. The engine latches instead of
/// catching up, and neither side moves faster than its limits; a jump back counts as no time.
#[test]
fn a_clock_that_jumps() {
    const HOUR: u64 = 3_600_000_000_000;
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    bench.run(400);
    // Time stamps of the driver from the future and from the past are ignored.
    for published_ns in [u64::MAX, 0, HOUR] {
        let setpoint = bench.period(0, |state| {
            Some(State {
                published_ns,
                measured_ns: published_ns,
                ..state
            })
        });
        assert_eq!(setpoint.flags & SetpointFlags::STOPPING, 0);
    }
    bench.period(HOUR / 1_000_000, Some);
    bench.run(600);
    bench.assert_smooth();
    let now = bench.remote.measured();
    assert!(now.faulted && now.resting);
    let stalled = |event: &Event| {
        matches!(
            event,
            Event::Faulted {
                fault: Fault::Stalled { .. },
                ..
            }
        )
    };
    assert!(bench.events().iter().any(stalled));
}

/// The same for the driver: an hour without a period, by its clock, is a stop within its own
/// limits from where it was; a clock that goes back moves nothing.
#[test]
fn a_clock_that_jumps_at_the_driver() {
    const PERIOD: u64 = 1_000_000;
    let mut options =
        system_tests::servo_arm::driver_options(system_tests::domain::arm("virtual/jump"));
    options.noise = 0.0;
    let limits = limits();
    let mut driver = driver_sim::driver(options).unwrap();
    let start = 1_000_000_000_000_u64;
    let hello = ipc::Hello::new(JOINTS, PERIOD, 100_000_000, Clock::Wall);
    let ack = driver.greet(&hello, start);
    let mut positions: Vec<[f64; JOINTS]> = Vec::new();
    let mut period = |number: u64, now: u64, follow: bool| {
        let plan = planned(0, number as f64 * 0.001);
        let before = planned(0, number.saturating_sub(1) as f64 * 0.001);
        let mut setpoint = Setpoint {
            joints: JOINTS as u32,
            session: ack.session,
            sequence: number + 1,
            published_ns: now,
            period_ns: PERIOD,
            watchdog_ns: 100_000_000,
            ..Setpoint::default()
        };
        setpoint.position[..JOINTS].copy_from_slice(plan.as_slice());
        setpoint.velocity[..JOINTS].copy_from_slice(((plan - before) * 1000.0).as_slice());
        if follow {
            driver.receive(&setpoint, now);
        }
        let state = *driver.step(now, PERIOD);
        positions.push(core::array::from_fn(|joint| state.position[joint]));
        state
    };
    for number in 0..400 {
        // The clock goes back by a second in the middle.
        let back = if number > 200 { 1_000_000_000 } else { 0 };
        let state = period(number, start + number * PERIOD - back, true);
        assert!(matches!(
            state.driver(),
            DriverState::Armed | DriverState::Active
        ));
    }
    let later = start + 3_600_000_000_000;
    let mut last = State::default();
    for number in 400..1400 {
        last = period(number, later + number * PERIOD, false);
    }
    assert_eq!(
        (last.driver(), last.fault_code()),
        (DriverState::Fault, FaultCode::Stalled)
    );
    for pair in positions.windows(2) {
        for joint in 0..JOINTS {
            let speed = (pair[1][joint] - pair[0][joint]).abs() / 0.001;
            assert!(speed <= limits.velocity[joint], "{speed} rad/s");
        }
    }
}

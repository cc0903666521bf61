//! The real-time path allocates nothing and does not wait: in 100 000 periods of step, check and
//! send there is no call of the allocator and no voluntary context switch.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(unsafe_code, reason = "an allocator is unsafe by its nature")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::time::Duration;

use ipc::{Clock, DriverLink, DriverState, EngineLink, HelloAck, Sensor, Setpoint, State, Verdict};
use servo::{
    Control, Event, FeedForward, GuardKind, GuardOrder, GuardOutcome, GuardSource, MAX_GUARDS,
    Monitor, Runner, SegmentSender, SensorGuard, Tick, Work,
};
use system_tests::servo_arm::{JOINTS, executor_config, feed_within, home};

thread_local! {
    static HEAP_CALLS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, with a count of calls for each thread.
struct Counting;

// SAFETY: every call is passed on unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn count() {
    // A thread that is ending no longer counts.
    let _ = HEAP_CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

fn heap_calls() -> u64 {
    HEAP_CALLS.with(Cell::get)
}

/// How often this thread has given up the processor by itself.
fn waits() -> u64 {
    let status = std::fs::read_to_string("/proc/thread-self/status").unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("voluntary_ctxt_switches"))
        .unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Both counters count: the test must be able to fail.
#[test]
fn the_counters_count() {
    let (heap, waited) = (heap_calls(), waits());
    let list = std::hint::black_box(vec![1, 2, 3]);
    drop(list);
    assert!(heap_calls() >= heap + 2);
    std::thread::sleep(Duration::from_millis(1));
    assert!(waits() > waited);
}

/// 100 000 whole periods as the real-time thread runs them: read the state from shared memory,
/// take segments from the ring, step along the path with pauses and overrides, check, publish the
/// setpoint; the driver's answer is sent from the same thread.
#[test]
fn a_hundred_thousand_periods_without_heap_or_wait() {
    let arm = system_tests::domain::arm("alloc/arm");
    let engine = EngineLink::open(&arm).unwrap();
    let driver = DriverLink::open(&arm).unwrap();
    let mut config = executor_config(arm, Clock::LockStep);
    config.record = false;
    // Every setpoint carries the efforts that the UR5e needs, by its inverse dynamics.
    let robot = planner::robot::load("ur5e").unwrap();
    let dynamics = robot.model.dynamics::<JOINTS>().unwrap();
    config.feed_forward = Some(FeedForward::new(move |[q, dq, ddq]| {
        dynamics.effort(q, dq, ddq)
    }));
    let weight = dynamics.effort(&home(), &home().map(|_| 0.0), &home().map(|_| 0.0));
    let (mut runner, mut sender, remote, mut monitor) = Runner::<JOINTS>::new(config);
    let ack = welcome();
    runner.open(&ack);

    let mut state = State {
        joints: JOINTS as u32,
        session: 1,
        ..State::default()
    };
    state.position = ack.position;
    state.commanded = ack.position;
    state.sensor_count = 1;
    let force = Cell::new(0.0);
    let mut received = Setpoint::default();
    let mut period = |number: u64| {
        let begin_ns = number * 1_000_000;
        let tick = Tick {
            number,
            begin_ns,
            now_ns: begin_ns,
            skipped: 0,
        };
        let came = engine.take_last_state(runner.incoming());
        assert!(engine.send(runner.tick(came, tick)));
        assert!(driver.take_last_setpoint(&mut received));
        if number == 0 {
            assert_eq!(received.effort[..JOINTS], *weight.as_slice());
        }
        state.sensors[0] = Sensor::new("force", force.get());
        state.position = received.position;
        state.commanded = received.position;
        state.sequence += 1;
        state.driver_state = DriverState::Active as u32;
        assert!(driver.send(&state));
    };
    // Connections are made when the first messages pass.
    (0..100).for_each(&mut period);

    let (mut next, mut finished, mut heap, mut waited, mut tripped) = (0, 0, 0, 0, 0);
    for block in 0..100 {
        while sender.room() > 4000
            && guard(&mut sender, next)
            && feed_within(&mut sender, next, 1e-6)
        {
            next += 1;
        }
        // Towards the end a guard stops the command that moves, and none begins any more.
        force.set(if block >= 95 { 20.0 } else { 0.0 });
        for order in orders(block) {
            remote.control(order);
        }
        let before = (heap_calls(), waits());
        let first = 100 + block * 1000;
        (first..first + 1000).for_each(&mut period);
        // Reading the second counter is itself a call of the heap; it is read last.
        let (after_heap, after_waits) = (heap_calls(), waits());
        heap += after_heap - before.0 - counting_costs();
        waited += after_waits - before.1;
        finished += count_finished(&mut monitor);
        let reports = std::iter::from_fn(|| monitor.guarded());
        tripped += reports
            .filter(|report| report.path_time > 0.0 && report.outcome != GuardOutcome::Quiet)
            .count();
    }
    assert!(finished > 40, "only {finished} commands");
    assert_eq!(remote.counters().published, 100_100);
    assert!(tripped > 0, "no guard has stopped a command");
    assert_eq!(
        (heap, waited),
        (0, 0),
        "heap calls and waits in the periods"
    );
}

/// Guards of the next command: it stops where the force is above 10 N.
fn guard(sender: &mut SegmentSender<JOINTS>, command: u32) -> bool {
    let mut guards = [None; MAX_GUARDS];
    guards[0] = Some(SensorGuard {
        source: GuardSource::named("force"),
        kind: GuardKind::Over,
        limit: 10.0,
    });
    sender
        .hand_over(Work::Guards(GuardOrder { command, guards }))
        .is_ok()
}

/// The driver's answer to the handshake.
fn welcome() -> HelloAck {
    let mut ack = HelloAck::refusal(JOINTS, Verdict::Welcome, "");
    ack.session = 1;
    ack.position[..JOINTS].copy_from_slice(home().as_slice());
    ack.commanded = ack.position;
    ack
}

/// What an operator wants in a block of periods.
fn orders(block: u64) -> Vec<Control> {
    match block % 10 {
        3 => vec![Control::Pause],
        6 => vec![Control::Override(0.4)],
        7 => vec![Control::Resume, Control::Override(1.0)],
        8 => vec![Control::Stop { fast: true }],
        _ => vec![Control::Resume],
    }
}

/// How many commands were finished since the last call.
fn count_finished(monitor: &mut Monitor<JOINTS>) -> usize {
    let mut finished = 0;
    while let Some(event) = monitor.event() {
        match event {
            Event::Finished { .. } => finished += 1,
            Event::Faulted { fault, .. } => panic!("{fault}"),
            _ => {}
        }
    }
    finished
}

/// Heap calls of one [`waits`]: it runs between the two readings of the first counter.
fn counting_costs() -> u64 {
    let before = heap_calls();
    waits();
    let cost = heap_calls() - before;
    std::hint::black_box(cost)
}

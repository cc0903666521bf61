//! How far arm and driver may be from what they are told, and when that stops a run.

use realtime::Quantity;
use servo::{Event, Fault};
use system_tests::servo_arm::{feed, home};

use super::Bench;

/// Runs a move with a driver that is `late` periods behind in `commanded` and `position`.
fn run_late(late: usize) -> Vec<Event> {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    for period in 0..2000_usize {
        let sent = &bench.setpoints;
        let then = period.checked_sub(late).and_then(|index| sent.get(index));
        let position = then.or(sent.first()).map(|setpoint| setpoint.position);
        bench.period(0, |mut state| {
            state.position = position.unwrap_or(state.position);
            state.commanded = state.position;
            Some(state)
        });
    }
    bench.events()
}

fn fault(events: &[Event]) -> Option<Fault> {
    events.iter().find_map(|event| match event {
        Event::Faulted { fault, .. } => Some(*fault),
        _ => None,
    })
}

/// A driver that is late by less than its watchdog is no fault, also where the plan rests already and
/// the arm is still on its way.
#[test]
fn a_late_driver_is_no_fault() {
    for late in [1, 20, 60, 100] {
        let events = run_late(late);
        assert_eq!(fault(&events), None, "{late} periods late");
        let finished = |event: &Event| matches!(event, Event::Finished { command: 0, .. });
        assert!(events.iter().any(finished), "{late} periods late");
    }
}

/// A driver that is later than that is told from an arm that does not follow.
#[test]
fn a_driver_that_leaves_the_setpoints() {
    let events = run_late(400);
    let Some(Fault::Limit(trip)) = fault(&events) else {
        panic!("{events:?}");
    };
    assert_eq!(trip.quantity, Quantity::Commanded);
}

/// The driver follows, the arm is held in place: seen within a few hundredths of a radian.
#[test]
fn an_arm_that_is_held() {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    for _ in 0..1000 {
        bench.period(0, |mut state| {
            state.position[0] = home()[0];
            Some(state)
        });
    }
    let events = bench.events();
    let Some(Fault::Limit(trip)) = fault(&events) else {
        panic!("{events:?}");
    };
    assert_eq!((trip.joint, trip.quantity), (0, Quantity::Following));
    let error = trip.value.abs();
    assert!((0.02..0.09).contains(&error), "{error} rad");
}

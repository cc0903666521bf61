//! Orders of operators, and when they act.

use realtime::{Piece, Sample, Segment};
use servo::{Control, Event};
use system_tests::servo_arm::{feed, home};

use super::Bench;

/// A recovery without a fault is refused and has no later effect: the pause after it keeps the
/// plan. A recovery acts on one fault only.
#[test]
fn a_recovery_without_a_fault_leaves_nothing_behind() {
    let mut bench = Bench::new();
    (0..2).for_each(|index| assert!(feed(&mut bench.sender, index)));
    bench.run(400);
    assert!(bench.remote.recover().is_err());
    bench.remote.control(Control::Pause);
    bench.run(1000);
    assert!(bench.remote.measured().resting);
    assert!(!bench.remote.measured().idle, "the plan was dropped");
    let forgotten =
        |event: &Event| matches!(event, Event::Aborted { .. } | Event::Recovered { .. });
    assert!(!bench.events().iter().any(forgotten));
    bench.remote.control(Control::Resume);
    bench.run(8000);
    let finished = |event: &Event| matches!(event, Event::Finished { command: 1, .. });
    assert!(bench.events().iter().any(finished));
}

/// An order acts in the first period after it, and its effect until then is reported.
#[test]
fn an_order_acts_in_the_next_period() {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    bench.run(400);
    let steering = bench.remote.steering();
    let orders = [
        Control::Pause,
        Control::Resume,
        Control::Override(0.2),
        Control::Stop { fast: true },
    ];
    for control in orders {
        let before = bench.setpoints.last().unwrap().time_scaling;
        let order = steering.control(control);
        assert!(!steering.progress().has(order));
        let setpoint = bench.period(0, Some);
        let now = steering.progress();
        assert!(now.has(order) && now.tick == setpoint.tick);
        assert!((now.time_scaling - setpoint.time_scaling).abs() < 1e-12);
        if control != Control::Resume {
            assert!(setpoint.time_scaling < before, "{control:?} does not act");
        }
        bench.run(60);
    }
}

/// A stop that comes while an abort brakes is not lost: the arm is held after the abort, and later
/// commands wait for the operator.
#[test]
fn a_stop_during_an_abort_holds() {
    let mut bench = Bench::new();
    (0..2).for_each(|index| assert!(feed(&mut bench.sender, index)));
    bench.run(400);
    bench.remote.control(Control::Abort);
    bench.run(20);
    bench.remote.control(Control::Stop { fast: true });
    bench.run(1000);
    let aborted = |event: &Event| matches!(event, Event::Aborted { aborts: 1, .. });
    assert!(bench.events().iter().any(aborted));
    bench.sender.renew();
    let here = bench.remote.measured();
    assert!(here.resting && here.idle && here.held);
    let back = Piece::hermite(1.0, &Sample::rest(here.setpoint), &Sample::rest(home()));
    let segment = Segment {
        piece: back,
        command: 5,
        last: true,
    };
    bench.sender.push(segment).unwrap();
    bench.run(200);
    assert_eq!(bench.remote.measured().setpoint, here.setpoint);
    bench.remote.control(Control::Resume);
    bench.run(1100);
    let finished = |event: &Event| matches!(event, Event::Finished { command: 5, .. });
    assert!(bench.events().iter().any(finished));
}

//! Arms that have a will of their own: they ask for less speed, arrive late, or send nothing.

use ipc::{SetpointFlags, State};
use servo::{Event, Fault};
use system_tests::servo_arm::{JOINTS, feed, planned};

use super::Bench;

/// The arm asks for less speed in the middle of a move: it stays on the path and needs longer; at 0
/// it rests on the path; every setpoint keeps the limits.
#[test]
fn the_arm_asks_for_less_speed() {
    let mut bench = Bench::new();
    (0..3).for_each(|index| assert!(feed(&mut bench.sender, index)));
    bench.run(400);
    bench.state.speed_scaling = 0.3;
    bench.run(800);
    assert!((bench.remote.measured().time_scaling - 0.3).abs() < 1e-6);
    assert_eq!(bench.remote.measured().speed_asked, 0.3);
    bench.state.speed_scaling = 0.0;
    bench.run(1500);
    assert!(bench.remote.measured().resting);
    bench.state.speed_scaling = 1.0;
    bench.run(9000);
    assert!(bench.remote.measured().idle);
    for setpoint in bench.setpoints.iter().filter(|setpoint| setpoint.tick > 20) {
        let plan = planned(setpoint.command, setpoint.path_time);
        for joint in 0..JOINTS {
            assert!((setpoint.position[joint] - plan[joint]).abs() < 1e-9);
        }
    }
    bench.assert_smooth();
    let asked: Vec<f64> = bench
        .events()
        .iter()
        .filter_map(|event| match event {
            Event::SpeedAsked { share, .. } => Some(*share),
            _ => None,
        })
        .collect();
    assert_eq!(asked, [0.3, 1.0]);
    // A share that is none is no state.
    bench.state.speed_scaling = f64::NAN;
    bench.run(1);
    assert!(bench.remote.measured().faulted);
}

/// A command is done when the measured arm is there: 20 ms after its plan where the arm is 20 ms late;
/// an arm that stays away is named after half a second. The next command does not wait.
#[test]
fn a_command_is_done_when_the_arm_has_arrived() {
    let mut bench = Bench::arriving(1e-6);
    (0..2).for_each(|index| assert!(feed(&mut bench.sender, index)));
    let mut late = std::collections::VecDeque::from(vec![bench.state.position; 20]);
    for _ in 0..8000 {
        let measured = late.pop_front().unwrap();
        let setpoint = bench.period(0, |state| {
            Some(State {
                position: measured,
                ..state
            })
        });
        late.push_back(setpoint.position);
    }
    let mut setpoints = bench.setpoints.iter();
    let rests = setpoints
        .find(|setpoint| setpoint.command == 1 && setpoint.flags & SetpointFlags::HOLD != 0);
    let rest = rests.unwrap().tick;
    let events = bench.events();
    let finished = |wanted: u32| {
        events.iter().find_map(|event| match event {
            Event::Finished { command, tick } if *command == wanted => Some(*tick),
            _ => None,
        })
    };
    let last = finished(1).unwrap();
    assert!((5..=25).contains(&(last - rest)), "{last} {rest}");
    let order: Vec<&Event> = events
        .iter()
        .filter(|event| matches!(event, Event::Started { .. } | Event::Finished { .. }))
        .collect();
    assert!(
        matches!(order[0], Event::Started { command: 0, .. }),
        "{order:?}"
    );
    assert!(
        matches!(order[1], Event::Finished { command: 0, .. }),
        "{order:?}"
    );
    assert!(
        matches!(order[2], Event::Started { command: 1, .. }),
        "{order:?}"
    );

    // The next command moves the arm away meanwhile: the distance is that of before.
    let mut bench = Bench::new();
    (0..2).for_each(|index| assert!(feed(&mut bench.sender, index)));
    for _ in 0..8000 {
        bench.period(0, |mut state| {
            state.position[2] += 0.004;
            Some(state)
        });
    }
    let events = bench.events();
    let warned = events.iter().find_map(|event| match event {
        Event::NotArrived {
            joint, error, tick, ..
        } => Some((*joint, *error, *tick)),
        _ => None,
    });
    let (joint, error, _) = warned.unwrap();
    assert_eq!(joint, 2);
    assert!((0.001..0.004 + 1e-6).contains(&error), "{error}");
    assert!(
        events
            .iter()
            .any(|event| matches!(event, Event::Finished { command: 0, .. }))
    );
}

/// A driver that lives while its arm sends nothing: the arm stops on the path.
#[test]
fn an_arm_that_sends_nothing() {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    bench.run(300);
    bench.state.flags = ipc::StateFlags::UNKNOWN;
    bench.run(90);
    assert!(!bench.remote.measured().faulted);
    bench.run(2000);
    let faults: Vec<Fault> = bench
        .events()
        .iter()
        .filter_map(|event| match event {
            Event::Faulted { fault, .. } => Some(*fault),
            _ => None,
        })
        .collect();
    assert!(
        matches!(
            faults[..],
            [Fault::Unmeasured {
                silent_ms: 101 | 100
            }]
        ),
        "{faults:?}"
    );
    assert!(bench.remote.measured().resting);
    bench.assert_smooth();
}

//! Arms that have a will of their own: they ask for less speed, arrive late, or send nothing.

use ipc::{SetpointFlags, State};
use servo::{Event, Fault};
use system_tests::servo_arm::{JOINTS, end_tolerance, feed, feed_within, planned};

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

/// The tolerance of a command's end holds for the measured tool: the next command moves when the arm,
/// which is 20 ms late, is within it. It loses no period where the arm is there already; a tool that stays
/// away is named after half a second, and the plan goes on.
#[test]
fn the_next_command_waits_until_the_tool_is_at_the_end() {
    // Periods from the end of the first plan to the start of the second, with the events.
    let run = |within: Option<f64>, delay: usize, away: f64| {
        let mut bench = Bench::new();
        for index in 0..2 {
            match within {
                Some(within) => assert!(feed_within(&mut bench.sender, index, within)),
                None => assert!(feed(&mut bench.sender, index)),
            }
        }
        let mut late = std::collections::VecDeque::from(vec![bench.state.position; delay]);
        let mut away_at = None;
        for _ in 0..4000 {
            late.push_back(bench.state.position);
            let mut measured = late.pop_front().unwrap();
            measured[2] += away;
            let state = |state| {
                Some(State {
                    position: measured,
                    ..state
                })
            };
            let setpoint = bench.period(0, state);
            if setpoint.command == 1 && setpoint.path_time > 0.0 && away_at.is_none() {
                away_at = Some((setpoint.tick, measured));
            }
        }
        bench.assert_smooth();
        let (tick, measured) = away_at.unwrap();
        (tick, measured, bench.events())
    };
    let off = |measured: &[f64]| {
        let end = end_tolerance(0, 1.0);
        end.off(&nalgebra::SVector::from_column_slice(&measured[..JOINTS]))
            .point
    };
    let missed = |events: &[Event]| {
        let misses = events.iter().filter_map(|event| match event {
            Event::EndMissed { command, point, .. } => Some((*command, *point)),
            _ => None,
        });
        misses.collect::<Vec<_>>()
    };
    let (free, at, events) = run(None, 20, 0.0);
    assert!(off(&at) > 1e-6, "the next command did not move before");
    assert!(missed(&events).is_empty());
    let (held, at, events) = run(Some(1e-6), 20, 0.0);
    assert!((3..=21).contains(&(held - free)), "{held} {free}");
    assert!(off(&at) <= 1e-6 && missed(&events).is_empty());
    assert_eq!(run(Some(1e-6), 0, 0.0).0, run(None, 0, 0.0).0);

    let (held, _, events) = run(Some(5e-4), 0, 8e-4);
    assert!((500..=502).contains(&(held - free)), "{held} {free}");
    let [(0, first), (1, second)] = missed(&events)[..] else {
        panic!("{events:?}")
    };
    assert!((first - 8e-4).abs() < 1e-9 && (second - 8e-4).abs() < 1e-9);
    // Nothing else is amiss: each joint is within the milliradian of the robot.
    let not_arrived = |event: &Event| matches!(event, Event::NotArrived { .. });
    assert!(!events.iter().any(not_arrived));
    let finished = |event: &&Event| matches!(event, Event::Finished { .. });
    assert_eq!(events.iter().filter(finished).count(), 2);
}

/// A tolerance of an end is dropped with its command: after an abort the arm waits for nothing.
#[test]
fn an_abort_forgets_the_tolerances_of_ends() {
    let mut bench = Bench::new();
    (0..2).for_each(|index| assert!(feed_within(&mut bench.sender, index, 1e-6)));
    bench.run(300);
    bench.remote.control(servo::Control::Abort);
    bench.run(600);
    assert!(bench.remote.measured().idle);
    bench.events();
    bench.sender.renew();
    // Command 0 again, from where the arm rests now.
    let here = nalgebra::SVector::from_column_slice(&bench.state.position[..JOINTS]);
    let hold = realtime::Piece::hold(here, 0.1);
    let last = |command| realtime::Segment {
        piece: hold,
        command,
        last: true,
    };
    (0..2).for_each(|command| bench.sender.push(last(command)).unwrap());
    bench.run(300);
    let events = bench.events();
    let finished = |event: &&Event| matches!(event, Event::Finished { .. });
    assert_eq!(events.iter().filter(finished).count(), 2, "{events:?}");
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

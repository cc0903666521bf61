//! What the arm carries is told to its controller.

use ipc::{HelloAck, Payload, TOOL_CHANGER, ToolAction, ToolStatus, Verdict};
use servo::{Event, ToolOrder};
use system_tests::servo_arm::{JOINTS, feed};

use super::Bench;

fn of_mass(mass: f64) -> Payload {
    Payload {
        mass,
        centre: [0.0, 0.0, mass / 10.0],
        tool_position: [0.0, 0.0, 0.1],
        ..Payload::default()
    }
}

/// An order to the tool changer, after which the arm carries `mass`.
fn order(bench: &mut Bench, command: u32, mass: Option<f64>) {
    let order = ToolOrder {
        payload: mass.map(of_mass),
        ..ToolOrder::new(command, TOOL_CHANGER, ToolAction::Open, 1.0)
    };
    bench.sender.tool(order).unwrap();
}

/// Nothing is told where nothing is known.
#[test]
fn an_unknown_payload_is_not_told() {
    let mut bench = Bench::new();
    assert!(feed(&mut bench.sender, 0));
    bench.run(3000);
    assert!(
        bench
            .setpoints
            .iter()
            .all(|setpoint| setpoint.payload == Payload::default())
    );
}

/// The payload of the start is in the first setpoint; that of a tool change comes when the tool has done it,
/// and before the next motion begins; a new session tells it again, and counts from 1.
#[test]
fn a_payload_is_told_when_the_tool_has_changed() {
    let mut bench = Bench::of(|config| config.payload = Some(of_mass(0.7)));
    order(&mut bench, 1000, Some(0.2));
    order(&mut bench, 1001, None);
    assert!(feed(&mut bench.sender, 0));
    for _ in 0..4000 {
        let last = bench
            .setpoints
            .last()
            .map(|setpoint| setpoint.tools[TOOL_CHANGER].order);
        // The tool takes 50 ms; its answers are a period late.
        let asked = last.unwrap_or(0);
        let since = bench.setpoints.iter().rev();
        let time = since.take_while(|setpoint| setpoint.tools[TOOL_CHANGER].order == asked);
        let done = time.count() > 50;
        bench.period(0, |mut state| {
            let tool = &mut state.tools[TOOL_CHANGER];
            let status = if done {
                ToolStatus::Open
            } else {
                ToolStatus::Moving
            };
            (tool.order, tool.status) = (asked, status as u32);
            Some(state)
        });
    }
    let first = &bench.setpoints[0].payload;
    assert_eq!((first.number, first.mass), (1, 0.7));
    let events = bench.events();
    let ticks: Vec<u64> = events
        .iter()
        .filter_map(|event| match event {
            Event::Finished {
                command: 1000 | 1001,
                tick,
            } => Some(*tick),
            _ => None,
        })
        .collect();
    let [changed, _] = ticks[..] else {
        panic!("{events:?}")
    };
    let mut setpoints = bench.setpoints.iter();
    let second = setpoints.find(|setpoint| setpoint.payload.number == 2);
    let told = second.unwrap().tick;
    assert!((changed..=changed + 1).contains(&told), "{changed} {told}");
    for setpoint in &bench.setpoints {
        let expected = if setpoint.tick < told {
            (1, 0.7)
        } else {
            (2, 0.2)
        };
        assert_eq!(
            (setpoint.payload.number, setpoint.payload.mass),
            expected,
            "{}",
            setpoint.tick
        );
    }
    let moves = bench
        .setpoints
        .iter()
        .find(|setpoint| setpoint.velocity[..JOINTS] != [0.0; JOINTS]);
    assert!(moves.unwrap().tick > told);
    let mut ack = HelloAck::refusal(JOINTS, Verdict::Welcome, "");
    ack.session = 2;
    ack.commanded = bench.state.position;
    ack.position = bench.state.position;
    bench.runner.open(&ack);
    bench.state.session = 2;
    let again = bench.period(0, Some).payload;
    assert_eq!((again.number, again.mass), (1, 0.2));
}

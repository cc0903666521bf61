//! Messages are written over older ones: what has a meaning arrives, whatever was there before.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc::{Arm, Domain, DriverLink, EngineLink, Sensor, Setpoint, SetpointFlags, State, bytes_of};

/// Random numbers from a seed (xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }

    fn number(&mut self) -> f64 {
        self.below(1 << 40) as f64
    }
}

fn arm(name: &str) -> Arm {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("domain");
    let name = format!("over-{}/{name}", std::process::id());
    Domain::open(&folder).unwrap().arm(&name).unwrap()
}

/// What the engine sends next: all that belongs to the joints is new, the rest sometimes.
fn next_setpoint(last: &Setpoint, random: &mut Random) -> Setpoint {
    let mut next = *last;
    next.sequence += 1;
    let begins = random.below(50) == 0;
    if begins {
        // Another session, perhaps of another arm: its revisions begin again.
        next.session += 1;
        next.joints = 6 + random.below(2) as u32;
        next.revision = random.below(2) as u32;
    }
    (next.tick, next.published_ns, next.tick_ns) = (random.below(99), random.below(99), 7);
    (next.command, next.valid) = (random.below(9) as u32, random.below(99) as u32);
    next.flags = random.below(32) as u32;
    (next.path_time, next.time_scaling) = (random.number(), random.number());
    for joint in 0..next.joints as usize {
        next.position[joint] = random.number();
        next.velocity[joint] = random.number();
        next.acceleration[joint] = random.number();
        next.effort[joint] = random.number();
    }
    if begins || next.revision == 0 || random.below(20) == 0 {
        next.tools[1].order += 1;
        next.tools[0].position = random.number();
        next.digital_outputs = random.below(99);
        next.digital_mask = random.below(99);
        next.analogue_outputs[7] = random.number();
        next.analogue_mask = random.below(99);
        next.payload.number += 1;
        next.payload.mass = random.number();
        next.revision += u32::from(!begins && next.revision != 0);
    }
    next
}

/// The message without what has no meaning in it.
fn setpoint_in_use(of: &Setpoint) -> Setpoint {
    let joints = of.joints as usize;
    let mut all = *of;
    if of.flags & SetpointFlags::EFFORT == 0 {
        all.effort = [0.0; 16];
    }
    let lists = [
        &mut all.position,
        &mut all.velocity,
        &mut all.acceleration,
        &mut all.effort,
    ];
    lists.into_iter().for_each(|list| list[joints..].fill(0.0));
    all
}

fn state_in_use(of: &State) -> State {
    let joints = of.joints as usize;
    let mut all = *of;
    if of.fault == 0 {
        all.text = [0; 96];
    }
    all.sensors[of.sensor_count as usize..].fill(Sensor::new("", 0.0));
    let lists = [
        &mut all.position,
        &mut all.velocity,
        &mut all.effort,
        &mut all.commanded,
    ];
    lists.into_iter().for_each(|list| list[joints..].fill(0.0));
    all
}

fn next_state(last: &State, random: &mut Random) -> State {
    let mut next = *last;
    next.sequence += 1;
    let begins = random.below(50) == 0;
    if begins {
        next.joints = 5 + random.below(3) as u32;
        next.session += 1;
        next.revision = random.below(2);
    }
    next.measured_ns = random.below(99);
    (next.published_ns, next.setpoint_sequence) = (random.below(99), random.below(99));
    (next.setpoint_published_ns, next.setpoint_received_ns) = (random.below(99), random.below(99));
    (next.driver_state, next.fault_joint) = (random.below(6) as u32, random.below(6) as u32);
    (next.fault_code, next.missed) = (random.below(99) as u32, random.below(99));
    (next.hardware_ns, next.speed_scaling) = (random.below(99), random.number());
    (next.flags, next.digital_inputs) = (random.below(16) as u32, random.below(99));
    for joint in 0..next.joints as usize {
        next.position[joint] = random.number();
        next.velocity[joint] = random.number();
        next.effort[joint] = random.number();
        next.commanded[joint] = random.number();
    }
    if begins || next.revision == 0 || random.below(10) == 0 {
        next.tools[1].position = random.number();
        next.analogue_inputs[3] = random.number();
        next.revision += u64::from(!begins && next.revision != 0);
    }
    next.sensor_count = random.below(4) as u32;
    for sensor in next.sensors.iter_mut().take(3) {
        *sensor = Sensor::new(&format!("s{}", random.below(9)), random.number());
    }
    next.fault = random.below(3) as u32;
    next.text = match (next.fault, random.below(2)) {
        (0, _) | (_, 0) => [0; 96],
        _ => bytes_of(&format!("fault {}", random.number())),
    };
    next
}

/// The receivers read at other times than the senders send, so that messages go into places of any age.
#[test]
fn what_has_a_meaning_arrives() {
    let arm = arm("arm");
    let (engine, driver) = (
        EngineLink::open(&arm).unwrap(),
        DriverLink::open(&arm).unwrap(),
    );
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut setpoint = Setpoint {
        joints: 6,
        revision: 1,
        ..Setpoint::default()
    };
    let mut state = State {
        joints: 6,
        revision: 1,
        ..State::default()
    };
    let (mut got_setpoint, mut got_state) = (Setpoint::default(), State::default());
    for _ in 0..20_000 {
        for _ in 0..=random.below(3) {
            setpoint = next_setpoint(&setpoint, &mut random);
            assert!(engine.send(&setpoint));
            state = next_state(&state, &mut random);
            assert!(driver.send(&state));
        }
        if random.below(2) == 0 {
            assert!(driver.take_last_setpoint(&mut got_setpoint));
            assert!(engine.take_last_state(&mut got_state));
        } else {
            while driver.take_setpoint(&mut got_setpoint) {}
            while engine.take_state(&mut got_state) {}
        }
        assert_eq!(setpoint_in_use(&got_setpoint), setpoint_in_use(&setpoint));
        assert_eq!(state_in_use(&got_state), state_in_use(&state));
        assert!(!driver.take_setpoint(&mut got_setpoint));
    }
}

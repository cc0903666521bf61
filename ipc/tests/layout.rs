//! The byte layout of the messages must not change: drivers in other languages rely on it.

use core::mem::{align_of, offset_of, size_of};

use ipc::{Hello, HelloAck, Payload, Sensor, Setpoint, State, ToolCommand, ToolFeedback};

#[test]
fn setpoint() {
    assert_eq!((size_of::<Setpoint>(), align_of::<Setpoint>()), (960, 8));
    let offsets = [
        (offset_of!(Setpoint, protocol), 0),
        (offset_of!(Setpoint, joints), 4),
        (offset_of!(Setpoint, session), 8),
        (offset_of!(Setpoint, sequence), 16),
        (offset_of!(Setpoint, tick), 24),
        (offset_of!(Setpoint, published_ns), 32),
        (offset_of!(Setpoint, tick_ns), 40),
        (offset_of!(Setpoint, state_sequence), 48),
        (offset_of!(Setpoint, period_ns), 56),
        (offset_of!(Setpoint, watchdog_ns), 64),
        (offset_of!(Setpoint, command), 72),
        (offset_of!(Setpoint, flags), 76),
        (offset_of!(Setpoint, valid), 80),
        (offset_of!(Setpoint, revision), 84),
        (offset_of!(Setpoint, path_time), 88),
        (offset_of!(Setpoint, time_scaling), 96),
        (offset_of!(Setpoint, digital_outputs), 104),
        (offset_of!(Setpoint, digital_mask), 112),
        (offset_of!(Setpoint, analogue_mask), 120),
        (offset_of!(Setpoint, position), 128),
        (offset_of!(Setpoint, velocity), 256),
        (offset_of!(Setpoint, acceleration), 384),
        (offset_of!(Setpoint, effort), 512),
        (offset_of!(Setpoint, tools), 640),
        (offset_of!(Setpoint, analogue_outputs), 720),
        (offset_of!(Setpoint, payload), 784),
        (offset_of!(Setpoint, reserved), 928),
    ];
    for (found, promised) in offsets {
        assert_eq!(found, promised);
    }
}

#[test]
fn state() {
    assert_eq!((size_of::<State>(), align_of::<State>()), (1408, 8));
    let offsets = [
        (offset_of!(State, protocol), 0),
        (offset_of!(State, joints), 4),
        (offset_of!(State, session), 8),
        (offset_of!(State, sequence), 16),
        (offset_of!(State, measured_ns), 24),
        (offset_of!(State, published_ns), 32),
        (offset_of!(State, setpoint_sequence), 40),
        (offset_of!(State, setpoint_published_ns), 48),
        (offset_of!(State, setpoint_received_ns), 56),
        (offset_of!(State, driver_state), 64),
        (offset_of!(State, fault), 68),
        (offset_of!(State, fault_joint), 72),
        (offset_of!(State, fault_code), 76),
        (offset_of!(State, missed), 80),
        (offset_of!(State, flags), 88),
        (offset_of!(State, sensor_count), 92),
        (offset_of!(State, speed_scaling), 96),
        (offset_of!(State, hardware_ns), 104),
        (offset_of!(State, digital_inputs), 112),
        (offset_of!(State, revision), 120),
        (offset_of!(State, position), 128),
        (offset_of!(State, velocity), 256),
        (offset_of!(State, effort), 384),
        (offset_of!(State, commanded), 512),
        (offset_of!(State, tools), 640),
        (offset_of!(State, analogue_inputs), 704),
        (offset_of!(State, sensors), 768),
        (offset_of!(State, text), 1280),
        (offset_of!(State, reserved), 1376),
    ];
    for (found, promised) in offsets {
        assert_eq!(found, promised);
    }
}

/// What a period writes and reads of an arm of up to 8 joints: the first two lines of 64 bytes, and one for each list.
#[test]
fn lists_begin_a_line() {
    let lists = [
        offset_of!(Setpoint, position),
        offset_of!(Setpoint, velocity),
        offset_of!(Setpoint, acceleration),
        offset_of!(Setpoint, effort),
        offset_of!(State, position),
        offset_of!(State, velocity),
        offset_of!(State, effort),
        offset_of!(State, commanded),
    ];
    assert!(lists.iter().all(|offset| offset % 64 == 0), "{lists:?}");
}

#[test]
fn handshake_and_tools() {
    assert_eq!(size_of::<ToolCommand>(), 40);
    assert_eq!(size_of::<ToolFeedback>(), 32);
    assert_eq!(size_of::<Hello>(), 144);
    assert_eq!(size_of::<Sensor>(), 32);
    assert_eq!(size_of::<Payload>(), 144);
    assert_eq!(size_of::<HelloAck>(), 1184);
    assert_eq!(offset_of!(HelloAck, session), 24);
    assert_eq!(offset_of!(HelloAck, position), 40);
    assert_eq!(offset_of!(HelloAck, name), 960);
}

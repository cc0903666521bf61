//! The modes of the controller, in the words of its maker.

use crate::rtde::Cycle;

/// Robot modes.
pub(crate) const POWER_OFF: i32 = 3;
pub(crate) const IDLE: i32 = 5;
pub(crate) const RUNNING: i32 = 7;

/// Safety modes.
pub(crate) const PROTECTIVE_STOP: i32 = 3;

/// Runtime states.
pub(crate) const STOPPED: u32 = 1;
pub(crate) const PLAYING: u32 = 2;
pub(crate) const PAUSED: u32 = 4;

/// Whether the arm may move in a safety mode: normal or reduced.
pub(crate) fn is_safe(mode: i32) -> bool {
    matches!(mode, 1 | 2)
}

/// A safety mode in words, and what the operator must do about it.
pub(crate) fn safety(mode: i32) -> &'static str {
    match mode {
        1 => "normal",
        2 => "reduced",
        PROTECTIVE_STOP => "protective stop",
        4 => "recovery mode: move the arm back into its limits on the pendant",
        5 => "safeguard stop: close the safeguard and reset it",
        6 => "emergency stop of the system: release it and switch on again",
        7 => "emergency stop: release it and switch on again",
        8 | 9 => "safety fault: restart the safety system on the pendant",
        10 => "a joint must be confirmed on the pendant",
        _ => "an unknown safety mode",
    }
}

/// A robot mode in words.
pub(crate) fn robot(mode: i32) -> &'static str {
    match mode {
        -1 => "no controller",
        0 => "the arm is not connected with its controller",
        1 => "the safety settings must be confirmed on the pendant",
        2 => "the controller starts",
        POWER_OFF => "the arm is switched off",
        4 => "the arm is being switched on",
        IDLE => "the brakes are closed",
        6 => "the arm can be moved by hand",
        RUNNING => "running",
        8 => "the firmware is being updated",
        _ => "an unknown mode of the robot",
    }
}

/// Why a program does not follow any more.
pub(crate) fn cause(cycle: &Cycle) -> String {
    if !is_safe(cycle.safety_mode) {
        return safety(cycle.safety_mode).to_owned();
    }
    if cycle.robot_mode != RUNNING {
        return robot(cycle.robot_mode).to_owned();
    }
    match cycle.runtime_state {
        PLAYING => "the program has closed the connection".to_owned(),
        3 | PAUSED => "the program was paused on the pendant".to_owned(),
        _ => "the program was stopped on the pendant".to_owned(),
    }
}

//! The state machine of a drive.

/// The state of a drive, as its statusword (0x6041) says.
///
/// # Source
/// CiA 402-2 (IEC 61800-7-201), "Drive profile - operation modes", state coding of the statusword.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveState {
    /// It starts.
    NotReady,
    /// Power may be missing.
    SwitchOnDisabled,
    /// Power may be switched on.
    ReadyToSwitchOn,
    /// Power is on.
    SwitchedOn,
    /// It follows.
    Enabled,
    /// It stopped quickly.
    QuickStop,
    /// It stops because of a fault.
    FaultReaction,
    /// It has a fault.
    Fault,
}

impl DriveState {
    /// The state that a statusword says.
    ///
    /// ```
    /// use driver_cia402::DriveState;
    ///
    /// assert_eq!(DriveState::of(0x1637), DriveState::Enabled);
    /// assert_eq!(DriveState::of(0x0218), DriveState::Fault);
    /// ```
    pub fn of(status: u16) -> Self {
        match status & 0x6F {
            0x21 => return Self::ReadyToSwitchOn,
            0x23 => return Self::SwitchedOn,
            0x27 => return Self::Enabled,
            0x07 => return Self::QuickStop,
            _ => {}
        }
        match status & 0x4F {
            0x40 => Self::SwitchOnDisabled,
            0x0F => Self::FaultReaction,
            0x08 => Self::Fault,
            _ => Self::NotReady,
        }
    }

    /// The state in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::NotReady => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::Enabled => "operation enabled",
            Self::QuickStop => "quick stop active",
            Self::FaultReaction => "fault reaction active",
            Self::Fault => "fault",
        }
    }
}

/// The controlword (0x6040) that brings a drive one step nearer to operation enabled, or, without
/// `enable`, to switch on disabled. A fault is cleared by a rising edge of `reset`.
///
/// # Source
/// CiA 402-2, transitions of the state machine: 2 to 4 and 8 to 12, 15.
pub fn control_word(state: DriveState, enable: bool, reset: bool) -> u16 {
    match (state, enable) {
        (DriveState::Fault, true) if reset => 0x80,
        (DriveState::SwitchOnDisabled, true) => 0x06,
        (DriveState::ReadyToSwitchOn, true) => 0x07,
        (DriveState::SwitchedOn | DriveState::Enabled, true) => 0x0F,
        (DriveState::Enabled, false) => 0x07,
        (DriveState::SwitchedOn, false) => 0x06,
        _ => 0x00,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of all 65536 statuswords none is read as another state than the profile's table says.
    #[test]
    fn each_statusword_is_one_state() {
        let table = [
            (0x4F, 0x00, DriveState::NotReady),
            (0x4F, 0x40, DriveState::SwitchOnDisabled),
            (0x6F, 0x21, DriveState::ReadyToSwitchOn),
            (0x6F, 0x23, DriveState::SwitchedOn),
            (0x6F, 0x27, DriveState::Enabled),
            (0x6F, 0x07, DriveState::QuickStop),
            (0x4F, 0x0F, DriveState::FaultReaction),
            (0x4F, 0x08, DriveState::Fault),
        ];
        for status in 0..=u16::MAX {
            let mut found = table
                .iter()
                .filter(|(mask, value, _)| status & mask == *value);
            let wanted = found.next().map_or(DriveState::NotReady, |row| row.2);
            assert_eq!(found.next(), None, "{status:#06x}");
            assert_eq!(DriveState::of(status), wanted, "{status:#06x}");
        }
    }

    /// Only an enabled drive, or one that is switched on, is told to follow; and never without a wish.
    #[test]
    fn nothing_is_enabled_without_a_wish() {
        for status in 0..=u16::MAX {
            let state = DriveState::of(status);
            for reset in [false, true] {
                let off = control_word(state, false, reset);
                assert!(off & 0x0F != 0x0F && off & 0x80 == 0, "{state:?}");
                let on = control_word(state, true, reset);
                let follows = matches!(state, DriveState::SwitchedOn | DriveState::Enabled);
                assert_eq!(on & 0x0F == 0x0F, follows, "{state:?}");
            }
        }
    }
}

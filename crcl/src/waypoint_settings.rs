//! What the settings of a single pose are as commands.

use crate::argument::ArgumentKind as Kind;
use crate::command::Command;
use crate::pose_and_set::PoseAndSet;
use crate::value::ValueError;

/// What the value of a setting is, and the command that sets it for all moves.
struct Setting {
    kind: Kind,
    command: fn(f64) -> Command,
}

/// All settings, in the order of [`PoseAndSet::NAMES`].
const SETTINGS: [Setting; 10] = {
    const fn setting(kind: Kind, command: fn(f64) -> Command) -> Setting {
        Setting { kind, command }
    }
    use Command as C;
    [
        setting(Kind::Speed, |value| C::SetAbsoluteSpeed { value }),
        setting(Kind::Percent, |percent| C::SetRelativeSpeed { percent }),
        setting(Kind::Acceleration, |value| C::SetAbsoluteAcceleration {
            value,
        }),
        setting(Kind::Percent, |percent| C::SetRelativeAcceleration {
            percent,
        }),
        setting(Kind::AngularSpeed, |value| C::SetAbsoluteRotSpeed { value }),
        setting(Kind::Percent, |percent| C::SetRelativeRotSpeed { percent }),
        setting(Kind::AngularAcceleration, |value| C::SetAbsoluteRotAccel {
            value,
        }),
        setting(Kind::Percent, |percent| C::SetRelativeRotAccel { percent }),
        setting(Kind::LengthTolerance, |tolerance| {
            C::SetIntermediatePointTolerance { tolerance }
        }),
        setting(Kind::AngleTolerance, |tolerance| {
            C::SetIntermediateAngleTolerance { tolerance }
        }),
    ]
};

impl PoseAndSet {
    /// The commands that would set the same for all later moves.
    pub fn settings(&self) -> Vec<Command> {
        let all = SETTINGS.iter().zip(self.values());
        let told = all.filter_map(|(setting, value)| value.map(|value| (setting.command)(value)));
        told.collect()
    }

    /// Checks the settings that can be judged without robot; the pose judges itself.
    pub(crate) fn check_settings(&self) -> Result<(), ValueError> {
        for (setting, value) in SETTINGS.iter().zip(self.values()) {
            if let Some(value) = value {
                setting.kind.check(value)?;
            }
        }
        Ok(())
    }
}

//! When a command is done: the measured arm has arrived, from `robot.toml`.

use serde::Deserialize;
use toml::Spanned;

use super::error::RobotError;
use super::files::Files;

/// When a command is done: the measured arm is where the command ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// How far each joint may be from the end (rad, m).
    pub tolerance: f64,
    /// After this time (s) the command is done with a warning that names the joint.
    pub patience: f64,
}

impl Default for Arrival {
    /// A milliradian, half a second.
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            patience: 0.5,
        }
    }
}

/// The table `[arrival]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Given {
    tolerance_rad_or_m: Option<Spanned<f64>>,
    patience_s: Option<Spanned<f64>>,
}

impl Files<'_> {
    /// What is given, and the usual values where nothing is.
    pub(super) fn arrival(&self, given: Option<&Given>) -> Result<Arrival, RobotError> {
        let usual = Arrival::default();
        let Some(given) = given else {
            return Ok(usual);
        };
        let tolerance = given.tolerance_rad_or_m.as_ref();
        let patience = given.patience_s.as_ref();
        Ok(Arrival {
            tolerance: tolerance.map_or(Ok(usual.tolerance), |value| {
                self.positive("arrival.tolerance_rad_or_m", value)
            })?,
            patience: patience.map_or(Ok(usual.patience), |value| {
                self.time("arrival.patience_s", value)
            })?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::load;

    /// The folder of a shipped robot with more lines in its `robot.toml`.
    fn with(lines: &str) -> Result<Arrival, String> {
        let shipped = load("ur5e").map_err(|error| error.to_string())?;
        let files = Files {
            name: "ur5e",
            place: std::path::Path::new("robots/ur5e"),
            urdf: &shipped.urdf,
            toml: &format!("{}\n{lines}", shipped.toml),
        };
        let robot = files.read().map_err(|error| error.to_string())?;
        Ok(robot.arrival)
    }

    #[test]
    fn arrival_is_read_and_checked() {
        assert_eq!(with(""), Ok(Arrival::default()));
        let given = with("[arrival]\ntolerance_rad_or_m = 0.004");
        let wanted = Arrival {
            tolerance: 0.004,
            ..Arrival::default()
        };
        assert_eq!(given, Ok(wanted));
        for wrong in [
            "tolerance_rad_or_m = 0.0",
            "patience_s = -1.0",
            "patience = 1",
        ] {
            let said = with(&format!("[arrival]\n{wrong}"));
            assert!(
                said.is_err_and(|said| said.contains("robot.toml")),
                "{wrong}"
            );
        }
    }
}

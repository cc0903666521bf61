//! Speed, acceleration and tolerances in force.

use crate::command_error::CommandError;
use crcl::Command;
use serde::Serialize;
use trajectory::ToolLimits;

/// Fraction of the maxima that applies before a program sets another.
///
/// # Source
/// NIST's KittingViewer (2013) starts at 10 % of both.
const START: f64 = 0.1;

/// Values that commands set, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Cruise speed of the controlled point, m/s.
    pub speed: f64,
    /// Acceleration of the controlled point, m/s2.
    pub acceleration: f64,
    /// Tolerance for intermediate poses, m.
    pub intermediate_point: f64,
    /// Tolerance for the position at the end of a move, m.
    pub end_point: f64,
    /// Tolerance for the orientation at the end of a move, rad.
    pub end_angle: f64,
}

impl Settings {
    pub(super) fn start(maxima: &ToolLimits) -> Self {
        Self {
            speed: START * maxima.speed,
            acceleration: START * maxima.acceleration,
            intermediate_point: 0.0,
            end_point: 0.0,
            end_angle: 0.0,
        }
    }

    /// Limits of a move under these settings: rotation is allowed the same
    /// fraction of its maxima as translation; jerk is the robot's.
    ///
    /// # Errors
    /// A range error when speed or acceleration are zero.
    pub fn tool_limits(&self, maxima: &ToolLimits) -> Result<ToolLimits, CommandError> {
        positive("speed", self.speed, "SetAbsoluteSpeed or SetRelativeSpeed")?;
        let help = "SetAbsoluteAcceleration or SetRelativeAcceleration";
        positive("acceleration", self.acceleration, help)?;
        Ok(ToolLimits {
            speed: self.speed,
            acceleration: self.acceleration,
            jerk: maxima.jerk,
            angular_speed: maxima.angular_speed * (self.speed / maxima.speed),
            angular_acceleration: maxima.angular_acceleration
                * (self.acceleration / maxima.acceleration),
            angular_jerk: maxima.angular_jerk,
        })
    }

    pub(super) fn set(
        &mut self,
        command: &Command,
        length: f64,
        angle: f64,
        maxima: &ToolLimits,
    ) -> Result<(), CommandError> {
        match command {
            Command::SetAbsoluteSpeed { value } => {
                self.speed = absolute("speed", value * length, maxima.speed, "m/s")?;
            }
            Command::SetAbsoluteAcceleration { value } => {
                let asked = value * length;
                self.acceleration = absolute("acceleration", asked, maxima.acceleration, "m/s2")?;
            }
            Command::SetRelativeSpeed { percent } => {
                self.speed = (percent / 100.0) * maxima.speed;
            }
            Command::SetRelativeAcceleration { percent } => {
                self.acceleration = (percent / 100.0) * maxima.acceleration;
            }
            Command::SetIntermediatePointTolerance { tolerance } => {
                self.intermediate_point = tolerance * length;
            }
            Command::SetEndPointTolerance { tolerance } => {
                self.end_point = tolerance * length;
            }
            Command::SetEndAngleTolerance { tolerance } => {
                self.end_angle = tolerance * angle;
            }
            other => {
                let message = format!("{} is not a setting", other.name());
                return Err(CommandError::sequence(message));
            }
        }
        Ok(())
    }
}

fn positive(what: &str, value: f64, help: &str) -> Result<(), CommandError> {
    if value > 0.0 {
        return Ok(());
    }
    Err(
        CommandError::range(format!("{what} is zero, so the move would never end"))
            .with_help(format!("set it with {help}")),
    )
}

fn absolute(what: &str, value: f64, maximum: f64, unit: &str) -> Result<f64, CommandError> {
    // An excess of one unit in the last place comes from unit conversion.
    if value > maximum * (1.0 + 4.0 * f64::EPSILON) {
        return Err(CommandError::range(format!(
            "{what} must be at most the robot's {maximum} {unit}, got {value} {unit}"
        ))
        .with_help("give a smaller value, or SetRelative... with 100"));
    }
    Ok(value.min(maximum))
}

//! Guards of CRCL's XML in the language, and back.

use super::data::Guard;
use super::refusal::{Refusal, refusal};
use crate::command::Command;
use crate::guard::GuardEnding;
use crate::units::{ForceUnit, TorqueUnit};

/// The parts of a sensor for force and torque.
const FORCES: [&str; 3] = ["Fx", "Fy", "Fz"];
const TORQUES: [&str; 3] = ["Tx", "Ty", "Tz"];

impl Guard {
    /// The guard with its limit in SI units; a limit of a value that is neither a force nor a
    /// torque of a sensor with parts stays as it is, for the sensor's own unit.
    ///
    /// ```
    /// use crcl::xml::{Guard, GuardLimit};
    /// use crcl::{ForceUnit, TorqueUnit};
    /// let guard = Guard::new("wrench", Some("Fz"), GuardLimit::OverMax, 2.0);
    /// let guard = guard.in_si(ForceUnit::Pound, TorqueUnit::NewtonMeter);
    /// assert!((guard.limit - 8.896443230521).abs() < 1e-12);
    /// ```
    pub fn in_si(&self, force: ForceUnit, torque: TorqueUnit) -> Self {
        let field = self.field.as_deref().unwrap_or_default();
        let unit = if FORCES.contains(&field) {
            force.newtons()
        } else if TORQUES.contains(&field) {
            torque.newton_meters()
        } else {
            1.0
        };
        Self {
            limit: self.limit * unit,
            ..self.clone()
        }
    }

    /// The guard in the language; its limit is in SI units already.
    pub(super) fn meaning(&self, occurrence: usize) -> Result<Command, Refusal> {
        let told = |flag: Option<bool>| flag.unwrap_or(false);
        let ending = match (told(self.require_trigger), told(self.error_on_trigger)) {
            (false, false) => GuardEnding::Done,
            (false, true) => GuardEnding::ErrorOnTrigger,
            (true, false) => GuardEnding::RequireTrigger,
            (true, true) => {
                let message = "a guard that must trip and must not trip: the command always fails";
                return Err(Refusal {
                    occurrence,
                    ..refusal("Guard", message)
                });
            }
        };
        let sensor = match &self.field {
            Some(field) => format!("{}.{field}", self.sensor),
            None => self.sensor.clone(),
        };
        Ok(Command::Guard {
            guard: crate::guard::Guard {
                sensor,
                limit: self.kind,
                value: self.limit,
                ending,
            },
        })
    }
}

impl From<&crate::guard::Guard> for Guard {
    /// The guard in XML, in newtons and newton metres.
    fn from(guard: &crate::guard::Guard) -> Self {
        let parted = guard.sensor.rsplit_once('.');
        let parted = parted.filter(|(_, part)| FORCES.contains(part) || TORQUES.contains(part));
        let (sensor, field) = match parted {
            Some((sensor, field)) => (sensor, Some(field)),
            None => (guard.sensor.as_str(), None),
        };
        let told = |ending| (guard.ending == ending).then_some(true);
        Self {
            require_trigger: told(GuardEnding::RequireTrigger),
            error_on_trigger: told(GuardEnding::ErrorOnTrigger),
            ..Self::new(sensor, field, guard.limit, guard.value)
        }
    }
}

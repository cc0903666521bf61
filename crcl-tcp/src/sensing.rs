//! Sensors in a status: what the driver measures, and what became of guards.

use std::collections::BTreeSet;

use crcl::Pose;
use crcl::xml::{Guard, GuardsStatus, SensorStatus, SensorValue};

use crate::si::{ConnectionUnits, axes, short};

/// The parts of a sensor of force and torque, in the order of a status.
const PARTS: [&str; 6] = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"];

/// What the sensors say, SI.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sensors {
    /// Named values; NaN where one is not known now.
    pub(crate) values: Vec<(String, f64)>,
    /// Digital inputs, one bit each.
    pub(crate) digital: u64,
    /// How often the driver has read them.
    pub(crate) count: u64,
    /// When they were read last (ms since 1970).
    pub(crate) read_ms: i64,
}

impl Sensors {
    /// Whether there is a sensor of that name.
    pub(crate) fn has(&self, id: &str) -> bool {
        let part = |name: &str| {
            name.rsplit_once('.')
                .is_some_and(|(sensor, _)| sensor == id)
        };
        let named = |(name, _): &(String, f64)| name == id || part(name);
        self.values.iter().any(named) || input(id).is_some()
    }

    /// The sensors of a status: all that the driver names but those in `disabled`, and the digital
    /// inputs in `enabled`.
    pub(crate) fn statuses(
        &self,
        chosen: &SensorChoice,
        units: &ConnectionUnits,
    ) -> Vec<SensorStatus> {
        let mut found = Vec::new();
        let mut done = BTreeSet::new();
        for (name, value) in &self.values {
            let (id, value) = match self.force_torque(name) {
                Some((id, values)) => (id, force_torque(values, units)),
                None => (name.as_str(), SensorValue::Scalar(short(*value))),
            };
            let known = !matches!(value, SensorValue::Scalar(value) if value.is_nan());
            if known && !chosen.disabled.contains(id) && done.insert(id) {
                found.push(self.status(id, value));
            }
        }
        for id in &chosen.enabled {
            if let Some(bit) = input(id) {
                let on = SensorValue::OnOff(self.digital >> bit & 1 == 1);
                found.push(self.status(id, on));
            }
        }
        found
    }

    fn status(&self, id: &str, value: SensorValue) -> SensorStatus {
        SensorStatus {
            id: id.to_owned(),
            read_count: i32::try_from(self.count & 0x7fff_ffff).unwrap_or(i32::MAX),
            last_read_ms: self.read_ms,
            parameters: Vec::new(),
            value,
        }
    }

    /// The sensor of six parts that a named value is one of, with all its values.
    fn force_torque<'a>(&self, name: &'a str) -> Option<(&'a str, [f64; 6])> {
        let (id, part) = name.rsplit_once('.')?;
        if !PARTS.contains(&part) {
            return None;
        }
        let mut values = [0.0; 6];
        for (place, part) in values.iter_mut().zip(PARTS) {
            let wanted = format!("{id}.{part}");
            let (_, value) = self.values.iter().find(|(name, _)| *name == wanted)?;
            *place = Some(*value).filter(|value| !value.is_nan())?;
        }
        Some((id, values))
    }
}

/// Which sensors a status has.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SensorChoice {
    enabled: BTreeSet<String>,
    disabled: BTreeSet<String>,
}

impl SensorChoice {
    /// Takes a sensor into the status, or out of it.
    ///
    /// # Errors
    /// A sentence about a sensor that the driver does not have.
    pub(crate) fn choose(&mut self, id: &str, on: bool, sensors: &Sensors) -> Result<(), String> {
        if !sensors.has(id) {
            return Err(format!("the driver of this arm has no sensor `{id}`"));
        }
        let (to, from) = if on {
            (&mut self.enabled, &mut self.disabled)
        } else {
            (&mut self.disabled, &mut self.enabled)
        };
        from.remove(id);
        to.insert(id.to_owned());
        Ok(())
    }
}

/// The bit of a digital input.
fn input(id: &str) -> Option<u32> {
    let number = id.strip_prefix("digital_input_")?.parse::<u32>().ok()?;
    (number < u64::BITS).then_some(number)
}

fn force_torque([fx, fy, fz, tx, ty, tz]: [f64; 6], units: &ConnectionUnits) -> SensorValue {
    let force = |value: f64| short(value / units.force.newtons());
    let torque = |value: f64| short(value / units.torque.newton_meters());
    SensorValue::ForceTorque([
        force(fx),
        force(fy),
        force(fz),
        torque(tx),
        torque(ty),
        torque(tz),
    ])
}

/// What became of the guards of the last command, SI.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Guards {
    /// The guards.
    pub(crate) guards: Vec<Guard>,
    /// How often a guard has tripped since the server started.
    pub(crate) count: i32,
    /// The last that tripped.
    pub(crate) last: Option<Tripped>,
}

/// A guard that tripped.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tripped {
    /// Name of the sensor.
    pub(crate) sensor: String,
    /// The value that tripped it.
    pub(crate) value: f64,
    /// How long the stop took (s).
    pub(crate) stop_s: f64,
    /// Where the controlled point was (m), and its orientation w, x, y, z.
    pub(crate) position: [f64; 3],
    pub(crate) orientation: [f64; 4],
    /// All about it in a sentence.
    pub(crate) sentence: String,
}

impl Guards {
    /// What a status says of them.
    pub(crate) fn status(&self, units: &ConnectionUnits) -> GuardsStatus {
        let pose = |tripped: &Tripped| {
            let (x_axis, z_axis) = axes(&tripped.orientation);
            Pose::Axes {
                point: tripped
                    .position
                    .map(|value| short(value / units.length.metres())),
                z_axis: z_axis.map(short),
                x_axis: x_axis.map(short),
            }
        };
        let unit = |tripped: &Tripped| match tripped.sensor.rsplit_once('.') {
            Some((_, "Fx" | "Fy" | "Fz")) => units.force.newtons(),
            Some((_, "Tx" | "Ty" | "Tz")) => units.torque.newton_meters(),
            _ => 1.0,
        };
        let last = self.last.as_ref();
        GuardsStatus {
            guards: self.guards.clone(),
            trigger_count: self.count,
            stop_us: last.map_or(0, |tripped| (tripped.stop_s * 1e6) as i64),
            value: last.map(|tripped| short(tripped.value / unit(tripped))),
            pose: last.map(pose),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensors() -> Sensors {
        let wrench = PARTS.iter().enumerate();
        let wrench = wrench.map(|(at, part)| (format!("w.{part}"), at as f64));
        let mut values: Vec<_> = wrench.collect();
        values.push(("distance".to_owned(), 0.25));
        values.push(("lost".to_owned(), f64::NAN));
        Sensors {
            values,
            digital: 2,
            ..Sensors::default()
        }
    }

    #[test]
    fn parts_are_one_sensor_and_unknown_values_are_left_out() {
        let (sensors, units) = (sensors(), ConnectionUnits::default());
        let mut chosen = SensorChoice::default();
        let found = sensors.statuses(&chosen, &units);
        let ids: Vec<_> = found.iter().map(|sensor| sensor.id.as_str()).collect();
        assert_eq!(ids, ["w", "distance"]);
        let parts = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(found[0].value, SensorValue::ForceTorque(parts));
        chosen.choose("digital_input_1", true, &sensors).unwrap();
        chosen.choose("w", false, &sensors).unwrap();
        let found = sensors.statuses(&chosen, &units);
        assert_eq!(found.len(), 2);
        assert_eq!(found[1].value, SensorValue::OnOff(true));
        assert!(chosen.choose("nothing", true, &sensors).is_err());
    }
}

//! Cyclic messages are written over older ones of the same link: what is the same, and what has no
//! meaning, is not touched.
//!
//! A message is 1 to 1.5 KiB, of which an arm of six joints needs a third. After a period of sleep each
//! line of 64 bytes that a processor reads or writes comes from another cache.

use crate::{MAX_JOINTS, Setpoint, SetpointFlags, State};

/// A message that is sent once per period.
pub(crate) trait Message: Copy {
    /// Makes `place`, which has an older message or zeros, a message of the same meaning.
    fn write_over(&self, place: &mut Self);
}

/// Copies the numbers of `joints` joints.
fn copy(from: &[f64; MAX_JOINTS], place: &mut [f64; MAX_JOINTS], joints: u32) {
    let numbers = place.iter_mut().zip(from).take(joints as usize);
    numbers.for_each(|(place, from)| *place = *from);
}

impl Setpoint {
    /// Makes `place`, which has an older setpoint of the same sender, one of the same meaning: writes only what
    /// is new and has a meaning. Does not allocate.
    pub fn write_over(&self, place: &mut Self) {
        Message::write_over(self, place);
    }
}

impl Message for Setpoint {
    fn write_over(&self, place: &mut Self) {
        if (place.protocol, place.joints) != (self.protocol, self.joints) {
            *place = *self;
            return;
        }
        let same =
            self.revision != 0 && (place.session, place.revision) == (self.session, self.revision);
        place.session = self.session;
        place.sequence = self.sequence;
        place.tick = self.tick;
        place.published_ns = self.published_ns;
        place.tick_ns = self.tick_ns;
        place.state_sequence = self.state_sequence;
        place.period_ns = self.period_ns;
        place.watchdog_ns = self.watchdog_ns;
        place.command = self.command;
        place.flags = self.flags;
        place.valid = self.valid;
        place.revision = self.revision;
        place.path_time = self.path_time;
        place.time_scaling = self.time_scaling;
        place.digital_outputs = self.digital_outputs;
        place.digital_mask = self.digital_mask;
        place.analogue_mask = self.analogue_mask;
        copy(&self.position, &mut place.position, self.joints);
        copy(&self.velocity, &mut place.velocity, self.joints);
        copy(&self.acceleration, &mut place.acceleration, self.joints);
        if self.flags & SetpointFlags::EFFORT != 0 {
            copy(&self.effort, &mut place.effort, self.joints);
        }
        if !same {
            place.tools = self.tools;
            place.analogue_outputs = self.analogue_outputs;
            place.payload = self.payload;
        }
    }
}

impl Message for State {
    fn write_over(&self, place: &mut Self) {
        if (place.protocol, place.joints) != (self.protocol, self.joints) {
            *place = *self;
            return;
        }
        let same =
            self.revision != 0 && (place.session, place.revision) == (self.session, self.revision);
        place.session = self.session;
        place.sequence = self.sequence;
        place.measured_ns = self.measured_ns;
        place.published_ns = self.published_ns;
        place.setpoint_sequence = self.setpoint_sequence;
        place.setpoint_published_ns = self.setpoint_published_ns;
        place.setpoint_received_ns = self.setpoint_received_ns;
        place.driver_state = self.driver_state;
        place.fault = self.fault;
        place.fault_joint = self.fault_joint;
        place.fault_code = self.fault_code;
        place.missed = self.missed;
        place.flags = self.flags;
        place.sensor_count = self.sensor_count;
        place.speed_scaling = self.speed_scaling;
        place.hardware_ns = self.hardware_ns;
        place.digital_inputs = self.digital_inputs;
        place.revision = self.revision;
        copy(&self.position, &mut place.position, self.joints);
        copy(&self.velocity, &mut place.velocity, self.joints);
        copy(&self.effort, &mut place.effort, self.joints);
        copy(&self.commanded, &mut place.commanded, self.joints);
        if !same {
            place.tools = self.tools;
            place.analogue_inputs = self.analogue_inputs;
        }
        let sensors = place.sensors.iter_mut().zip(&self.sensors);
        for (place, sensor) in sensors.take(self.sensor_count as usize) {
            *place = *sensor;
        }
        // A fault without a name has an empty text; without a fault the text has no meaning.
        if self.fault != 0 {
            place.text = self.text;
        }
    }
}

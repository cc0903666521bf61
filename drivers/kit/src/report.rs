//! The state that a driver sends.

use ipc::{Clock, StateFlags};

use crate::{Driver, Measurement, Robot, speed_share};

impl<R: Robot> Driver<R> {
    /// Writes the state at `now_ns`, with the next sequence number, over the last one.
    pub(crate) fn report(&mut self, now_ns: u64) {
        self.sequence += 1;
        let share = self.robot.speed_scaling();
        // A share that is not a number asks for no motion.
        let robot = if share.is_nan() { 0.0 } else { share };
        let speed_scaling = robot.clamp(0.0, speed_share(self.lag()));
        let state = &mut self.reported;
        state.joints = self.about.joints() as u32;
        state.session = self.session.as_ref().map_or(0, |session| session.number);
        state.sequence = self.sequence;
        state.published_ns = now_ns;
        state.setpoint_sequence = self.last.sequence;
        state.setpoint_published_ns = self.last.published_ns;
        state.setpoint_received_ns = self.received_ns;
        state.driver_state = self.state as u32;
        state.fault = self.fault as u32;
        state.fault_joint = self.fault_joint;
        state.fault_code = self.fault_code;
        state.text = self.fault_text;
        state.missed = self.missed;
        state.speed_scaling = speed_scaling;
        self.report_tools();
        self.report_joints(now_ns);
    }

    /// Tools, inputs and sensors, with a new revision where tools or analogue inputs have changed.
    fn report_tools(&mut self) {
        let state = &mut self.reported;
        let mut changed = state.revision == 0;
        for (tool, place) in state.tools.iter_mut().enumerate() {
            let mut feedback = self.robot.tool(tool);
            feedback.order = self.orders[tool];
            if *place != feedback {
                (*place, changed) = (feedback, true);
            }
        }
        let inputs = self.robot.inputs();
        state.digital_inputs = inputs.digital;
        if state.analogue_inputs != inputs.analogue {
            (state.analogue_inputs, changed) = (inputs.analogue, true);
        }
        state.revision += u64::from(changed);
        self.sensors.clear();
        self.robot.sensors(&mut self.sensors);
        state.sensor_count = self.sensors.write(&mut state.sensors);
    }

    /// How far what the robot follows is behind the setpoints, as the time that the last joint needs at its
    /// largest speed (s); 0 in lock-step, where nobody is late.
    fn lag(&self) -> f64 {
        if !self.is_following() || self.clock() != Some(Clock::Wall) {
            return 0.0;
        }
        let pairs = self.references.iter().zip(&self.targets);
        let times = pairs
            .zip(&self.about.velocity)
            .map(|((reference, target), most)| {
                let ahead = target.position - reference.position;
                let towards = if target.velocity == 0.0 {
                    0.0
                } else {
                    target.velocity.signum()
                };
                ahead * towards / most
            });
        times.fold(0.0, f64::max)
    }

    fn report_joints(&mut self, now_ns: u64) {
        let virtual_time = self.clock() == Some(Clock::LockStep);
        let state = &mut self.reported;
        (state.flags, state.measured_ns, state.hardware_ns) = (0, 0, 0);
        for (joint, measured) in self.measured.iter().enumerate() {
            state.position[joint] = measured.position;
            state.velocity[joint] = measured.velocity;
            state.effort[joint] = measured.effort;
            state.commanded[joint] = if self.says_commanded {
                self.commanded[joint]
            } else {
                self.references[joint].position
            };
        }
        if self.says_commanded {
            state.flags |= StateFlags::COMMANDED;
        }
        match self.measurement {
            Measurement::Now => state.measured_ns = now_ns,
            Measurement::At { hardware_ns, .. } if virtual_time => {
                (state.measured_ns, state.hardware_ns) = (now_ns, hardware_ns);
            }
            Measurement::At {
                measured_ns,
                hardware_ns,
            } => (state.measured_ns, state.hardware_ns) = (measured_ns, hardware_ns),
            Measurement::Unknown => state.flags |= StateFlags::UNKNOWN,
        }
    }
}

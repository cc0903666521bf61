//! The simulated robot: servos, gripper, tool changer.

use std::collections::VecDeque;

use driver_kit::{
    About, Command, DriverError, Inputs, Measured, Measurement, Reference, Robot, Sensors,
};
use ipc::{ToolCommand, ToolFeedback};

use crate::Options;
use crate::noise::Noise;
use crate::servo::Servo;
use crate::tool::Tool;
use crate::wall::Touch;

/// The sensors of force and torque at the end of the arm.
const WRENCH: [&str; 6] = [
    "wrench.Fx",
    "wrench.Fy",
    "wrench.Fz",
    "wrench.Tx",
    "wrench.Ty",
    "wrench.Tz",
];

/// A deterministic simulated robot: one servo per joint, a gripper and a tool changer.
#[derive(Clone, Debug)]
pub struct Simulated {
    options: Options,
    servos: Vec<Servo>,
    tools: [Tool; 2],
    noise: Noise,
    /// What the servos follow later, for a delay.
    waiting: VecDeque<Vec<Reference>>,
    /// A period (s) that the servos have not moved yet.
    pending: Option<f64>,
    /// True positions of the joints (rad, m).
    joints: Vec<f64>,
    /// What the wall does to the tool where the joints are.
    touch: Touch,
}

impl Simulated {
    /// A robot at rest.
    ///
    /// # Errors
    /// When the options do not fit together.
    pub fn new(options: Options) -> Result<Self, DriverError> {
        options.check()?;
        Ok(Self {
            servos: options.position.iter().map(|at| Servo::rest(*at)).collect(),
            tools: [Tool::new(options.gripper), Tool::new(options.tool_changer)],
            noise: Noise::new(options.seed),
            waiting: VecDeque::new(),
            pending: None,
            joints: options.position.clone(),
            touch: Touch::default(),
            options,
        })
    }
}

impl Robot for Simulated {
    fn about(&self) -> About {
        let options = &self.options;
        About {
            name: options.name.clone(),
            model: options.model,
            lower: options.lower.clone(),
            upper: options.upper.clone(),
            velocity: options.velocity.clone(),
            acceleration: options.acceleration.clone(),
            jerk: options.jerk.clone(),
            ..About::default()
        }
    }

    fn measure(&mut self, joints: &mut [Measured]) -> Measurement {
        let pending = self.pending.take();
        for (joint, servo) in joints.iter_mut().zip(&mut self.servos) {
            if let Some(period) = pending {
                servo.move_on(period);
            }
            let noise = if self.options.noise > 0.0 {
                self.options.noise * self.noise.next()
            } else {
                0.0
            };
            joint.position = servo.position + noise;
            joint.velocity = servo.velocity;
        }
        if let Some(wall) = &self.options.wall {
            for (at, servo) in self.joints.iter_mut().zip(&self.servos) {
                *at = servo.position;
            }
            self.touch = wall.touch(&self.joints);
        }
        Measurement::Now
    }

    fn follow(&mut self, command: &Command<'_>) {
        let (joints, period) = (command.joints, command.period);
        let control = [
            self.options.frequency.min(0.4 / period),
            self.options.damping,
        ];
        if self.options.delay == 0 {
            for (servo, reference) in self.servos.iter_mut().zip(joints) {
                servo.control(reference, control);
            }
        } else {
            self.waiting.push_back(joints.to_vec());
            if self.waiting.len() > self.options.delay + 1 {
                self.waiting.pop_front();
            }
            // Until the first setpoint arrives, the robot stays there.
            let late = self.waiting.front().map_or(joints, Vec::as_slice);
            for (servo, reference) in self.servos.iter_mut().zip(late) {
                servo.control(reference, control);
            }
        }
        self.pending = Some(period);
        self.tools.iter_mut().for_each(|tool| tool.move_on(period));
    }

    fn act(&mut self, tool: usize, order: &ToolCommand) {
        if let Some(tool) = self.tools.get_mut(tool) {
            tool.act(order);
        }
    }

    fn inputs(&self) -> Inputs {
        Inputs {
            digital: u64::from(self.touch.depth() > 0.0),
            ..Inputs::default()
        }
    }

    fn sensors(&self, sensors: &mut Sensors) {
        if self.options.wall.is_none() {
            return;
        }
        let wrench = self.touch.force.iter().chain(&self.touch.torque);
        for (name, value) in WRENCH.iter().zip(wrench) {
            sensors.push(name, *value);
        }
        sensors.push("force", self.touch.size());
        sensors.push("distance", self.touch.distance);
    }

    fn tool(&self, tool: usize) -> ToolFeedback {
        self.tools.get(tool).map(Tool::feedback).unwrap_or_default()
    }
}

//! Random programs for an arm, with their meaning in SI units.

use crcl::{AngleUnit, Command, LengthUnit, Pose};
use k::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use system_tests::arm::Arm;

use crate::random::Random;

/// What a command means, for the judge.
#[derive(Clone, Debug)]
pub(crate) enum Meaning {
    /// Nothing moves, for so long (s).
    Still(f64),
    Move(Move),
}

/// A move in SI units, in the workstation.
#[derive(Clone, Debug)]
pub(crate) struct Move {
    pub(crate) shape: Shape,
    pub(crate) poses: Vec<Isometry3<f64>>,
    /// Radius of the balls (m), and the largest angle (rad) that was set for passes.
    pub(crate) tolerance: f64,
    pub(crate) angular_tolerance: f64,
    /// Fractions of the largest speed and acceleration that apply.
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Joint,
    Straight,
    Smooth,
}

/// A program: commands with their meaning.
pub(crate) struct Program {
    pub(crate) commands: Vec<Command>,
    pub(crate) meanings: Vec<Meaning>,
}

/// Writes a program.
pub(crate) struct Writer<'a> {
    arm: &'a Arm,
    random: Random,
    /// For the settings of angles, so that programs without them are as before.
    random_angles: Random,
    program: Program,
    length: LengthUnit,
    angle: AngleUnit,
    tolerance: f64,
    angular_tolerance: f64,
    speed: f64,
    acceleration: f64,
    /// The controlled point where the arm should be by then.
    at: Isometry3<f64>,
}

/// Program number `seed` for an arm.
pub(crate) fn program(arm: &Arm, seed: u64) -> Program {
    let mut writer = Writer {
        arm,
        random: Random::new(seed),
        random_angles: Random::new(!seed),
        program: Program {
            commands: Vec::new(),
            meanings: Vec::new(),
        },
        length: LengthUnit::Millimeter,
        angle: AngleUnit::Degree,
        tolerance: 0.0,
        angular_tolerance: f64::INFINITY,
        speed: 0.1,
        acceleration: 0.1,
        at: arm.flange(&arm.home) * arm.flange_from_tool(arm.mounted),
    };
    writer.write();
    writer.program
}

impl Writer<'_> {
    fn still(&mut self, command: Command, seconds: f64) {
        self.program.commands.push(command);
        self.program.meanings.push(Meaning::Still(seconds));
    }

    fn write(&mut self) {
        self.still(Command::InitCanon, 0.0);
        let moves = 2 + self.random.below(4);
        for _ in 0..moves {
            self.settings();
            match self.random.below(8) {
                0 | 1 => self.joint(),
                2 | 3 => self.straight(),
                _ => self.smooth(),
            }
            if self.random.one_in(5) {
                let seconds = self.random.between(0.0, 0.05);
                self.still(Command::Dwell { seconds }, seconds);
            }
        }
        self.still(Command::EndCanon { reason: 0 }, 0.0);
    }

    fn settings(&mut self) {
        if self.random.one_in(3) {
            let length = [LengthUnit::Inch, LengthUnit::Millimeter, LengthUnit::Meter];
            self.length = self.random.pick(&length);
            let unit = self.length;
            self.still(Command::SetLengthUnits { unit }, 0.0);
        }
        if self.random.one_in(3) {
            self.angle = self.random.pick(&[AngleUnit::Degree, AngleUnit::Radian]);
            let unit = self.angle;
            self.still(Command::SetAngleUnits { unit }, 0.0);
        }
        if self.random.one_in(2) {
            self.speed = self.random.pick(&[0.05, 0.2, 0.3092, 0.6, 1.0]);
            let percent = 100.0 * self.speed;
            self.still(Command::SetRelativeSpeed { percent }, 0.0);
        }
        if self.random.one_in(2) {
            self.acceleration = self.random.pick(&[0.03, 0.1, 0.3, 0.7, 1.0]);
            let value = self.acceleration * self.arm.tool_acceleration / self.metres();
            self.still(Command::SetAbsoluteAcceleration { value }, 0.0);
        }
        if self.random.one_in(2) {
            self.tolerance = self.random.pick(&[0.0, 1e-4, 1e-3, 5e-3, 0.02, 0.05]);
            let tolerance = self.tolerance / self.metres();
            self.still(Command::SetIntermediatePointTolerance { tolerance }, 0.0);
        }
        if self.random_angles.one_in(4) {
            self.angular_tolerance = self.random_angles.pick(&[0.005, 0.05, 0.15, 0.3]);
            let tolerance = self.angular_tolerance / self.radian();
            self.still(Command::SetIntermediateAngleTolerance { tolerance }, 0.0);
        }
    }

    /// Somewhere within the joint limits, round home.
    fn joint(&mut self) {
        let part = self.random.pick(&[0.05, 0.2, 0.5]);
        let home = self.arm.home.clone();
        let joints: Vec<f64> = (0..home.len())
            .map(|joint| {
                let [lower, upper, _] = self.arm.joints[joint];
                let (lower, upper) = (lower.max(-3.2), upper.min(3.2));
                let value = home[joint] + part * self.random.between(-1.0, 1.0);
                value.clamp(lower + 1e-3, upper - 1e-3)
            })
            .collect();
        let pose = self.arm.flange(&joints) * self.arm.flange_from_tool(self.arm.mounted);
        self.moved(Shape::Joint, vec![pose]);
    }

    fn straight(&mut self) {
        let at = self.at;
        let pose = self.next(&at);
        self.moved(Shape::Straight, vec![pose]);
    }

    fn smooth(&mut self) {
        let count = 1 + self.random.pick(&[0, 1, 2, 3, 5, 8, 14]);
        let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(count);
        for _ in 0..count {
            let last = *poses.last().unwrap_or(&self.at);
            let pose = match self.random.below(8) {
                // Back to the pose before, or the same pose again.
                0 => {
                    let back = poses.len().checked_sub(2).map(|index| poses[index]);
                    back.unwrap_or(last)
                }
                _ => self.next(&last),
            };
            poses.push(pose);
        }
        self.moved(Shape::Smooth, poses);
    }

    /// A pose near another one: moved, turned, or both.
    fn next(&mut self, from: &Isometry3<f64>) -> Isometry3<f64> {
        let size = self.random.pick(&[0.002, 0.02, 0.06, 0.15]);
        let (way, turn) = match self.random.below(6) {
            0 => (Vector3::zeros(), self.random.vector(0.4)),
            1 | 2 => (self.random.vector(size), Vector3::zeros()),
            _ => (self.random.vector(size), self.random.vector(3.0 * size)),
        };
        let point = from.translation.vector + way;
        let rotation = UnitQuaternion::from_scaled_axis(turn) * from.rotation;
        Isometry3::from_parts(point.into(), rotation)
    }

    fn moved(&mut self, shape: Shape, poses: Vec<Isometry3<f64>>) {
        let written: Vec<Pose> = poses.iter().map(|pose| self.written(pose)).collect();
        self.at = poses[poses.len() - 1];
        self.program.commands.push(match shape {
            Shape::Joint => Command::MoveTo { pose: written[0] },
            Shape::Straight => Command::MoveStraightTo { pose: written[0] },
            Shape::Smooth => Command::MoveSmoothlyTo { poses: written },
        });
        self.program.meanings.push(Meaning::Move(Move {
            shape,
            poses,
            tolerance: self.tolerance,
            angular_tolerance: self.angular_tolerance,
            speed: self.speed,
            acceleration: self.acceleration,
        }));
    }

    fn written(&mut self, pose: &Isometry3<f64>) -> Pose {
        let point = (pose.translation.vector / self.metres()).into();
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        let unit = self.radian();
        if self.random.one_in(3) {
            return Pose::RollPitchYaw {
                point,
                roll: roll / unit,
                pitch: pitch / unit,
                yaw: yaw / unit,
            };
        }
        Pose::Axes {
            point,
            z_axis: (pose.rotation * Vector3::z()).into(),
            x_axis: (pose.rotation * Vector3::x() * 2.0).into(),
        }
    }

    /// The unit of angles in rad.
    fn radian(&self) -> f64 {
        match self.angle {
            AngleUnit::Degree => 1f64.to_radians(),
            AngleUnit::Radian => 1.0,
        }
    }

    fn metres(&self) -> f64 {
        match self.length {
            LengthUnit::Inch => 0.0254,
            LengthUnit::Meter => 1.0,
            LengthUnit::Millimeter => 1e-3,
        }
    }
}

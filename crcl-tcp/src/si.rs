//! Turns what a connection writes in its own units into metres and radians, and back.

use crcl::xml::{
    ActuateJoint, JointDetails, MoveScrew, PoseSettings, PoseTolerance, Quantity, Waypoint,
    XmlCommand,
};
use crcl::{AngleUnit, Command, ForceUnit, LengthUnit, Pose, TorqueUnit};

/// The units of a connection that has not set its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Units {
    /// Unit of lengths. Default: millimetre, as NIST's clients expect.
    pub length: LengthUnit,
    /// Unit of angles. Default: degree, as NIST's clients expect.
    pub angle: AngleUnit,
}

impl Units {
    pub(crate) fn of_connection(self) -> ConnectionUnits {
        ConnectionUnits {
            length: self.length,
            angle: self.angle,
            ..ConnectionUnits::default()
        }
    }
}

/// The units of a connection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ConnectionUnits {
    pub(crate) length: LengthUnit,
    pub(crate) angle: AngleUnit,
    pub(crate) force: ForceUnit,
    pub(crate) torque: TorqueUnit,
}

impl ConnectionUnits {
    fn metres(&self, value: f64) -> f64 {
        value * self.length.metres()
    }

    fn radians(&self, value: f64) -> f64 {
        value * self.angle.radians()
    }

    /// A command in metres and radians. `sliding` says of each joint whether it slides.
    pub(crate) fn to_si(self, command: &XmlCommand, sliding: &[bool]) -> XmlCommand {
        let linear = |quantity: &Quantity| self.quantity(*quantity, false);
        let angular = |quantity: &Quantity| self.quantity(*quantity, true);
        match command {
            XmlCommand::MoveTo { straight, end } => XmlCommand::MoveTo {
                straight: *straight,
                end: self.waypoint(end),
            },
            XmlCommand::MoveThroughTo {
                straight,
                waypoints,
            } => XmlCommand::MoveThroughTo {
                straight: *straight,
                waypoints: waypoints.iter().map(|each| self.waypoint(each)).collect(),
            },
            XmlCommand::MoveScrew(screw) => XmlCommand::MoveScrew(MoveScrew {
                start: screw.start.map(|start| self.waypoint(&start)),
                axis_point: screw
                    .axis_point
                    .map(|point| point.map(|value| self.metres(value))),
                free: screw.free.map(|value| self.metres(value)),
                advance: self.metres(screw.advance),
                turn: self.radians(screw.turn),
            }),
            XmlCommand::ActuateJoints { joints, tolerances } => XmlCommand::ActuateJoints {
                joints: joints
                    .iter()
                    .map(|joint| self.actuate_joint(joint, sliding))
                    .collect(),
                tolerances: tolerances.clone(),
            },
            XmlCommand::SetTransSpeed(quantity) => XmlCommand::SetTransSpeed(linear(quantity)),
            XmlCommand::SetTransAccel(quantity) => XmlCommand::SetTransAccel(linear(quantity)),
            XmlCommand::SetRotSpeed(quantity) => XmlCommand::SetRotSpeed(angular(quantity)),
            XmlCommand::SetRotAccel(quantity) => XmlCommand::SetRotAccel(angular(quantity)),
            XmlCommand::SetEndPoseTolerance(tolerance) => {
                XmlCommand::SetEndPoseTolerance(self.tolerance(tolerance))
            }
            XmlCommand::SetIntermediatePoseTolerance(tolerance) => {
                XmlCommand::SetIntermediatePoseTolerance(self.tolerance(tolerance))
            }
            other => other.clone(),
        }
    }

    /// Commands whose numbers are in units of the connection, for an engine that reads metres and
    /// radians before and after them.
    pub(crate) fn around(self, commands: Vec<Command>) -> Vec<Command> {
        let units = |length, angle| {
            [
                Command::SetLengthUnits { unit: length },
                Command::SetAngleUnits { unit: angle },
            ]
        };
        let before = units(self.length, self.angle).into_iter();
        let after = units(LengthUnit::Meter, AngleUnit::Radian);
        before.chain(commands).chain(after).collect()
    }

    fn quantity(self, quantity: Quantity, angular: bool) -> Quantity {
        match quantity {
            Quantity::Absolute(value) if angular => Quantity::Absolute(self.radians(value)),
            Quantity::Absolute(value) => Quantity::Absolute(self.metres(value)),
            share @ Quantity::Relative(_) => share,
        }
    }

    fn tolerance(self, tolerance: &PoseTolerance) -> PoseTolerance {
        let length = |value: Option<f64>| value.map(|value| self.metres(value));
        let angle = |value: Option<f64>| value.map(|value| self.radians(value));
        PoseTolerance {
            x: length(tolerance.x),
            y: length(tolerance.y),
            z: length(tolerance.z),
            x_axis: angle(tolerance.x_axis),
            z_axis: angle(tolerance.z_axis),
        }
    }

    fn waypoint(self, waypoint: &Waypoint) -> Waypoint {
        let pose = match waypoint.pose {
            Pose::Axes {
                point,
                z_axis,
                x_axis,
            } => Pose::Axes {
                point: point.map(|value| self.metres(value)),
                z_axis,
                x_axis,
            },
            Pose::RollPitchYaw {
                point,
                roll,
                pitch,
                yaw,
            } => Pose::RollPitchYaw {
                point: point.map(|value| self.metres(value)),
                roll: self.radians(roll),
                pitch: self.radians(pitch),
                yaw: self.radians(yaw),
            },
        };
        let settings = waypoint.settings.map(|settings| PoseSettings {
            coordinated: settings.coordinated,
            trans_speed: settings.trans_speed.map(|each| self.quantity(each, false)),
            rot_speed: settings.rot_speed.map(|each| self.quantity(each, true)),
            trans_accel: settings.trans_accel.map(|each| self.quantity(each, false)),
            rot_accel: settings.rot_accel.map(|each| self.quantity(each, true)),
            tolerance: settings.tolerance.map(|each| self.tolerance(&each)),
        });
        Waypoint { pose, settings }
    }

    fn actuate_joint(self, joint: &ActuateJoint, sliding: &[bool]) -> ActuateJoint {
        let index = usize::try_from(joint.joint)
            .ok()
            .and_then(|n| n.checked_sub(1));
        let slides = index.and_then(|index| sliding.get(index).copied());
        let convert = |value: f64| value * self.joint_unit(slides.unwrap_or(false));
        ActuateJoint {
            joint: joint.joint,
            position: convert(joint.position),
            details: match joint.details {
                JointDetails::SpeedAccel { speed, accel } => JointDetails::SpeedAccel {
                    speed: speed.map(convert),
                    accel: accel.map(convert),
                },
                force => force,
            },
        }
    }

    /// How many rad or m one unit of a joint is.
    pub(crate) fn joint_unit(self, slides: bool) -> f64 {
        if slides {
            self.length.metres()
        } else {
            self.angle.radians()
        }
    }
}

/// A number with nine digits after the point: a picometre, and no exponent.
pub(crate) fn short(value: f64) -> f64 {
    if value.abs() < 1e6 {
        (value * 1e9).round() / 1e9
    } else {
        value
    }
}

/// The X axis and the Z axis of an orientation w, x, y, z.
pub(crate) fn axes(q: &[f64; 4]) -> ([f64; 3], [f64; 3]) {
    let [w, x, y, z] = *q;
    let x_axis = [
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
    ];
    let z_axis = [
        2.0 * (x * z + w * y),
        2.0 * (y * z - w * x),
        1.0 - 2.0 * (x * x + y * y),
    ];
    (x_axis, z_axis)
}

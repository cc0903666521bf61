//! The checker's own forward kinematics, from the joints of the URDF.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::robot::{JointLimits, Robot};

/// Joints, frames and limits of an arm with its base in the workstation.
pub(super) struct Arm<'a> {
    workstation_from_base: Isometry3<f64>,
    joints: Vec<Joint>,
    last_from_flange: Isometry3<f64>,
    /// Limits of the joints.
    pub limits: &'a JointLimits,
}

struct Joint {
    frame: Isometry3<f64>,
    axis: Vector3<f64>,
    slides: bool,
    /// Most that it slides, m; 0 for turning joints.
    travel: f64,
}

/// Controlled point and tool at one time, in the workstation: SI units.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToolState {
    pub pose: Isometry3<f64>,
    pub velocity: Vector3<f64>,
    pub acceleration: Vector3<f64>,
    pub angular_velocity: Vector3<f64>,
    pub angular_acceleration: Vector3<f64>,
}

impl ToolState {
    pub(super) fn point(&self) -> Vector3<f64> {
        self.pose.translation.vector
    }
}

impl<'a> Arm<'a> {
    pub(super) fn new(robot: &'a Robot) -> Self {
        let model = &robot.model;
        let limits = &robot.joints;
        let joint = |index: usize| {
            let slides = model.joints[index].kind == kinematics::urdf::JointKind::Prismatic;
            let (lower, upper) = (limits.lower[index], limits.upper[index]);
            Joint {
                frame: model.frames[index],
                axis: model.axes[index].into_inner(),
                slides,
                travel: if slides {
                    lower.abs().max(upper.abs())
                } else {
                    0.0
                },
            }
        };
        Self {
            workstation_from_base: robot.workstation_from_base,
            joints: (0..model.dof()).map(joint).collect(),
            last_from_flange: model.last_from_flange,
            limits,
        }
    }

    pub(super) fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Unit of a joint's position.
    pub(super) fn unit(&self, joint: usize) -> [&'static str; 4] {
        if self.joints[joint].slides {
            ["m", "m/s", "m/s2", "m/s3"]
        } else {
            ["rad", "rad/s", "rad/s2", "rad/s3"]
        }
    }

    /// Pose of the flange in the workstation.
    pub(super) fn flange(&self, q: &[f64]) -> Isometry3<f64> {
        let mut pose = self.workstation_from_base;
        for (joint, &value) in self.joints.iter().zip(q) {
            pose *= joint.frame;
            pose *= joint.motion(value);
        }
        pose * self.last_from_flange
    }

    /// State of the tool from joint positions, velocities and accelerations: velocities and
    /// accelerations are carried from link to link.
    ///
    /// # Source
    /// J. Luh, M. Walker, R. Paul, "On-line computational scheme for mechanical manipulators",
    /// ASME J. Dynamic Systems 102, 1980: the outward recursion.
    pub(super) fn tool(
        &self,
        columns: [&[f64]; 3],
        flange_from_tool: &Isometry3<f64>,
    ) -> ToolState {
        let [q, dq, ddq] = columns;
        let zero = Vector3::zeros();
        let mut state = ToolState {
            pose: self.workstation_from_base,
            velocity: zero,
            acceleration: zero,
            angular_velocity: zero,
            angular_acceleration: zero,
        };
        for (index, joint) in self.joints.iter().enumerate() {
            state = state.carried(&joint.frame);
            let axis = state.pose.rotation * joint.axis;
            let spin = state.angular_velocity;
            if joint.slides {
                state = state.carried(&joint.motion(q[index]));
                state.velocity += axis * dq[index];
                state.acceleration += axis * ddq[index] + spin.cross(&axis) * (2.0 * dq[index]);
            } else {
                state.pose *= joint.motion(q[index]);
                state.angular_velocity += axis * dq[index];
                state.angular_acceleration += axis * ddq[index] + spin.cross(&axis) * dq[index];
            }
        }
        state.carried(&(self.last_from_flange * flange_from_tool))
    }

    /// Largest distance of the controlled point per radian or metre of each joint, m.
    pub(super) fn levers(&self, flange_from_tool: &Isometry3<f64>) -> Vec<f64> {
        let end = self.last_from_flange * flange_from_tool;
        let mut beyond = end.translation.vector.norm();
        let mut levers: Vec<f64> = Vec::with_capacity(self.dof());
        for joint in self.joints.iter().rev() {
            beyond += joint.travel;
            levers.push(if joint.slides { 1.0 } else { beyond });
            beyond += joint.frame.translation.vector.norm();
        }
        levers.reverse();
        levers
    }

    /// Largest distance (m) and rotation (rad) of the controlled point if each joint moves by at
    /// most its entry in `by`.
    pub(super) fn spread(&self, levers: &[f64], by: impl Fn(usize) -> f64) -> (f64, f64) {
        let (mut way, mut turn) = (0.0, 0.0);
        for (index, joint) in self.joints.iter().enumerate() {
            way += levers[index] * by(index);
            turn += if joint.slides { 0.0 } else { by(index) };
        }
        (way, turn)
    }
}

impl Joint {
    fn motion(&self, value: f64) -> Isometry3<f64> {
        if self.slides {
            Translation3::from(self.axis * value).into()
        } else {
            let turn = UnitQuaternion::from_scaled_axis(self.axis * value);
            Isometry3::from_parts(Translation3::identity(), turn)
        }
    }
}

impl ToolState {
    /// The state of a frame that is fixed to this one.
    fn carried(&self, to: &Isometry3<f64>) -> Self {
        let lever = self.pose.rotation * to.translation.vector;
        let spin = self.angular_velocity;
        Self {
            pose: self.pose * to,
            velocity: self.velocity + spin.cross(&lever),
            acceleration: self.acceleration
                + self.angular_acceleration.cross(&lever)
                + spin.cross(&spin.cross(&lever)),
            ..*self
        }
    }
}

/// Angle between two orientations, rad; accurate near zero.
pub(super) fn angle_between(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    let between = a.inverse() * b;
    2.0 * between.imag().norm().atan2(between.w.abs())
}

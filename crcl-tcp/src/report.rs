//! The status that a connection is sent: what it has chosen, in its units.

use std::collections::BTreeMap;

use crcl::Pose;
use crcl::xml::{
    CommandStatus, GripperState, GripperStatus, JointReport, JointStatus, PoseStatus,
    PoseTolerance, SettingsStatus, Status, StatusParts, write_status,
};

use crate::cell::{Last, Picture};
use crate::parameters::Parameters;
use crate::sensing::{Guards, SensorChoice};
use crate::si::{ConnectionUnits, axes, short};

/// The longest status (bytes): NIST's C++ client takes what one call of `recv` gives it for a
/// document, and its buffer has 4096.
const LONGEST: usize = 4094;

/// The longest text of a status (characters).
const LONGEST_TEXT: usize = 400;

/// What a connection has chosen.
#[derive(Clone, Debug)]
pub(crate) struct Choice {
    pub(crate) units: ConnectionUnits,
    pub(crate) parts: StatusParts,
    /// What is reported of each joint; the position of all until something is chosen.
    pub(crate) joints: Option<BTreeMap<i32, JointReport>>,
    /// Which sensors a status has.
    pub(crate) sensors: SensorChoice,
}

impl Choice {
    /// Before anything is chosen: clients want joints and pose from the first status on.
    pub(crate) fn new(units: ConnectionUnits) -> Self {
        Self {
            units,
            parts: StatusParts {
                joints: true,
                pose: true,
                ..StatusParts::default()
            },
            joints: None,
            sensors: SensorChoice::default(),
        }
    }

    /// Chooses what is reported of joints; `count` is how many the arm has.
    ///
    /// # Errors
    /// A sentence about a joint that the arm does not have.
    pub(crate) fn choose_joints(
        &mut self,
        reset_all: bool,
        reports: &[JointReport],
        count: usize,
    ) -> Result<(), String> {
        let last = i32::try_from(count).unwrap_or(i32::MAX);
        if let Some(wrong) = reports.iter().find(|r| !(1..=last).contains(&r.joint)) {
            return Err(format!(
                "there is no joint {}; the arm has joints 1 to {count}",
                wrong.joint
            ));
        }
        let mut joints = match self.joints.take() {
            _ if reset_all => BTreeMap::new(),
            Some(joints) => joints,
            None => (1..=last).map(|joint| (joint, position(joint))).collect(),
        };
        joints.extend(reports.iter().map(|report| (report.joint, *report)));
        self.joints = Some(joints);
        Ok(())
    }

    /// The text of a status.
    pub(crate) fn write(
        &self,
        last: &Last,
        number: i64,
        picture: &Picture,
        (parameters, guards): (&Parameters, &Guards),
    ) -> String {
        let mut status = Status {
            command: command(last, number),
            joints: self.joints(picture),
            pose: self.parts.pose.then(|| self.pose(picture)),
            gripper: self.gripper(picture),
            settings: self.parts.settings.then(|| SettingsStatus {
                robot_parameters: parameters.robot.clone(),
                end_effector_parameters: parameters.end_effector.clone(),
                ..self.settings(picture)
            }),
            sensors: match self.parts.sensors {
                true => picture.sensors.statuses(&self.sensors, &self.units),
                false => Vec::new(),
            },
            guards: self.parts.guards.then(|| guards.status(&self.units)),
            ..Status::default()
        };
        let mut text = write_status(&status);
        if text.len() > LONGEST
            && let Some(settings) = &mut status.settings
        {
            settings.robot_parameters.clear();
            settings.end_effector_parameters.clear();
            text = write_status(&status);
        }
        if text.len() > LONGEST {
            status.sensors.truncate(4);
            text = write_status(&status);
        }
        if text.len() > LONGEST {
            status.settings = None;
            text = write_status(&status);
        }
        if text.len() > LONGEST {
            status.joints.truncate(8);
            status.sensors.clear();
            status.command.description = status.command.description.map(|text| cut(&text, 80));
            text = write_status(&status);
        }
        text
    }

    fn joints(&self, picture: &Picture) -> Vec<JointStatus> {
        if !self.parts.joints {
            return Vec::new();
        }
        let one = |(index, value): (usize, &f64)| {
            let joint = i32::try_from(index).ok()? + 1;
            let report = match &self.joints {
                Some(joints) => *joints.get(&joint)?,
                None => position(joint),
            };
            if !(report.position || report.velocity || report.effort) {
                return None;
            }
            let slides = picture.sliding.get(index).copied().unwrap_or(false);
            let unit = self.units.joint_unit(slides);
            let velocity = picture.velocities.get(index).copied().unwrap_or(0.0);
            let effort = picture.efforts.get(index).copied().unwrap_or(0.0);
            Some(JointStatus {
                joint,
                position: report.position.then(|| short(value / unit)),
                effort: report.effort.then(|| short(effort)),
                velocity: report.velocity.then(|| short(velocity / unit)),
            })
        };
        picture.joints.iter().enumerate().filter_map(one).collect()
    }

    fn pose(&self, picture: &Picture) -> PoseStatus {
        let metres = self.units.length.metres();
        let (x_axis, z_axis) = axes(&picture.orientation);
        PoseStatus {
            pose: Pose::Axes {
                point: picture.position.map(|value| short(value / metres)),
                z_axis: z_axis.map(short),
                x_axis: x_axis.map(short),
            },
            twist: None,
            wrench: None,
            configuration: None,
        }
    }

    fn gripper(&self, picture: &Picture) -> Option<GripperStatus> {
        let opening = picture.gripper.filter(|_| self.parts.gripper)?;
        Some(GripperStatus {
            name: "gripper".to_owned(),
            options: Vec::new(),
            // NIST's client of 2021 needs the element; nothing is known of an object.
            holding: Some(false),
            state: GripperState::Parallel {
                separation: short(opening / self.units.length.metres()),
            },
        })
    }

    /// The settings that every version of the schema since 2016 knows under the same name.
    fn settings(&self, picture: &Picture) -> SettingsStatus {
        let length = |value: f64| Some(short(value / self.units.length.metres()));
        let ball = length(picture.settings.intermediate_point);
        SettingsStatus {
            angle_unit: Some(self.units.angle),
            force_unit: Some(self.units.force),
            length_unit: Some(self.units.length),
            torque_unit: Some(self.units.torque),
            coordinated: Some(true),
            intermediate_tolerance: Some(PoseTolerance {
                x: ball,
                y: ball,
                z: ball,
                ..PoseTolerance::default()
            }),
            trans_accel: length(picture.settings.acceleration),
            trans_speed: length(picture.settings.speed),
            ..SettingsStatus::default()
        }
    }
}

fn position(joint: i32) -> JointReport {
    JointReport {
        joint,
        position: true,
        effort: false,
        velocity: false,
    }
}

fn command(last: &Last, number: i64) -> CommandStatus {
    let mut place = last.place.clone();
    place.file = place.file.map(|file| cut(&file, 200));
    CommandStatus {
        name: last.name.as_deref().map(|name| cut(name, 100)),
        command: last.id,
        status: number,
        state: last.state,
        description: last
            .description
            .as_deref()
            .map(|text| cut(text, LONGEST_TEXT)),
        place,
        override_percent: None,
    }
}

fn cut(text: &str, most: usize) -> String {
    text.chars().take(most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crcl::xml::{CommandState, Parameter, XmlCommand, read_status};

    fn picture(joints: usize) -> Picture {
        Picture {
            joints: vec![1.0 / 3.0; joints],
            velocities: vec![-1.0 / 7.0; joints],
            efforts: vec![-1.0 / 7.0; joints],
            sliding: vec![false; joints],
            position: [1.0 / 3.0, -1.0 / 7.0, 1e-13],
            orientation: [0.0, 1.0, 0.0, 0.0],
            gripper: Some(0.085),
            ..Picture::default()
        }
    }

    #[test]
    fn every_status_fits_into_one_read() {
        let last = Last {
            id: i64::MIN,
            name: Some("<".repeat(5000)),
            description: Some("&".repeat(5000)),
            state: CommandState::Error,
            ..Last::default()
        };
        let mut parameters = Parameters::default();
        for number in 0..16 {
            let parameter = Parameter {
                name: format!("n{number}"),
                value: "&".repeat(64),
            };
            let set = XmlCommand::SetRobotParameters(vec![parameter]);
            assert_eq!(parameters.set(&set), Some(Ok(())));
        }
        for joints in [0, 1, 6, 7, 16] {
            let mut choice = Choice::new(ConnectionUnits::default());
            let all = |joint| JointReport {
                joint,
                position: true,
                effort: true,
                velocity: true,
            };
            let reports: Vec<_> = (1..=joints).map(all).collect();
            choice
                .choose_joints(true, &reports, joints as usize)
                .unwrap();
            choice.parts = StatusParts {
                joints: true,
                pose: true,
                gripper: true,
                settings: true,
                sensors: true,
                guards: true,
            };
            let text = choice.write(
                &last,
                i64::MAX,
                &picture(joints as usize),
                (&parameters, &Guards::default()),
            );
            assert!(text.len() < 4095, "{} bytes, {joints} joints", text.len());
            read_status(&text).unwrap();
        }
    }

    #[test]
    fn joints_are_reported_as_they_were_chosen() {
        let mut choice = Choice::new(ConnectionUnits::default());
        let arm = picture(6);
        assert_eq!(choice.joints(&arm).len(), 6);
        let velocity = JointReport {
            joint: 2,
            position: false,
            effort: true,
            velocity: true,
        };
        choice.choose_joints(false, &[velocity], 6).unwrap();
        let joints = choice.joints(&arm);
        assert_eq!(joints.len(), 6);
        assert!(joints[1].position.is_none() && joints[1].velocity.is_some());
        choice.choose_joints(true, &[velocity], 6).unwrap();
        assert_eq!(choice.joints(&arm).len(), 1);
        assert!(choice.choose_joints(true, &[position(7)], 6).is_err());
        assert!(choice.choose_joints(true, &[position(0)], 6).is_err());
    }

    #[test]
    fn units_are_those_of_the_connection() {
        let choice = Choice::new(ConnectionUnits {
            length: crcl::LengthUnit::Meter,
            angle: crcl::AngleUnit::Radian,
            ..ConnectionUnits::default()
        });
        let text = choice.write(
            &Last::default(),
            1,
            &picture(1),
            (&Parameters::default(), &Guards::default()),
        );
        let status = read_status(&text).unwrap();
        assert_eq!(status.joints[0].position, Some(0.333333333));
        let Pose::Axes { point, z_axis, .. } = status.pose.unwrap().pose else {
            panic!("axes");
        };
        assert_eq!((point[0], z_axis), (0.333333333, [0.0, 0.0, -1.0]));
    }
}

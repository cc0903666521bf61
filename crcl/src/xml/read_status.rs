//! Reads status documents.

use roxmltree::Node;

use super::elements::{Children, Reader, opening};
use super::read_data::whole;
use super::status::{
    CommandState, CommandStatus, GripperState, GripperStatus, GuardsStatus, JointLimits,
    JointStatus, PoseStatus, ProgramPlace, SensorStatus, SensorValue, SettingsStatus, Status,
};
use crate::code;
use crate::finding::Finding;
use crate::lexer::clip;
use crate::units::{AngleUnit, ForceUnit, LengthUnit, TorqueUnit};

impl Reader<'_> {
    /// A whole status document.
    pub(super) fn status(&mut self, root: Node) -> Option<Status> {
        let (name, mut children) = self.children(root);
        let command = children.wanted(self, "CommandStatus")?;
        let command = self.command_status(command);
        let joints = children
            .maybe("JointStatuses")
            .map(|node| self.joint_statuses(node));
        let pose = children
            .maybe("PoseStatus")
            .map(|node| self.pose_status(node));
        let gripper = children
            .maybe("GripperStatus")
            .map(|node| self.gripper_status(node));
        let settings = children
            .maybe("SettingsStatus")
            .map(|node| self.settings_status(node));
        let sensors = children
            .maybe("SensorStatuses")
            .map(|node| self.sensor_statuses(node));
        let guards = children
            .maybe("GuardsStatuses")
            .map(|node| self.guards_status(node));
        children.end(self)?;
        Some(Status {
            name,
            command: command?,
            joints: whole(joints)?.unwrap_or_default(),
            pose: whole(pose)?,
            gripper: whole(gripper)?,
            settings: whole(settings)?,
            sensors: whole(sensors)?.unwrap_or_default(),
            guards: whole(guards)?,
        })
    }

    fn command_status(&mut self, node: Node) -> Option<CommandStatus> {
        let (name, mut children) = self.children(node);
        let command = children.wanted(self, "CommandID")?;
        let status = children.wanted(self, "StatusID")?;
        let state = children.wanted(self, "CommandState")?;
        let (command, status) = (self.integer(command), self.integer(status));
        let state = self.choice(state, CommandState::NAMES);
        let description = children
            .maybe("StateDescription")
            .map(|node| self.text(node));
        let place = self.program_place(&mut children);
        let share = children
            .maybe("OverridePercent")
            .map(|node| self.count(node));
        children.end(self)?;
        Some(CommandStatus {
            name,
            command: command?,
            status: status?,
            state: state?,
            description: whole(description)?,
            place: place?,
            override_percent: whole(share)?,
        })
    }

    /// Where a command comes from: three elements, each of which may be missing.
    pub(super) fn program_place(&mut self, children: &mut Children) -> Option<ProgramPlace> {
        let file = children.maybe("ProgramFile").map(|node| self.text(node));
        let index = children.maybe("ProgramIndex").map(|node| self.count(node));
        let length = children.maybe("ProgramLength").map(|node| self.count(node));
        Some(ProgramPlace {
            file: whole(file)?,
            index: whole(index)?,
            length: whole(length)?,
        })
    }

    fn joint_statuses(&mut self, node: Node) -> Option<Vec<JointStatus>> {
        let (_, mut children) = self.children(node);
        let nodes = children.some(self, "JointStatus", 1)?;
        children.end(self)?;
        let read: Vec<_> = nodes
            .into_iter()
            .map(|node| {
                let (_, mut children) = self.children(node);
                let joint = children.wanted(self, "JointNumber")?;
                let joint = self.count(joint);
                let position = self.maybe_number(&mut children, "JointPosition");
                let effort = self.maybe_number(&mut children, "JointTorqueOrForce");
                let velocity = self.maybe_number(&mut children, "JointVelocity");
                children.end(self)?;
                Some(JointStatus {
                    joint: joint?,
                    position: position?,
                    effort: effort?,
                    velocity: velocity?,
                })
            })
            .collect();
        read.into_iter().collect()
    }

    fn maybe_number(&mut self, children: &mut Children, name: &str) -> Option<Option<f64>> {
        whole(children.maybe(name).map(|node| self.number(node)))
    }

    fn pose_status(&mut self, node: Node) -> Option<PoseStatus> {
        let (_, mut children) = self.children(node);
        let pose = children.wanted(self, "Pose")?;
        let pose = self.waypoint(pose);
        let twist = children
            .maybe("Twist")
            .map(|node| self.two_vectors(node, ["LinearVelocity", "AngularVelocity"]));
        let wrench = children
            .maybe("Wrench")
            .map(|node| self.two_vectors(node, ["Force", "Moment"]));
        let configuration = children.maybe("Configuration").map(|node| self.text(node));
        children.end(self)?;
        Some(PoseStatus {
            pose: pose?.pose,
            twist: whole(twist)?,
            wrench: whole(wrench)?,
            configuration: whole(configuration)?,
        })
    }

    fn two_vectors(&mut self, node: Node, names: [&str; 2]) -> Option<([f64; 3], [f64; 3])> {
        let (_, mut children) = self.children(node);
        let [first, second] = names.map(|name| {
            let node = children.wanted(self, name)?;
            self.vector(node)
        });
        children.end(self)?;
        Some((first?, second?))
    }

    fn gripper_status(&mut self, node: Node) -> Option<GripperStatus> {
        let kind = self.kind(node)?;
        let (_, mut children) = self.children(node);
        let name = children.wanted(self, "GripperName")?;
        let name = self.token(name);
        let options = self.parameters(children.many("GripperOption"));
        let holding = children
            .maybe("HoldingObject")
            .map(|node| self.boolean(node));
        let state = match kind {
            "ParallelGripperStatus" => {
                let node = children.wanted(self, "Separation")?;
                let separation = self.number(node)?;
                GripperState::Parallel { separation }
            }
            "VacuumGripperStatus" => {
                let node = children.wanted(self, "IsPowered")?;
                let powered = self.boolean(node)?;
                GripperState::Vacuum { powered }
            }
            "ThreeFingerGripperStatus" => self.fingers(&mut children)?,
            _ => {
                let message = format!("there is no gripper `{}Type`", clip(kind));
                let finding = Finding::error(code::XML_KIND, opening(node), message);
                self.findings.push(finding);
                return None;
            }
        };
        children.end(self)?;
        Some(GripperStatus {
            name: name?,
            options: options?,
            holding: whole(holding)?,
            state,
        })
    }

    fn fingers(&mut self, children: &mut Children) -> Option<GripperState> {
        let mut three = |names: [&str; 3]| names.map(|name| self.maybe_number(children, name));
        let [a, b, c] = three(["Finger1Position", "Finger2Position", "Finger3Position"]);
        let [d, e, f] = three(["Finger1Force", "Finger2Force", "Finger3Force"]);
        Some(GripperState::ThreeFinger {
            positions: [a?, b?, c?],
            forces: [d?, e?, f?],
        })
    }

    fn settings_status(&mut self, node: Node) -> Option<SettingsStatus> {
        let (_, mut children) = self.children(node);
        let angle = children
            .maybe("AngleUnitName")
            .map(|node| self.choice(node, AngleUnit::XML_NAMES));
        let end_effector_parameters = self.parameters(children.many("EndEffectorParameterSetting"));
        let end_effector = self.maybe_number(&mut children, "EndEffectorSetting");
        let force = children
            .maybe("ForceUnitName")
            .map(|node| self.choice(node, ForceUnit::XML_NAMES));
        let limits: Vec<_> = children
            .many("JointLimits")
            .into_iter()
            .map(|node| self.joint_limits(node))
            .collect();
        let intermediate = children
            .maybe("IntermediatePoseTolerance")
            .map(|node| self.pose_tolerance(node));
        let length = children
            .maybe("LengthUnitName")
            .map(|node| self.choice(node, LengthUnit::XML_NAMES));
        let most = children
            .maybe("MaxCartesianLimit")
            .map(|node| self.point(node));
        let least = children
            .maybe("MinCartesianLimit")
            .map(|node| self.point(node));
        let coordinated = children
            .maybe("MotionCoordinated")
            .map(|node| self.boolean(node));
        let end = children
            .maybe("EndPoseTolerance")
            .or_else(|| children.maybe("PoseTolerance"))
            .map(|node| self.pose_tolerance(node));
        let robot_parameters = self.parameters(children.many("RobotParameterSetting"));
        let start = SettingsStatus {
            angle_unit: whole(angle)?,
            end_effector_parameters: end_effector_parameters?,
            end_effector: end_effector?,
            force_unit: whole(force)?,
            joint_limits: limits.into_iter().collect::<Option<_>>()?,
            intermediate_tolerance: whole(intermediate)?,
            length_unit: whole(length)?,
            max_cartesian: whole(most)?,
            min_cartesian: whole(least)?,
            coordinated: whole(coordinated)?,
            end_tolerance: whole(end)?,
            robot_parameters: robot_parameters?,
            ..SettingsStatus::default()
        };
        self.settings_speeds(children, start)
    }

    /// The second half of the settings.
    fn settings_speeds(
        &mut self,
        mut children: Children,
        start: SettingsStatus,
    ) -> Option<SettingsStatus> {
        let inner = |reader: &mut Self, children: &mut Children, name: &str| {
            let part = if name.ends_with("Absolute") {
                "Setting"
            } else {
                "Fraction"
            };
            whole(children.maybe(name).map(|node| {
                let (_, mut children) = reader.children(node);
                let value = children.wanted(reader, part)?;
                children.end(reader)?;
                reader.number(value)
            }))
        };
        let rot_accel = inner(self, &mut children, "RotAccelAbsolute");
        let rot_accel_share = inner(self, &mut children, "RotAccelRelative");
        let rot_speed = inner(self, &mut children, "RotSpeedAbsolute");
        let rot_speed_share = inner(self, &mut children, "RotSpeedRelative");
        let torque = children
            .maybe("TorqueUnitName")
            .map(|node| self.choice(node, TorqueUnit::XML_NAMES));
        let trans_accel = inner(self, &mut children, "TransAccelAbsolute");
        let trans_accel_share = inner(self, &mut children, "TransAccelRelative");
        let trans_speed = inner(self, &mut children, "TransSpeedAbsolute");
        let trans_speed_share = inner(self, &mut children, "TransSpeedRelative");
        let tolerances = children
            .maybe("JointTolerances")
            .map(|node| self.joint_tolerances(node));
        children.end(self)?;
        Some(SettingsStatus {
            rot_accel: rot_accel?,
            rot_accel_share: rot_accel_share?,
            rot_speed: rot_speed?,
            rot_speed_share: rot_speed_share?,
            torque_unit: whole(torque)?,
            trans_accel: trans_accel?,
            trans_accel_share: trans_accel_share?,
            trans_speed: trans_speed?,
            trans_speed_share: trans_speed_share?,
            joint_tolerances: whole(tolerances)?.unwrap_or_default(),
            ..start
        })
    }

    fn joint_limits(&mut self, node: Node) -> Option<JointLimits> {
        let (_, mut children) = self.children(node);
        let joint = children.wanted(self, "JointNumber")?;
        let joint = self.count(joint);
        let min_position = self.maybe_number(&mut children, "JointMinPosition");
        let max_position = self.maybe_number(&mut children, "JointMaxPosition");
        let max_effort = self.maybe_number(&mut children, "JointMaxTorqueOrForce");
        let max_velocity = self.maybe_number(&mut children, "JointMaxVelocity");
        children.end(self)?;
        Some(JointLimits {
            joint: joint?,
            min_position: min_position?,
            max_position: max_position?,
            max_effort: max_effort?,
            max_velocity: max_velocity?,
        })
    }

    fn sensor_statuses(&mut self, node: Node) -> Option<Vec<SensorStatus>> {
        let (_, mut children) = self.children(node);
        let mut read = Vec::new();
        for kind in [
            "OnOffSensorStatus",
            "ScalarSensorStatus",
            "CountSensorStatus",
            "ForceTorqueSensorStatus",
        ] {
            for node in children.many(kind) {
                read.push(self.sensor_status(node, kind));
            }
        }
        children.end(self)?;
        read.into_iter().collect()
    }

    fn sensor_status(&mut self, node: Node, kind: &str) -> Option<SensorStatus> {
        let (_, mut children) = self.children(node);
        let id = children.wanted(self, "SensorID")?;
        let count = children.wanted(self, "ReadCount")?;
        let time = children.wanted(self, "LastReadTime")?;
        let parameters = self.parameters(children.many("SensorParameterSetting"));
        let value = match kind {
            "OnOffSensorStatus" => {
                let node = children.wanted(self, "On")?;
                self.boolean(node).map(SensorValue::OnOff)
            }
            // The dot is part of the name in the schema.
            "ScalarSensorStatus" => {
                let node = children.wanted(self, "ScalarValue.")?;
                self.number(node).map(SensorValue::Scalar)
            }
            "CountSensorStatus" => {
                let node = children.wanted(self, "CountValue.")?;
                self.integer(node).map(SensorValue::Count)
            }
            _ => {
                let found = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"].map(|name| {
                    let node = children.wanted(self, name)?;
                    self.number(node)
                });
                let [a, b, c, d, e, f] = found;
                Some(SensorValue::ForceTorque([a?, b?, c?, d?, e?, f?]))
            }
        };
        children.end(self)?;
        Some(SensorStatus {
            id: self.token(id)?,
            read_count: self.count(count)?,
            last_read_ms: self.integer(time)?,
            parameters: parameters?,
            value: value?,
        })
    }

    fn guards_status(&mut self, node: Node) -> Option<GuardsStatus> {
        let (_, mut children) = self.children(node);
        let guards: Vec<_> = children
            .many("Guard")
            .into_iter()
            .map(|node| self.guard(node))
            .collect();
        let count = children.wanted(self, "TriggerCount")?;
        let time = children.wanted(self, "TriggerStopTimeMicros")?;
        let (count, time) = (self.count(count), self.integer(time));
        let value = self.maybe_number(&mut children, "TriggerValue");
        let pose = children
            .maybe("TriggerPose")
            .map(|node| self.waypoint(node));
        children.end(self)?;
        Some(GuardsStatus {
            guards: guards.into_iter().collect::<Option<_>>()?,
            trigger_count: count?,
            stop_us: time?,
            value: value?,
            pose: whole(pose)?.map(|waypoint| waypoint.pose),
        })
    }
}

//! Reads commands, one function for each group of them.

use roxmltree::Node;

use super::command::{
    ActuateJoint, COMMAND_NAMES, Instruction, JointDetails, JointReport, MoveScrew, StatusParts,
    StopCondition, XmlCommand,
};
use super::elements::{Children, Reader, opening};
use super::read_data::whole;
use crate::code;
use crate::finding::Finding;
use crate::lexer::clip;
use crate::suggest;
use crate::units::{AngleUnit, ForceUnit, LengthUnit, TorqueUnit};

impl Reader<'_> {
    /// A command; `kind` is given where the name of the element tells it.
    pub(super) fn instruction(&mut self, node: Node, kind: Option<&str>) -> Option<Instruction> {
        let kind = match kind {
            Some(kind) => kind,
            None => self.kind(node)?,
        };
        if !COMMAND_NAMES.contains(&kind) {
            self.unknown(node, kind);
            return None;
        }
        let (name, mut children) = self.children(node);
        let id = children.wanted(self, "CommandID")?;
        let id = self.integer(id);
        let guards: Vec<_> = children
            .many("Guard")
            .into_iter()
            .map(|guard| self.guard(guard))
            .collect();
        let command = self.command(kind, &mut children);
        children.end(self)?;
        Some(Instruction {
            name,
            id: id?,
            guards: guards.into_iter().collect::<Option<_>>()?,
            command: command?,
        })
    }

    fn unknown(&mut self, node: Node, kind: &str) {
        let message = format!("there is no command `{}Type`", clip(kind));
        let finding = Finding::error(code::UNKNOWN_COMMAND, opening(node), message)
            .expected("the `xsi:type` of a command")
            .found(format!("`{}Type`", clip(kind)));
        self.findings
            .push(match suggest::nearest(kind, COMMAND_NAMES) {
                Some(near) => finding.help(format!("did you mean `{near}Type`?")),
                None => finding,
            });
    }

    fn command(&mut self, kind: &str, children: &mut Children) -> Option<XmlCommand> {
        match kind {
            "InitCanon" => Some(XmlCommand::InitCanon),
            "EndCanon" => Some(XmlCommand::EndCanon),
            "OpenToolChanger" => Some(XmlCommand::OpenToolChanger),
            "CloseToolChanger" => Some(XmlCommand::CloseToolChanger),
            "GetStatus" => Some(XmlCommand::GetStatus),
            "MoveTo" | "MoveThroughTo" | "MoveScrew" | "ActuateJoints" | "StopMotion" => {
                self.motion(kind, children)
            }
            "ConfigureJointReports" | "ConfigureStatusReport" => self.report(kind, children),
            "SetEndEffectorParameters"
            | "SetRobotParameters"
            | "EnableSensor"
            | "EnableGripper" => self.with_parameters(kind, children),
            "LoopBlockEnd" => {
                let name = children.wanted(self, "LoopName")?;
                let count = children.wanted(self, "MaxCount")?;
                let (name, count) = (self.token(name), self.count(count));
                Some(XmlCommand::LoopBlockEnd {
                    name: name?,
                    count: count?,
                })
            }
            _ => self.setting(kind, children),
        }
    }

    fn motion(&mut self, kind: &str, children: &mut Children) -> Option<XmlCommand> {
        match kind {
            "MoveTo" => {
                let straight = children.wanted(self, "MoveStraight")?;
                let straight = self.boolean(straight);
                let end = children.wanted(self, "EndPosition")?;
                let end = self.waypoint(end);
                Some(XmlCommand::MoveTo {
                    straight: straight?,
                    end: end?,
                })
            }
            "MoveThroughTo" => self.move_through(children),
            "MoveScrew" => self.move_screw(children),
            "StopMotion" => {
                let condition = children.wanted(self, "StopCondition")?;
                let condition = self.choice(condition, StopCondition::NAMES)?;
                Some(XmlCommand::StopMotion(condition))
            }
            _ => {
                let joints = children.some(self, "ActuateJoint", 1)?;
                let joints: Vec<_> = joints
                    .into_iter()
                    .map(|joint| self.actuate_joint(joint))
                    .collect();
                let tolerances = children
                    .maybe("JointTolerances")
                    .map(|tolerances| self.joint_tolerances(tolerances));
                Some(XmlCommand::ActuateJoints {
                    joints: joints.into_iter().collect::<Option<_>>()?,
                    tolerances: whole(tolerances)?.unwrap_or_default(),
                })
            }
        }
    }

    fn move_through(&mut self, children: &mut Children) -> Option<XmlCommand> {
        let straight = children.wanted(self, "MoveStraight")?;
        let straight = self.boolean(straight);
        let nodes = children.some(self, "Waypoint", 2)?;
        let number = children.wanted(self, "NumPositions")?;
        let stated = self.count(number)?;
        let given = nodes.len();
        if usize::try_from(stated) != Ok(given) {
            let message = format!("there are {given} waypoints, but `NumPositions` says {stated}");
            let span = super::elements::value_span(number);
            let finding = Finding::error(code::COUNT_MISMATCH, span, message)
                .expected(format!("`{given}`"))
                .found(format!("`{stated}`"));
            let help = format!("write `{given}`, or look for a missing or surplus waypoint");
            self.findings.push(finding.help(help));
            return None;
        }
        let waypoints: Vec<_> = nodes.into_iter().map(|node| self.waypoint(node)).collect();
        Some(XmlCommand::MoveThroughTo {
            straight: straight?,
            waypoints: waypoints.into_iter().collect::<Option<_>>()?,
        })
    }

    fn move_screw(&mut self, children: &mut Children) -> Option<XmlCommand> {
        let start = children
            .maybe("StartPosition")
            .map(|node| self.waypoint(node));
        let axis_point = children.maybe("AxisPoint").map(|node| self.point(node));
        let free = children
            .maybe("AxialDistanceFree")
            .map(|node| self.number(node));
        let advance = children.wanted(self, "AxialDistanceScrew")?;
        let turn = children.wanted(self, "Turn")?;
        let (advance, turn) = (self.number(advance), self.number(turn));
        Some(XmlCommand::MoveScrew(MoveScrew {
            start: whole(start)?,
            axis_point: whole(axis_point)?,
            free: whole(free)?,
            advance: advance?,
            turn: turn?,
        }))
    }

    fn actuate_joint(&mut self, node: Node) -> Option<ActuateJoint> {
        let (_, mut children) = self.children(node);
        let joint = children.wanted(self, "JointNumber")?;
        let position = children.wanted(self, "JointPosition")?;
        let details = children.wanted(self, "JointDetails")?;
        children.end(self)?;
        let (joint, position) = (self.count(joint), self.number(position));
        let details = self.joint_details(details);
        Some(ActuateJoint {
            joint: joint?,
            position: position?,
            details: details?,
        })
    }

    fn joint_details(&mut self, node: Node) -> Option<JointDetails> {
        let kind = self.kind(node)?;
        let (_, mut children) = self.children(node);
        let mut part = |reader: &mut Self, name: &str, any_sign: bool| -> Option<Option<f64>> {
            let node = children.maybe(name);
            whole(node.map(|node| {
                if any_sign {
                    reader.number(node)
                } else {
                    reader.not_negative(node)
                }
            }))
        };
        let details = match kind {
            "JointSpeedAccel" => {
                let speed = part(self, "JointSpeed", false);
                let accel = part(self, "JointAccel", false);
                JointDetails::SpeedAccel {
                    speed: speed?,
                    accel: accel?,
                }
            }
            "JointForceTorque" => {
                let setting = part(self, "Setting", true);
                let change_rate = part(self, "ChangeRate", true);
                JointDetails::ForceTorque {
                    setting: setting?,
                    change_rate: change_rate?,
                }
            }
            _ => {
                let message = format!("`JointDetails` is no `{}Type`", clip(kind));
                let finding = Finding::error(code::XML_KIND, opening(node), message);
                let expected = "`JointSpeedAccelType` or `JointForceTorqueType`";
                self.findings.push(
                    finding
                        .expected(expected)
                        .found(format!("`{}Type`", clip(kind))),
                );
                return None;
            }
        };
        children.end(self)?;
        Some(details)
    }

    fn report(&mut self, kind: &str, children: &mut Children) -> Option<XmlCommand> {
        if kind == "ConfigureStatusReport" {
            let mut flag = |reader: &mut Self, name: &str| {
                let node = children.wanted(reader, name)?;
                reader.boolean(node)
            };
            let joints = flag(self, "ReportJointStatuses");
            let pose = flag(self, "ReportPoseStatus");
            let gripper = flag(self, "ReportGripperStatus");
            let settings = flag(self, "ReportSettingsStatus");
            // Files from before 2019 have four flags.
            let mut later = |reader: &mut Self, name: &str| {
                let node = children.maybe(name);
                whole(node.map(|node| reader.boolean(node))).map(Option::unwrap_or_default)
            };
            let sensors = later(self, "ReportSensorsStatus");
            let guards = later(self, "ReportGuardsStatus");
            return Some(XmlCommand::ConfigureStatusReport(StatusParts {
                joints: joints?,
                pose: pose?,
                gripper: gripper?,
                settings: settings?,
                sensors: sensors?,
                guards: guards?,
            }));
        }
        let reset_all = children.wanted(self, "ResetAll")?;
        let reset_all = self.boolean(reset_all);
        let reports: Vec<_> = children
            .many("ConfigureJointReport")
            .into_iter()
            .map(|node| self.joint_report(node))
            .collect();
        Some(XmlCommand::ConfigureJointReports {
            reset_all: reset_all?,
            reports: reports.into_iter().collect::<Option<_>>()?,
        })
    }

    fn joint_report(&mut self, node: Node) -> Option<JointReport> {
        let (_, mut children) = self.children(node);
        let joint = children.wanted(self, "JointNumber")?;
        let position = children.wanted(self, "ReportPosition")?;
        let effort = children.wanted(self, "ReportTorqueOrForce")?;
        let velocity = children.wanted(self, "ReportVelocity")?;
        children.end(self)?;
        Some(JointReport {
            joint: self.count(joint)?,
            position: self.boolean(position)?,
            effort: self.boolean(effort)?,
            velocity: self.boolean(velocity)?,
        })
    }

    fn with_parameters(&mut self, kind: &str, children: &mut Children) -> Option<XmlCommand> {
        let mut named = |reader: &mut Self, name: &str, option: &str| {
            let node = children.wanted(reader, name)?;
            let name = reader.token(node);
            let options = reader.parameters(children.many(option));
            Some((name?, options?))
        };
        match kind {
            "EnableSensor" => {
                let (sensor, options) = named(self, "SensorID", "SensorOption")?;
                Some(XmlCommand::EnableSensor { sensor, options })
            }
            "EnableGripper" => {
                let (gripper, options) = named(self, "GripperName", "GripperOption")?;
                Some(XmlCommand::EnableGripper { gripper, options })
            }
            _ => {
                let settings = children.some(self, "ParameterSetting", 1)?;
                let settings = self.parameters(settings)?;
                Some(match kind {
                    "SetRobotParameters" => XmlCommand::SetRobotParameters(settings),
                    _ => XmlCommand::SetEndEffectorParameters(settings),
                })
            }
        }
    }

    /// Commands with one child.
    fn setting(&mut self, kind: &str, children: &mut Children) -> Option<XmlCommand> {
        use XmlCommand as X;
        let mut child = |reader: &mut Self, name: &str| children.wanted(reader, name);
        Some(match kind {
            "Dwell" => X::Dwell(child(self, "DwellTime").and_then(|c| self.not_negative(c))?),
            "Message" => X::Message(child(self, "Message").and_then(|c| self.text(c))?),
            "SetEndEffector" => {
                X::SetEndEffector(child(self, "Setting").and_then(|c| self.fraction(c))?)
            }
            "SetTransSpeed" | "SetTransAccel" | "SetRotSpeed" | "SetRotAccel" => {
                let name = kind.trim_start_matches("Set");
                let quantity = child(self, name).and_then(|c| self.quantity(c, name))?;
                match kind {
                    "SetTransSpeed" => X::SetTransSpeed(quantity),
                    "SetTransAccel" => X::SetTransAccel(quantity),
                    "SetRotSpeed" => X::SetRotSpeed(quantity),
                    _ => X::SetRotAccel(quantity),
                }
            }
            "SetEndPoseTolerance" => X::SetEndPoseTolerance(
                child(self, "Tolerance").and_then(|c| self.pose_tolerance(c))?,
            ),
            "SetIntermediatePoseTolerance" => X::SetIntermediatePoseTolerance(
                child(self, "Tolerance").and_then(|c| self.pose_tolerance(c))?,
            ),
            "SetMotionCoordination" => {
                X::SetMotionCoordination(child(self, "Coordinated").and_then(|c| self.boolean(c))?)
            }
            "SetLengthUnits" => X::SetLengthUnits(
                child(self, "UnitName").and_then(|c| self.choice(c, LengthUnit::XML_NAMES))?,
            ),
            "SetAngleUnits" => X::SetAngleUnits(
                child(self, "UnitName").and_then(|c| self.choice(c, AngleUnit::XML_NAMES))?,
            ),
            "SetForceUnits" => X::SetForceUnits(
                child(self, "UnitName").and_then(|c| self.choice(c, ForceUnit::XML_NAMES))?,
            ),
            "SetTorqueUnits" => X::SetTorqueUnits(
                child(self, "UnitName").and_then(|c| self.choice(c, TorqueUnit::XML_NAMES))?,
            ),
            "SetDefaultJointPositonsTolerances" => X::SetDefaultJointPositonsTolerances(
                child(self, "JointTolerances").and_then(|c| self.joint_tolerances(c))?,
            ),
            "RunProgram" => X::RunProgram(child(self, "ProgramText").and_then(|c| self.text(c))?),
            "DisableSensor" => {
                X::DisableSensor(child(self, "SensorID").and_then(|c| self.token(c))?)
            }
            "DisableGripper" => {
                X::DisableGripper(child(self, "GripperName").and_then(|c| self.token(c))?)
            }
            "EnableRobotParameterStatus" => X::EnableRobotParameterStatus(
                child(self, "RobotParameterName").and_then(|c| self.token(c))?,
            ),
            "DisableRobotParameterStatus" => X::DisableRobotParameterStatus(
                child(self, "RobotParameterName").and_then(|c| self.token(c))?,
            ),
            _ => X::LoopBlockStart(child(self, "LoopName").and_then(|c| self.token(c))?),
        })
    }
}

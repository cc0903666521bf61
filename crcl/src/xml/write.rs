//! Writes programs and commands.

use super::command::{
    ActuateJoint, Instruction, JointDetails, MoveScrew, StatusParts, StopCondition, XmlCommand,
};
use super::data::{Guard, Waypoint};
use super::document::Instance;
use super::form::form;
use super::out::Out;
use crate::code;
use crate::command::Command;
use crate::finding::Finding;
use crate::program::{Located, Program};
use crate::units::{AngleUnit, ForceUnit, LengthUnit, TorqueUnit};

/// Writes a program in XML form, valid against the schema of 28 April 2021.
///
/// Reading it again gives the same commands, with these exceptions: MoveThroughTo comes back under
/// its standard name MoveSmoothlyTo, through a single pose as MoveStraightTo; a pose in roll, pitch
/// and yaw comes back with axes; StopMotion that is not gentle has the number 1.
///
/// ```
/// use crcl::{Command, Program, xml};
/// let program: Program = [Command::InitCanon, Command::EndCanon { reason: 0 }].into_iter().collect();
/// assert!(xml::write(&program).unwrap().contains("<CommandID>1</CommandID>"));
/// ```
///
/// # Errors
/// One finding for each command that XML cannot say, at its place in the program.
pub fn write(program: &Program) -> Result<String, Vec<Finding>> {
    let mut findings = Vec::new();
    let count = program.commands.len();
    let mut instructions = Vec::with_capacity(count);
    let mut angle = AngleUnit::default();
    let mut guards = Vec::new();
    for (index, located) in program.commands.iter().enumerate() {
        match &located.command {
            Command::InitCanon => angle = AngleUnit::default(),
            Command::SetAngleUnits { unit } => angle = *unit,
            _ => {}
        }
        findings.extend(misplaced(located, index, count));
        if let Command::Guard { guard } = &located.command {
            guards.push(Guard::from(guard));
            continue;
        }
        let guarded = located.command.takes_guards();
        if !guards.is_empty() && matches!(located.command, Command::EndCanon { .. }) {
            findings.push(formless(located, "a guard comes before it".to_owned()));
        }
        match form(&located.command, angle) {
            Ok((name, command)) => instructions.push(Instruction {
                name,
                guards: if guarded {
                    std::mem::take(&mut guards)
                } else {
                    Vec::new()
                },
                ..Instruction::new(instructions.len() as i64 + 1, command)
            }),
            Err(why) => findings.push(formless(located, why)),
        }
    }
    if count < 2 {
        let message = "a program in XML has InitCanon and EndCanon";
        findings.push(Finding::error(code::NO_FORM, 0..0, message));
    }
    if findings.is_empty() {
        Ok(write_instructions(&instructions))
    } else {
        Err(findings)
    }
}

/// InitCanon and EndCanon have one place each.
fn misplaced(located: &Located, index: usize, count: usize) -> Option<Finding> {
    let wanted = match index {
        0 => "InitCanon",
        _ if index + 1 == count => "EndCanon",
        _ => "",
    };
    let name = located.command.name();
    let has_place = matches!(name, "InitCanon" | "EndCanon");
    if name == wanted || (wanted.is_empty() && !has_place) {
        return None;
    }
    let message = match wanted {
        "" => format!("a program in XML has {name} at its end only"),
        _ => format!("a program in XML has {wanted} here"),
    };
    let message = message.replace("InitCanon at its end", "InitCanon at its beginning");
    let finding = Finding::error(code::NO_FORM, located.span.clone(), message);
    Some(finding.found(format!("`{name}`")))
}

fn formless(located: &Located, why: String) -> Finding {
    let name = located.command.name();
    let message = format!("{name} has no form in XML: {why}");
    Finding::error(code::NO_FORM, located.span.clone(), message)
}

/// Writes commands as a program; the first must be InitCanon and the last EndCanon, which is
/// what their elements then say.
pub fn write_instructions(instructions: &[Instruction]) -> String {
    let mut out = Out::new(true);
    out.root("CRCLProgram", "CRCLProgramInstance.xsd", |out| {
        let last = instructions.len().saturating_sub(1);
        for (index, instruction) in instructions.iter().enumerate() {
            match (index, &instruction.command) {
                (0, XmlCommand::InitCanon) => {
                    out.element("InitCanon", |out| write_instruction(out, instruction));
                }
                (at, XmlCommand::EndCanon) if at == last => {
                    out.element("EndCanon", |out| write_instruction(out, instruction));
                }
                _ => out.kind("MiddleCommand", instruction.command.name(), |out| {
                    write_instruction(out, instruction);
                }),
            }
        }
    });
    out.finish() + "\n"
}

/// Writes a document with a single command, on one line.
pub fn write_instance(instance: &Instance) -> String {
    let mut out = Out::new(false);
    out.root("CRCLCommandInstance", "CRCLCommandInstance.xsd", |out| {
        out.maybe("Name", instance.name.as_ref());
        let kind = instance.instruction.command.name();
        out.kind("CRCLCommand", kind, |out| {
            write_instruction(out, &instance.instruction);
        });
        out.maybe("ProgramFile", instance.place.file.as_ref());
        out.maybe("ProgramIndex", instance.place.index);
        out.maybe("ProgramLength", instance.place.length);
    });
    out.finish()
}

/// What stands inside the element of a command.
fn write_instruction(out: &mut Out, instruction: &Instruction) {
    out.maybe("Name", instruction.name.as_ref());
    out.leaf("CommandID", &instruction.id.to_string());
    for guard in &instruction.guards {
        out.guard(guard);
    }
    match &instruction.command {
        XmlCommand::MoveTo { straight, end } => {
            out.leaf("MoveStraight", &straight.to_string());
            waypoint(out, "EndPosition", end);
        }
        XmlCommand::MoveThroughTo {
            straight,
            waypoints,
        } => {
            out.leaf("MoveStraight", &straight.to_string());
            for pose in waypoints {
                waypoint(out, "Waypoint", pose);
            }
            out.leaf("NumPositions", &waypoints.len().to_string());
        }
        XmlCommand::MoveScrew(screw) => move_screw(out, screw),
        XmlCommand::ActuateJoints { joints, tolerances } => {
            for joint in joints {
                actuate_joint(out, joint);
            }
            out.joint_tolerances("JointTolerances", tolerances);
        }
        XmlCommand::StopMotion(condition) => {
            out.choice("StopCondition", *condition, StopCondition::NAMES);
        }
        XmlCommand::ConfigureJointReports { .. } | XmlCommand::ConfigureStatusReport(_) => {
            write_report(out, &instruction.command);
        }
        other => write_setting(out, other),
    }
}

fn waypoint(out: &mut Out, name: &str, waypoint: &Waypoint) {
    let Some(settings) = &waypoint.settings else {
        out.element(name, |out| out.pose(&waypoint.pose));
        return;
    };
    out.kind(name, "PoseAndSet", |out| {
        out.pose(&waypoint.pose);
        out.leaf("Coordinated", &settings.coordinated.to_string());
        for (name, quantity) in [
            ("TransSpeed", settings.trans_speed),
            ("RotSpeed", settings.rot_speed),
            ("TransAccel", settings.trans_accel),
            ("RotAccel", settings.rot_accel),
        ] {
            if let Some(quantity) = quantity {
                out.quantity(name, quantity);
            }
        }
        if let Some(tolerance) = &settings.tolerance {
            out.tolerance("Tolerance", tolerance);
        }
    });
}

fn move_screw(out: &mut Out, screw: &MoveScrew) {
    if let Some(start) = &screw.start {
        waypoint(out, "StartPosition", start);
    }
    if let Some(point) = &screw.axis_point {
        out.point("AxisPoint", point);
    }
    out.maybe_number("AxialDistanceFree", screw.free);
    out.number("AxialDistanceScrew", screw.advance);
    out.number("Turn", screw.turn);
}

fn actuate_joint(out: &mut Out, joint: &ActuateJoint) {
    out.element("ActuateJoint", |out| {
        out.leaf("JointNumber", &joint.joint.to_string());
        out.number("JointPosition", joint.position);
        match joint.details {
            JointDetails::SpeedAccel { speed, accel } => {
                out.kind("JointDetails", "JointSpeedAccel", |out| {
                    out.maybe_number("JointSpeed", speed);
                    out.maybe_number("JointAccel", accel);
                });
            }
            JointDetails::ForceTorque {
                setting,
                change_rate,
            } => out.kind("JointDetails", "JointForceTorque", |out| {
                out.maybe_number("Setting", setting);
                out.maybe_number("ChangeRate", change_rate);
            }),
        }
    });
}

fn write_report(out: &mut Out, command: &XmlCommand) {
    match command {
        XmlCommand::ConfigureJointReports { reset_all, reports } => {
            out.leaf("ResetAll", &reset_all.to_string());
            for report in reports {
                out.element("ConfigureJointReport", |out| {
                    out.leaf("JointNumber", &report.joint.to_string());
                    out.leaf("ReportPosition", &report.position.to_string());
                    out.leaf("ReportTorqueOrForce", &report.effort.to_string());
                    out.leaf("ReportVelocity", &report.velocity.to_string());
                });
            }
        }
        XmlCommand::ConfigureStatusReport(parts) => {
            let StatusParts {
                joints,
                pose,
                gripper,
                settings,
                sensors,
                guards,
            } = parts;
            for (name, value) in [
                ("ReportJointStatuses", joints),
                ("ReportPoseStatus", pose),
                ("ReportGripperStatus", gripper),
                ("ReportSettingsStatus", settings),
                ("ReportSensorsStatus", sensors),
                ("ReportGuardsStatus", guards),
            ] {
                out.leaf(name, &value.to_string());
            }
        }
        _ => {}
    }
}

/// What stands inside commands with one child or a list.
fn write_setting(out: &mut Out, command: &XmlCommand) {
    match command {
        XmlCommand::Dwell(seconds) => out.number("DwellTime", *seconds),
        XmlCommand::Message(text) => out.leaf("Message", text),
        XmlCommand::SetEndEffector(setting) => out.number("Setting", *setting),
        XmlCommand::SetTransSpeed(quantity) => out.quantity("TransSpeed", *quantity),
        XmlCommand::SetTransAccel(quantity) => out.quantity("TransAccel", *quantity),
        XmlCommand::SetRotSpeed(quantity) => out.quantity("RotSpeed", *quantity),
        XmlCommand::SetRotAccel(quantity) => out.quantity("RotAccel", *quantity),
        XmlCommand::SetEndPoseTolerance(tolerance)
        | XmlCommand::SetIntermediatePoseTolerance(tolerance) => {
            out.tolerance("Tolerance", tolerance);
        }
        XmlCommand::SetMotionCoordination(coordinated) => {
            out.leaf("Coordinated", &coordinated.to_string());
        }
        XmlCommand::SetLengthUnits(unit) => out.choice("UnitName", *unit, LengthUnit::XML_NAMES),
        XmlCommand::SetAngleUnits(unit) => out.choice("UnitName", *unit, AngleUnit::XML_NAMES),
        XmlCommand::SetForceUnits(unit) => out.choice("UnitName", *unit, ForceUnit::XML_NAMES),
        XmlCommand::SetTorqueUnits(unit) => out.choice("UnitName", *unit, TorqueUnit::XML_NAMES),
        XmlCommand::SetDefaultJointPositonsTolerances(tolerances) => {
            out.joint_tolerances("JointTolerances", tolerances);
        }
        XmlCommand::SetEndEffectorParameters(parameters)
        | XmlCommand::SetRobotParameters(parameters) => {
            out.parameters("ParameterSetting", parameters);
        }
        XmlCommand::RunProgram(text) => out.leaf("ProgramText", text),
        XmlCommand::EnableSensor { sensor, options } => {
            out.leaf("SensorID", sensor);
            out.parameters("SensorOption", options);
        }
        XmlCommand::DisableSensor(sensor) => out.leaf("SensorID", sensor),
        XmlCommand::EnableGripper { gripper, options } => {
            out.leaf("GripperName", gripper);
            out.parameters("GripperOption", options);
        }
        XmlCommand::DisableGripper(gripper) => out.leaf("GripperName", gripper),
        XmlCommand::EnableRobotParameterStatus(name)
        | XmlCommand::DisableRobotParameterStatus(name) => out.leaf("RobotParameterName", name),
        XmlCommand::LoopBlockStart(name) => out.leaf("LoopName", name),
        XmlCommand::LoopBlockEnd { name, count } => {
            out.leaf("LoopName", name);
            out.leaf("MaxCount", &count.to_string());
        }
        _ => {}
    }
}

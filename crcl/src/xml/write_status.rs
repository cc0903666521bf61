//! Writes status documents.

use super::out::Out;
use super::status::{
    CommandState, CommandStatus, GripperState, GripperStatus, GuardsStatus, JointStatus,
    PoseStatus, SensorStatus, SensorValue, SettingsStatus, Status,
};
use crate::units::{AngleUnit, ForceUnit, LengthUnit, TorqueUnit};

/// Writes a status document on one line, with nothing after the end of its root element.
///
/// ```
/// use crcl::xml::{Status, write_status};
/// let text = write_status(&Status::default());
/// assert!(text.ends_with("<CommandState>CRCL_Ready</CommandState></CommandStatus></CRCLStatus>"));
/// ```
pub fn write_status(status: &Status) -> String {
    let mut out = Out::new(false);
    out.root("CRCLStatus", "CRCLStatus.xsd", |out| {
        out.maybe("Name", status.name.as_ref());
        command(out, &status.command);
        if !status.joints.is_empty() {
            out.element("JointStatuses", |out| {
                for each in &status.joints {
                    joint(out, each);
                }
            });
        }
        if let Some(each) = &status.pose {
            pose(out, each);
        }
        if let Some(each) = &status.gripper {
            gripper(out, each);
        }
        if let Some(each) = &status.settings {
            out.element("SettingsStatus", |out| settings(out, each));
        }
        if !status.sensors.is_empty() {
            out.element("SensorStatuses", |out| sensors(out, &status.sensors));
        }
        if let Some(each) = &status.guards {
            guards(out, each);
        }
    });
    out.finish()
}

fn command(out: &mut Out, status: &CommandStatus) {
    out.element("CommandStatus", |out| {
        out.maybe("Name", status.name.as_ref());
        out.leaf("CommandID", &status.command.to_string());
        out.leaf("StatusID", &status.status.to_string());
        out.choice("CommandState", status.state, CommandState::NAMES);
        out.maybe("StateDescription", status.description.as_ref());
        out.maybe("ProgramFile", status.place.file.as_ref());
        out.maybe("ProgramIndex", status.place.index);
        out.maybe("ProgramLength", status.place.length);
        out.maybe("OverridePercent", status.override_percent);
    });
}

fn joint(out: &mut Out, status: &JointStatus) {
    out.element("JointStatus", |out| {
        out.leaf("JointNumber", &status.joint.to_string());
        out.maybe_number("JointPosition", status.position);
        out.maybe_number("JointTorqueOrForce", status.effort);
        out.maybe_number("JointVelocity", status.velocity);
    });
}

fn pose(out: &mut Out, status: &PoseStatus) {
    out.element("PoseStatus", |out| {
        out.element("Pose", |out| out.pose(&status.pose));
        if let Some((linear, angular)) = &status.twist {
            out.element("Twist", |out| {
                out.vector("LinearVelocity", linear);
                out.vector("AngularVelocity", angular);
            });
        }
        if let Some((force, moment)) = &status.wrench {
            out.element("Wrench", |out| {
                out.vector("Force", force);
                out.vector("Moment", moment);
            });
        }
        out.maybe("Configuration", status.configuration.as_ref());
    });
}

fn gripper(out: &mut Out, status: &GripperStatus) {
    let kind = match status.state {
        GripperState::Parallel { .. } => "ParallelGripperStatus",
        GripperState::Vacuum { .. } => "VacuumGripperStatus",
        GripperState::ThreeFinger { .. } => "ThreeFingerGripperStatus",
    };
    out.kind("GripperStatus", kind, |out| {
        out.leaf("GripperName", &status.name);
        out.parameters("GripperOption", &status.options);
        out.maybe("HoldingObject", status.holding);
        match status.state {
            GripperState::Parallel { separation } => out.number("Separation", separation),
            GripperState::Vacuum { powered } => out.leaf("IsPowered", &powered.to_string()),
            GripperState::ThreeFinger { positions, forces } => {
                for (finger, value) in (1..).zip(positions) {
                    out.maybe_number(&format!("Finger{finger}Position"), value);
                }
                for (finger, value) in (1..).zip(forces) {
                    out.maybe_number(&format!("Finger{finger}Force"), value);
                }
            }
        }
    });
}

fn settings(out: &mut Out, status: &SettingsStatus) {
    if let Some(unit) = status.angle_unit {
        out.choice("AngleUnitName", unit, AngleUnit::XML_NAMES);
    }
    let parameters = &status.end_effector_parameters;
    out.parameters("EndEffectorParameterSetting", parameters);
    out.maybe_number("EndEffectorSetting", status.end_effector);
    if let Some(unit) = status.force_unit {
        out.choice("ForceUnitName", unit, ForceUnit::XML_NAMES);
    }
    for limits in &status.joint_limits {
        out.element("JointLimits", |out| {
            out.leaf("JointNumber", &limits.joint.to_string());
            out.maybe_number("JointMinPosition", limits.min_position);
            out.maybe_number("JointMaxPosition", limits.max_position);
            out.maybe_number("JointMaxTorqueOrForce", limits.max_effort);
            out.maybe_number("JointMaxVelocity", limits.max_velocity);
        });
    }
    if let Some(tolerance) = &status.intermediate_tolerance {
        out.tolerance("IntermediatePoseTolerance", tolerance);
    }
    if let Some(unit) = status.length_unit {
        out.choice("LengthUnitName", unit, LengthUnit::XML_NAMES);
    }
    if let Some(corner) = &status.max_cartesian {
        out.point("MaxCartesianLimit", corner);
    }
    if let Some(corner) = &status.min_cartesian {
        out.point("MinCartesianLimit", corner);
    }
    out.maybe("MotionCoordinated", status.coordinated);
    if let Some(tolerance) = &status.end_tolerance {
        out.tolerance("EndPoseTolerance", tolerance);
    }
    out.parameters("RobotParameterSetting", &status.robot_parameters);
    speeds(out, status);
}

/// The second half of the settings.
fn speeds(out: &mut Out, status: &SettingsStatus) {
    let one = |out: &mut Out, name: &str, part: &str, value: Option<f64>| {
        if let Some(value) = value {
            out.element(name, |out| out.number(part, value));
        }
    };
    one(out, "RotAccelAbsolute", "Setting", status.rot_accel);
    one(out, "RotAccelRelative", "Fraction", status.rot_accel_share);
    one(out, "RotSpeedAbsolute", "Setting", status.rot_speed);
    one(out, "RotSpeedRelative", "Fraction", status.rot_speed_share);
    if let Some(unit) = status.torque_unit {
        out.choice("TorqueUnitName", unit, TorqueUnit::XML_NAMES);
    }
    one(out, "TransAccelAbsolute", "Setting", status.trans_accel);
    let share = status.trans_accel_share;
    one(out, "TransAccelRelative", "Fraction", share);
    one(out, "TransSpeedAbsolute", "Setting", status.trans_speed);
    let share = status.trans_speed_share;
    one(out, "TransSpeedRelative", "Fraction", share);
    out.joint_tolerances("JointTolerances", &status.joint_tolerances);
}

/// The sensors in the order of the schema: one kind after the other.
fn sensors(out: &mut Out, all: &[SensorStatus]) {
    for wanted in [
        "OnOffSensorStatus",
        "ScalarSensorStatus",
        "CountSensorStatus",
        "ForceTorqueSensorStatus",
    ] {
        for sensor in all.iter().filter(|sensor| kind(sensor) == wanted) {
            out.element(wanted, |out| {
                out.leaf("SensorID", &sensor.id);
                out.leaf("ReadCount", &sensor.read_count.to_string());
                out.leaf("LastReadTime", &sensor.last_read_ms.to_string());
                out.parameters("SensorParameterSetting", &sensor.parameters);
                value(out, sensor.value);
            });
        }
    }
}

fn kind(sensor: &SensorStatus) -> &'static str {
    match sensor.value {
        SensorValue::OnOff(_) => "OnOffSensorStatus",
        SensorValue::Scalar(_) => "ScalarSensorStatus",
        SensorValue::Count(_) => "CountSensorStatus",
        SensorValue::ForceTorque(_) => "ForceTorqueSensorStatus",
    }
}

fn value(out: &mut Out, value: SensorValue) {
    match value {
        SensorValue::OnOff(on) => out.leaf("On", &on.to_string()),
        // The dot is part of the name in the schema.
        SensorValue::Scalar(number) => out.number("ScalarValue.", number),
        SensorValue::Count(count) => out.leaf("CountValue.", &count.to_string()),
        SensorValue::ForceTorque(values) => {
            let names = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"];
            for (name, value) in names.iter().zip(values) {
                out.number(name, value);
            }
        }
    }
}

fn guards(out: &mut Out, status: &GuardsStatus) {
    out.element("GuardsStatuses", |out| {
        for guard in &status.guards {
            out.guard(guard);
        }
        out.leaf("TriggerCount", &status.trigger_count.to_string());
        out.leaf("TriggerStopTimeMicros", &status.stop_us.to_string());
        out.maybe_number("TriggerValue", status.value);
        if let Some(pose) = &status.pose {
            out.element("TriggerPose", |out| out.pose(pose));
        }
    });
}

//! The messages of a recording, as bytes.

use crate::cdr::{CdrReader, CdrWriter};
use crate::{Head, Periods, Sample};

/// The name of the workstation's frame.
const WORKSTATION: &str = "workstation";
/// The name of the controlled point's frame.
const TOOL: &str = "tool";

/// `std_msgs/String`.
pub(crate) fn string(text: &str) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.text(text);
    out.finish()
}

/// The text of a `std_msgs/String`.
pub(crate) fn text_of(message: &[u8]) -> Option<&str> {
    CdrReader::new(message)?.text()
}

/// `rcl_interfaces/Log`; level 20 is information, 30 a warning, 40 an error.
pub(crate) fn log(time_ns: u64, level: u8, text: &str) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.stamp(time_ns);
    out.u8(level);
    out.text("canter");
    out.text(text);
    out.text("");
    out.text("");
    out.u32(0);
    out.finish()
}

/// `canter_msgs/Setpoint`.
pub(crate) fn setpoint(time_ns: u64, sample: &Sample, joints: usize) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.header(time_ns, "");
    out.u64(sample.tick);
    out.u32(sample.command);
    out.f64(sample.path_time);
    out.f64(sample.time_scaling);
    for list in [&sample.position, &sample.velocity, &sample.acceleration] {
        out.numbers(list.get(..joints).unwrap_or(list));
    }
    out.numbers(&sample.tool);
    out.finish()
}

/// A sample without what was measured.
pub(crate) fn setpoint_of(message: &[u8]) -> Option<Sample> {
    let mut from = CdrReader::new(message)?;
    from.header()?;
    Some(Sample {
        tick: from.u64()?,
        command: from.u32()?,
        path_time: from.f64()?,
        time_scaling: from.f64()?,
        position: from.numbers()?,
        velocity: from.numbers()?,
        acceleration: from.numbers()?,
        tool: from.numbers()?,
        ..Sample::default()
    })
}

/// `canter_msgs/State`.
pub(crate) fn state(time_ns: u64, sample: &Sample, joints: usize) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.header(time_ns, "");
    out.u64(sample.tick);
    let measured = &sample.measured;
    out.numbers(measured.get(..joints).unwrap_or(measured));
    out.numbers(&sample.measured_tool);
    out.finish()
}

/// The period and what was measured in it: joints and controlled point.
pub(crate) fn state_of(message: &[u8]) -> Option<(u64, [f64; crate::MAX_JOINTS], [f64; 3])> {
    let mut from = CdrReader::new(message)?;
    from.header()?;
    Some((from.u64()?, from.numbers()?, from.numbers()?))
}

/// `sensor_msgs/JointState` of the measured joints.
pub(crate) fn joint_state(time_ns: u64, sample: &Sample, head: &Head) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.header(time_ns, "");
    out.u32(head.joints.len() as u32);
    for name in &head.joints {
        out.text(name);
    }
    let count = head.joints.len();
    for list in [&sample.measured, &sample.velocity] {
        out.numbers(list.get(..count).unwrap_or(list));
    }
    out.numbers(&[]);
    out.finish()
}

/// The numbers of a pose in ROS 2's order: place, then x, y, z, w of the quaternion.
fn pose(out: &mut CdrWriter, [x, y, z, qw, qx, qy, qz]: [f64; 7]) {
    for number in [x, y, z, qx, qy, qz, qw] {
        out.f64(number);
    }
}

/// `geometry_msgs/PoseStamped` of the controlled point.
pub(crate) fn tool(time_ns: u64, sample: &Sample) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.header(time_ns, WORKSTATION);
    pose(&mut out, sample.tool);
    out.finish()
}

/// `tf2_msgs/TFMessage`: base and controlled point in the workstation.
pub(crate) fn transforms(time_ns: u64, sample: &Sample, head: &Head) -> Vec<u8> {
    let mut out = CdrWriter::new();
    let frames = [
        (head.root_link.as_str(), head.workstation_from_base),
        (TOOL, sample.tool),
    ];
    out.u32(frames.len() as u32);
    for (child, transform) in frames {
        out.header(time_ns, WORKSTATION);
        out.text(child);
        pose(&mut out, transform);
    }
    out.finish()
}

/// `canter_msgs/Periods`.
pub(crate) fn periods(time_ns: u64, periods: &Periods) -> Vec<u8> {
    let mut out = CdrWriter::new();
    out.header(time_ns, "");
    for count in [
        periods.ticks,
        periods.published,
        periods.skipped,
        periods.driver_missed,
        periods.unrecorded,
    ] {
        out.u64(count);
    }
    out.finish()
}

/// Counts of servo periods.
pub(crate) fn periods_of(message: &[u8]) -> Option<Periods> {
    let mut from = CdrReader::new(message)?;
    from.header()?;
    Some(Periods {
        ticks: from.u64()?,
        published: from.u64()?,
        skipped: from.u64()?,
        driver_missed: from.u64()?,
        unrecorded: from.u64()?,
    })
}

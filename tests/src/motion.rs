//! Checks a recorded motion against its program, from the recorded samples alone: forward
//! kinematics by `k`, finite differences, an independent reading of the modes of the language.
//!
//! Nothing of the engine, the planner or the kinematics of Canter is used, so an error there cannot
//! hide itself.

use crcl::{Command, Pose};
use k::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::arm::Arm;

/// One row of the CSV of `canter plan --samples`.
pub struct Row {
    /// Time, s.
    pub t: f64,
    /// Number of the command.
    pub command: usize,
    /// Joint positions.
    pub q: Vec<f64>,
    /// Joint velocities.
    pub dq: Vec<f64>,
    /// Joint accelerations.
    pub ddq: Vec<f64>,
    /// The controlled point in the workstation, as recorded.
    pub pose: Isometry3<f64>,
}

/// Reads the CSV.
///
/// # Errors
/// What is wrong with its form.
pub fn rows(csv: &str, joints: usize) -> Result<Vec<Row>, String> {
    let mut lines = csv.lines();
    let found = lines.next().unwrap_or_default();
    let expected = header(joints);
    if found != expected {
        return Err(format!("header is {found}, not {expected}"));
    }
    lines
        .enumerate()
        .map(|(index, line)| row(line, joints, index))
        .collect()
}

fn header(joints: usize) -> String {
    let list = |name: &str| {
        (1..=joints)
            .map(|k| format!("{name}{k},"))
            .collect::<String>()
    };
    format!(
        "t_s,command,{}{}{}x_m,y_m,z_m,qw,qx,qy,qz",
        list("q"),
        list("dq"),
        list("ddq")
    )
}

fn row(line: &str, joints: usize, index: usize) -> Result<Row, String> {
    let cells: Vec<f64> = line
        .split(',')
        .map(str::parse)
        .collect::<Result<_, _>>()
        .map_err(|error| format!("row {index}: {error}"))?;
    if cells.len() != 2 + 3 * joints + 7 {
        return Err(format!("row {index}: {} cells", cells.len()));
    }
    let list = |nth: usize| cells[2 + nth * joints..2 + (nth + 1) * joints].to_vec();
    let tail = &cells[2 + 3 * joints..];
    let turn = k::nalgebra::Quaternion::new(tail[3], tail[4], tail[5], tail[6]);
    if (turn.norm() - 1.0).abs() > 1e-9 {
        return Err(format!("row {index}: quaternion of length {}", turn.norm()));
    }
    Ok(Row {
        t: cells[0],
        command: cells[1] as usize,
        q: list(0),
        dq: list(1),
        ddq: list(2),
        pose: Isometry3::from_parts(
            Translation3::new(tail[0], tail[1], tail[2]),
            UnitQuaternion::from_quaternion(turn),
        ),
    })
}

/// All errors of a recorded motion of a program; empty if it is correct.
pub fn faults(arm: &Arm, program: &[Command], rows: &[Row]) -> Vec<String> {
    let mut faults = Vec::new();
    let Some(first) = rows.first() else {
        return vec!["no rows".to_owned()];
    };
    joint_limits(arm, rows, &mut faults);
    finite_differences(arm, rows, &mut faults);
    let mut modes = Modes::new(arm);
    let mut from = 0;
    if !at_rest(first) {
        faults.push("does not start at rest".to_owned());
    }
    for (index, command) in program.iter().enumerate() {
        let end = rows[from..].partition_point(|row| row.command <= index) + from;
        // The row before belongs to the command before, and is where this command starts.
        let part = &rows[from.saturating_sub(1)..end];
        let mut say = |fault: String| faults.push(format!("command {index}: {fault}"));
        if let Some(last) = part.last() {
            let changes_tool = modes.run(arm, command, part, &mut say);
            poses_agree(
                arm,
                &modes,
                if changes_tool { &part[1..] } else { part },
                &mut say,
            );
            if end > from && !at_rest(last) {
                say(format!("ends at {} s, not at rest", last.t));
            }
        }
        from = end;
    }
    if from != rows.len() {
        faults.push(format!("{} rows belong to no command", rows.len() - from));
    }
    faults
}

fn at_rest(row: &Row) -> bool {
    row.dq.iter().all(|rate| rate.abs() < 1e-9)
}

/// Position, velocity, acceleration as recorded, jerk by differences.
fn joint_limits(arm: &Arm, rows: &[Row], faults: &mut Vec<String>) {
    let mut check = |what: &str, row: &Row, joint: usize, value: f64, limit: f64| {
        if value > limit * (1.0 + 1e-6) + 1e-9 {
            let t = row.t;
            faults.push(format!(
                "joint {joint} at {t} s: {what} {value} beyond {limit}"
            ));
        }
    };
    for (index, row) in rows.iter().enumerate() {
        for (joint, &[lower, upper, velocity]) in arm.joints.iter().enumerate() {
            check("position below", row, joint, lower - row.q[joint], 0.0);
            check("position above", row, joint, row.q[joint] - upper, 0.0);
            check("velocity", row, joint, row.dq[joint].abs(), velocity);
            check(
                "acceleration",
                row,
                joint,
                row.ddq[joint].abs(),
                arm.acceleration[joint],
            );
            if let Some(before) = index.checked_sub(1).and_then(|index| rows.get(index)) {
                let jerk = (row.ddq[joint] - before.ddq[joint]) / (row.t - before.t);
                check("jerk", row, joint, jerk.abs(), arm.jerk[joint]);
            }
        }
    }
}

/// Velocities and accelerations are the derivatives of the positions: with the jerk bounded by
/// `j`, a central difference over `2 h` is within `j h^2 / 6` of the velocity and within `j h / 2`
/// of the acceleration.
fn finite_differences(arm: &Arm, rows: &[Row], faults: &mut Vec<String>) {
    for window in rows.windows(3) {
        let [before, here, after] = window else {
            continue;
        };
        let h = (after.t - before.t) / 2.0;
        for (joint, jerk) in arm.jerk.iter().enumerate() {
            let velocity = (after.q[joint] - before.q[joint]) / (2.0 * h);
            let acceleration = (after.dq[joint] - before.dq[joint]) / (2.0 * h);
            let apart = (velocity - here.dq[joint]).abs();
            if apart > jerk * h * h / 6.0 * (1.0 + 1e-6) + 1e-9 {
                faults.push(format!(
                    "joint {joint} at {} s: dq is off by {apart}",
                    here.t
                ));
            }
            let apart = (acceleration - here.ddq[joint]).abs();
            if apart > jerk * h / 2.0 * (1.0 + 1e-6) + 1e-6 {
                faults.push(format!(
                    "joint {joint} at {} s: ddq is off by {apart}",
                    here.t
                ));
            }
        }
    }
}

/// The recorded pose is the one that the recorded joints have.
fn poses_agree(arm: &Arm, modes: &Modes, rows: &[Row], say: &mut impl FnMut(String)) {
    let flange_from_tool = arm.flange_from_tool(modes.mounted);
    for row in rows {
        let pose = arm.flange(&row.q) * flange_from_tool;
        let apart = (pose.translation.vector - row.pose.translation.vector).norm();
        let turned = pose.rotation.angle_to(&row.pose.rotation);
        if apart > 1e-9 || turned > 1e-7 {
            say(format!(
                "pose at {} s is off by {apart} m, {turned} rad",
                row.t
            ));
            return;
        }
    }
}

/// The modes of the language, implemented independently from its description.
struct Modes {
    metre: f64,
    radian: f64,
    tolerance: f64,
    speed: f64,
    acceleration: f64,
    mounted: Option<usize>,
    in_holder: Vec<bool>,
}

impl Modes {
    fn new(arm: &Arm) -> Self {
        let in_holder = (0..arm.tools.len())
            .map(|tool| Some(tool) != arm.mounted)
            .collect();
        Self {
            metre: 1e-3,
            radian: 1f64.to_radians(),
            tolerance: 0.0,
            speed: 0.1 * arm.tool_speed,
            acceleration: 0.1 * arm.tool_acceleration,
            mounted: arm.mounted,
            in_holder,
        }
    }

    /// Applies a command and checks its motion; returns whether the tool changed.
    fn run(
        &mut self,
        arm: &Arm,
        command: &Command,
        rows: &[Row],
        say: &mut impl FnMut(String),
    ) -> bool {
        match command {
            Command::InitCanon => (self.metre, self.radian) = (1e-3, 1f64.to_radians()),
            Command::SetLengthUnits { unit } => self.metre = metres(unit.name()),
            Command::SetAngleUnits { unit } => {
                self.radian = if unit.name() == "degree" {
                    1f64.to_radians()
                } else {
                    1.0
                };
            }
            Command::SetIntermediatePointTolerance { tolerance } => {
                self.tolerance = tolerance * self.metre;
            }
            Command::SetAbsoluteSpeed { value } => self.speed = value * self.metre,
            Command::SetAbsoluteAcceleration { value } => self.acceleration = value * self.metre,
            Command::SetRelativeSpeed { percent } => self.speed = percent / 100.0 * arm.tool_speed,
            Command::SetRelativeAcceleration { percent } => {
                self.acceleration = percent / 100.0 * arm.tool_acceleration;
            }
            Command::OpenToolChanger | Command::CloseToolChanger => {
                self.change_tool(arm, matches!(command, Command::OpenToolChanger), rows, say);
                return true;
            }
            Command::MoveTo { pose } => self.arrives(pose, rows, say),
            Command::MoveStraightTo { pose } => {
                self.arrives(pose, rows, say);
                straight(rows, say);
            }
            Command::MoveSmoothlyTo { poses } | Command::MoveThroughTo { poses } => {
                let (last, between) = poses.split_last().expect("a move has a pose");
                self.arrives(last, rows, say);
                self.passes(between, rows, say);
            }
            _ => {}
        }
        tool_limits(self, rows, say);
        false
    }

    /// Takes or leaves the tool in the holder at the flange.
    fn change_tool(&mut self, arm: &Arm, open: bool, rows: &[Row], say: &mut impl FnMut(String)) {
        let Some(last) = rows.last() else { return };
        let flange = arm.flange(&last.q);
        let at = arm.tools.iter().position(|tool| {
            tool.workstation_from_holder.is_some_and(|holder| {
                (holder.translation.vector - flange.translation.vector).norm() < 1e-3
            })
        });
        match (open, at) {
            (true, Some(tool)) if self.mounted == Some(tool) => {
                (self.mounted, self.in_holder[tool]) = (None, true);
            }
            (false, Some(tool)) if self.mounted.is_none() && self.in_holder[tool] => {
                (self.mounted, self.in_holder[tool]) = (Some(tool), false);
            }
            _ => say("the tool changer works away from the right holder".to_owned()),
        }
    }

    fn pose(&self, pose: &Pose) -> Isometry3<f64> {
        match *pose {
            Pose::Axes {
                point,
                z_axis,
                x_axis,
            } => {
                let z = Vector3::from(z_axis).normalize();
                let x = Vector3::from(x_axis).normalize();
                let matrix = Matrix3::from_columns(&[x, z.cross(&x), z]);
                let turn = Rotation3::from_matrix_unchecked(matrix);
                let place = Vector3::from(point) * self.metre;
                Isometry3::from_parts(place.into(), UnitQuaternion::from_rotation_matrix(&turn))
            }
            Pose::RollPitchYaw {
                point,
                roll,
                pitch,
                yaw,
            } => {
                let about =
                    |axis, angle: f64| UnitQuaternion::from_axis_angle(&axis, angle * self.radian);
                let turn = about(Vector3::z_axis(), yaw)
                    * about(Vector3::y_axis(), pitch)
                    * about(Vector3::x_axis(), roll);
                Isometry3::from_parts((Vector3::from(point) * self.metre).into(), turn)
            }
        }
    }

    fn arrives(&self, goal: &Pose, rows: &[Row], say: &mut impl FnMut(String)) {
        let (goal, Some(last)) = (self.pose(goal), rows.last()) else {
            return;
        };
        let apart = (goal.translation.vector - last.pose.translation.vector).norm();
        let turned = goal.rotation.angle_to(&last.pose.rotation);
        if apart > 2e-6 || turned > 2e-6 {
            say(format!(
                "ends {apart} m and {turned} rad from the last pose"
            ));
        }
    }

    /// Intermediate poses are passed in order, each at the first closest approach that is near.
    fn passes(&self, poses: &[Pose], rows: &[Row], say: &mut impl FnMut(String)) {
        // Between two rows the point may bulge out of the line by a h^2 / 8.
        let period = rows.get(1).map_or(0.0, |row| row.t - rows[0].t);
        let sag = self.acceleration * period * period / 8.0;
        let mut from = 0;
        for (index, pose) in poses.iter().enumerate() {
            let target = self.pose(pose).translation.vector;
            let gap = |k: usize| gap(&rows[k], &rows[k + 1], &target);
            let allowed = self.tolerance.max(1e-6) * (1.0 + 1e-6) + sag;
            match (from..rows.len().saturating_sub(1)).find(|&k| gap(k) <= allowed) {
                Some(enters) => from = enters,
                None => {
                    let least = (from..rows.len() - 1)
                        .map(gap)
                        .fold(f64::INFINITY, f64::min);
                    say(format!(
                        "pose {} is passed at {least} m, allowed {allowed}",
                        index + 1
                    ));
                }
            }
        }
    }
}

fn metres(unit: &str) -> f64 {
    match unit {
        "inch" => 0.0254,
        "meter" => 1.0,
        _ => 1e-3,
    }
}

/// Distance of a point from the line between two rows.
fn gap(from: &Row, to: &Row, target: &Vector3<f64>) -> f64 {
    let (a, b) = (from.pose.translation.vector, to.pose.translation.vector);
    let along = b - a;
    let part = if along.norm() > 0.0 {
        (target - a).dot(&along) / along.norm_squared()
    } else {
        0.0
    };
    (a + along * part.clamp(0.0, 1.0) - target).norm()
}

/// The controlled point stays within 10 um of the line, and never goes back along it.
fn straight(rows: &[Row], say: &mut impl FnMut(String)) {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return;
    };
    let origin = first.pose.translation.vector;
    let way = last.pose.translation.vector - origin;
    if way.norm() < 1e-9 {
        return;
    }
    let along = way.normalize();
    let mut reached = 0.0;
    for row in rows {
        let here = row.pose.translation.vector - origin;
        let off = (here - along * here.dot(&along)).norm();
        if off > 10e-6 {
            say(format!("{off} m off the straight line at {} s", row.t));
        }
        if here.dot(&along) < reached - 1e-6 {
            say(format!("goes back along the line at {} s", row.t));
        }
        reached = f64::max(reached, here.dot(&along));
    }
}

/// Speed and acceleration of the controlled point by differences: a first difference is a mean of
/// the velocity, a second difference a weighted mean of the acceleration, so neither can exceed a
/// limit that the motion holds.
fn tool_limits(modes: &Modes, rows: &[Row], say: &mut impl FnMut(String)) {
    for window in rows.windows(3) {
        let [a, b, c] = [0, 1, 2].map(|k| window[k].pose.translation.vector);
        let h = window[1].t - window[0].t;
        let speed = (b - a).norm() / h;
        if speed > modes.speed * (1.0 + 1e-4) + 1e-6 {
            say(format!(
                "tool at {} s: {speed} m/s beyond {}",
                window[1].t, modes.speed
            ));
            return;
        }
        let acceleration = (c - b * 2.0 + a).norm() / (h * h);
        if acceleration > modes.acceleration * (1.0 + 1e-4) + 1e-6 {
            let limit = modes.acceleration;
            say(format!(
                "tool at {} s: {acceleration} m/s2 beyond {limit}",
                window[1].t
            ));
            return;
        }
    }
}

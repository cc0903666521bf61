//! A recorded motion held against the program it came from.
//!
//! Everything is judged from the samples: the program says what was asked for, the robot what is
//! allowed, and [`trajectory::verify`] does the arithmetic. Nothing is planned.

use crcl::{LengthUnit, Program};
use kinematics::Chain;
use nalgebra::Isometry3;
use serde::Serialize;
use trajectory::verify::{Recorded, Target, Verdict, Wanted, verify};
use trajectory::{JointLimits, ToolLimits};

use crate::modal::Modal;
use crate::robot::{Robot, RobotError, vector};
use crate::task::{Move, Shape, Task};
use crate::with_dof;

/// One row of a recorded motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Number of the command in the program, from 0.
    pub command: usize,
    /// Joint positions, rad or m.
    pub joints: Vec<f64>,
    /// The controlled point in the workstation as it was recorded.
    pub pose: Isometry3<f64>,
}

/// How an intermediate pose was passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PassFound {
    /// Which pose of the command, counted from 1.
    pub index: usize,
    /// Distance at the closest approach that keeps the order, m.
    pub deviation_m: f64,
    /// Tolerance in force, m; rounding for the last pose.
    pub tolerance_m: f64,
    /// When, s.
    pub time_s: f64,
    /// Whether it is within, in order.
    pub within: bool,
}

/// What the samples prove about one command.
#[derive(Clone, Debug, Serialize)]
pub struct CommandVerdict {
    /// Number of the command in the program, from 0.
    pub index: usize,
    /// Line of the program, from 1.
    pub line: usize,
    /// Name of the command.
    pub name: &'static str,
    /// Number of samples of it.
    pub samples: usize,
    /// For a move: its poses, the last included.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub poses: Vec<PassFound>,
    /// For a straight move: largest distance from the line, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub straightness_m: Option<f64>,
    /// Largest ratio to a limit of joint or tool that the samples prove, and of what.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak: Option<(f64, String)>,
    /// What is wrong; empty if nothing is.
    pub findings: Vec<String>,
}

/// What the samples prove about a program.
#[derive(Clone, Debug, Serialize)]
pub struct ProgramVerdict {
    /// Version of this form.
    pub schema: u32,
    /// Name of the robot.
    pub robot: String,
    /// Number of samples.
    pub samples: usize,
    /// The commands, in order.
    pub commands: Vec<CommandVerdict>,
    /// What is wrong with the samples as a whole.
    pub findings: Vec<String>,
    /// Whether nothing is wrong anywhere.
    pub holds: bool,
}

/// Rounding of recorded numbers, m and rad: they are written with all their digits.
const RESOLUTION: f64 = 1e-12;
/// Largest deviation of a straight line, m.
const STRAIGHT: f64 = 1e-5;
/// Largest distance (m) and angle (rad) from the last pose.
const ARRIVED: (f64, f64) = (1e-6, 1e-6);
/// Largest distance (m) and angle (rad) of a recorded pose from that of the recorded joints.
const POSE: (f64, f64) = (1e-6, 1e-6);

/// Holds recorded rows against the program they came from.
///
/// Rows are in the order of time; a command's rows follow the last row of the command before it.
/// Recordings that were stretched by pauses or by an override are judged like any other.
///
/// # Errors
/// [`RobotError`] when the robot's description is at fault; what is wrong with the motion is in
/// the verdict.
pub fn verify_program(
    robot: &Robot,
    program: &Program,
    default_length: LengthUnit,
    rows: &[Row],
) -> Result<ProgramVerdict, RobotError> {
    with_dof!(robot.dof(), N => verify_with::<N>(robot, program, default_length, rows))
}

fn verify_with<const N: usize>(
    robot: &Robot,
    program: &Program,
    default_length: LengthUnit,
    rows: &[Row],
) -> Result<ProgramVerdict, RobotError> {
    let mut check = Check::<N> {
        workstation_from_flange: robot.chain::<N>()?,
        limits: robot.joint_limits::<N>(),
        modal: Modal::new(
            robot.motion_limits(),
            robot.workstation_from_base,
            robot.tooling(),
            default_length,
        ),
        rows,
        at: 0,
    };
    let mut verdict = ProgramVerdict {
        schema: 1,
        robot: robot.name.clone(),
        samples: rows.len(),
        commands: Vec::with_capacity(program.commands.len()),
        findings: unordered(rows),
        holds: false,
    };
    if verdict.findings.is_empty() {
        for (index, located) in program.commands.iter().enumerate() {
            verdict.commands.push(check.command(index, located));
        }
        if let Some(row) = rows.get(check.at) {
            verdict.findings.push(format!(
                "{} samples from {} s on belong to command {}, which the program has not or has before",
                rows.len() - check.at,
                row.t_s,
                row.command
            ));
        }
    }
    let sound = |command: &CommandVerdict| command.findings.is_empty();
    verdict.holds = verdict.findings.is_empty() && verdict.commands.iter().all(sound);
    Ok(verdict)
}

/// What is wrong with the times.
fn unordered(rows: &[Row]) -> Vec<String> {
    if rows.is_empty() {
        return vec!["there are no samples".into()];
    }
    rows.windows(2)
        .filter(|pair| pair[1].t_s.is_nan() || pair[1].t_s <= pair[0].t_s)
        .take(1)
        .map(|pair| {
            format!(
                "the sample at {} s comes after that at {} s",
                pair[1].t_s, pair[0].t_s
            )
        })
        .collect()
}

/// A recording on its way through the commands.
struct Check<'a, const N: usize> {
    workstation_from_flange: Chain<N>,
    limits: JointLimits<N>,
    modal: Modal,
    rows: &'a [Row],
    /// First row that no command had yet.
    at: usize,
}

impl<const N: usize> Check<'_, N> {
    fn command(&mut self, index: usize, located: &crcl::Located) -> CommandVerdict {
        let mine = self.rows[self.at..]
            .iter()
            .take_while(|row| row.command == index)
            .count();
        // The instant at which it starts is the last of the command before.
        let first = self.at.saturating_sub(1);
        let rows = &self.rows[first..self.at + mine];
        self.at += mine;
        let mut verdict = CommandVerdict {
            index,
            line: located.line,
            name: located.command.name(),
            samples: mine,
            poses: Vec::new(),
            straightness_m: None,
            peak: None,
            findings: Vec::new(),
        };
        let Some(start) = rows.first() else {
            return verdict;
        };
        let flange = self.workstation_from_flange.forward(&vector(&start.joints));
        let before = self.modal.tooling().flange_from_tool();
        let task = match self.modal.resolve(&located.command, &flange) {
            Ok(task) => task,
            Err(error) => {
                verdict
                    .findings
                    .push(format!("it may not be executed here: {error}"));
                return verdict;
            }
        };
        let chain = self.workstation_from_flange.with_tool(&before);
        if mine > 0
            && let Task::Tool(_) = task
        {
            // The first row is still that of the tool before, the others may be of either.
        } else {
            verdict.findings.extend(misplaced(&chain, &rows[1..]));
        }
        match task {
            Task::Move(motion) => self.motion(&motion, &chain, rows, &mut verdict),
            _ => verdict.findings.extend(moved(rows)),
        }
        verdict
    }

    fn motion(&self, motion: &Move, chain: &Chain<N>, rows: &[Row], verdict: &mut CommandVerdict) {
        let samples: Vec<Recorded<N>> = rows.iter().map(|row| recorded(chain, row)).collect();
        let targets = targets(motion);
        let tool = tool_limits(motion);
        let wanted = Wanted {
            joint: &self.limits,
            tool: &tool,
            targets: &targets,
            straightness: (motion.shape == Shape::Straight).then_some(STRAIGHT),
            resolution: RESOLUTION,
        };
        let found = verify(&samples, &wanted);
        verdict.straightness_m = wanted.straightness.map(|_| found.straightness);
        verdict.peak = largest(&found);
        verdict.poses = found
            .passes
            .iter()
            .zip(&targets)
            .map(|(pass, target)| PassFound {
                index: pass.index + 1,
                deviation_m: pass.deviation,
                tolerance_m: target.tolerance,
                time_s: pass.time,
                within: pass.within,
            })
            .collect();
        verdict.findings.extend(found.findings);
        let end = samples.last().map(|sample| sample.tool).unwrap_or_default();
        let gap = motion
            .poses
            .last()
            .map(|goal| goal.inv_mul(&end))
            .unwrap_or_default();
        let (off, turned) = (gap.translation.vector.norm(), gap.rotation.angle());
        if off > ARRIVED.0 || turned > ARRIVED.1 {
            verdict.findings.push(format!(
                "it ends {:.6} mm and {:.6} degrees from its last pose",
                off * 1e3,
                turned.to_degrees()
            ));
        }
    }
}

fn recorded<const N: usize>(chain: &Chain<N>, row: &Row) -> Recorded<N> {
    let position = vector(&row.joints);
    Recorded {
        time: row.t_s,
        position,
        tool: chain.forward(&position),
    }
}

/// What has to be passed: the intermediate poses, whose orientation is free, and the last.
fn targets(motion: &Move) -> Vec<Target> {
    let last = motion.poses.len().saturating_sub(1);
    let target = |(index, pose): (usize, &Isometry3<f64>)| Target {
        pose: *pose,
        tolerance: if index == last {
            ARRIVED.0
        } else {
            motion.tolerance.max(ARRIVED.0)
        },
        angular_tolerance: if index == last {
            ARRIVED.1
        } else {
            f64::INFINITY
        },
    };
    motion.poses.iter().enumerate().map(target).collect()
}

/// Limits of the tool that hold for a move; one in joint space has no jerk limit of the tool.
fn tool_limits(motion: &Move) -> ToolLimits {
    match motion.shape {
        Shape::Joint => ToolLimits {
            jerk: f64::INFINITY,
            ..motion.limits
        },
        Shape::Straight | Shape::Smooth => motion.limits,
    }
}

fn largest(found: &Verdict) -> Option<(f64, String)> {
    let peak = found
        .peaks
        .iter()
        .max_by(|a, b| a.ratio.total_cmp(&b.ratio))?;
    Some((peak.ratio, peak.limit.to_string()))
}

/// A finding if a recorded pose is not that of the recorded joints.
fn misplaced<const N: usize>(chain: &Chain<N>, rows: &[Row]) -> Option<String> {
    rows.iter().find_map(|row| {
        let gap = chain.forward(&vector(&row.joints)).inv_mul(&row.pose);
        let (off, turned) = (gap.translation.vector.norm(), gap.rotation.angle());
        let wrong = off.is_nan() || turned.is_nan() || off > POSE.0 || turned > POSE.1;
        wrong.then(|| {
            format!(
                "at {} s the recorded pose is {:.4} mm and {:.4} degrees from that of the joints",
                row.t_s,
                off * 1e3,
                turned.to_degrees()
            )
        })
    })
}

/// A finding if a joint moves under a command that moves nothing.
fn moved(rows: &[Row]) -> Option<String> {
    rows.windows(2).find_map(|pair| {
        let joints = pair[0].joints.iter().zip(&pair[1].joints);
        let joint = joints
            .enumerate()
            .find(|(_, (a, b))| (*a - *b).abs() > RESOLUTION)?;
        Some(format!("joint {} moves at {} s", joint.0 + 1, pair[1].t_s))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dry_run::{PlanOptions, plan_program};

    const PROGRAM: &str = "InitCanon()\nSetRelativeSpeed(50)\nSetRelativeAcceleration(50)\n\
        SetIntermediatePointTolerance(2)\n\
        MoveTo({{400, -100, 300}, {0, 0, -1}, {1, 0, 0}})\n\
        MoveStraightTo({{400, 100, 300}, {0, 0, -1}, {1, 0, 0}})\n\
        Dwell(0.1)\n\
        MoveSmoothlyTo({{{400, 100, 200}, {0, 0, -1}, {1, 0, 0}}, \
        {{400, -100, 200}, {0, 0, -1}, {1, 0, 0}}}, 2)\nEndCanon(0)\n";

    fn recording() -> (Robot, Program, Vec<Row>) {
        let robot = crate::robot::load("ur5e").unwrap();
        let program = crcl::text::read(PROGRAM, &crcl::ReadOptions::default()).program;
        let plan = plan_program(&robot, &program, &PlanOptions::default()).unwrap();
        let rows = plan.samples(1e-3).map(|sample| Row {
            t_s: sample.t_s,
            command: sample.command,
            joints: sample.q,
            pose: sample.workstation_from_tool,
        });
        let rows = rows.collect();
        (robot, program, rows)
    }

    fn verdict(change: impl Fn(&mut Vec<Row>)) -> ProgramVerdict {
        let (robot, program, mut rows) = recording();
        change(&mut rows);
        verify_program(&robot, &program, LengthUnit::default(), &rows).unwrap()
    }

    #[test]
    fn what_was_planned_holds() {
        let verdict = verdict(|_| {});
        assert!(verdict.holds, "{verdict:#?}");
        assert_eq!(verdict.commands.len(), 9);
        assert_eq!(verdict.commands[7].poses.len(), 2);
    }

    #[test]
    fn a_recording_that_was_touched_does_not() {
        // A joint displaced in one sample, and its pose with it: velocity and more.
        let touched = verdict(|rows| {
            let middle = rows.len() / 2;
            rows[middle].joints[0] += 1e-3;
        });
        assert!(!touched.holds);
        // Time runs twice as fast.
        let fast = verdict(|rows| rows.iter_mut().for_each(|row| row.t_s *= 0.5));
        assert!(!fast.holds);
        // The end is missing.
        let short = verdict(|rows| rows.truncate(rows.len() * 2 / 3));
        assert!(!short.holds);
        // Samples out of order.
        assert!(!verdict(|rows| rows.swap(10, 11)).holds);
        assert!(!verdict(Vec::clear).holds);
    }

    #[test]
    fn a_pose_that_is_passed_too_far_away_is_found() {
        let (robot, _, rows) = recording();
        let other = PROGRAM.replace("{400, 100, 200}", "{403, 100, 200}");
        let program = crcl::text::read(&other, &crcl::ReadOptions::default()).program;
        let verdict = verify_program(&robot, &program, LengthUnit::default(), &rows).unwrap();
        let faults = &verdict.commands[7].findings;
        assert!(faults.iter().any(|f| f.contains("pose 1")), "{faults:?}");
    }
}

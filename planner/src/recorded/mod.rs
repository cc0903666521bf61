//! Checks a recorded motion against its program.
//!
//! Everything is computed from the samples, the program and the limits of the robot. Nothing is
//! planned, and the planner's certificates and kinematics are not used: forward kinematics,
//! interpolation and the search for passes are the checker's own.
//!
//! What must hold is a list of [`Rule`]s. Samples are a time `h` apart; what happens between them
//! is not recorded. Each rule allows for what the joints can do in `h` within their limits, and no
//! more. So no correct motion is refused at any period, and a shorter period proves more.

mod arm;
mod between;
mod ends;
mod finding;
mod joints;
mod row;
mod rule;
mod run;
mod smooth;
mod span;
mod stillness;
mod straight;
mod time;
mod tool;
mod verdict;

use crcl::{LengthUnit, Program};
use trajectory::smooth::SmoothOptions;

pub use finding::{Finding, Measure, Side, Subject};
pub use row::{RecordedSample, RunColumns};
pub use rule::Rule;
pub use verdict::{CommandVerdict, PassFound, ProgramVerdict};

use crate::modal::Modal;
use crate::robot::Robot;
use crate::task::{Move, Shape, Task};
use arm::Arm;
use finding::RuleReport;
use span::{Recording, Span};

/// Checks recorded rows against their program.
///
/// Rows are in the order of time; a command's rows follow the last row of the command before it.
/// Recordings of runs that were paused or slowed down are checked like any other.
#[must_use]
pub fn verify_program(
    robot: &Robot,
    program: &Program,
    default_length: LengthUnit,
    rows: &[RecordedSample],
) -> ProgramVerdict {
    let mut verdict = ProgramVerdict {
        schema: 1,
        robot: robot.name.clone(),
        samples: rows.len(),
        commands: Vec::with_capacity(program.commands.len()),
        findings: Vec::new(),
        broken: Vec::new(),
        holds: false,
    };
    let mut whole = RuleReport::default();
    if let Some(period) = readable(robot, rows, &mut whole) {
        let recording = Recording {
            arm: Arm::new(robot),
            rows,
            period,
        };
        ends::start(&recording, &mut whole);
        let modal = Modal::new(
            robot.motion_limits(),
            robot.workstation_from_base,
            robot.tooling(),
            default_length,
            robot.sliding(),
        );
        for (span, report) in span::spans(&recording, modal, &program.commands, &mut whole) {
            verdict.commands.push(command(&recording, &span, report));
        }
    }
    verdict.broken = whole.take();
    verdict.findings = words(&verdict.broken);
    let sound = verdict.all_broken().next().is_none();
    verdict.holds = sound;
    verdict
}

/// The period of rows that can be checked: every number finite, times growing.
fn readable(robot: &Robot, rows: &[RecordedSample], report: &mut RuleReport) -> Option<f64> {
    if let Some(bad) = rows.iter().find(|row| !row.is_sound(robot.dof())) {
        let measure = Measure::at_most(f64::NAN, f64::MAX, "");
        report.hold(
            Rule::Time,
            Subject::The("a row that is not finite"),
            bad.t_s,
            measure,
        );
        return None;
    }
    time::period(rows, report)
}

/// Checks one command against every rule that applies to it.
fn command(recording: &Recording<'_>, span: &Span<'_>, mut report: RuleReport) -> CommandVerdict {
    let mut verdict = CommandVerdict {
        index: span.index,
        line: span.located.line,
        name: span.located.command.name(),
        samples: span.own.len(),
        poses: Vec::new(),
        straightness_m: None,
        peak: None,
        findings: Vec::new(),
        broken: Vec::new(),
    };
    joints::limits(recording, span, &mut report);
    joints::derivatives(recording, span, &mut report);
    tool::pose(recording, span, &mut report);
    run::path_time(recording, span, &mut report);
    run::measured(recording, span, &mut report);
    match &span.task {
        Some(Task::Move(motion)) => moved(recording, span, motion, &mut verdict, &mut report),
        Some(task) => {
            stillness::standstill(recording, span, &mut report);
            if let Some(seconds) = least_time(recording, span, task) {
                stillness::duration(recording, span, seconds, &mut report);
            }
        }
        None => {}
    }
    verdict.peak = report.peak();
    verdict.broken = report.take();
    verdict.findings = words(&verdict.broken);
    verdict
}

/// The rules of moves.
fn moved(
    recording: &Recording<'_>,
    span: &Span<'_>,
    motion: &Move,
    verdict: &mut CommandVerdict,
    report: &mut RuleReport,
) {
    ends::end(recording, span, motion, report);
    if span.own.is_empty() {
        return;
    }
    let states = tool::states(recording, span);
    tool::caps(recording, span, &states, &motion.limits, report);
    match (motion.shape, motion.poses.last()) {
        (Shape::Straight, Some(goal)) => {
            let off = straight::straight(recording, span, &states, goal, report);
            verdict.straightness_m = Some(off);
        }
        (Shape::Smooth, Some(_)) => {
            let options = SmoothOptions::new(motion.tolerance, motion.limits);
            let smooth = smooth::SmoothMove {
                recording,
                span,
                states: &states,
                motion,
                angular_tolerance: options.angular_tolerance(),
                levers: recording.arm.levers(&span.tools[1]),
            };
            verdict.poses = smooth.check(report);
        }
        _ => {}
    }
    verdict
        .poses
        .extend(ends::last_pass(recording, span, motion));
}

/// The least time of a command that moves nothing, s. In a run a tool is done when its driver says
/// so.
fn least_time(recording: &Recording<'_>, span: &Span<'_>, task: &Task) -> Option<f64> {
    match task {
        Task::Dwell { seconds } => Some(*seconds),
        Task::Tool(_) if !recording.is_run() => Some(span.tool_time),
        _ => None,
    }
}

fn words(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(ToString::to_string).collect()
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

    fn recording() -> (Robot, Program, Vec<RecordedSample>) {
        let robot = crate::robot::load("ur5e").unwrap();
        let program = crcl::text::read(PROGRAM, &crcl::ReadOptions::default()).program;
        let plan = plan_program(&robot, &program, &PlanOptions::default()).unwrap();
        let rows = plan.samples(1e-3).map(RecordedSample::from).collect();
        (robot, program, rows)
    }

    fn verdict(change: impl Fn(&mut Vec<RecordedSample>)) -> ProgramVerdict {
        let (robot, program, mut rows) = recording();
        change(&mut rows);
        verify_program(&robot, &program, LengthUnit::default(), &rows)
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
        let verdict = verify_program(&robot, &program, LengthUnit::default(), &rows);
        let faults = &verdict.commands[7].findings;
        assert!(faults.iter().any(|f| f.contains("pose 1")), "{faults:?}");
    }
}

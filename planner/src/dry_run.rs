//! The dry run: plans a whole program with the same planner, without an arm.

use crcl::{LengthUnit, Program};
use kinematics::Chain;
use nalgebra::{Isometry3, SVector};
use serde::Serialize;

use crate::command_error::CommandError;
use crate::controller::{AnyStep, Controller, PlannedStep};
use crate::motion::MoveCertificate;
use crate::robot::{Robot, RobotError, vector};
use crate::with_dof;

/// How a program is planned.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// Servo rate, Hz: every command starts on a period of it.
    pub rate_hz: f64,
    /// Unit of length before SetLengthUnits and after InitCanon.
    pub default_length: LengthUnit,
    /// Whether planning continues after a command that is refused.
    pub on_refusal: FailurePolicy,
    /// Joint positions at the start (rad, m); the robot's home unless given.
    pub start: Option<Vec<f64>>,
    /// A monotonic clock (s), for the planning times in the plan; this crate has none. Without it
    /// they are 0.
    pub clock: fn() -> f64,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            rate_hz: 1000.0,
            default_length: LengthUnit::default(),
            on_refusal: FailurePolicy::default(),
            start: None,
            clock: || 0.0,
        }
    }
}

/// What happens when a command cannot be executed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FailurePolicy {
    /// Stop, drop what waits, accept only InitCanon.
    #[default]
    Abort,
    /// The command has no effect; continue with the next.
    Skip,
    /// Stop and keep the waiting commands until the operator decides.
    Hold,
}

/// A command that was refused, and where it stands.
#[derive(Clone, Debug, Serialize)]
pub struct Refusal {
    /// Number of the command in the program, from 0.
    pub index: usize,
    /// Line of the program, from 1.
    pub line: usize,
    /// Column of the program, from 1.
    pub column: usize,
    /// Bytes of the program text.
    #[serde(skip)]
    pub span: std::ops::Range<usize>,
    /// Name of the command.
    pub name: &'static str,
    /// Why.
    #[serde(flatten)]
    pub error: CommandError,
}

/// One command of a planned program.
#[derive(Debug, Serialize)]
pub struct PlannedCommand {
    /// Number of the command in the program, from 0.
    pub index: usize,
    /// Line of the program, from 1.
    pub line: usize,
    /// Name of the command.
    pub name: &'static str,
    /// Start after the start of the program, s.
    pub start_s: f64,
    /// Length, s; whole servo periods.
    pub duration_s: f64,
    /// Time that planning took, s.
    pub planning_s: f64,
    /// For a move: what was proved of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate: Option<MoveCertificate>,
    /// For a move: intended poses of the controlled point, `workstation_from_tool`.
    #[serde(skip)]
    pub poses: Vec<Isometry3<f64>>,
    #[serde(skip)]
    motion: Box<dyn Motion>,
}

impl PlannedCommand {
    /// The step itself, to be executed.
    #[must_use]
    pub fn into_step(self) -> AnyStep {
        self.motion.into_step()
    }
}

/// State of the arm at one time of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanSample {
    /// Time after the start of the program, s.
    pub t_s: f64,
    /// Number of the command, from 0.
    pub command: usize,
    /// Joint positions, rad or m.
    pub q: Vec<f64>,
    /// Joint velocities.
    pub dq: Vec<f64>,
    /// Joint accelerations.
    pub ddq: Vec<f64>,
    /// Joint jerks.
    pub dddq: Vec<f64>,
    /// Pose of the controlled point in the workstation.
    pub workstation_from_tool: Isometry3<f64>,
}

/// A program as it would be executed.
#[derive(Debug, Serialize)]
pub struct Plan {
    /// Version of this form.
    pub schema: u32,
    /// Name of the robot.
    pub robot: String,
    /// Number of joints.
    pub dof: usize,
    /// Joint positions at the start (rad, m).
    pub start: Vec<f64>,
    /// How many moves were planned, refused ones and those of an earlier plan included.
    pub plans: u64,
    /// Length of the program, s.
    pub duration_s: f64,
    /// Time that planning took, s.
    pub planning_s: f64,
    /// The commands that can be executed, in order.
    pub commands: Vec<PlannedCommand>,
    /// Commands that were refused; the first ends the plan unless they are skipped.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refusals: Vec<Refusal>,
}

impl Plan {
    /// Whether the plan is for an arm that stands at `joints` (rad, m): it begins exactly there.
    #[must_use]
    pub fn begins_at(&self, joints: &[f64]) -> bool {
        self.start == joints
    }

    /// Whether the plan may be executed under this policy: with refused commands only if the policy
    /// is not to abort.
    #[must_use]
    pub fn may_run(&self, policy: FailurePolicy) -> bool {
        self.refusals.is_empty() || policy != FailurePolicy::Abort
    }

    /// States at `0, period, 2 period, ...` up to the end; a time that two commands share belongs
    /// to the one that ends there.
    pub fn samples(&self, period: f64) -> impl Iterator<Item = PlanSample> + '_ {
        let count = if self.commands.is_empty() || period.is_nan() || period <= 0.0 {
            0
        } else {
            (self.duration_s / period + 1e-6).floor() as u64 + 1
        };
        let mut at = 0;
        (0..count).map(move |k| {
            let t_s = k as f64 * period;
            // Half a microperiod: start times are sums of whole periods.
            let slack = 1e-6 * period;
            while at + 1 < self.commands.len() && self.ends_before(at, t_s - slack) {
                at += 1;
            }
            self.sample(at, t_s)
        })
    }

    fn ends_before(&self, command: usize, t_s: f64) -> bool {
        let command = &self.commands[command];
        command.start_s + command.duration_s < t_s
    }

    fn sample(&self, at: usize, t_s: f64) -> PlanSample {
        let command = &self.commands[at];
        let mut sample = command.motion.sample((t_s - command.start_s).max(0.0));
        sample.t_s = t_s;
        sample.command = command.index;
        sample
    }
}

/// Plans a whole program from the robot's home position.
///
/// # Errors
/// [`RobotError`] when the robot cannot be planned for; commands that are
/// refused are part of the plan.
pub fn plan_program(
    robot: &Robot,
    program: &Program,
    options: &PlanOptions,
) -> Result<Plan, RobotError> {
    with_dof!(robot.dof(), N => plan_with::<N>(robot, program, options))
}

/// The plan of a program for an arm that stands at `options.start`: `earlier`, a plan of the same
/// program at the same rate, if it begins exactly there, otherwise a new one.
///
/// # Errors
/// As [`plan_program`].
///
/// ```
/// use planner::dry_run::{PlanOptions, plan_from, plan_program};
///
/// let robot = planner::robot::load("ur5e").unwrap();
/// let program = crcl::text::read("InitCanon()", &crcl::ReadOptions::default()).program;
/// let options = PlanOptions::default();
/// let from_home = plan_program(&robot, &program, &options).unwrap();
/// let start = vec![0.1; 6];
/// let options = PlanOptions { start: Some(start.clone()), ..options };
/// let plan = plan_from(&robot, &program, &options, Some(from_home)).unwrap();
/// assert!(plan.begins_at(&start));
/// ```
pub fn plan_from(
    robot: &Robot,
    program: &Program,
    options: &PlanOptions,
    earlier: Option<Plan>,
) -> Result<Plan, RobotError> {
    let made = earlier.as_ref().map_or(0, |plan| plan.plans);
    let start = options.start.as_ref().unwrap_or(&robot.home);
    if let Some(plan) = earlier.filter(|plan| plan.begins_at(start)) {
        return Ok(plan);
    }
    let mut plan = plan_program(robot, program, options)?;
    plan.plans += made;
    Ok(plan)
}

fn plan_with<const N: usize>(
    robot: &Robot,
    program: &Program,
    options: &PlanOptions,
) -> Result<Plan, RobotError> {
    let begin = (options.clock)();
    let mut controller = Controller::<N>::new(robot, options.rate_hz, options.default_length)?;
    if let Some(start) = &options.start {
        controller.set_joints(vector(start));
    }
    let mut plan = Plan {
        schema: 1,
        robot: robot.name.clone(),
        dof: N,
        start: controller.joints().as_slice().to_vec(),
        plans: 0,
        duration_s: 0.0,
        planning_s: 0.0,
        commands: Vec::with_capacity(program.commands.len()),
        refusals: Vec::new(),
    };
    let mut ticks = 0;
    for (index, located) in program.commands.iter().enumerate() {
        let started = (options.clock)();
        match controller.step_ahead(&located.command) {
            Ok(planned) => {
                let mut command = planned_command(&controller, planned, options.rate_hz);
                command.index = index;
                command.line = located.line;
                command.name = located.command.name();
                command.start_s = ticks as f64 / options.rate_hz;
                command.planning_s = (options.clock)() - started;
                ticks += (command.duration_s * options.rate_hz).round() as u64;
                plan.commands.push(command);
            }
            Err(error) => {
                plan.refusals.push(refusal(index, located, error));
                if options.on_refusal != FailurePolicy::Skip {
                    break;
                }
            }
        }
    }
    plan.plans = controller.plans();
    plan.duration_s = ticks as f64 / options.rate_hz;
    plan.planning_s = (options.clock)() - begin;
    Ok(plan)
}

fn refusal(index: usize, located: &crcl::Located, error: CommandError) -> Refusal {
    Refusal {
        index,
        line: located.line,
        column: located.column,
        span: located.span.clone(),
        name: located.command.name(),
        error,
    }
}

fn planned_command<const N: usize>(
    controller: &Controller<N>,
    planned: PlannedStep<N>,
    rate_hz: f64,
) -> PlannedCommand {
    let step = &planned.step;
    let poses = match &step.task {
        crate::task::Task::Move(motion) => motion.poses.clone(),
        _ => Vec::new(),
    };
    PlannedCommand {
        index: 0,
        line: 0,
        name: "",
        start_s: 0.0,
        duration_s: step.ticks as f64 / rate_hz,
        planning_s: 0.0,
        certificate: step
            .planned
            .as_ref()
            .map(|planned| planned.certificate.clone()),
        poses,
        motion: Box::new(ArmMotion {
            chain: *controller.chain(),
            planned,
        }),
    }
}

/// A motion of any number of joints.
trait Motion: std::fmt::Debug + Send + Sync {
    /// State `t` s after the start; at rest after the end.
    fn sample(&self, t: f64) -> PlanSample;

    /// The step that moves so.
    fn into_step(self: Box<Self>) -> AnyStep;
}

#[derive(Debug)]
struct ArmMotion<const N: usize> {
    planned: PlannedStep<N>,
    chain: Chain<N>,
}

impl<const N: usize> Motion for ArmMotion<N> {
    fn sample(&self, t: f64) -> PlanSample {
        let joints = match &self.planned.step.planned {
            Some(planned) if !planned.trajectory.pieces().is_empty() => {
                let trajectory = &planned.trajectory;
                trajectory.sample(t.min(trajectory.duration()))
            }
            _ => realtime::Sample::rest(*self.planned.start()),
        };
        let list = |vector: &SVector<f64, N>| vector.as_slice().to_vec();
        PlanSample {
            t_s: t,
            command: 0,
            q: list(&joints.position),
            dq: list(&joints.velocity),
            ddq: list(&joints.acceleration),
            dddq: list(&joints.jerk),
            workstation_from_tool: self.chain.forward(&joints.position),
        }
    }

    fn into_step(self: Box<Self>) -> AnyStep {
        self.planned.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: &str = r#"
InitCanon()
SetRelativeSpeed(50)
SetRelativeAcceleration(50)
SetIntermediatePointTolerance(2)
MoveTo({{400, -100, 300}, {0, 0, -1}, {1, 0, 0}})
MoveStraightTo({{400, 100, 300}, {0, 0, -1}, {1, 0, 0}})
OpenGripper()
Dwell(0.1)
MoveSmoothlyTo({{{400, 100, 200}, {0, 0, -1}, {1, 0, 0}}, {{400, -100, 200}, {0, 0, -1}, {1, 0, 0}},
  {{400, -100, 300}, {0, 0, -1}, {1, 0, 0}}}, 3)
EndCanon(0)
"#;

    fn planned(robot: &str) -> Plan {
        let robot = crate::robot::load(robot).unwrap();
        let program = crcl::text::read(PROGRAM, &crcl::ReadOptions::default()).program;
        plan_program(&robot, &program, &PlanOptions::default()).unwrap()
    }

    #[test]
    fn a_program_is_planned_and_certified() {
        for robot in ["ur5e", "panda", "irb120"] {
            let plan = planned(robot);
            assert!(plan.refusals.is_empty(), "{robot}: {:?}", plan.refusals);
            assert_eq!(plan.commands.len(), 10);
            for command in plan.commands.iter().filter_map(|c| c.certificate.as_ref()) {
                assert!(
                    command.peaks.largest() <= 1.0 + 1e-9,
                    "{robot}: {command:?}"
                );
            }
            println!(
                "{robot} {} s planned in {} s",
                plan.duration_s, plan.planning_s
            );
            for command in &plan.commands {
                println!(
                    "{} {} {} {:?}",
                    command.name, command.duration_s, command.planning_s, command.certificate
                );
            }
        }
    }

    #[test]
    fn a_long_path_of_a_redundant_arm_begins_where_the_arm_is() {
        let robot = crate::robot::load("panda").unwrap();
        let text = include_str!("../../examples/long_smooth_path.canon");
        let program = crcl::text::read(text, &crcl::ReadOptions::default()).program;
        let plan = plan_program(&robot, &program, &PlanOptions::default()).unwrap();
        assert!(plan.refusals.is_empty(), "{:?}", plan.refusals);
    }

    /// A plan is used where the arm stands at its start, and made again where it stands elsewhere;
    /// the moves of both plans are counted.
    #[test]
    fn a_plan_is_made_again_where_the_arm_stands_elsewhere() {
        let robot = crate::robot::load("ur5e").unwrap();
        let program = crcl::text::read(PROGRAM, &crcl::ReadOptions::default()).program;
        let mut options = PlanOptions {
            start: Some(robot.home.clone()),
            ..PlanOptions::default()
        };
        let first = plan_program(&robot, &program, &options).unwrap();
        let (moves, duration) = (first.plans, first.duration_s);
        let same = plan_from(&robot, &program, &options, Some(first)).unwrap();
        assert_eq!((same.plans, same.duration_s), (moves, duration));
        let mut elsewhere = robot.home.clone();
        elsewhere[0] += f64::EPSILON * 4.0;
        options.start = Some(elsewhere.clone());
        let again = plan_from(&robot, &program, &options, Some(same)).unwrap();
        assert!(again.begins_at(&elsewhere));
        assert_eq!(again.plans, 2 * moves);
    }

    #[test]
    fn a_plan_with_refusals_runs_only_where_the_policy_allows_it() {
        let robot = crate::robot::load("ur5e").unwrap();
        let text = "InitCanon()\nMoveTo({{9000, 0, 0}, {0, 0, -1}, {1, 0, 0}})\n";
        let program = crcl::text::read(text, &crcl::ReadOptions::default()).program;
        let plan = plan_program(&robot, &program, &PlanOptions::default()).unwrap();
        assert!(!plan.may_run(FailurePolicy::Abort) && plan.may_run(FailurePolicy::Skip));
    }

    #[test]
    fn two_dry_runs_are_equal() {
        let (a, b) = (planned("ur5e"), planned("ur5e"));
        assert!(a.samples(0.01).eq(b.samples(0.01)));
    }
}

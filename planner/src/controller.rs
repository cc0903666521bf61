//! The state of one arm during a program: modes, planner and the joints reached so far.

use std::any::Any;
use std::borrow::Cow;

use crcl::LengthUnit;
use kinematics::{Chain, Inertia};
use nalgebra::{Isometry3, SVector};
use realtime::Sample;
use trajectory::{JointLimits, ToolLimits};

use crate::command_error::{CommandError, ErrorClass};
use crate::modal::Modal;
use crate::motion::{Efforts, MotionError, MoveWindow, PlannedMove, Planner, WindowedMove};
use crate::robot::{Robot, RobotError, vector};
use crate::task::{Move, Shape, Task};
use crate::timed::TimedTrajectory;

/// A command that has left the queue: its task and, for a move, its trajectory.
#[derive(Clone, Debug)]
pub struct Step<const N: usize> {
    /// What the command means.
    pub task: Task,
    /// The trajectory, for a move.
    pub planned: Option<PlannedMove<N>>,
    /// Nominal length in servo ticks, without the time until a driver's answer.
    pub ticks: u64,
    /// Conditions on sensors that end it before its time; their limits are SI.
    pub guards: Vec<crcl::Guard>,
}

/// A step that was planned ahead, with the state it was planned for and the state after it.
#[derive(Clone, Debug)]
pub struct PlannedStep<const N: usize> {
    /// The step itself.
    pub step: Step<N>,
    /// Joints at its start, at rest.
    start: SVector<f64, N>,
    /// Modes before it.
    before: Modal,
    /// Modes after it.
    after: Modal,
    /// Servo rate that its length is counted in (Hz).
    rate_hz: f64,
}

/// A planned step of a robot with any number of joints.
#[derive(Debug)]
pub struct AnyStep(Box<dyn Any + Send>);

impl AnyStep {
    /// The step, for a robot of `N` joints; `None` for another number of joints.
    #[must_use]
    pub fn into_step<const N: usize>(self) -> Option<PlannedStep<N>> {
        self.0.downcast().ok().map(|step| *step)
    }
}

impl<const N: usize> From<PlannedStep<N>> for AnyStep {
    fn from(step: PlannedStep<N>) -> Self {
        Self(Box::new(step))
    }
}

impl<const N: usize> PlannedStep<N> {
    /// Joints at the start, at rest (rad, m).
    #[must_use]
    pub fn start(&self) -> &SVector<f64, N> {
        &self.start
    }
}

/// Resolves and plans commands one after the other, each from where the one before it ends. It does
/// not move an arm.
#[derive(Clone, Debug)]
pub struct Controller<const N: usize> {
    workstation_from_flange: Chain<N>,
    limits: JointLimits<N>,
    joint_names: Vec<String>,
    modal: Modal,
    planner: Planner<N>,
    /// Limits of efforts of the arm with nothing at its flange.
    bare_efforts: Option<Efforts<N>>,
    /// What the planner counts with at the flange.
    carried: Option<Inertia>,
    joints: SVector<f64, N>,
    rate_hz: f64,
    plans: u64,
}

impl<const N: usize> Controller<N> {
    /// A controller for `robot`, unready, at its home position.
    ///
    /// # Errors
    /// [`RobotError`] when the robot does not have `N` joints or its description is wrong.
    pub fn new(robot: &Robot, rate_hz: f64, length: LengthUnit) -> Result<Self, RobotError> {
        let workstation_from_flange = robot.chain::<N>()?;
        let limits = robot.joint_limits::<N>();
        let tooling = robot.tooling();
        let carried = tooling.carried();
        let planner = Planner::new(
            &workstation_from_flange,
            tooling.flange_from_tool(),
            limits,
            robot.joint_names(),
        )
        .with_efforts(robot.efforts());
        let modal = Modal::new(
            robot.motion_limits(),
            robot.workstation_from_base,
            tooling,
            length,
            robot.sliding(),
        );
        let joints = vector(&robot.home);
        let joint_names = robot.joint_names();
        Ok(Self {
            workstation_from_flange,
            limits,
            joint_names,
            modal,
            planner,
            bare_efforts: robot.bare_efforts(),
            carried,
            joints,
            rate_hz,
            plans: 0,
        })
    }

    /// Joints at the end of the last step.
    #[must_use]
    pub fn joints(&self) -> &SVector<f64, N> {
        &self.joints
    }

    /// Takes over where the arm was found, at rest.
    pub fn set_joints(&mut self, joints: SVector<f64, N>) {
        self.joints = joints;
    }

    /// Modes of the program.
    #[must_use]
    pub fn modal(&self) -> &Modal {
        &self.modal
    }

    /// Plans moves with the tool in force.
    #[must_use]
    pub fn planner(&self) -> &Planner<N> {
        &self.planner
    }

    /// Refuses everything but InitCanon from now on.
    pub fn abort(&mut self) {
        self.modal.abort();
    }

    /// Limits of the joints.
    #[must_use]
    pub fn limits(&self) -> &JointLimits<N> {
        &self.limits
    }

    /// From the workstation to the controlled point.
    #[must_use]
    pub fn chain(&self) -> &Chain<N> {
        self.planner.chain()
    }

    /// Pose of the controlled point in the workstation, at the end of the last step.
    #[must_use]
    pub fn pose(&self) -> Isometry3<f64> {
        self.chain().forward(&self.joints)
    }

    /// Resolves a command with the present settings and plans it as a whole.
    ///
    /// # Errors
    /// A [`CommandError`]; the controller is then unchanged, but for guards of the command.
    pub fn step(&mut self, command: &crcl::Command) -> Result<Step<N>, CommandError> {
        let flange = self.workstation_from_flange.forward(&self.joints);
        let task = self.modal.resolve(command, &flange)?;
        let guards = if command.takes_guards() {
            self.modal.take_guards()
        } else {
            Vec::new()
        };
        let step = self.plan(task)?;
        Ok(Step { guards, ..step })
    }

    /// As [`Self::step`], for a move that begins in a state of motion: it takes the place of one that
    /// is under way.
    ///
    /// # Errors
    /// A [`CommandError`] for a command that is no single move without guards, or that cannot begin
    /// in that state.
    pub fn step_moving(
        &mut self,
        command: &crcl::Command,
        start: &Sample<N>,
    ) -> Result<Step<N>, CommandError> {
        let flange = self.workstation_from_flange.forward(&start.position);
        let task = self.modal.resolve(command, &flange)?;
        let guards = self.modal.take_guards();
        let Task::Move(motion) = task else {
            return Err(CommandError::motion(
                "only a single move begins while the arm moves",
            ));
        };
        if !guards.is_empty() {
            return Err(CommandError::motion("a guarded move begins at rest"));
        }
        let planned = self.planner.moving(&motion, start);
        self.moved(motion, planned)
    }

    /// Begins a long smooth move whose whole way can be checked before its time law is planned: see
    /// [`Planner::windows`]. The joints are then where it ends. `None` for every other command, and
    /// for one with guards: [`Self::step`] plans it; the controller is then unchanged.
    pub fn begin(&mut self, command: &crcl::Command) -> Option<WindowedMove<'static, N>> {
        use crcl::Command::{MoveSmoothlyTo, MoveThroughTo};
        if !matches!(command, MoveSmoothlyTo { .. } | MoveThroughTo { .. }) {
            return None;
        }
        let flange = self.workstation_from_flange.forward(&self.joints);
        let mut modal = self.modal.clone();
        let Ok(Task::Move(motion)) = modal.resolve(command, &flange) else {
            return None;
        };
        if !modal.take_guards().is_empty() {
            return None;
        }
        let windowed = self.planner.windows(Cow::Owned(motion), &self.joints)?;
        self.modal = modal;
        self.plans += 1;
        self.joints = *windowed.end();
        Some(windowed)
    }

    /// The next window of a move that was begun.
    ///
    /// # Errors
    /// A [`CommandError`] when the move cannot go on; the arm then rests on the way, where the last
    /// window ended.
    pub fn next_window(
        &self,
        windowed: &mut WindowedMove<'_, N>,
    ) -> Result<MoveWindow<N>, CommandError> {
        self.planner.window_of(windowed).map_err(refused)
    }

    /// The step of a task, from where the arm is.
    fn plan(&mut self, task: Task) -> Result<Step<N>, CommandError> {
        let (planner, start) = (&self.planner, &self.joints);
        match task {
            Task::Move(motion) => {
                let planned = planner.plan(&motion, start);
                self.moved(motion, planned)
            }
            Task::Joints(motion) => {
                let planned = planner.actuate(&motion, start);
                let mut joints = *start;
                motion.apply(joints.as_mut_slice());
                let end = self.chain().forward(&joints);
                self.moved(motion.of_point(end), planned)
            }
            Task::Legs(legs) => {
                let planned = planner.legs(&legs, start);
                self.moved(legs.motion, planned)
            }
            Task::Screw(motion) => {
                let planned = planner.screw(&motion, start);
                self.moved(motion.of_point(&self.pose()), planned)
            }
            Task::Dwell { seconds } => Ok(Step {
                ticks: self.ticks(seconds),
                planned: None,
                guards: Vec::new(),
                task,
            }),
            Task::Tool(action) => {
                let time = self.modal.tooling().nominal_time(action);
                self.change_tool();
                Ok(Step {
                    ticks: self.ticks(time),
                    planned: None,
                    guards: Vec::new(),
                    task,
                })
            }
            _ => Ok(Step {
                ticks: 0,
                planned: None,
                guards: Vec::new(),
                task,
            }),
        }
    }

    /// Plans a joint trajectory whose times are given, as a whole, within the limits `most` of the
    /// controlled point. It needs no InitCanon and changes no mode.
    ///
    /// # Errors
    /// A [`CommandError`]; the controller is then unchanged.
    pub fn step_timed(
        &mut self,
        timed: &TimedTrajectory,
        most: &ToolLimits,
    ) -> Result<Step<N>, CommandError> {
        let planned = self.planner.timed(timed, &self.joints, most);
        let end = planned.as_ref().map_or(self.joints, |planned| planned.end);
        let motion = Move {
            shape: Shape::Joint,
            poses: vec![self.chain().forward(&end)],
            tolerance: 0.0,
            limits: *most,
        };
        self.moved(motion, planned)
    }

    /// The step of a motion that was planned; the joints are then where it ends.
    fn moved(
        &mut self,
        motion: Move,
        planned: Result<PlannedMove<N>, MotionError>,
    ) -> Result<Step<N>, CommandError> {
        self.plans += 1;
        let planned = planned.map_err(refused)?;
        self.joints = planned.end;
        Ok(Step {
            ticks: self.ticks(planned.trajectory.duration()),
            task: Task::Move(motion),
            planned: Some(planned),
            guards: Vec::new(),
        })
    }

    /// The task of a command in the present modes; nothing is planned and nothing changes.
    ///
    /// # Errors
    /// A [`CommandError`] for a command that is out of order or out of range.
    pub fn resolve(&self, command: &crcl::Command) -> Result<Task, CommandError> {
        let flange = self.workstation_from_flange.forward(&self.joints);
        self.modal.clone().resolve(command, &flange)
    }

    /// A pose of the controlled point in the workstation (m) as the program would write it now.
    #[must_use]
    pub fn written(&self, workstation_from_tool: &Isometry3<f64>) -> crcl::Pose {
        let flange = self.workstation_from_flange.forward(&self.joints);
        self.modal.written(workstation_from_tool, &flange)
    }

    /// As [`Self::step`]; the step can be executed later, by [`Self::follow`].
    ///
    /// # Errors
    /// A [`CommandError`]; the controller is then unchanged.
    pub fn step_ahead(&mut self, command: &crcl::Command) -> Result<PlannedStep<N>, CommandError> {
        let (start, before) = (self.joints, self.modal.clone());
        let step = self.step(command)?;
        let after = self.modal.clone();
        Ok(PlannedStep {
            step,
            start,
            before,
            after,
            rate_hz: self.rate_hz,
        })
    }

    /// Executes a step that was planned before, without planning it again. Returns whether that was
    /// possible: only if joints, modes and servo rate are exactly those that the step was planned
    /// for, and the robot is the same. Otherwise the controller is unchanged.
    pub fn follow(&mut self, planned: &PlannedStep<N>) -> bool {
        let same = self.joints == planned.start && self.modal == planned.before;
        if !same || self.rate_hz.to_bits() != planned.rate_hz.to_bits() {
            return false;
        }
        self.modal = planned.after.clone();
        if let Some(motion) = &planned.step.planned {
            self.joints = motion.end;
        }
        self.change_tool();
        true
    }

    /// How many moves this controller has planned, refused ones included.
    #[must_use]
    pub fn plans(&self) -> u64 {
        self.plans
    }

    /// A time in whole servo periods, rounded up.
    fn ticks(&self, seconds: f64) -> u64 {
        // A duration that is whole up to rounding gets no additional tick.
        (seconds * self.rate_hz - 1e-6).ceil().max(0.0) as u64
    }

    fn change_tool(&mut self) {
        let tooling = self.modal.tooling();
        let (flange_from_tool, carried) = (tooling.flange_from_tool(), tooling.carried());
        if flange_from_tool == *self.planner.flange_from_tool() && carried == self.carried {
            return;
        }
        let bare = self.bare_efforts.clone();
        self.planner = Planner::new(
            &self.workstation_from_flange,
            flange_from_tool,
            self.limits,
            self.joint_names.clone(),
        )
        .with_efforts(bare.map(|bare| bare.carrying(carried.as_ref())));
        self.carried = carried;
    }
}

/// A motion that cannot be planned, as the error of its command.
fn refused(error: MotionError) -> CommandError {
    CommandError::new(ErrorClass::Motion, error.to_string()).with_help(error.help())
}

//! The arm of a robot as a plan needs it: planned by the engine, and moved by a driver if there is
//! one.

use std::io;

use crcl::{Command, LengthUnit, Pose};
use nalgebra::{Isometry3, SVector};
use plan::run::{Batch, Motion, MotionFailure, Situation, canonical};
use plan::world::{Change, from_axes};
use planner::command_error::CommandError;
use planner::controller::Controller;
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::moving_arm::MovingArm;
use crate::recent::Recent;

/// How many predictions and situations are remembered at least.
const REMEMBERED: usize = 2000;

/// The exact pose of the end of the arm and the tool on it.
type Key = ([u64; 7], Option<String>);

fn key(arm: &Isometry3<f64>, tool: Option<&str>) -> Key {
    let (t, r) = (arm.translation, arm.rotation.quaternion());
    (
        [t.x, t.y, t.z, r.i, r.j, r.k, r.w].map(f64::to_bits),
        tool.map(str::to_owned),
    )
}

/// Where a batch ends, by its own account.
fn end_key(start: &Situation, batch: &Batch) -> Key {
    let arm = batch.changes.iter().rev().find_map(|change| match change {
        Change::Arm(arm) => Some(*arm),
        _ => None,
    });
    let tool = match batch.tools.last() {
        Some((_, tool)) => tool.as_ref(),
        None => start.tool.as_ref(),
    };
    key(
        &arm.unwrap_or(start.arm),
        tool.map(|tool| tool.name.as_str()),
    )
}

/// Time (s) from one look at a free way to the next.
const LOOK: f64 = 0.01;

/// How far (m) a free way may go below its lower end: half of the distance that is kept while
/// travelling.
const DIP: f64 = 0.02;

/// Most parts that a straight way is made in.
const MOST_PARTS: usize = 8;

/// A batch that can be executed.
struct Planned<const N: usize> {
    /// The controller afterwards.
    end: Controller<N>,
    seconds: f64,
    /// The commands as they are executed.
    commands: Vec<Command>,
}

/// Plans a command; the commands that do it with their servo ticks.
fn steps<const N: usize>(
    controller: &mut Controller<N>,
    command: &Command,
) -> Result<Vec<(Command, u64)>, CommandError> {
    match command {
        Command::MoveTo { pose } => travel(controller, pose),
        Command::MoveStraightTo { pose } => straight(controller, pose),
        _ => Ok(vec![(command.clone(), controller.step(command)?.ticks)]),
    }
}

/// A free way between two places above the workstation, unless the arm would come down on it: then
/// a straight one.
fn travel<const N: usize>(
    controller: &mut Controller<N>,
    pose: &Pose,
) -> Result<Vec<(Command, u64)>, CommandError> {
    let command = Command::MoveTo { pose: *pose };
    let mut trial = controller.clone();
    let lower_end = |trial: &Controller<N>| {
        let (from, to) = (controller.pose(), trial.pose());
        from.translation.z.min(to.translation.z)
    };
    let step = trial.step(&command)?;
    let Some(planned) = &step.planned else {
        return Ok(vec![(command, step.ticks)]);
    };
    let moments = (planned.trajectory.duration() / LOOK).ceil() as usize;
    let lowest = (0..=moments)
        .map(|moment| planned.trajectory.sample(moment as f64 * LOOK).position)
        .map(|joints| trial.chain().forward(&joints).translation.z)
        .fold(f64::INFINITY, f64::min);
    if lowest < lower_end(&trial) - DIP {
        return straight(controller, pose);
    }
    *controller = trial;
    Ok(vec![(command, step.ticks)])
}

/// A straight way. One that an arm with a spare joint cannot go at once is made in parts, with a
/// rest between them, in which the arm chooses its posture anew.
fn straight<const N: usize>(
    controller: &mut Controller<N>,
    pose: &Pose,
) -> Result<Vec<(Command, u64)>, CommandError> {
    let command = Command::MoveStraightTo { pose: *pose };
    let whole = match controller.step(&command) {
        Ok(step) => return Ok(vec![(command, step.ticks)]),
        Err(error) => error,
    };
    let Pose::Axes {
        point,
        z_axis,
        x_axis,
    } = pose
    else {
        return Err(whole);
    };
    let Ok(goal) = from_axes(*point, *x_axis, *z_axis) else {
        return Err(whole);
    };
    let start = controller.pose();
    let mut parts = 2;
    while N > 6 && parts <= MOST_PARTS {
        let mut trial = controller.clone();
        let part = |number: usize| {
            let share = number as f64 / parts as f64;
            let between = start.try_lerp_slerp(&goal, share, 1e-9).unwrap_or(goal);
            let pose = canonical(if number == parts { &goal } else { &between });
            let command = Command::MoveStraightTo { pose };
            let ticks = trial.step(&command)?.ticks;
            Ok((command, ticks))
        };
        let done: Result<Vec<_>, CommandError> = (1..=parts).map(part).collect();
        if let Ok(done) = done {
            *controller = trial;
            return Ok(done);
        }
        parts *= 2;
    }
    Err(whole)
}

/// An arm of `N` joints.
pub(crate) struct ArmMotion<const N: usize> {
    /// Does in thought what the session does.
    mirror: Controller<N>,
    rate_hz: f64,
    arm: Option<MovingArm>,
    known: Recent<Key, Controller<N>>,
    times: Recent<(Key, String), f64>,
}

impl<const N: usize> ArmMotion<N> {
    /// The arm where it stands, or at its home position where nothing moves; `rate_hz` is the
    /// servo rate that times are counted in.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] with the fault of the robot's description.
    pub(crate) fn new(
        robot: &Robot,
        rate_hz: f64,
        arm: Option<MovingArm>,
    ) -> Result<Self, Failure> {
        let mut mirror = Controller::new(robot, rate_hz, LengthUnit::Meter)
            .map_err(|error| Failure::new(Exit::Unreadable, error))?;
        if let Some(arm) = &arm {
            mirror.set_joints(SVector::from_column_slice(arm.start()));
        }
        Ok(Self {
            mirror,
            rate_hz,
            arm,
            known: Recent::new(REMEMBERED),
            times: Recent::new(REMEMBERED),
        })
    }

    /// How a process ends whose arm had a fault, if it had one.
    pub(crate) fn blame(&self) -> Option<Exit> {
        self.arm.as_ref().and_then(MovingArm::blame)
    }

    /// Ends the engine, if there is one; how far (m) the arm was off its path at most.
    ///
    /// # Errors
    /// The samples cannot be written.
    pub(crate) fn finish(self) -> io::Result<Option<f64>> {
        self.arm.map(MovingArm::finish).transpose()
    }

    /// The end of the arm in the frame of the workstation (m).
    fn flange(&self) -> Isometry3<f64> {
        self.mirror.pose() * self.mirror.modal().tooling().flange_from_tool().inverse()
    }

    /// The controller as it is in this situation.
    fn controller(&mut self, start: &Situation) -> Result<Controller<N>, MotionFailure> {
        let key = key(
            &start.arm,
            start.tool.as_ref().map(|tool| tool.name.as_str()),
        );
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let difference = start.arm.inv_mul(&self.flange());
        if difference.translation.vector.norm() < 1e-3 && difference.rotation.angle() < 1e-2 {
            return Ok(self.mirror.clone());
        }
        Err(MotionFailure::new(0, "the arm is not where the world says"))
    }

    /// Plans a batch from where a controller is.
    fn plan(
        &self,
        mut controller: Controller<N>,
        batch: &Batch,
    ) -> Result<Planned<N>, MotionFailure> {
        let (mut ticks, mut commands) = (0, Vec::new());
        for (index, command) in batch.commands.iter().enumerate() {
            let parts = steps(&mut controller, command).map_err(|error| {
                let reason = format!("{}: {error}", crcl::text::write_command(command));
                MotionFailure::new(index, reason)
            })?;
            for (part, length) in parts {
                ticks += length;
                commands.push(part);
            }
        }
        Ok(Planned {
            end: controller,
            seconds: ticks as f64 / self.rate_hz,
            commands,
        })
    }

    fn remember(&mut self, start: &Situation, batch: &Batch, end: Controller<N>) {
        self.known.insert(end_key(start, batch), end);
    }
}

impl<const N: usize> Motion for ArmMotion<N> {
    fn arm(&mut self) -> Option<Isometry3<f64>> {
        Some(self.flange())
    }

    fn execute(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let Planned {
            end,
            seconds,
            commands,
        } = self.plan(self.mirror.clone(), batch)?;
        if let Some(arm) = &mut self.arm {
            arm.execute(&commands)?;
        }
        self.mirror = end.clone();
        self.remember(start, batch, end);
        Ok(seconds)
    }

    fn predict(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let key = key(
            &start.arm,
            start.tool.as_ref().map(|tool| tool.name.as_str()),
        );
        let key = (key, format!("{:?}", batch.commands));
        if let Some(seconds) = self.times.get(&key).copied()
            && self.known.get(&end_key(start, batch)).is_some()
        {
            return Ok(seconds);
        }
        let controller = self.controller(start)?;
        let Planned { end, seconds, .. } = self.plan(controller, batch)?;
        self.remember(start, batch, end);
        self.times.insert(key, seconds);
        Ok(seconds)
    }

    fn recover(&mut self) -> bool {
        self.mirror.abort();
        let Some(arm) = &mut self.arm else {
            return true;
        };
        let recovered = arm.recover();
        let joints = arm.setpoint();
        if joints.len() == N {
            self.mirror.set_joints(SVector::from_column_slice(&joints));
        }
        recovered
    }
}

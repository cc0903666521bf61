//! The arm of a robot for executing plans: moves are planned here, and executed by a driver if
//! there is one.

use crcl::LengthUnit;
use nalgebra::{Isometry3, SVector};
use plan::run::{Batch, Motion, MotionFailure, Situation};
use plan::world::Change;
use planner::controller::Controller;
use planner::robot::{Robot, RobotError};
use planner::way::{Leg, plan_way};

use crate::queue::Given;
use crate::recent::Recent;

/// Number of predictions and situations that are kept, at least.
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

/// A batch that can be executed.
struct Planned<const N: usize> {
    /// The controller afterwards.
    end: Controller<N>,
    seconds: f64,
    /// The commands as they are executed.
    legs: Vec<Leg<N>>,
}

/// A running engine that executes a few commands at a time, for a plan.
pub trait Mover {
    /// Executes commands and waits for the last.
    ///
    /// # Errors
    /// [`MotionFailure`], with `stopped` if the operator stopped the motion.
    fn execute(&mut self, commands: Vec<Given>) -> Result<(), MotionFailure>;

    /// Joint positions of the last setpoint (rad, m).
    fn setpoint(&self) -> Vec<f64>;

    /// Clears a fault; whether that was possible.
    fn recover(&mut self) -> bool;
}

/// An arm of `N` joints that is planned for, and moved by an `M` if there is one.
#[derive(Debug)]
pub struct ArmMotion<const N: usize, M> {
    /// Does in thought what the session does.
    mirror: Controller<N>,
    rate_hz: f64,
    mover: Option<M>,
    known: Recent<Key, Controller<N>>,
    times: Recent<(Key, String), f64>,
}

impl<const N: usize, M: Mover> ArmMotion<N, M> {
    /// The arm at its present position, or at home if nothing moves it; `rate_hz` is the servo rate
    /// in which times are counted.
    ///
    /// # Errors
    /// [`RobotError`] when the robot's description is wrong.
    pub fn new(robot: &Robot, rate_hz: f64, mover: Option<M>) -> Result<Self, RobotError> {
        let mut mirror = Controller::new(robot, rate_hz, LengthUnit::Meter)?;
        if let Some(mover) = &mover {
            mirror.set_joints(SVector::from_column_slice(&mover.setpoint()));
        }
        Ok(Self {
            mirror,
            rate_hz,
            mover,
            known: Recent::new(REMEMBERED),
            times: Recent::new(REMEMBERED),
        })
    }

    /// What moves the arm, to be ended.
    pub fn into_mover(self) -> Option<M> {
        self.mover
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
        let mut all = Vec::new();
        for (index, command) in batch.commands.iter().enumerate() {
            let legs = plan_way(&mut controller, command).map_err(|error| {
                let reason = format!("{}: {error}", crcl::text::write_command(command));
                MotionFailure::new(index, reason)
            })?;
            all.extend(legs);
        }
        let ticks: u64 = all.iter().map(|leg| leg.planned.step.ticks).sum();
        Ok(Planned {
            end: controller,
            seconds: ticks as f64 / self.rate_hz,
            legs: all,
        })
    }

    fn remember(&mut self, start: &Situation, batch: &Batch, end: Controller<N>) {
        self.known.insert(end_key(start, batch), end);
    }
}

impl<const N: usize, M: Mover> Motion for ArmMotion<N, M> {
    fn arm(&mut self) -> Option<Isometry3<f64>> {
        Some(self.flange())
    }

    fn execute(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let Planned { end, seconds, legs } = self.plan(self.mirror.clone(), batch)?;
        if let Some(mover) = &mut self.mover {
            mover.execute(given(legs))?;
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
        let Some(mover) = &mut self.mover else {
            return true;
        };
        let recovered = mover.recover();
        let joints = mover.setpoint();
        if joints.len() == N {
            self.mirror.set_joints(SVector::from_column_slice(&joints));
        }
        recovered
    }
}

/// Planned legs for a session: numbered from 1, executed as planned.
fn given<const N: usize>(legs: Vec<Leg<N>>) -> Vec<Given> {
    let (commands, planned): (Vec<_>, Vec<_>) = legs
        .into_iter()
        .map(|leg| (leg.command, leg.planned))
        .unzip();
    let program: crcl::Program = commands.into_iter().collect();
    let both = program.commands.into_iter().zip(planned);
    both.map(|(located, planned)| Given::Command {
        located,
        planned: Some(planned.into()),
    })
    .collect()
}

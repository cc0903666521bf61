//! The arm of a robot as a plan needs it: planned by the engine, and moved by a driver if there is
//! one.

use std::io;

use crcl::LengthUnit;
use engine::controller::Controller;
use engine::robot::Robot;
use nalgebra::{Isometry3, SVector};
use plan::run::{Batch, Motion, MotionFailure, Situation};
use plan::world::Change;

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

    /// Plans a batch; the controller afterwards and the time (s).
    fn plan(
        &self,
        mut controller: Controller<N>,
        batch: &Batch,
    ) -> Result<(Controller<N>, f64), MotionFailure> {
        let mut ticks = 0;
        for (index, command) in batch.commands.iter().enumerate() {
            match controller.step(command) {
                Ok(step) => ticks += step.ticks,
                Err(error) => {
                    let reason = format!("{}: {error}", crcl::text::write_command(command));
                    return Err(MotionFailure::new(index, reason));
                }
            }
        }
        Ok((controller, ticks as f64 / self.rate_hz))
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
        let (end, seconds) = self.plan(self.mirror.clone(), batch)?;
        if let Some(arm) = &mut self.arm {
            arm.execute(&batch.commands)?;
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
        let (end, seconds) = self.plan(controller, batch)?;
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
        let joints = arm.joints();
        if joints.len() == N {
            self.mirror.set_joints(SVector::from_column_slice(&joints));
        }
        recovered
    }
}

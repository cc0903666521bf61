//! The arm of a robot as a plan needs it: planned by the engine, and moved by a driver if there is
//! one.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crcl::{Command, LengthUnit};
use engine::controller::Controller;
use engine::robot::{EndEffector, Gripper, Robot, ToolChanger};
use engine::session::{Note, Session};
use nalgebra::{Isometry3, SVector};
use plan::run::{Batch, Motion, MotionFailure, Situation};
use plan::world::{Change, Class, Model, pointing_down};

use crate::failure::Failure;

/// Servo periods a second that dry runs count with.
pub(crate) const RATE_HZ: f64 = 1000.0;

/// Most predictions and situations that are remembered.
const MOST_REMEMBERED: usize = 4000;

/// Opening and closing time of a gripper or tool changer that the world says nothing about (s).
const NOMINAL_S: f64 = 0.2;

/// Gives the robot the end effectors of the world, and the places where they are kept.
pub(crate) fn equip(robot: &mut Robot, world: &Model) -> Result<(), plan::PlanError> {
    robot.end_effectors.clear();
    robot.mounted = None;
    let down = Isometry3::from_parts([0.0; 3].into(), pointing_down());
    let mut free: Vec<Isometry3<f64>> = Vec::new();
    for holder in world
        .objects()
        .filter(|o| o.class == Class::EndEffectorHolder)
    {
        if world.children(holder.id).next().is_none() {
            free.push(world.workstation_from(holder.id)? * down);
        }
    }
    for effector in world.objects().filter(|o| o.class.is_a(Class::EndEffector)) {
        let on_arm = world
            .effector()
            .is_some_and(|mounted| mounted.id == effector.id);
        if on_arm {
            robot.mounted = Some(robot.end_effectors.len());
        }
        // The engine knows a holder as the place of one end effector; the one on the arm gets a
        // place that is free.
        let workstation_from_holder = if on_arm {
            free.pop()
        } else {
            Some(world.workstation_from(effector.id)?)
        };
        robot.end_effectors.push(EndEffector {
            name: effector.name.clone(),
            flange_from_tcp: Isometry3::translation(0.0, 0.0, effector.effector_length()),
            gripper: Some(Gripper {
                opening: NOMINAL_S,
                closing: NOMINAL_S,
            }),
            workstation_from_holder,
        });
    }
    let nominal = ToolChanger {
        opening: NOMINAL_S,
        closing: NOMINAL_S,
    };
    robot.tool_changer.get_or_insert(nominal);
    Ok(())
}

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

/// A driver that this process runs itself, in step with the engine.
pub(crate) struct OwnDriver {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl OwnDriver {
    /// Starts the simulated driver of this robot.
    pub(crate) fn start(robot: &Robot, arm: &ipc::Arm) -> Result<Self, Failure> {
        let joints = &robot.joints;
        let options = driver_sim::Options {
            model: ipc::model_hash(robot.urdf.as_bytes()),
            position: robot.home.clone(),
            lower: joints.lower.iter().map(|value| value.max(-1e3)).collect(),
            upper: joints.upper.iter().map(|value| value.min(1e3)).collect(),
            velocity: joints.velocity.clone(),
            acceleration: joints.acceleration.clone(),
            jerk: joints.jerk.clone(),
            ..driver_sim::Options::new(arm.clone(), robot.dof())
        };
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let run = move || {
            if let Err(error) = driver_sim::run(options, &flag) {
                tracing::error!("simulated driver: {error}");
            }
        };
        let thread = std::thread::Builder::new()
            .name("driver".into())
            .spawn(run)?;
        Ok(Self {
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for OwnDriver {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A driver that panicked has already said so.
            let _ = thread.join();
        }
    }
}

/// An arm of `N` joints.
pub(crate) struct ArmMotion<const N: usize> {
    /// Does in thought what the session does.
    mirror: Controller<N>,
    session: Option<Session>,
    known: HashMap<Key, Controller<N>>,
    times: HashMap<(Key, String), f64>,
}

impl<const N: usize> ArmMotion<N> {
    /// The arm, at its home position or where the session found it.
    pub(crate) fn new(robot: &Robot, session: Option<Session>) -> Result<Self, Failure> {
        let mut mirror = Controller::new(robot, RATE_HZ, LengthUnit::Meter)
            .map_err(|error| Failure::new(crate::exit::Exit::Unreadable, error))?;
        if let Some(session) = &session {
            mirror.set_joints(SVector::from_column_slice(&session.start));
        }
        Ok(Self {
            mirror,
            session,
            known: HashMap::new(),
            times: HashMap::new(),
        })
    }

    /// The end of the arm in the frame of the workstation (m).
    fn flange(&self) -> Isometry3<f64> {
        self.mirror.pose() * self.mirror.modal().tooling().flange_from_tool().inverse()
    }

    /// The controller as it is in this situation.
    fn controller(&self, start: &Situation) -> Result<Controller<N>, MotionFailure> {
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
        let reason = "the arm is not where the world says".into();
        Err(MotionFailure { command: 0, reason })
    }

    /// Plans a batch; the controller afterwards and the time (s).
    fn plan(
        mut controller: Controller<N>,
        batch: &Batch,
    ) -> Result<(Controller<N>, f64), MotionFailure> {
        let mut ticks = 0;
        for (index, command) in batch.commands.iter().enumerate() {
            match controller.step(command) {
                Ok(step) => ticks += step.ticks,
                Err(error) => {
                    let reason = format!("{}: {error}", crcl::text::write_command(command));
                    return Err(MotionFailure {
                        command: index,
                        reason,
                    });
                }
            }
        }
        Ok((controller, ticks as f64 / RATE_HZ))
    }

    fn remember(&mut self, start: &Situation, batch: &Batch, end: Controller<N>) {
        if self.known.len() > MOST_REMEMBERED {
            self.known.clear();
        }
        self.known.insert(end_key(start, batch), end);
    }

    /// Has the session execute the commands and waits for the last.
    fn move_arm(&self, session: &Session, batch: &Batch) -> Result<(), MotionFailure> {
        let failure = |command: usize, reason: String| MotionFailure { command, reason };
        let program: crcl::Program = batch.commands.iter().cloned().collect();
        let ids = session
            .submit(program.commands)
            .map_err(|full| failure(0, format!("the queue is full: {full}")))?;
        let Some(last) = ids.last().copied() else {
            return Ok(());
        };
        let position = |id: u32| ids.iter().position(|known| *known == id).unwrap_or(0);
        let ends = matches!(batch.commands.last(), Some(Command::EndCanon { .. }));
        loop {
            match session.note(Duration::from_millis(100)) {
                Some(Note::Done { id, .. }) if id == last => return Ok(()),
                Some(Note::Ended { .. }) if ends => return Ok(()),
                Some(Note::Refused { id, error, .. }) => {
                    return Err(failure(position(id), error.to_string()));
                }
                Some(Note::Faulted { reason, .. }) => return Err(failure(0, reason)),
                Some(Note::Aborted { .. } | Note::Closed) => {
                    return Err(failure(0, "the motion was stopped".into()));
                }
                Some(Note::Message { text }) => crate::output::note(&text),
                _ => {}
            }
        }
    }
}

impl<const N: usize> Motion for ArmMotion<N> {
    fn arm(&mut self) -> Option<Isometry3<f64>> {
        Some(self.flange())
    }

    fn execute(&mut self, start: &Situation, batch: &Batch) -> Result<f64, MotionFailure> {
        let (end, seconds) = Self::plan(self.mirror.clone(), batch)?;
        if let Some(session) = &self.session {
            self.move_arm(session, batch)?;
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
        if let Some(seconds) = self.times.get(&key)
            && self.known.contains_key(&end_key(start, batch))
        {
            return Ok(*seconds);
        }
        let (end, seconds) = Self::plan(self.controller(start)?, batch)?;
        self.remember(start, batch, end);
        if self.times.len() > MOST_REMEMBERED {
            self.times.clear();
        }
        self.times.insert(key, seconds);
        Ok(seconds)
    }

    fn recover(&mut self) -> bool {
        self.mirror.abort();
        if let Some(session) = &self.session {
            session.recover();
            for _ in 0..50 {
                match session.note(Duration::from_millis(100)) {
                    Some(Note::Recovered) => return true,
                    Some(Note::Closed) => return false,
                    _ => {}
                }
            }
            return false;
        }
        true
    }
}

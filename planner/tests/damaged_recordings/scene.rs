//! Programs that every robot can execute, made from its home pose, and recordings of them.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use crcl::{Command, LengthUnit, Pose, Program};
use nalgebra::{Isometry3, Vector3};
use planner::dry_run::{Plan, PlanOptions, plan_program};
use planner::recorded::{ProgramVerdict, RecordedSample, verify_program};
use planner::robot::{Robot, load};

/// A robot at home.
pub(crate) struct Scene {
    pub(crate) robot: Robot,
    /// The controlled point at home, in the workstation.
    home: Isometry3<f64>,
    /// Plans that were made, by their programs: many recordings are of the same program.
    plans: RefCell<HashMap<String, Rc<Plan>>>,
}

/// Pose of the flange at home, from a plan that only waits.
fn home(robot: &Robot) -> Isometry3<f64> {
    let wait = [Command::InitCanon, Command::Dwell { seconds: 0.001 }];
    let program: Program = wait.into_iter().collect();
    let plan = plan_program(robot, &program, &PlanOptions::default()).unwrap();
    plan.samples(1.0).next().unwrap().workstation_from_tool
}

impl Scene {
    pub(crate) fn new(robot: &str) -> Self {
        let robot = load(robot).unwrap();
        Self {
            home: home(&robot),
            plans: RefCell::default(),
            robot,
        }
    }

    /// The plan of a program, made once.
    fn planned(&self, commands: &[Command]) -> Rc<Plan> {
        let name = format!("{commands:?}");
        if let Some(plan) = self.plans.borrow().get(&name) {
            return Rc::clone(plan);
        }
        let program: Program = commands.iter().cloned().collect();
        let plan = plan_program(&self.robot, &program, &PlanOptions::default()).unwrap();
        let plan = Rc::new(plan);
        self.plans.borrow_mut().insert(name, Rc::clone(&plan));
        plan
    }

    /// What was recorded of a program; none when the robot cannot do it.
    pub(crate) fn recorded(
        &self,
        commands: &[Command],
        period: f64,
    ) -> Option<Vec<RecordedSample>> {
        let plan = self.planned(commands);
        if !plan.refusals.is_empty() {
            return None;
        }
        Some(plan.samples(period).map(RecordedSample::from).collect())
    }

    /// A pose `way` (mm) and `turn` (rotation vector, rad) from home, in the tool's axes.
    pub(crate) fn pose(&self, way: [f64; 3], turn: [f64; 3]) -> Pose {
        let to = Isometry3::new(Vector3::from(way) * 1e-3, Vector3::from(turn));
        written(&(self.home * to))
    }

    /// The program that most damages are done to.
    pub(crate) fn program(&self) -> Vec<Command> {
        vec![
            Command::InitCanon,
            Command::SetRelativeSpeed { percent: 20.0 },
            Command::SetRelativeAcceleration { percent: 12.0 },
            Command::SetIntermediatePointTolerance { tolerance: 5.0 },
            Command::MoveTo {
                pose: self.pose([30.0, 10.0, -20.0], [0.1, 0.0, 0.1]),
            },
            Command::MoveStraightTo {
                pose: self.straight_goal(),
            },
            Command::CloseGripper,
            Command::Dwell { seconds: 0.2 },
            Command::MoveSmoothlyTo {
                poses: self.corners(),
            },
            Command::OpenGripper,
            Command::MoveStraightTo {
                pose: self.pose([-30.0, -20.0, -30.0], [0.0, 0.3, -0.25]),
            },
            Command::EndCanon { reason: 0 },
        ]
    }

    /// Where the straight move of [`Self::program`] ends.
    pub(crate) fn straight_goal(&self) -> Pose {
        self.pose([-30.0, 10.0, -20.0], [0.0, 0.25, 0.1])
    }

    /// The poses of the smooth move of [`Self::program`].
    pub(crate) fn corners(&self) -> Vec<Pose> {
        vec![
            self.pose([-30.0, 10.0, -50.0], [0.0, 0.25, 0.1]),
            self.pose([10.0, 10.0, -50.0], [0.0, 0.1, 0.1]),
            self.pose([10.0, -20.0, -50.0], [0.1, 0.0, 0.0]),
            self.pose([-30.0, -20.0, -30.0], [0.0, 0.0, 0.0]),
        ]
    }
}

/// A pose as a program writes it, in mm.
pub(crate) fn written(pose: &Isometry3<f64>) -> Pose {
    let point: Vector3<f64> = pose.translation.vector * 1e3;
    Pose::Axes {
        point: point.into(),
        z_axis: (pose.rotation * Vector3::z()).into(),
        x_axis: (pose.rotation * Vector3::x()).into(),
    }
}

/// Rows held against commands.
pub(crate) fn verdict(
    robot: &Robot,
    commands: &[Command],
    rows: &[RecordedSample],
) -> ProgramVerdict {
    let program: Program = commands.iter().cloned().collect();
    verify_program(robot, &program, LengthUnit::default(), rows)
}

impl Scene {
    /// How far from its pose a smooth move is at its widest pass, m.
    pub(crate) fn largest_deviation(&self, commands: &[Command], command: usize) -> f64 {
        let rows = self.recorded(commands, crate::PERIOD).unwrap();
        let verdict = verdict(&self.robot, commands, &rows);
        let passes = &verdict.commands[command].poses;
        let between = &passes[..passes.len() - 1];
        between
            .iter()
            .map(|pass| pass.deviation_m)
            .fold(0.0, f64::max)
    }
}

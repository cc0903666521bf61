//! Whatever the operator asks at any time: a program of a shipped robot keeps its joint limits, its
//! tool stays on the planned path, and the tolerances of the certificate hold.
//!
//! `CANTER_CASES` sets the number of random sequences; the long run is 10 000.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use std::path::Path;

use kinematics::Chain;
use nalgebra::{SVector, Vector3};
use planner::controller::Controller;
use planner::motion::PlannedMove;
use planner::robot::{load, vector};
use planner::task::{Move, Shape, Task};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use realtime::{Cycle, Demand, JointLimits, Segment, StopCategory};

const PERIOD: f64 = 0.001;
/// Distance of the tool from the path (m) that rounding may cause.
const ON_PATH: f64 = 1e-9;
/// Share of a limit that the guard leaves for rounding: a peak between two samples of the governor's
/// simulation may take a part of it (seen: 3e-4).
const ROOM: f64 = 1e-3;
/// Periods after which a program must have ended.
const LONGEST: usize = 120_000;

/// A move of the program with the tool it is made with.
struct Leg<const N: usize> {
    motion: Move,
    planned: PlannedMove<N>,
    chain: Chain<N>,
}

/// A robot with its planned program.
struct Bench<const N: usize> {
    start: SVector<f64, N>,
    limits: JointLimits<N>,
    legs: Vec<Leg<N>>,
}

impl<const N: usize> Bench<N> {
    fn new(robot: &str, example: &str) -> Self {
        let robot = load(robot).unwrap();
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../examples")
            .join(example);
        let text = std::fs::read_to_string(file).unwrap();
        let reading = crcl::text::read(&text, &crcl::ReadOptions::default());
        let mut controller =
            Controller::<N>::new(&robot, 1000.0, crcl::LengthUnit::default()).unwrap();
        let mut legs = Vec::new();
        for located in &reading.program.commands {
            let chain = *controller.chain();
            let step = controller.step(&located.command).unwrap();
            if let (Task::Move(motion), Some(planned)) = (step.task, step.planned)
                && !planned.trajectory.pieces().is_empty()
            {
                legs.push(Leg {
                    motion,
                    planned,
                    chain,
                });
            }
        }
        assert!(legs.len() >= 4, "{}", legs.len());
        Self {
            start: vector(&robot.home),
            limits: *controller.limits(),
            legs,
        }
    }

    /// The program from its beginning to its end under these demands, each for a time (ms), then
    /// at full speed.
    fn run(&self, demands: &[(Demand, u32)]) -> Result<(), TestCaseError> {
        let mut cycle = Box::new(Cycle::<N, 512>::new(self.start, self.limits, PERIOD));
        let mut demands = demands
            .iter()
            .flat_map(|(demand, periods)| std::iter::repeat_n(*demand, *periods as usize))
            .chain(std::iter::repeat(Demand::Run(1.0)));
        let mut pieces = self.legs.iter().enumerate().flat_map(|(command, leg)| {
            let pieces = leg.planned.trajectory.pieces();
            pieces
                .iter()
                .enumerate()
                .map(move |(index, piece)| Segment {
                    piece: *piece,
                    command: command as u32,
                    last: index + 1 == pieces.len(),
                })
        });
        let mut waiting = pieces.next();
        let mut past: Vec<SVector<f64, N>> = vec![self.start];
        let mut seen: Vec<Seen> = self.legs.iter().map(Seen::new).collect();
        let mut begun = false;
        for _ in 0..LONGEST {
            while let Some(segment) = &waiting
                && cycle.push(segment) == realtime::Pushed::Taken
            {
                waiting = pieces.next();
            }
            let step = cycle.step(demands.next().unwrap());
            prop_assert_eq!(step.trip, None);
            past.push(step.setpoint.position);
            self.check_limits(&past)?;
            if let Some(command) = step.finished {
                let leg = &self.legs[command as usize];
                seen[command as usize].check(leg, &leg.planned.end)?;
                if command as usize + 1 == self.legs.len() {
                    return Ok(());
                }
            }
            begun |= step.started.is_some();
            if begun {
                let leg = &self.legs[step.command as usize];
                seen[step.command as usize].take(leg, &step.setpoint.position, step.path_time)?;
            }
        }
        Err(TestCaseError::fail("the program never ended"))
    }

    /// Finite differences of the last positions: nothing but what was published counts.
    fn check_limits(&self, past: &[SVector<f64, N>]) -> Result<(), TestCaseError> {
        let within = |value: SVector<f64, N>, limit: &SVector<f64, N>, noise: f64, what: &str| {
            for joint in 0..N {
                prop_assert!(
                    value[joint].abs() <= limit[joint] * (1.0 + ROOM) + noise,
                    "{what} of joint {joint} is {} of {}, period {}",
                    value[joint],
                    limit[joint],
                    past.len()
                );
            }
            Ok(())
        };
        // Rounding of a position of a few rad.
        let noise = 4e-15;
        let n = past.len();
        let h = PERIOD;
        within(
            (past[n - 1] - past[n - 2]) / h,
            &self.limits.velocity,
            noise / h,
            "velocity",
        )?;
        if n >= 3 {
            let second = past[n - 1] - past[n - 2] * 2.0 + past[n - 3];
            within(
                second / (h * h),
                &self.limits.acceleration,
                noise / (h * h),
                "acceleration",
            )?;
        }
        if n >= 4 {
            let third = past[n - 1] - past[n - 4] + (past[n - 3] - past[n - 2]) * 3.0;
            within(
                third / (h * h * h),
                &self.limits.jerk,
                2.0 * noise / (h * h * h),
                "jerk",
            )?;
        }
        Ok(())
    }
}

/// What was seen of a move: how near its tool came to each pose, and how far from the line.
struct Seen {
    nearest: Vec<f64>,
    last: Option<Vector3<f64>>,
    longest_step: f64,
    off_line: f64,
}

impl Seen {
    fn new<const N: usize>(leg: &Leg<N>) -> Self {
        Self {
            nearest: vec![f64::INFINITY; leg.motion.poses.len()],
            last: None,
            longest_step: 0.0,
            off_line: 0.0,
        }
    }

    /// One period: on the planned path, and nearer to some pose.
    fn take<const N: usize>(
        &mut self,
        leg: &Leg<N>,
        position: &SVector<f64, N>,
        path_time: f64,
    ) -> Result<(), TestCaseError> {
        let trajectory = &leg.planned.trajectory;
        let planned = trajectory.sample(path_time.min(trajectory.duration()));
        let place = |joints: &SVector<f64, N>| leg.chain.forward(joints).translation.vector;
        let here = place(position);
        let distance = (here - place(&planned.position)).norm();
        prop_assert!(
            distance <= ON_PATH,
            "{distance} m from the path at {path_time} s"
        );
        for (nearest, pose) in self.nearest.iter_mut().zip(&leg.motion.poses) {
            *nearest = nearest.min((here - pose.translation.vector).norm());
        }
        if let Some(last) = self.last.replace(here) {
            self.longest_step = self.longest_step.max((here - last).norm());
        }
        if leg.motion.shape == Shape::Straight {
            let from = place(&trajectory.sample(0.0).position);
            let to = leg.motion.poses[0].translation.vector;
            let along = (to - from).try_normalize(1e-9).unwrap_or_default();
            let aside = (here - from) - along * along.dot(&(here - from));
            self.off_line = self.off_line.max(aside.norm());
        }
        Ok(())
    }

    /// At the end: what the certificate promised.
    fn check<const N: usize>(
        &self,
        leg: &Leg<N>,
        end: &SVector<f64, N>,
    ) -> Result<(), TestCaseError> {
        let certificate = &leg.planned.certificate;
        let (last, between) = leg.motion.poses.split_last().unwrap();
        let arrived = leg.chain.forward(end).translation.vector;
        let off = (arrived - last.translation.vector).norm();
        prop_assert!(
            off <= certificate.end_deviation_m + ON_PATH,
            "{off} m off the end"
        );
        if leg.motion.shape == Shape::Smooth {
            for ((index, _), pass) in between.iter().enumerate().zip(&certificate.poses) {
                // The nearest point may lie between two periods.
                let slack = self.longest_step / 2.0 + ON_PATH;
                let nearest = self.nearest[index];
                prop_assert!(
                    nearest <= pass.tolerance_m + slack,
                    "pose {} passed at {nearest} m, tolerance {}",
                    index + 1,
                    pass.tolerance_m
                );
            }
        }
        if let Some(straightness) = certificate.straightness_m {
            let most = straightness.max(1e-7) + ON_PATH;
            prop_assert!(self.off_line <= most, "{} m off the line", self.off_line);
        }
        Ok(())
    }
}

fn demand() -> impl Strategy<Value = Demand> {
    prop_oneof![
        4 => (0.0..1.0_f64).prop_map(Demand::Run),
        2 => Just(Demand::Run(1.0)),
        1 => Just(Demand::Run(0.0)),
        2 => Just(Demand::Stop(StopCategory::Gentle)),
        2 => Just(Demand::Stop(StopCategory::Fast)),
    ]
}

/// Random pauses, resumes, overrides and stops through a whole program.
fn law<const N: usize>(robot: &str, example: &str) {
    let cases = std::env::var("CANTER_CASES").map_or(25, |text| text.parse().unwrap());
    let bench = Bench::<N>::new(robot, example);
    let mut runner = TestRunner::new(ProptestConfig {
        rng_seed: RngSeed::Fixed(17),
        cases,
        max_shrink_iters: 30,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let sequences = prop::collection::vec((demand(), 1_u32..500), 0..16);
    let result = runner.run(&sequences, |demands| bench.run(&demands));
    assert!(result.is_ok(), "{}", result.unwrap_err());
}

#[test]
fn a_ur5e_stays_on_its_path() {
    law::<6>("ur5e", "pick_and_place.canon");
}

#[test]
fn a_panda_stays_on_its_path() {
    law::<7>("panda", "pick_and_place.canon");
}

//! Checks random planned programs on every shipped robot, from samples, URDF and robot.toml alone,
//! with `k` and its own arithmetic.
//!
//! `CANTER_JUDGE_PROGRAMS` sets the number of programs per robot, `CANTER_JUDGE_SEED` the first
//! seed, which otherwise is another one for each robot. 10 010 programs:
//! `CANTER_JUDGE_PROGRAMS=715 CANTER_JUDGE_SEED=0 cargo test --release -p system-tests --test judge`.

mod kinematics;
mod laws;
mod programs;
mod random;
mod tally;

use std::panic::{AssertUnwindSafe, catch_unwind};

use crcl::Program;
use k::nalgebra::{UnitQuaternion, Vector3};
use planner::dry_run::{FailurePolicy, Plan, PlanOptions, plan_program};
use planner::robot::{Robot, load};
use programs::Meaning;
use system_tests::arm::Arm;
use tally::Tally;

/// Number of programs per robot unless the environment sets another.
const PROGRAMS: u64 = 1;

fn number(variable: &str, otherwise: u64) -> u64 {
    let value = std::env::var(variable).ok();
    value.map_or(otherwise, |text| text.parse().expect("a whole number"))
}

fn planned(robot: &Robot, program: &Program) -> Plan {
    let options = PlanOptions {
        rate_hz: laws::RATE,
        on_refusal: FailurePolicy::Skip,
        ..PlanOptions::default()
    };
    plan_program(robot, program, &options).expect("the robot can be planned for")
}

/// Judges one program.
fn judge(arm: &Arm, robot: &Robot, seed: u64, tally: &mut Tally) {
    let random = programs::program(arm, seed);
    tally.program = format!("{} {seed}", robot.name);
    tally.programs += 1;
    let program: Program = random.commands.iter().cloned().collect();
    let plan = catch_unwind(AssertUnwindSafe(|| planned(robot, &program)));
    tally.must("no panic", plan.is_ok());
    let Ok(plan) = plan else { return };
    let moves = plan
        .commands
        .iter()
        .filter(|command| command.certificate.is_some());
    tally.moves += moves.count();
    tally.refused += plan.refusals.len();
    for refusal in &plan.refusals {
        let text = refusal.error.to_string();
        tally.must(
            "a refusal has a reason with numbers that are numbers",
            !text.contains("NaN"),
        );
    }
    laws::judge(arm, &random.meanings, &plan, tally);
    if seed.is_multiple_of(8) {
        let again = planned(robot, &program);
        let equal = plan.samples(0.003).eq(again.samples(0.003));
        tally.must("the same again", equal);
    }
}

fn judged(name: &str) -> Tally {
    let (arm, robot) = (Arm::read(name), load(name).expect("a shipped robot"));
    let own = NAMED.iter().position(|named| *named == name).unwrap_or(0);
    let first = number("CANTER_JUDGE_SEED", own as u64);
    let mut tally = Tally::default();
    for seed in first..first + number("CANTER_JUDGE_PROGRAMS", PROGRAMS) {
        judge(&arm, &robot, seed, &mut tally);
    }
    tally
}

macro_rules! robots {
    ($($robot:ident)*) => {
        /// The robots that have a test of their own.
        const NAMED: &[&str] = &[$(stringify!($robot)),*];
        $(#[test]
        fn $robot() {
            let tally = judged(stringify!($robot));
            println!("{}", tally.table());
            assert!(tally.moves * 2 > tally.programs, "hardly a move was made");
            assert_eq!(tally.broken(), 0, "{}", tally.table());
        })*
    };
}

robots! {
    fr3 gantry iiwa14 iiwa7 irb120 irb1200_5_90 irb1200_7_70 lrmate200id panda tx2_60 ur10e ur5e
    xarm6 xarm7
}

/// A pose that is passed with another orientation than its ball allows is found, by the samples and
/// by the angle in the certificate; the place is as it must be.
#[test]
fn a_pass_with_another_orientation_is_seen() {
    const PLACES: &str = "poses passed in order, within tolerance and corridor";
    let (arm, robot) = (Arm::read("ur5e"), load("ur5e").expect("a shipped robot"));
    let mut seen = 0;
    for seed in 0..30 {
        let mut random = programs::program(&arm, seed);
        let program: Program = random.commands.iter().cloned().collect();
        let plan = planned(&robot, &program);
        let made = |index: usize| plan.commands.iter().any(|command| command.index == index);
        let smooth = random.meanings.iter_mut().enumerate();
        let smooth = smooth.filter(|(index, _)| plan.refusals.is_empty() && made(*index));
        let Some(motion) = smooth
            .filter_map(|(_, meaning)| match meaning {
                Meaning::Move(motion) if motion.poses.len() > 2 => Some(motion),
                _ => None,
            })
            .next()
        else {
            continue;
        };
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.6, 0.0));
        motion.poses[0].rotation *= turn;
        let mut tally = Tally::default();
        laws::judge(&arm, &random.meanings, &plan, &mut tally);
        assert!(!tally.is_broken(PLACES), "seed {seed}: {}", tally.table());
        for law in [
            "poses passed with their orientation",
            "certificate: the angle is that of its time",
        ] {
            assert!(tally.is_broken(law), "seed {seed}: {law}");
        }
        seen += 1;
        if seen > 2 {
            break;
        }
    }
    assert!(seen > 2, "{seen} programs had a smooth move");
}

#[test]
fn every_shipped_robot_is_judged() {
    assert_eq!(planner::robot::list(), NAMED);
}

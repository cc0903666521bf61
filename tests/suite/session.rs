//! A program through the whole chain: queue, planner, real-time thread, shared memory, driver. Here
//! the driver runs in a thread of this process; the tests of the command line have it in a separate
//! process.

use std::time::Duration;

use engine::session::{Note, RunSample, Session, SessionConfig};
use ipc::Clock;
use planner::dry_run::{PlanOptions, PlanSample, plan_program};
use planner::robot::Robot;
use system_tests::driver_thread::{DriverThread, options_of};

const PROGRAM: &str = r#"
InitCanon()
SetRelativeSpeed(50)
SetRelativeAcceleration(50)
SetIntermediatePointTolerance(2)
MoveTo({{400, -100, 300}, {0, 0, -1}, {1, 0, 0}})
MoveStraightTo({{400, 100, 300}, {0, 0, -1}, {1, 0, 0}})
CloseGripper()
Message("half way")
Dwell(0.05)
OpenGripper()
MoveSmoothlyTo({{{400, 100, 200}, {0, 0, -1}, {1, 0, 0}}, {{400, -100, 200}, {0, 0, -1}, {1, 0, 0}},
  {{400, -100, 300}, {0, 0, -1}, {1, 0, 0}}}, 3)
EndCanon(0)
"#;

/// Runs the program to its end and returns what was reported and recorded.
fn run(robot: &Robot, name: &str) -> (Vec<Note>, Vec<RunSample>) {
    let arm = system_tests::domain::arm(&format!("test/{name}"));
    let _driver = DriverThread::start(options_of(robot, &arm));
    let mut config = SessionConfig::new(arm);
    config.clock = Clock::LockStep;
    config.record = true;
    let mut session = Session::start(robot, &config).unwrap();
    let program = crcl::text::read(PROGRAM, &crcl::ReadOptions::default()).program;
    session.submit(program.commands).unwrap();
    let mut notes = Vec::new();
    for _ in 0..600 {
        notes.extend(session.note(Duration::from_millis(100)));
        let over = |note: &Note| {
            matches!(
                note,
                Note::Done {
                    name: "EndCanon",
                    ..
                } | Note::Faulted { .. }
            )
        };
        if notes.iter().any(over) {
            break;
        }
    }
    // The sample of the very last setpoint is complete only now.
    session.close();
    (notes, session.samples())
}

fn planned(robot: &Robot) -> Vec<PlanSample> {
    let program = crcl::text::read(PROGRAM, &crcl::ReadOptions::default()).program;
    let plan = plan_program(robot, &program, &PlanOptions::default()).unwrap();
    assert!(plan.refusals.is_empty(), "{:?}", plan.refusals);
    plan.samples(0.001).collect()
}

/// Every setpoint of every move is the one of the dry run, in order, none left out.
fn assert_equal_to_plan(run: &[RunSample], plan: &[PlanSample]) {
    for command in 0..12_u32 {
        let dry: Vec<_> = plan
            .iter()
            .filter(|s| s.command == command as usize)
            .collect();
        let moves = dry.windows(2).any(|pair| pair[0].q != pair[1].q);
        if !moves {
            continue;
        }
        let wet: Vec<_> = run
            .iter()
            .filter(|s| s.command == command + 1 && s.path_time > 0.0)
            .collect();
        // The period in which a move ends at rest may already belong to the next command.
        let (ran, due) = (wet.len() + 1, dry.len());
        assert!(ran >= due, "command {command}: {ran} of {due} setpoints");
        for (wet, dry) in wet.iter().zip(&dry) {
            for (a, b) in wet.q.iter().zip(&dry.q) {
                assert!(
                    (a - b).abs() < 1e-9,
                    "command {command} at {} s",
                    wet.path_time
                );
            }
        }
    }
}

fn names_done(notes: &[Note]) -> Vec<&'static str> {
    notes
        .iter()
        .filter_map(|note| match note {
            Note::Done { name, .. } => Some(*name),
            _ => None,
        })
        .collect()
}

#[test]
fn a_program_runs_in_step_with_the_driver() {
    let robot = planner::robot::load("ur5e").unwrap();
    let (notes, samples) = run(&robot, "step");
    assert_eq!(names_done(&notes).len(), 12, "{notes:#?}");
    let planned = planned(&robot);
    assert_equal_to_plan(&samples, &planned);
    // Down to the end of the last move: after it comes nothing that could push it out.
    let (wet, dry) = (samples.last().unwrap(), planned.last().unwrap());
    let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
    assert!(wet.q.iter().zip(&dry.q).all(close), "{wet:?} {dry:?}");
    let off = |s: &RunSample| {
        let gap = s.workstation_from_tool.translation.vector - s.measured_pose.translation.vector;
        gap.norm()
    };
    let worst = samples.iter().map(off).fold(0.0, f64::max);
    assert!(worst < 2e-3, "the driver is {worst} m off its setpoint");
}

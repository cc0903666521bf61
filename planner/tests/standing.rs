//! Moves to where the arm already is, and turns on the spot.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use crcl::{Command, LengthUnit, Pose};
use planner::controller::Controller;
use planner::dry_run::{PlanOptions, plan_program};

/// Both moves are allowed, take no time and leave the joints as they are.
#[test]
fn a_move_to_where_the_arm_is_takes_no_time() {
    let robot = planner::robot::load("ur5e").unwrap();
    let mut controller = Controller::<6>::new(&robot, 1000.0, LengthUnit::Meter).unwrap();
    controller.step(&Command::InitCanon).unwrap();
    let unit = LengthUnit::Meter;
    controller.step(&Command::SetLengthUnits { unit }).unwrap();
    let (here, joints) = (controller.pose(), *controller.joints());
    let axis = |axis: nalgebra::Vector3<f64>| (here.rotation * axis).into();
    let pose = Pose::Axes {
        point: here.translation.vector.into(),
        z_axis: axis(nalgebra::Vector3::z()),
        x_axis: axis(nalgebra::Vector3::x()),
    };
    let poses = vec![pose; 3];
    for command in [
        Command::MoveStraightTo { pose },
        Command::MoveTo { pose },
        Command::MoveSmoothlyTo { poses },
    ] {
        let step = controller.step(&command).unwrap();
        assert_eq!(step.ticks, 0, "{command:?}");
        let moved = (controller.joints() - joints).amax();
        assert!(moved < 1e-9, "{command:?}: {moved}");
    }
}

/// A turn on the spot at the last point, after several legs with a tolerance, is planned.
#[test]
fn a_turn_on_the_spot_after_several_legs_is_planned() {
    let text = "InitCanon()
SetRelativeSpeed(50)
SetRelativeAcceleration(50)
SetIntermediatePointTolerance(2)
MoveTo({{400, -60, 320}, {0, 0, -1}, {1, 0, 0}})
MoveSmoothlyTo({ {{400, 0, 320}, {0, 0, -1}, {1, 0, 0}}, {{400, 40, 360}, {0, 0, -1}, {1, 0, 0}},
  {{400, 80, 320}, {0, 0, -1}, {1, 0, 0}}, {{400, 80, 320}, {0, 0.2, -1}, {1, 0, 0}} }, 4)
";
    let program = crcl::text::read(text, &crcl::ReadOptions::default()).program;
    for name in ["ur5e", "panda", "irb120", "xarm7"] {
        let robot = planner::robot::load(name).unwrap();
        let plan = plan_program(&robot, &program, &PlanOptions::default()).unwrap();
        assert!(plan.refusals.is_empty(), "{name}: {:?}", plan.refusals);
        let certificate = plan.commands.last().unwrap().certificate.as_ref().unwrap();
        assert!(
            certificate.in_order && certificate.poses.len() == 3,
            "{name}"
        );
        assert!(certificate.peaks.largest() <= 1.0 + 1e-9, "{name}");
    }
}

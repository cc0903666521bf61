//! Moves to where the arm already is.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use crcl::{Command, LengthUnit, Pose};
use planner::controller::Controller;

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

//! Converts the end effectors of a world into those of a robot.

use nalgebra::Isometry3;
use plan::world::{Class, Model, pointing_down};
use planner::end_effector::{EndEffector, Gripper, ToolChanger};
use planner::robot::Robot;

/// Opening and closing time of a gripper or tool changer if the world has none (s).
const NOMINAL_S: f64 = 0.2;

/// Gives the robot the end effectors of the world, and the places where they are kept.
///
/// # Errors
/// [`plan::PlanError`] when an object of the world has no place.
pub fn equip(robot: &mut Robot, world: &Model) -> Result<(), plan::PlanError> {
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
        // In the engine a holder belongs to one end effector; the one on the arm gets a free
        // holder.
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
                width: None,
            }),
            inertia: None,
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

//! Chooses the path of a move that a kitting plan leaves open, so that the arm stays above the
//! workstation and the path is possible.

use crcl::{Command, Pose};

use crate::command_error::CommandError;
use crate::controller::{Controller, PlannedStep};
use crate::task::Task;

/// Time (s) between two checks of a free path.
const LOOK: f64 = 0.01;

/// How far (m) a free path may go below its lower end: half of the clearance that is kept during
/// travel.
const DIP: f64 = 0.02;

/// Largest number of parts of a straight path.
const MOST_PARTS: usize = 8;

/// A command as it is executed, and how.
#[derive(Clone, Debug)]
pub struct Leg<const N: usize> {
    /// The command.
    pub command: Command,
    /// How it was planned.
    pub planned: PlannedStep<N>,
}

/// Plans a command of a plan; returns the commands that do it.
///
/// A `MoveTo` becomes a `MoveStraightTo` where it would go below its lower end by more than 20 mm.
/// A `MoveStraightTo` that an arm with more than six joints cannot do in one move is divided into
/// up to eight parts with a rest between them; for each part the arm chooses its posture again.
///
/// # Errors
/// A [`CommandError`]; the controller is then unchanged.
pub fn plan_way<const N: usize>(
    controller: &mut Controller<N>,
    command: &Command,
) -> Result<Vec<Leg<N>>, CommandError> {
    match command {
        Command::MoveTo { pose } => free(controller, pose),
        Command::MoveStraightTo { pose } => straight(controller, pose),
        _ => Ok(vec![leg(controller, command.clone())?]),
    }
}

fn leg<const N: usize>(
    controller: &mut Controller<N>,
    command: Command,
) -> Result<Leg<N>, CommandError> {
    let planned = controller.step_ahead(&command)?;
    Ok(Leg { command, planned })
}

/// A free path between two places above the workstation; a straight one if the free path would go
/// too low.
fn free<const N: usize>(
    controller: &mut Controller<N>,
    pose: &Pose,
) -> Result<Vec<Leg<N>>, CommandError> {
    let mut trial = controller.clone();
    let leg = leg(&mut trial, Command::MoveTo { pose: *pose })?;
    if let Some(motion) = &leg.planned.step.planned {
        let ends = [controller.pose(), trial.pose()].map(|pose| pose.translation.z);
        let moments = (motion.trajectory.duration() / LOOK).ceil() as usize;
        let lowest = (0..=moments)
            .map(|moment| motion.trajectory.sample(moment as f64 * LOOK).position)
            .map(|joints| trial.chain().forward(&joints).translation.z)
            .fold(f64::INFINITY, f64::min);
        if lowest < ends[0].min(ends[1]) - DIP {
            return straight(controller, pose);
        }
    }
    *controller = trial;
    Ok(vec![leg])
}

/// A straight path, divided into parts if the arm cannot do it in one move.
fn straight<const N: usize>(
    controller: &mut Controller<N>,
    pose: &Pose,
) -> Result<Vec<Leg<N>>, CommandError> {
    let command = Command::MoveStraightTo { pose: *pose };
    let whole = match leg(controller, command.clone()) {
        Ok(leg) => return Ok(vec![leg]),
        Err(error) => error,
    };
    let Ok(Task::Move(motion)) = controller.resolve(&command) else {
        return Err(whole);
    };
    let Some(goal) = motion.poses.last().copied() else {
        return Err(whole);
    };
    let start = controller.pose();
    let mut parts = 2;
    while N > 6 && parts <= MOST_PARTS {
        let mut trial = controller.clone();
        let part = |number: usize| {
            if number == parts {
                return leg(&mut trial, command.clone());
            }
            let share = number as f64 / parts as f64;
            let between = start.try_lerp_slerp(&goal, share, 1e-9).unwrap_or(goal);
            let pose = trial.written(&between);
            leg(&mut trial, Command::MoveStraightTo { pose })
        };
        let done: Result<Vec<_>, CommandError> = (1..=parts).map(part).collect();
        if let Ok(done) = done {
            *controller = trial;
            return Ok(done);
        }
        parts *= 2;
    }
    Err(whole)
}

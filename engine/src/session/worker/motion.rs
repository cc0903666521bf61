//! A planned motion as work of the real-time thread, and how near the measured tool must come to its end.

use planner::controller::Controller;
use realtime::{Piece, Segment};
use servo::{EndTolerance, Work};

/// The work of pieces of `command`; `whole` says whether the command ends with the last of them, and
/// `within` how near the tool must come then.
pub(super) fn motion<const N: usize>(
    command: u32,
    pieces: &[Piece<N>],
    whole: bool,
    within: Option<EndTolerance<N>>,
) -> Vec<Work<N>> {
    let mut work = Vec::with_capacity(pieces.len() + 1);
    for (index, piece) in pieces.iter().enumerate() {
        let last = whole && index + 1 == pieces.len();
        if last {
            work.extend(within.map(Work::End));
        }
        work.push(Work::Motion(Segment {
            piece: *piece,
            command,
            last,
        }));
    }
    work
}

/// How near the tool must come to the end of a move of these pieces, by `SetEndPointTolerance` and
/// `SetEndAngleTolerance`; none where the program sets none.
pub(super) fn end_tolerance<const N: usize>(
    command: u32,
    pieces: &[Piece<N>],
    controller: &Controller<N>,
) -> Option<EndTolerance<N>> {
    let given = |tolerance: f64| {
        if tolerance > 0.0 {
            tolerance
        } else {
            f64::INFINITY
        }
    };
    let settings = controller.modal().settings();
    let [point, angle] = [settings.end_point, settings.end_angle].map(given);
    let last = pieces
        .last()
        .filter(|_| point.is_finite() || angle.is_finite())?;
    let joints = last.sample(last.duration).position;
    Some(EndTolerance {
        command,
        joints,
        jacobian: controller.chain().jacobian(&joints).1,
        point,
        angle,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tolerance that the last command of a program gets on a UR5e.
    fn of_last(program: &str) -> Option<EndTolerance<6>> {
        let robot = planner::robot::load("ur5e").unwrap();
        let mut controller = Controller::<6>::new(&robot, 1000.0, crcl::LengthUnit::Meter).unwrap();
        let reading = crcl::text::read(program, &crcl::ReadOptions::default());
        let mut found = None;
        for command in reading.program.iter() {
            let step = controller.step(command).unwrap();
            let planned = step.planned.as_ref();
            let pieces = planned.map_or(&[][..], |it| it.trajectory.pieces());
            found = end_tolerance(1, pieces, &controller);
        }
        found
    }

    #[test]
    fn moves_have_the_end_tolerance_that_is_set() {
        let units = "InitCanon()\nSetLengthUnits(\"mm\")\n";
        let set = format!("{units}SetEndPointTolerance(0.5)\n");
        let pose = "{{400, 100, 300}, {0, 0, -1}, {1, 0, 0}}";
        let to_pose = format!("MoveTo({pose})\n");
        let of_joint = "ActuateJoints({{1, 10}})\n";
        for moves in [&to_pose, of_joint] {
            let end = of_last(&format!("{set}{moves}")).unwrap();
            assert_eq!((end.point, end.angle), (5e-4, f64::INFINITY));
            assert_eq!(of_last(&format!("{units}{moves}")), None);
        }
        assert_eq!(of_last(&format!("{set}Dwell(0.1)\n")), None);
    }
}

//! A planned motion as work of the real-time thread, and how near the measured tool must come to its end.

use kinematics::Chain;
use planner::modal::Settings;
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
    chain: &Chain<N>,
    settings: &Settings,
) -> Option<EndTolerance<N>> {
    let given = |tolerance: f64| {
        if tolerance > 0.0 {
            tolerance
        } else {
            f64::INFINITY
        }
    };
    let [point, angle] = [settings.end_point, settings.end_angle].map(given);
    let last = pieces
        .last()
        .filter(|_| point.is_finite() || angle.is_finite())?;
    let joints = last.sample(last.duration).position;
    Some(EndTolerance {
        command,
        joints,
        jacobian: chain.jacobian(&joints).1,
        point,
        angle,
    })
}

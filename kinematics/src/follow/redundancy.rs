//! The null-space motion of arms with more than six joints: chosen over the whole path.

use super::FollowPoint;
use super::error::FollowError;
use super::null_space::NullSpace;
use super::null_space_path;
use super::trace::Task;
use nalgebra::{SMatrix, SVector};

/// Distance from a limit, rad or m, from which a joint counts as well inside.
const ROOM: f64 = 0.1;
/// Smallest singular value that counts as well away from singular poses.
const NIMBLE: f64 = 0.05;

/// A joint path with its quality, or why there is none.
type Attempt<const N: usize> = (f64, Result<Vec<FollowPoint<N>>, FollowError>);

/// Follows without null-space motion if the quality is good, otherwise along the polynomial that a
/// search over the whole path finds. The null-space motion is measured along the direction in which
/// the arm can move at the start. Where that direction becomes one that moves the tool, the path
/// seems singular though the arm is not; then single joints are tried as the measure.
pub(super) fn resolve<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
) -> Result<Vec<FollowPoint<N>>, FollowError> {
    let (_, jacobian) = task.solver.chain().jacobian(start);
    let directions = null_space(&jacobian);
    let (mut best, mut answer) = along(task, start, &directions);
    if answer.is_ok() {
        return answer;
    }
    for joint in measures(&directions[0]) {
        let mut single = directions;
        single[0] = SVector::from_fn(|row, _| if row == joint { 1.0 } else { 0.0 });
        let (found, points) = along(task, start, &single);
        if points.is_ok() && found > best {
            (best, answer) = (found, points);
        }
        if best >= ENOUGH {
            break;
        }
    }
    answer
}

/// A path of this quality ends the search along single joints.
const ENOUGH: f64 = 0.2;
/// Least share of a joint in the null-space motion at the start, if it is to measure it.
const SHARE: f64 = 0.1;

/// The joints that can measure the null-space motion, those that move most first.
fn measures<const N: usize>(direction: &SVector<f64, N>) -> Vec<usize> {
    let mut joints: Vec<usize> = (0..N).filter(|i| direction[*i].abs() >= SHARE).collect();
    joints.sort_by(|a, b| direction[*b].abs().total_cmp(&direction[*a].abs()));
    joints
}

/// The best path whose null-space motion is measured along the first direction.
fn along<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
    directions: &[SVector<f64, N>; 2],
) -> Attempt<N> {
    let (from, to) = (task.grid[0], task.grid[task.grid.len() - 1]);
    let polynomials = directions.map(|direction| [direction.dot(start), 0.0, 0.0, 0.0, 0.0, 0.0]);
    let still = NullSpace {
        directions: *directions,
        polynomials,
        from,
        span: to - from,
        u: from,
        still_ends: task.options.still_ends,
    };
    let first = task.trace(start, &still);
    let quality = |points: &Vec<FollowPoint<N>>| quality(task, points);
    let mut best = first.as_ref().map_or(f64::NEG_INFINITY, quality);
    // A path cannot be expected to be better than its start.
    if first.is_ok() && best >= 1.0 {
        return (best, first);
    }
    let mut answer = first;
    for null_space_path in null_space_path::search(task, start, &still) {
        let mut moving = still;
        moving.polynomials[0] = null_space_path;
        if let Ok(points) = task.trace(start, &moving) {
            let found = quality(&points);
            if found > best {
                (best, answer) = (found, Ok(points));
            }
            if best >= 1.0 {
                break;
            }
        }
    }
    (best, answer)
}

/// How well a path stays inside limits and away from singular poses: 1 is good, or no worse than at
/// its start.
fn quality<const N: usize>(task: &Task<'_, N>, points: &[FollowPoint<N>]) -> f64 {
    let chain = task.solver.chain();
    let one = |point: &FollowPoint<N>| {
        let room = (0..N).fold(f64::INFINITY, |room, i| {
            let q = point.q[0][i];
            room.min(chain.upper()[i] - q).min(q - chain.lower()[i])
        });
        (room / ROOM).min(point.smallest / NIMBLE)
    };
    let start = points.first().map_or(1.0, one).clamp(1e-6, 1.0);
    points.iter().map(one).fold(f64::INFINITY, f64::min) / start
}

/// Directions in which the joints can move without moving the tool: `N - 6` of them,
/// at right angles to each other and to the rows of the Jacobian.
fn null_space<const N: usize>(jacobian: &SMatrix<f64, 6, N>) -> [SVector<f64, N>; 2] {
    let mut basis: Vec<SVector<f64, N>> = Vec::new();
    let mut reduce = |mut v: SVector<f64, N>, keep: bool| {
        // Twice: the second pass removes the rounding of the first.
        for _ in 0..2 {
            for b in &basis {
                v -= b * b.dot(&v);
            }
        }
        let length = v.norm();
        if keep && length > 1e-9 {
            basis.push(v / length);
        }
        (v, length)
    };
    for i in 0..6 {
        reduce(jacobian.row(i).transpose(), true);
    }
    std::array::from_fn(|k| {
        if k + 6 >= N {
            return SVector::zeros();
        }
        let unit = |i: usize| SVector::from_fn(|row, _| if row == i { 1.0 } else { 0.0 });
        let longest = (0..N)
            .max_by(|a, b| {
                reduce(unit(*a), false)
                    .1
                    .total_cmp(&reduce(unit(*b), false).1)
            })
            .unwrap_or(0);
        let (v, length) = reduce(unit(longest), true);
        v / length.max(1e-300)
    })
}

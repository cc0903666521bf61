//! How well a path stays inside limits and away from singular poses.

use super::FollowPoint;
use super::trace::Task;
use crate::Chain;
use crate::measure::{self, NIMBLE, ROOM};
use nalgebra::SVector;

/// How well a path stays inside limits and away from singular poses: 1 is good, or no worse than at
/// its start.
pub(super) fn ease_along<const N: usize>(task: &Task<'_, N>, points: &[FollowPoint<N>]) -> f64 {
    let chain = task.solver.chain();
    let start = points
        .first()
        .map_or(1.0, |point| ease_at(chain, &point.q[0], f64::INFINITY));
    let least = points.iter().fold(f64::INFINITY, |least, point| {
        ease_at(chain, &point.q[0], least)
    });
    least / start.clamp(1e-6, 1.0)
}

/// How well joints are inside limits and away from singular poses, or `least`, if that is less.
pub(super) fn ease_at<const N: usize>(chain: &Chain<N>, q: &SVector<f64, N>, least: f64) -> f64 {
    let room = (0..N).fold(f64::INFINITY, |room, i| room.min(chain.room(i, q[i])));
    let least = least.min(room / ROOM);
    if measure::surely_nimble(chain, q, least * NIMBLE) {
        return least;
    }
    least.min(measure::dexterity(chain, q).smallest / NIMBLE)
}

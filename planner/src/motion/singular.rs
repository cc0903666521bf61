//! Detects paths that come so near to a singular pose that they have no time law.

use kinematics::follow::FollowPoint;
use kinematics::measure::dexterity;
use trajectory::Trajectory;

use super::{BlockedCause, MotionError, Planner};

impl<const N: usize> Planner<N> {
    /// Returns the trajectory if all its numbers are finite. Next to a singular pose the
    /// derivatives of the joints along the path become too large to compute with; the error then
    /// names the point of the path that is nearest to the singular pose.
    ///
    /// # Errors
    /// [`MotionError::Blocked`].
    pub(super) fn finite(
        &self,
        trajectory: Trajectory<N>,
        points: &[FollowPoint<N>],
        towards: &dyn Fn(f64) -> usize,
    ) -> Result<Trajectory<N>, MotionError> {
        let sound = |piece: &realtime::Piece<N>| {
            let ends = [0.0, piece.duration].map(|time| piece.sample(time).position);
            ends.iter().flat_map(|q| q.iter()).all(|q| q.is_finite())
        };
        if trajectory.pieces().iter().all(sound) {
            return Ok(trajectory);
        }
        let smallest = |point: &FollowPoint<N>| dexterity(self.chain(), &point.q[0]).smallest;
        let worst = points
            .iter()
            .map(|point| (smallest(point), point.u))
            .min_by(|one, other| one.0.total_cmp(&other.0));
        let (smallest, u) = worst.unwrap_or((0.0, 0.0));
        let end = points.last().map_or(1.0, |point| point.u);
        Err(MotionError::Blocked {
            pose: towards(u),
            percent: if end > 0.0 { 100.0 * u / end } else { 0.0 },
            cause: BlockedCause::NearSingular { smallest },
        })
    }
}

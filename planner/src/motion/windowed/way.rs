//! The check of the whole way of a long smooth move.

use std::borrow::Cow;

use nalgebra::SVector;
use trajectory::Boundary;
use trajectory::smooth::{FittedCurve, SmoothOptions};

use super::super::Planner;
use super::WindowedMove;
use super::ahead::Ahead;
use crate::task::{Move, Shape};

/// Fewest poses of a move that is planned in windows.
const LONG: usize = 3500;
/// Least tolerance, m: a fiftieth of it is kept for what follows the curve.
const LEAST_TOLERANCE: f64 = 1e-5;

impl<const N: usize> Planner<N> {
    /// Checks the whole way of a long smooth move: a curve passes every pose in order within 0.98 of
    /// its tolerances and stays in the corridor; the joints follow it on one branch, inside their
    /// ranges, away from singular places, from its first point to its last. The first window is planned
    /// too. `None` if that cannot be done in this way: then the move is planned as a whole.
    ///
    /// A list may be long, so one that is owned is not copied.
    pub(in super::super) fn begin_windows(
        &self,
        mut motion: Cow<'_, Move>,
        start: &SVector<f64, N>,
    ) -> Option<WindowedMove<N>> {
        let long = motion.shape == Shape::Smooth && motion.poses.len() >= LONG;
        if !long || motion.tolerance < LEAST_TOLERANCE || self.efforts.is_some() {
            return None;
        }
        self.check_reach(&motion, start).ok()?;
        let origin = self.chain().forward(start);
        let options = SmoothOptions::new(motion.tolerance, motion.limits);
        let curve = {
            let poses = &mut motion.to_mut().poses;
            poses.reserve_exact(1);
            poses.insert(0, origin);
            let curve = FittedCurve::new(poses, &options);
            poses.remove(0);
            curve?
        };
        let joints = self.joints_along(&curve, start, &motion)?;
        let mut windowed = WindowedMove {
            end: *joints.last(),
            ahead: Ahead::new(curve, joints),
            motion: motion.into_owned(),
            start: *start,
            origin,
            from: 0.0,
            boundary: Boundary::Rest,
            passed: 0,
            stop: None,
            certificate: None,
            rests: 0,
            first: None,
        };
        windowed.first = Some(self.next_window(&mut windowed).ok()?);
        Some(windowed)
    }
}

//! The check of the whole way of a long smooth move.

use std::borrow::Cow;

use nalgebra::{Isometry3, SVector};
use trajectory::Boundary;
use trajectory::smooth::{FittedCurve, SmoothOptions};

use super::super::Planner;
use super::super::corners::has_few;
use super::WindowedMove;
use super::ahead::Ahead;
use super::joints::{Checked, NoWay};
use crate::task::{Move, Shape};

/// Fewest poses of a move that is planned in windows.
const LONG: usize = 3500;
/// Least tolerance, m: a fiftieth of it is kept for what follows the curve.
const LEAST_TOLERANCE: f64 = 1e-5;

impl<const N: usize> Planner<N> {
    /// Checks the whole way of a long smooth move: a curve passes every pose in order within 0.98 of
    /// its tolerances and stays in the corridor; the joints follow it on one branch, inside their
    /// ranges, away from singular places, from its first point to its last. The first window is planned
    /// too. `None` if that cannot be done in this way, or if the list has few corners: then the move is planned as a whole.
    ///
    /// A list may be long, so it is not copied.
    pub(in super::super) fn begin_windows<'a>(
        &self,
        motion: Cow<'a, Move>,
        start: &SVector<f64, N>,
    ) -> Option<WindowedMove<'a, N>> {
        let long = motion.shape == Shape::Smooth && motion.poses.len() >= LONG;
        let narrow = motion.tolerance < LEAST_TOLERANCE;
        if !long || narrow || self.efforts.is_some() || has_few(&motion) {
            return None;
        }
        self.check_reach(&motion, start).ok()?;
        let origin = self.chain().forward(start);
        let (curve, checked) = self.checked_way(&motion, &origin, start)?;
        let mut windowed = WindowedMove {
            end: *checked.joints.last(),
            corridor_ratio: checked.corridor_ratio,
            ahead: Ahead::new(curve, checked),
            motion,
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

    /// The first curve that is good all along, if the arm follows it.
    fn checked_way(
        &self,
        motion: &Move,
        origin: &Isometry3<f64>,
        start: &SVector<f64, N>,
    ) -> Option<(FittedCurve, Checked<N>)> {
        let options = SmoothOptions::new(motion.tolerance, motion.limits);
        for curve in FittedCurve::all(origin, &motion.poses, &options) {
            match self.joints_along(&curve, start, motion) {
                Ok(checked) => return Some((curve, checked)),
                Err(NoWay::Curve) => {}
                Err(NoWay::Joints) => return None,
            }
        }
        None
    }
}

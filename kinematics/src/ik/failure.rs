//! Finds out why a goal is not reached.

use nalgebra::{Point3, SVector};

use super::goal::Goal;
use super::numeric::{Restarts, SolverResult, Stop};
use super::{IkFailure, IkReport, Solver, score, turns};
use crate::measure;

/// Restarts before a position alone is reported as out of reach.
const PLACES: u32 = 120;

impl<const N: usize> Solver<N> {
    /// Finds out why a goal was not reached. `place` is the nearest that the tool comes to its position, if that is known.
    #[cold]
    pub(super) fn report(
        &self,
        goal: &Goal,
        best: &SolverResult<N>,
        place: Option<SolverResult<N>>,
    ) -> IkReport<N> {
        let point = goal.point();
        if !goal.is_finite() {
            return self.report_with(best, IkFailure::NotFinite);
        }
        // If the search for the position alone fails, the distance is the reason.
        let place = place.unwrap_or_else(|| self.best_place(point, &best.q));
        if !place.reached {
            let distance = place.position;
            return self.report_with(best, IkFailure::OutOfReach { distance });
        }
        let free = self.best_of(
            goal,
            24,
            Stop {
                limits: false,
                ..self.stop
            },
            &best.q,
        );
        if free.reached {
            let q = turns::nearest(&self.chain, &free.q, &best.q);
            let (joint, beyond) = self.worst_joint(&q);
            if beyond > 1e-9 {
                return self.report_with(best, IkFailure::AtLimit { joint, beyond });
            }
        }
        if best.position < 1e-4 && best.rotation < 1e-4 {
            let smallest = measure::dexterity(&self.chain, &best.q).smallest;
            return self.report_with(best, IkFailure::Singular { smallest });
        }
        self.report_with(
            best,
            IkFailure::Orientation {
                angle: best.rotation,
            },
        )
    }

    /// The nearest that the tool comes to a position, with any orientation.
    pub(super) fn best_place(&self, point: Point3<f64>, seed: &SVector<f64, N>) -> SolverResult<N> {
        let target = Goal::Position(point).target();
        let seeds = Restarts::new(&self.chain);
        let mut best = self.descend(&target, seed, self.stop);
        for index in 0..PLACES {
            if best.reached {
                break;
            }
            let next = self.restarted(&target, &seeds, index);
            if next.reached || score(&next) < score(&best) {
                best = next;
            }
        }
        best
    }

    fn best_of(
        &self,
        goal: &Goal,
        tries: u32,
        stop: Stop,
        seed: &SVector<f64, N>,
    ) -> SolverResult<N> {
        let (target, seeds) = (goal.target(), Restarts::new(&self.chain));
        let mut best = self.descend(&target, seed, stop);
        for index in 0..tries {
            if best.reached {
                break;
            }
            let next = self.descend(&target, &seeds.at(index), stop);
            if next.reached || score(&next) < score(&best) {
                best = next;
            }
        }
        best
    }

    /// The joint farthest beyond its limits, and by how much.
    fn worst_joint(&self, q: &SVector<f64, N>) -> (usize, f64) {
        let beyond = |i: usize| (q[i] - self.chain.upper()[i]).max(self.chain.lower()[i] - q[i]);
        (0..N)
            .map(|i| (i, beyond(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0, 0.0))
    }

    pub(super) fn report_with(&self, best: &SolverResult<N>, failure: IkFailure) -> IkReport<N> {
        IkReport {
            failure,
            nearest: best.q,
            nearest_pose: self.chain.forward(&best.q),
            position_error: best.position,
            rotation_error: best.rotation,
        }
    }
}

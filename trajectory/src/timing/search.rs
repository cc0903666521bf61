//! The search for the final law of a problem: solves, bounds between the gridpoints, tightens the
//! rows that are exceeded there, solves again; where that does not help, over a finer grid.

use super::draft::{Draft, MOST_STEPS};
use super::excess::Excess;
use super::grid::{Bounded, Grid};
use super::gridpoints::Gridpoints;
use super::interior::{self, Descent, Interior};
use super::moving;
use super::problem::Problem;
use crate::TimingError;

/// Newton steps after rows were tightened.
const FEW_STEPS: usize = 12;
/// Times that rows are tightened.
const ROUNDS: usize = 2;
/// Times that cells are divided after that.
const REFINEMENTS: usize = 4;
/// Cells are divided at once in which a law would have to be stretched by this factor: tightened rows would cost much there.
const MUCH: f64 = 1.05;
/// The same where tightened rows did not help.
const LITTLE: f64 = 1.002;
/// A law that has to be stretched by this factor is worth finer cells.
const POOR: f64 = 1.001;

/// How a search begins, and when it is enough.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manner {
    /// The share of the square of the rate that limits allow with which it begins: first, and after rows
    /// were tightened.
    share: [f64; 2],
    /// The relative gap that is assumed then.
    gap: [f64; 2],
    /// Time that need not be gained back by another round.
    enough: f64,
    /// By how much more than their excess rows are tightened.
    more: f64,
}

/// Far from the limits.
pub(super) const FAR: Manner = Manner {
    share: [interior::FAR, interior::FAR],
    gap: [0.3, 0.02],
    enough: 1.0005,
    more: 1.0,
};

/// Near the limits: a fifth fewer steps, and hardly any third round.
pub(super) const NEAR: Manner = Manner {
    share: [0.9, 0.97],
    gap: [3.0, 0.02],
    enough: 1.0003,
    more: 1.0003,
};

/// The fastest law found over `grid`, or over finer ones if it may, once it is stretched to meet every bound. `None` if it is not
/// shorter than `limit` (s).
pub(super) fn best<const N: usize>(
    bounded: Bounded<'_, N>,
    grid: Grid,
    (limit, manner): (f64, &Manner),
) -> Result<Option<Draft<N>>, TimingError> {
    let gridpoints = Gridpoints::new(bounded, grid);
    let problem = bounded.problem(&gridpoints);
    if problem.moving {
        return moving::best(bounded, &gridpoints, problem).map(Some);
    }
    let descent = Descent {
        gap: bounded.options.gap,
        first: manner.gap[0],
        steps: MOST_STEPS,
        limit,
    };
    let mut interior = Interior::new(&problem);
    interior.slow_down_to(&problem, manner.share[0]);
    let is_found = interior.solve(&problem, &descent);
    if !is_found || interior.time() * sure(&bounded) >= limit {
        return Ok(None);
    }
    let best = Draft::new(bounded, &gridpoints, &problem, &interior);
    let search = Search {
        bounded,
        manner,
        limit,
        narrowed: Excess::none(&best),
        best,
        last: None,
        gridpoints,
        problem,
        interior,
    };
    Ok(Some(search.finish()))
}

/// Tightened rows never make a law faster than this share of its time, up to the gap.
fn sure<const N: usize>(bounded: &Bounded<'_, N>) -> f64 {
    1.0 - 2.0 * bounded.options.gap
}

/// What is known once a law was found.
struct Search<'a, const N: usize> {
    bounded: Bounded<'a, N>,
    manner: &'a Manner,
    /// A law that takes this long (s) is of no use.
    limit: f64,
    /// The fastest law.
    best: Draft<N>,
    /// The latest law, if it is not the fastest.
    last: Option<Draft<N>>,
    /// By what the limits are narrowed, in each cell of the latest law.
    narrowed: Excess,
    /// The places of that law.
    gridpoints: Gridpoints<N>,
    problem: Problem,
    interior: Interior,
}

impl<const N: usize> Search<'_, N> {
    fn latest(&self) -> &Draft<N> {
        self.last.as_ref().unwrap_or(&self.best)
    }

    /// The fastest law once rows are tightened and cells divided.
    fn finish(mut self) -> Draft<N> {
        self.tighten();
        if self.bounded.options.fine {
            self.divide_further();
        }
        self.best.iterations = self.interior.iterations;
        self.best
    }

    /// Tightens rows that are exceeded between the gridpoints; divides cells where that would cost much.
    fn tighten(&mut self) {
        for _ in 0..ROUNDS {
            if self.latest().audit.stretch < self.manner.enough {
                return;
            }
            let excess = self.excess();
            if !(self.bounded.options.fine && self.divide(&excess, MUCH)) {
                excess.narrow(&mut self.problem);
                self.narrowed = std::mem::take(&mut self.narrowed).and(&excess);
            }
            if !self.solve() {
                return;
            }
        }
    }

    /// Divides the cells in which limits are still exceeded.
    fn divide_further(&mut self) {
        for _ in 0..REFINEMENTS {
            // Of cells that were divided in vain no law is known.
            let is_known = self.latest().cells == self.problem.cells();
            if !is_known || self.best.audit.stretch < POOR {
                return;
            }
            let excess = self.excess();
            if !self.divide(&excess, LITTLE) || !self.solve() {
                return;
            }
        }
    }

    /// What the latest law exceeds.
    fn excess(&self) -> Excess {
        Excess::of(self.latest()).raised(self.manner.more)
    }

    /// Divides the cells of the latest law that would have to be stretched by more than a factor, and tightens the rows of
    /// others; false, and nothing changes, if there are none.
    fn divide(&mut self, excess: &Excess, factor: f64) -> bool {
        let grid = &self.gridpoints.grid;
        let knots = self.bounded.path.knots();
        let Some(refined) = grid.refined(knots, |k| excess.stretch(k) > factor) else {
            return false;
        };
        let law = refined.law(&self.problem, &grid.nodes, &self.interior.x);
        let narrowed = std::mem::take(&mut self.narrowed).and(excess);
        self.narrowed = narrowed.over(&refined.same());
        self.gridpoints = Gridpoints::new(self.bounded, refined.grid);
        self.problem = self.bounded.problem(&self.gridpoints);
        self.narrowed.narrow(&mut self.problem);
        self.interior = self.interior.over(&self.problem, &law);
        true
    }

    /// Finds a law, from the known one; false if it cannot be faster than the best.
    fn solve(&mut self) -> bool {
        let descent = Descent {
            gap: self.bounded.options.gap,
            first: self.manner.gap[1],
            steps: FEW_STEPS,
            limit: self.limit.min(self.best.duration),
        };
        let interior = &mut self.interior;
        interior.slow_down_to(&self.problem, self.manner.share[1]);
        let is_found = interior.solve(&self.problem, &descent);
        if !is_found || interior.time() * sure(&self.bounded) >= descent.limit {
            return false;
        }
        let next = Draft::new(
            self.bounded,
            &self.gridpoints,
            &self.problem,
            &self.interior,
        );
        self.last = keep_faster(&mut self.best, next);
        true
    }
}

/// Keeps the faster of two drafts, the first when they are even; returns the second if it is slower.
fn keep_faster<const N: usize>(best: &mut Draft<N>, next: Draft<N>) -> Option<Draft<N>> {
    if best.duration <= next.duration {
        return Some(next);
    }
    *best = next;
    None
}

#[cfg(test)]
mod tests {
    use super::super::PathTiming;
    use crate::{
        Boundary, JointLimits, JointLine, JointPoint, TimingOptions, ToolLimits, ToolPoint,
    };
    use nalgebra::{Isometry3, SVector};

    /// Both searches find the same time within their gap, within all limits; that from near the limits
    /// takes fewer steps.
    #[test]
    fn a_search_from_near_the_limits_takes_fewer_steps() {
        let still = |_: &JointPoint<3>| ToolPoint::still(Isometry3::identity());
        let limits = JointLimits::uniform(2.0, 12.0, 6000.0);
        let options = TimingOptions {
            end: Boundary::Rest,
            gap: 2e-4,
            ..TimingOptions::default()
        };
        let mut steps = [0; 2];
        for i in 1..12 {
            let end = SVector::from_fn(|j, _| (f64::from(i) * (1.0 + j as f64)).sin());
            let line = JointLine::new(SVector::zeros(), end, still);
            let timing = PathTiming::new(&line, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
            let [far, near] = [timing.clone(), timing.near()].map(|timing| timing.solve().unwrap());
            let [a, b] = [&far, &near].map(|timed| timed.trajectory.duration());
            assert!((a - b).abs() < 1e-3 * a, "{a} {b}");
            let highest = |most: f64, peak: &crate::timing::LimitPeak| most.max(peak.ratio);
            assert!(near.certificate.peaks.iter().fold(0.0, highest) < 1.0 + 1e-9);
            steps[0] += far.certificate.iterations;
            steps[1] += near.certificate.iterations;
        }
        assert!(10 * steps[1] < 9 * steps[0], "{steps:?}");
    }

    /// With wider cells where the law without jerk limits does not switch a law takes hardly longer, and has fewer cells;
    /// those at both ends are as they were.
    #[test]
    fn wider_cells_cost_little_time() {
        let still = |_: &JointPoint<2>| ToolPoint::still(Isometry3::identity());
        let limits = JointLimits::uniform(2.0, 5.0, 500.0);
        let mut cells = [0; 2];
        for i in 1..12 {
            let end = SVector::from_fn(|j, _| 2.0 * (f64::from(i) * (1.0 + j as f64)).sin());
            let line = JointLine::new(SVector::zeros(), end, still);
            let law = |widest: usize| {
                let options = TimingOptions {
                    widest,
                    gap: 1e-5,
                    ..TimingOptions::default()
                };
                let timing = PathTiming::new(&line, &limits, &ToolLimits::UNLIMITED, &options);
                timing.unwrap().solve().unwrap()
            };
            let [even, wide] = [1, 8].map(law);
            let [a, b] = [&even, &wide].map(|timed| timed.trajectory.duration());
            assert!((b / a - 1.0).abs() < 5e-4, "{a} {b}");
            let firsts = [&even, &wide].map(|timed| timed.trajectory.pieces()[0].duration);
            assert!((firsts[1] / firsts[0] - 1.0).abs() < 0.05, "{firsts:?}");
            cells[0] += even.certificate.cells;
            cells[1] += wide.certificate.cells;
        }
        assert!(10 * cells[1] < 6 * cells[0], "{cells:?}");
    }
}

//! A search of a null-space motion that costs less than a known one and is near it.
//!
//! # Source
//! R. Hooke, T. A. Jeeves, "Direct search solution of numerical and statistical problems", J. ACM 8(2), 1961 (exploratory moves),
//! with a step of its own for each coordinate.

use super::Cost;
use super::ease::ease_along;
use super::null_space::{NullSpace, SHAPES};
use super::price::Price;
use super::redundancy::{Coarse, WORTH};
use super::trace::Task;
use nalgebra::SVector;

/// Points of the path for each step along it in which a motion is judged, and fewest steps.
const JUDGED: [usize; 2] = [16, 6];
/// First size of each shape that is added, rad.
const SIZE: f64 = 0.05;
/// Factors on the size of a step that saved something, and of one that did not; a shape is given up below the last size, rad.
const GROWS: f64 = 2.0;
const SHRINKS: f64 = 0.3;
const SMALLEST: f64 = 0.02;
/// Least share of the ease of the known motion that another one needs.
const EASE: f64 = 0.9;

/// A null-space motion that costs less than a known one and has nearly its ease, by at most so many trials. The function of the joints
/// stays, and its values are changed by one shape after the other. The search may miss the best.
pub(super) fn cheapest<const N: usize>(
    task: &Task<'_, N>,
    (start, known): (&SVector<f64, N>, &NullSpace<N>),
    cost: &Cost<'_, N>,
    trials: usize,
) -> Option<NullSpace<N>> {
    let places = Coarse::new(task, JUDGED);
    let coarse = places.of(task);
    let first = coarse.trace(start, known).ok()?;
    let ease = EASE * ease_along(&coarse, &first).min(1.0);
    let price = Price {
        coarse: &coarse,
        start,
        ease,
        cost,
    };
    let now = cost(&first);
    let mut search = Search {
        price,
        best: known.clone(),
        least: now,
        trials,
    };
    search.run();
    (search.least < now * (1.0 - WORTH)).then_some(search.best)
}

/// What a search has come to.
struct Search<'a, const N: usize> {
    price: Price<'a, N>,
    best: NullSpace<N>,
    least: f64,
    /// Trials that are left.
    trials: usize,
}

impl<const N: usize> Search<'_, N> {
    /// Adds one shape after the other, in sizes that fit, until none saves anything.
    fn run(&mut self) {
        let mut sizes = SHAPES.map(|_| SIZE);
        while self.trials > 0 && sizes.iter().any(|size| size.abs() >= SMALLEST) {
            for (shape, size) in sizes.iter_mut().enumerate() {
                if size.abs() >= SMALLEST {
                    *size *= self.step(shape, *size);
                }
            }
        }
    }

    /// Adds a shape in one size, or takes it away; returns the factor on that size for the next step.
    fn step(&mut self, shape: usize, size: f64) -> f64 {
        for sign in [1.0, -1.0] {
            if self.trials == 0 {
                return 1.0;
            }
            self.trials -= 1;
            let mut other = self.best.clone();
            other.add_shape(&SHAPES[shape], sign * size);
            if let Some(cost) = self.price.below(self.least, &other) {
                (self.best, self.least) = (other, cost);
                return sign * GROWS;
            }
        }
        SHRINKS
    }
}

//! The joints along a path as functions of a change of its null-space motion, and a search of a change that costs less.
//!
//! At each point of the path the joints are known to second order in the value of the spare function, the linear function of the
//! joints that says where the spare joint is. With that and the derivatives of a change along the path, the joints with the
//! change and their derivatives are sums of a few terms. So a change is searched with these, and the path is followed anew only when it is found.

use super::FollowPoint;
use super::ease::ease_at;
use super::null_space::{NullSpace, SHAPES};
use super::null_space_spline::{BASIS, Spline};
use super::price::{Price, both_ways};
use super::trace::Task;
use nalgebra::SVector;
use std::ops::Range;

/// Changes of the spare function at which the joints are looked for, to either side, for the terms of a place: the first one at which they
/// are found, rad. And the largest change there for which the terms are taken to hold, over that.
const STEPS: [f64; 3] = [0.1, 0.03, 0.01];
const REACH: f64 = 4.0;
/// Most rounds with one size, and least share of the cost that a round has to save for another one.
const ROUNDS: usize = 3;
const GAIN: f64 = 1e-3;
/// Most changes, one after the other, and shares that are followed of each until one costs less.
const CHANGES: usize = 8;
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Least share of the cost that a change has to save for another one.
const ENOUGH: f64 = 2e-3;
/// Parts of a change: those of a spline, and the shapes of polynomials.
const PARTS: usize = BASIS + SHAPES.len();

/// Parts of a change: coefficients of the spline (rad), then sizes of the shapes (rad).
type Parts = [f64; PARTS];

/// A value and its first three derivatives along a path.
type Jet = [f64; 4];

/// A motion of less cost near a known one, if there is one, otherwise that one, and its cost; `None` if it does not have the
/// ease. Steps of these sizes (rad) are tried of each part of a change, one after the other.
pub(super) fn cheaper<const N: usize>(
    price: &Price<'_, N>,
    known: &NullSpace<N>,
    sizes: &[f64],
) -> Option<(NullSpace<N>, f64)> {
    let (mut points, mut least) = price.of(known)?;
    let mut best = known.clone();
    for _ in 0..CHANGES {
        let model = Model::new(price.coarse, &best, &points);
        let parts = model.cheaper(price, sizes);
        let found = SHARES.into_iter().find_map(|share| {
            let other = changed(&best, &parts.map(|part| part * share));
            let (points, cost) = price.of(&other)?;
            (cost < least).then_some((other, points, cost))
        });
        let Some((other, path, cost)) = found else {
            break;
        };
        let saved = 1.0 - cost / least;
        (best, points, least) = (other, path, cost);
        if saved < ENOUGH {
            break;
        }
    }
    Some((best, least))
}

/// A motion with parts added to it.
fn changed<const N: usize>(known: &NullSpace<N>, parts: &Parts) -> NullSpace<N> {
    let (spline, shapes) = parts.split_at(BASIS);
    let mut other = known.clone();
    let Spline(coefficients) = other.spline.get_or_insert_default();
    for (c, part) in coefficients.iter_mut().zip(spline) {
        *c += part;
    }
    for (shape, part) in SHAPES.iter().zip(shapes) {
        other.add_shape(shape, *part);
    }
    other
}

/// The joints along a path, to second order in the change of their spare function.
struct Model<const N: usize> {
    places: Vec<Place<N>>,
    /// One of each part of a change at each place, and the places where that is not zero.
    parts: Vec<(Vec<Jet>, Range<usize>)>,
}

/// The joints at a place of the path, and the terms of first and second order with their derivatives along the path.
struct Place<const N: usize> {
    point: FollowPoint<N>,
    first: [SVector<f64, N>; 4],
    second: [SVector<f64, N>; 4],
    /// Largest change, rad.
    reach: f64,
}

impl<const N: usize> Model<N> {
    /// The model near a motion, of which the path is known.
    fn new(task: &Task<'_, N>, motion: &NullSpace<N>, points: &[FollowPoint<N>]) -> Self {
        let places = points.iter().map(|point| Place::new(task, motion, point));
        let places = places.collect();
        let mut none = motion.clone();
        (none.polynomials[0], none.spline) = ([0.0; 6], None);
        let parts = (0..PARTS).map(|part| {
            let unit: Parts = std::array::from_fn(|k| if k == part { 1.0 } else { 0.0 });
            let unit = changed(&none, &unit);
            let jets: Vec<Jet> = points.iter().map(|point| unit.jet(point.u)).collect();
            let moves = |jet: &Jet| jet.iter().any(|x| *x != 0.0);
            let from = jets.iter().position(moves).unwrap_or(0);
            let to = jets.iter().rposition(moves).map_or(from, |last| last + 1);
            (jets, from..to)
        });
        Self {
            places,
            parts: parts.collect(),
        }
    }

    /// A change that costs less; zero if none is found.
    fn cheaper(&self, price: &Price<'_, N>, sizes: &[f64]) -> Parts {
        let points: Vec<_> = self.places.iter().map(|place| place.point).collect();
        let mut search = Search {
            model: self,
            price,
            ease: price.ease * ease_at(price.coarse.solver.chain(), &points[0].q[0], 1.0).max(1e-6),
            least: (price.cost)(&points),
            other: points.clone(),
            points,
            change: vec![[0.0; 4]; self.places.len()],
            parts: [0.0; PARTS],
        };
        search.run(sizes);
        search.parts
    }
}

/// A search of a change: steps of one part after the other.
struct Search<'a, const N: usize> {
    model: &'a Model<N>,
    price: &'a Price<'a, N>,
    /// Least ease at each place.
    ease: f64,
    least: f64,
    /// The best change: its parts, its value at each place, and the joints with it; and joints with another one.
    parts: Parts,
    change: Vec<Jet>,
    points: Vec<FollowPoint<N>>,
    other: Vec<FollowPoint<N>>,
}

impl<const N: usize> Search<'_, N> {
    /// Takes steps of all parts, in smaller and smaller sizes.
    fn run(&mut self, sizes: &[f64]) {
        for size in sizes {
            for _ in 0..ROUNDS {
                let before = self.least;
                for part in 0..PARTS {
                    both_ways(|sign| self.step(part, sign * size));
                }
                if self.least >= before * (1.0 - GAIN) {
                    break;
                }
            }
        }
    }

    /// Takes a step, if it saves something.
    fn step(&mut self, part: usize, size: f64) -> bool {
        let (jets, range) = &self.model.parts[part];
        let range = range.clone();
        for k in range.clone() {
            let change = added(&self.change[k], &jets[k], size);
            if change[0].abs() > self.model.places[k].reach {
                self.other[range.start..=k].copy_from_slice(&self.points[range.start..=k]);
                return false;
            }
            self.other[k] = self.model.places[k].at(&change);
        }
        let cost = (self.price.cost)(&self.other);
        let chain = self.price.coarse.solver.chain();
        let eased = |point: &FollowPoint<N>| ease_at(chain, &point.q[0], self.ease) >= self.ease;
        let saves = cost < self.least && self.other[range.clone()].iter().all(eased);
        if saves {
            self.least = cost;
            self.parts[part] += size;
            for k in range.clone() {
                self.change[k] = added(&self.change[k], &jets[k], size);
            }
            self.points[range.clone()].copy_from_slice(&self.other[range]);
        } else {
            self.other[range.clone()].copy_from_slice(&self.points[range]);
        }
        saves
    }
}

/// One value and another one times a factor.
fn added(one: &Jet, other: &Jet, factor: f64) -> Jet {
    std::array::from_fn(|k| one[k] + factor * other[k])
}

impl<const N: usize> Place<N> {
    /// The terms at a point of the path; none where the joints cannot be changed.
    fn new(task: &Task<'_, N>, motion: &NullSpace<N>, point: &FollowPoint<N>) -> Self {
        let both = |step: f64| {
            let less = task.beside(point, motion, -step)?;
            let more = task.beside(point, motion, step)?;
            Some((step, less, more))
        };
        let Some((step, less, more)) = STEPS.into_iter().find_map(both) else {
            return Self {
                point: *point,
                first: [SVector::zeros(); 4],
                second: [SVector::zeros(); 4],
                reach: 0.0,
            };
        };
        let terms = |k: usize| {
            let (less, more) = (less[k] - point.q[k], more[k] - point.q[k]);
            let first = (more - less) / (2.0 * step);
            let second = (more + less) / (2.0 * step * step);
            (first, second)
        };
        Self {
            point: *point,
            first: std::array::from_fn(|k| terms(k).0),
            second: std::array::from_fn(|k| terms(k).1),
            reach: REACH * step,
        }
    }

    /// The joints with a change.
    fn at(&self, &[d, d1, d2, d3]: &Jet) -> FollowPoint<N> {
        let square = [
            d * d,
            2.0 * d * d1,
            2.0 * (d1 * d1 + d * d2),
            6.0 * d1 * d2 + 2.0 * d * d3,
        ];
        let mut point = self.point;
        for (term, [f, f1, f2, f3]) in [(&self.first, [d, d1, d2, d3]), (&self.second, square)] {
            let [a, a1, a2, a3] = term;
            point.q[0] += a * f;
            point.q[1] += a1 * f + a * f1;
            point.q[2] += a2 * f + a1 * (2.0 * f1) + a * f2;
            point.q[3] += a3 * f + (a2 * f1 + a1 * f2) * 3.0 + a * f3;
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FollowOptions, TwistPoint, redundancy};
    use super::*;
    use crate::{Solver, urdf};
    use nalgebra::Vector3;

    /// The joints with a change, and all three derivatives, are known within a hundredth of what it moves them by; where the change is the
    /// one at which they were looked for, they are where they were found.
    #[test]
    fn the_joints_with_a_change_are_foretold() {
        let text = include_str!("../../../robots/panda/robot.urdf");
        let solver = Solver::new(urdf::read(text, None).unwrap().chain::<7>().unwrap());
        let start = SVector::<f64, 7>::from([0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8]);
        let from = solver.chain().forward(&start);
        let tool = |u: f64| {
            let mut pose = from;
            pose.translation.vector += Vector3::new(0.1 * u * u, 0.2 * u, -0.1 * u.powi(3));
            let linear = [
                Vector3::new(0.2 * u, 0.2, -0.3 * u * u),
                Vector3::new(0.2, 0.0, -0.6 * u),
                Vector3::new(0.0, 0.0, -0.6),
            ];
            let (angular, jump) = ([Vector3::zeros(); 3], [Vector3::zeros(); 2]);
            TwistPoint {
                pose,
                linear,
                angular,
                jump,
            }
        };
        let grid: Vec<f64> = (0..=40).map(|i| f64::from(i) / 40.0).collect();
        let options = FollowOptions::default();
        let task = Task {
            solver: &solver,
            tool: &tool,
            grid: &grid,
            options: &options,
        };
        let motion = redundancy::resolve(&task, &start).unwrap().1;
        let points = task.trace(&start, &motion).unwrap();
        let model = Model::new(&task, &motion, &points);
        let mut parts = [0.0; PARTS];
        (parts[3], parts[4], parts[12], parts[BASIS]) = (0.1, -0.05, 0.08, 0.1);
        let traced = task.trace(&start, &changed(&motion, &parts)).unwrap();
        let (mut off, mut moved) = ([0.0_f64; 4], [0.0_f64; 4]);
        for (i, place) in model.places.iter().enumerate() {
            let jets = model.parts.iter().zip(parts);
            let change = jets.fold([0.0; 4], |sum, ((jets, _), part)| {
                added(&sum, &jets[i], part)
            });
            let u = place.point.u;
            let exact = traced.iter().find(|point| point.u == u).unwrap();
            let foretold = place.at(&change);
            for k in 0..4 {
                off[k] = off[k].max((foretold.q[k] - exact.q[k]).amax());
                moved[k] = moved[k].max((place.point.q[k] - exact.q[k]).amax());
            }
            for by in [-STEPS[0], STEPS[0]] {
                let found = task.beside(&place.point, &motion, by).unwrap();
                let foretold = place.at(&[by, 0.0, 0.0, 0.0]).q;
                let same = |k: usize| (foretold[k] - found[k]).amax() < 1e-9;
                assert!((0..4).all(same), "{i} {by}");
            }
        }
        assert!(moved[0] > 0.05, "{moved:?}");
        let near = |k: usize| off[k] < 0.01 * moved[k];
        assert!((0..4).all(near), "{off:?}, {moved:?}");
    }
}

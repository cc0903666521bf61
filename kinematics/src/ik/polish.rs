//! Branches of arms that are only near a closed form, as calibrated ones are.
//!
//! The closed form of the ideal arm gives the seed of a descent. Where two branches lie close
//! together (a fold: elbow straight, wrist straight), both descents may end in the same branch or
//! in none; then the other branch is searched for across the fold.

use super::closed::Closed;
use super::goal::{Goal, Target};
use super::numeric::Stop;
use super::report::{Branches, Solution};
use super::{Solver, turns};
use crate::measure::LENGTH;
use nalgebra::{Isometry3, SMatrix, SVector};

/// Smallest singular value below which another branch across a fold is searched for.
const FOLD: f64 = 0.3;
/// Smallest singular value below which a fold is searched along its whole length.
const NARROW: f64 = 0.05;
/// Steps along a fold if only its middle is known, rad.
const ASIDE: [f64; 10] = [0.15, -0.15, 0.5, -0.5, 1.0, -1.0, 1.7, -1.7, 2.6, -2.6];

impl<const N: usize> Solver<N> {
    /// All branches at one parameter of an arm whose closed form is approximate.
    #[cold]
    pub(super) fn near_branches(
        &self,
        closed: &Closed,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
        parameter: f64,
    ) -> Branches<N> {
        let raw = self.raw_branches(closed, pose, seed, parameter);
        let target = Goal::Pose(*pose).target();
        // All branches, also those beyond the limits: a branch outside is not missing.
        let (mut all, mut lost) = (Branches::new(), Branches::new());
        let mut expected = 0;
        for id in 0..8_u8 {
            let Some(q) = raw.any(id) else {
                continue;
            };
            expected += 1;
            // At the edge of the reach two seeds coincide.
            let same = |other: u8| raw.any(other).is_some_and(|p| (p - q).amax() < 1e-9);
            if (0..id).any(same) {
                continue;
            }
            let found = self.polished(&target, &q);
            if !found.is_some_and(|q| self.add(&mut all, &q, id)) {
                let branch = Some(id);
                lost.push(Solution { q, branch });
            }
        }
        if all.len() < expected {
            self.add_twins(&target, &mut all);
            for seed in &lost {
                self.add_along(&target, seed, expected, &mut all);
            }
        }
        let mut found = Branches::new();
        for solution in &all {
            let q = turns::nearest(&self.chain, &solution.q, seed);
            if self.chain.within_limits(&q, 0.0) {
                found.push(Solution { q, ..*solution });
            }
        }
        found
    }

    /// Searches along the fold of a seed that led to no new branch: where two axes nearly coincide,
    /// small errors of the links change the joints between them by large angles.
    fn add_along(
        &self,
        target: &Target,
        seed: &Solution<N>,
        expected: usize,
        all: &mut Branches<N>,
    ) {
        if all.len() >= expected {
            return;
        }
        let (along, smallest) = self.fold(&seed.q);
        if smallest > FOLD {
            return;
        }
        let steps = if smallest < NARROW {
            &ASIDE[..]
        } else {
            &ASIDE[..2]
        };
        for step in steps {
            if all.len() >= expected {
                return;
            }
            if let Some(q) = self.polished(target, &(seed.q + along * *step)) {
                self.add(all, &q, seed.branch.unwrap_or(0));
            }
        }
    }

    /// Searches across every near fold for a branch that is still missing.
    fn add_twins(&self, target: &Target, all: &mut Branches<N>) {
        for index in 0..all.len() {
            let Some(solution) = all.get(index).copied() else {
                continue;
            };
            let (along, smallest) = self.fold(&solution.q);
            if smallest > FOLD {
                continue;
            }
            let twin = solution.q + along * self.across(&solution.q, &along, smallest);
            if let Some(q) = self.polished(target, &twin) {
                self.add(all, &q, solution.branch.unwrap_or(0));
            }
        }
    }

    /// Adds a joint position that is new; whether it was.
    fn add(&self, all: &mut Branches<N>, q: &SVector<f64, N>, id: u8) -> bool {
        let known = |other: &Solution<N>| turns::distance(&self.chain, &other.q, q) < 1e-6;
        let new = !all.iter().any(known);
        if new {
            all.push(Solution {
                q: *q,
                branch: Some(id),
            });
        }
        new
    }

    /// Moves an approximate branch to the exact pose; `None` if that fails.
    fn polished(&self, target: &Target, q: &SVector<f64, N>) -> Option<SVector<f64, N>> {
        let result = self.descend(
            target,
            q,
            Stop {
                limits: false,
                steps: 20,
                ..self.stop
            },
        );
        // A seed that had to move far was not a branch.
        (result.reached && turns::distance(&self.chain, &result.q, q) < 2.0).then_some(result.q)
    }

    /// Direction of the joints that moves the tool least, and by how much: the last
    /// singular vector, by inverse iteration.
    fn fold(&self, q: &SVector<f64, N>) -> (SVector<f64, N>, f64) {
        let j = self.scaled_jacobian(q);
        let mut normal = j.transpose() * j;
        for i in 0..N {
            normal[(i, i)] += 1e-12;
        }
        let Some(factor) = normal.cholesky() else {
            return (SVector::zeros(), 0.0);
        };
        let mut v = SVector::<f64, N>::from_fn(|i, _| 1.0 + 0.1 * i as f64).normalize();
        for _ in 0..6 {
            let next = factor.solve(&v);
            v = next / next.norm().max(f64::MIN_POSITIVE);
        }
        (v, (j * v).norm())
    }

    /// How far along a fold the twin of a solution lies: with `f(s) = a s + b s^2 / 2`
    /// along it, the other root.
    fn across(&self, q: &SVector<f64, N>, along: &SVector<f64, N>, smallest: f64) -> f64 {
        let j = self.scaled_jacobian(q);
        let image = (j * along) / smallest.max(1e-12);
        let mut change = self.chain.jacobian_derivative(q, along) * along;
        change.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
        let bend = image.dot(&change);
        if bend.abs() < 1e-6 {
            0.0
        } else {
            (-2.0 * smallest / bend).clamp(-1.5, 1.5)
        }
    }

    fn scaled_jacobian(&self, q: &SVector<f64, N>) -> SMatrix<f64, 6, N> {
        let (_, mut j) = self.chain.jacobian(q);
        j.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
        j
    }
}

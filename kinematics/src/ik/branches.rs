//! The branches of a closed form, checked once per chain, and the search over its free parameter.

use std::f64::consts::PI;

use nalgebra::{Isometry3, SVector};

use super::closed::{self, Branching, Closed, Raw};
use super::{Branches, Solution, Solver, numeric, turns};

impl<const N: usize> Solver<N> {
    /// The free parameter (rad) at a fraction of its range.
    pub(super) fn parameter_at(&self, closed: &Closed, fraction: f64) -> f64 {
        let joint = closed.given::<N>();
        let (low, high) = joint.map_or((-PI, PI), |i| numeric::window(&self.chain, i));
        low + (high - low) * fraction
    }

    /// The nearest solution over the whole range of the free parameter, on a grid of so many values: near
    /// the edge of the reach only few of them have a solution.
    #[cold]
    pub(super) fn sweep(
        &self,
        closed: &Closed,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
        values: u32,
    ) -> Option<Solution<N>> {
        let mut best: Option<(f64, Solution<N>)> = None;
        for i in 0..values {
            let parameter = self.parameter_at(closed, (f64::from(i) + 0.5) / f64::from(values));
            let Some(solution) = self.nearest_at(closed, pose, seed, parameter) else {
                continue;
            };
            let distance = (solution.q - seed).norm_squared();
            if best.as_ref().is_none_or(|(least, _)| distance < *least) {
                best = Some((distance, solution));
            }
        }
        best.map(|(_, solution)| solution)
    }

    /// What the closed form gives at one value (rad) of its free parameter, before any polishing.
    #[inline(always)]
    pub(super) fn raw_branches(
        &self,
        closed: &Closed,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
        parameter: f64,
    ) -> Raw<N> {
        let mut raw = Raw::none();
        if let Some(compute) = const { closed::branching::<N>() } {
            let branching = Branching {
                closed,
                pose,
                parameter,
                seed,
                raw: &mut raw,
            };
            compute(self.chain.build(), branching);
        }
        raw
    }

    pub(super) fn branches_at(
        &self,
        closed: &Closed,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
        parameter: f64,
    ) -> Branches<N> {
        if !closed.exact() {
            return self.near_branches(closed, pose, seed, parameter);
        }
        let raw = self.raw_branches(closed, pose, seed, parameter);
        let mut found = Branches::new();
        for id in 0..8_u8 {
            if let Some(q) = raw.inside(id) {
                let branch = Some(id);
                found.push(Solution { q, branch });
            }
        }
        found
    }

    pub(super) fn nearest_at(
        &self,
        closed: &Closed,
        pose: &Isometry3<f64>,
        seed: &SVector<f64, N>,
        parameter: f64,
    ) -> Option<Solution<N>> {
        if closed.exact() {
            let raw = self.raw_branches(closed, pose, seed, parameter);
            let (id, q) = raw.nearest()?;
            let branch = Some(id);
            return Some(Solution { q, branch });
        }
        let mut best: Option<(f64, Solution<N>)> = None;
        for solution in &self.near_branches(closed, pose, seed, parameter) {
            let distance = (solution.q - seed).norm_squared();
            if best.as_ref().is_none_or(|(least, _)| distance < *least) {
                best = Some((distance, *solution));
            }
        }
        best.map(|(_, solution)| solution)
    }

    /// Whether the closed form finds a thousand joint positions again from their poses.
    pub(super) fn closed_form_holds(&self) -> bool {
        let Some(closed) = &self.closed else {
            return false;
        };
        let seeds = numeric::Restarts::new(&self.chain);
        let (mut lost, mut wrong) = (0, 0);
        for index in 0..1000 {
            let q = seeds.at(index);
            let pose = self.chain.forward(&q);
            let branches = self.branches_at(closed, &pose, &q, closed.parameter(&q));
            lost += u32::from(
                !branches
                    .iter()
                    .any(|b| turns::distance(&self.chain, &b.q, &q) < 1e-6),
            );
            for branch in &branches {
                let (position, rotation) = self.error(&pose, &branch.q);
                wrong += u32::from(position > 2e-9 || rotation > 2e-9);
            }
        }
        wrong == 0 && lost <= if closed.exact() { 0 } else { 20 }
    }
}

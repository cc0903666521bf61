//! A grid whose cells are divided where that of a law was too coarse.

use super::grid::Grid;
use super::problem::Problem;

/// Parts of a divided cell.
const PARTS: usize = 4;
/// A shorter cell (s) is not divided, and none is made at a knot: rounding would look like a jerk in its pieces.
const SHORTEST: f64 = 1e-4;

/// A grid with divided cells.
#[derive(Clone, Debug)]
pub(super) struct Refined {
    /// The grid.
    pub grid: Grid,
    /// For each of its cells that of the coarser grid that it lies in.
    inside: Vec<usize>,
}

impl Grid {
    /// The same with cells divided: at the knots of the path (ascending) inside a cell, or into equal parts. `None` if
    /// no cell is divided.
    pub(super) fn refined(&self, knots: &[f64], divide: impl Fn(usize) -> bool) -> Option<Refined> {
        let mut refined = Refined {
            grid: Self {
                nodes: Vec::with_capacity(self.nodes.len()),
                knot: Vec::with_capacity(self.nodes.len()),
                ..self.clone()
            },
            inside: Vec::with_capacity(self.nodes.len()),
        };
        for (k, pair) in self.nodes.windows(2).enumerate() {
            refined.push(pair[0], self.knot[k], k);
            if pair[1] - pair[0] > SHORTEST && divide(k) {
                for (w, knot) in self.inner(knots, [pair[0], pair[1]]) {
                    refined.push(w, knot, k);
                }
            }
        }
        if refined.inside.len() + 1 == self.nodes.len() {
            return None;
        }
        refined.grid.nodes.extend(self.nodes.last());
        refined.grid.knot.extend(self.knot.last());
        Some(refined)
    }

    /// The nodes that divide a cell, and whether they are knots.
    fn inner(&self, knots: &[f64], [from, to]: [f64; 2]) -> Vec<(f64, bool)> {
        let [first, last] = [from, to].map(|w| self.reparametrization.at(w)[0]);
        let inside = &knots[knots.partition_point(|u| *u <= first)..];
        let mut inner: Vec<(f64, bool)> = Vec::new();
        for u in inside.iter().take_while(|u| **u < last) {
            let w = self.reparametrization.inverse(*u);
            let before = inner.last().map_or(from, |(w, _)| *w);
            if w - before > SHORTEST && to - w > SHORTEST {
                inner.push((w, true));
            }
        }
        if inner.is_empty() {
            let share = |i: usize| i as f64 / PARTS as f64;
            inner.extend((1..PARTS).map(|i| (from + share(i) * (to - from), false)));
        }
        inner
    }
}

impl Refined {
    /// Adds a cell that begins at a node.
    fn push(&mut self, w: f64, knot: bool, inside: usize) {
        self.grid.nodes.push(w);
        self.grid.knot.push(knot);
        self.inside.push(inside);
    }

    /// For each cell that of the coarser grid, if it is the same.
    pub(super) fn same(&self) -> Vec<Option<usize>> {
        let lonely = |i: usize| {
            let k = self.inside[i];
            let before = i.checked_sub(1).map(|i| self.inside[i]);
            let shared = before == Some(k) || self.inside.get(i + 1) == Some(&k);
            (!shared).then_some(k)
        };
        (0..self.inside.len()).map(lonely).collect()
    }

    /// The unknowns of a law of the coarser grid, whose `problem` has the `nodes`, over this one: the middle Bézier point of each
    /// cell.
    ///
    /// # Source
    /// Knot insertion by the polar form `a + b ((s - n) + (t - n)) + c (s - n) (t - n)` of a quadratic (Ramshaw 1987).
    pub(super) fn law(&self, problem: &Problem, nodes: &[f64], x: &[f64]) -> Vec<f64> {
        let middles = self.inside.iter().zip(self.grid.nodes.windows(2));
        let middle = |(k, pair): (&usize, &[f64])| {
            let spot = problem.spot(*k, x);
            let (s, t) = (pair[0] - nodes[*k], pair[1] - nodes[*k]);
            spot.a + spot.b * (s + t) + spot.c * s * t
        };
        let mut law = vec![x[0]];
        law.extend(middles.map(middle));
        law.push(x[problem.cells() + 1]);
        law
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::problem::Spot;
    use crate::timing::reachability::ReachabilityPass;
    use crate::{JointLimits, JointLine, Path, TimingOptions, ToolLimits, ToolPoint};
    use nalgebra::{Isometry3, vector};

    fn grid() -> Grid {
        let still = |_: &crate::JointPoint<2>| ToolPoint::still(Isometry3::identity());
        let line = JointLine::new(vector![0.0, 0.5], vector![0.7, -0.9], still);
        let limits = JointLimits::uniform(1.0, 4.0, 90.0);
        let (tool, options) = (ToolLimits::UNLIMITED, TimingOptions::default());
        let pass = ReachabilityPass::new(&line, &limits, &tool, &options).unwrap();
        Grid::new(&pass, line.knots(), line.end(), &options)
    }

    /// The law `x` over `nodes` at `w`.
    fn at(nodes: &[f64], x: &[f64], w: f64) -> Spot {
        let problem = Problem::new(nodes, 1, [0, 0], false);
        let last = nodes.len() - 2;
        let k = (nodes.partition_point(|node| *node <= w) - 1).min(last);
        problem.spot(k, x).moved(w - nodes[k])
    }

    /// A law over divided cells is the same law; the nodes of the coarser grid are nodes of the finer one, and so are the knots
    /// inside divided cells.
    #[test]
    fn a_law_over_divided_cells_is_the_same() {
        let grid = grid();
        let nodes = &grid.nodes;
        let problem = Problem::new(nodes, 1, [0, 0], false);
        let x: Vec<f64> = (0..problem.unknowns())
            .map(|i| 1.0 + 0.3 * (1.7 * i as f64).sin())
            .collect();
        let within = |k: usize, share: f64| nodes[k] + share * (nodes[k + 1] - nodes[k]);
        let knots = [(3, 0.2), (3, 0.7), (4, 0.5)].map(|(k, share)| within(k, share));
        let at_knots = knots.map(|w| grid.reparametrization.at(w)[0]);
        let refined = grid.refined(&at_knots, |k| k % 3 == 0).unwrap();
        let finer = &refined.grid.nodes;
        let law = refined.law(&problem, nodes, &x);
        for w in (0..=500).map(|i| nodes[nodes.len() - 1] * f64::from(i) / 500.0) {
            let [old, new] = [at(nodes, &x, w), at(finer, &law, w)];
            assert!(
                (old.a - new.a).abs() < 1e-12 && (old.b - new.b).abs() < 1e-8,
                "{w}"
            );
        }
        let is_node = |w: &f64| finer.iter().any(|node| (node - w).abs() < 1e-9);
        assert!(nodes.iter().all(|node| finer.contains(node)));
        assert_eq!(knots.map(|w| is_node(&w)), [true, true, false]);
        let same = refined.same();
        assert!(same.contains(&Some(1)) && !same.contains(&Some(0)));
        assert!(grid.refined(&[], |_| false).is_none());
    }
}

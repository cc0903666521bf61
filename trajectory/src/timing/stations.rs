//! The path at the nodes and middles of a grid, seen once for all that need it.

use nalgebra::SVector;

use super::grid::{Grid, Local};
use super::survey::ASIDE;
use crate::{Path, PathPoint};

/// The path at one place of the law's parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station<const N: usize> {
    /// The joints (rad).
    pub position: SVector<f64, N>,
    /// Derivatives to the parameter of the law.
    pub local: Local<N>,
    /// The path parameter and its derivatives to that of the law.
    pub warp: [f64; 4],
}

/// The path at all nodes and middles of a grid.
#[derive(Clone, Debug)]
pub(super) struct Stations<'a, const N: usize> {
    /// The grid.
    pub grid: &'a Grid,
    /// Left end and middle of each cell.
    cells: Vec<[Station<N>; 2]>,
    /// Nodes on knots as seen from before, and the last.
    before: Vec<Station<N>>,
    /// For each cell whose right end is such a node, its index.
    ends: Vec<Option<usize>>,
}

impl<'a, const N: usize> Stations<'a, N> {
    /// Looks at `path` at the places of `grid`.
    pub(super) fn new(path: &impl Path<N>, grid: &'a Grid) -> Self {
        let nodes = &grid.nodes;
        let count = nodes.len() - 1;
        let mut stations = Self {
            grid,
            cells: Vec::with_capacity(count),
            before: Vec::new(),
            ends: Vec::with_capacity(count),
        };
        for k in 0..count {
            // The same place seen from both sides gives the same values; only jerks differ.
            let side = if grid.knot[k] { 1.0 } else { 0.0 };
            let left = grid.station(path, nodes[k], side);
            let middle = nodes[k] + 0.5 * (nodes[k + 1] - nodes[k]);
            let middle = grid.station(path, middle, 0.0);
            stations.cells.push([left, middle]);
            let end = grid.knot[k + 1].then_some(stations.before.len());
            if end.is_some() {
                let before = grid.station(path, nodes[k + 1], -1.0);
                stations.before.push(before);
            }
            stations.ends.push(end);
        }
        stations
    }

    /// The left end of cell `k`.
    pub(super) fn left(&self, k: usize) -> &Station<N> {
        &self.cells[k][0]
    }

    /// The middle of cell `k`.
    pub(super) fn middle(&self, k: usize) -> &Station<N> {
        &self.cells[k][1]
    }

    /// The right end of cell `k`, seen from within.
    pub(super) fn right(&self, k: usize) -> &Station<N> {
        match self.ends[k] {
            Some(i) => &self.before[i],
            None => self.left(k + 1),
        }
    }
}

impl Grid {
    /// The path at `w`; its third derivatives seen from the side: -1 before, 0 at, 1 after.
    pub(super) fn station<const N: usize>(
        &self,
        path: &impl Path<N>,
        w: f64,
        side: f64,
    ) -> Station<N> {
        let warp = self.warp.at(w);
        let end = path.end();
        let mut point: PathPoint<N> = path.at(warp[0].clamp(0.0, end));
        if side != 0.0 {
            let aside = path.at((warp[0] + side * ASIDE * end).clamp(0.0, end));
            point.joint.q[3] = aside.joint.q[3];
            point.tool.linear[2] = aside.tool.linear[2];
            point.tool.angular[2] = aside.tool.angular[2];
        }
        Station {
            position: point.joint.q[0],
            local: Local::new(&point, warp),
            warp,
        }
    }
}

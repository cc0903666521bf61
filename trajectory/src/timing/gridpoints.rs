//! The path at the nodes and middles of a grid, evaluated once.

use nalgebra::{SVector, Vector3};

use super::grid::{Bounded, Grid};
use super::reachability::ASIDE;
use crate::{Path, PathPoint, ToolPoint};

/// The joints at one place of the law's parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gridpoint<const N: usize> {
    /// Positions (rad).
    pub position: SVector<f64, N>,
    /// Derivatives 1 to 3 to the parameter of the law.
    pub joint: [SVector<f64, N>; 3],
    /// The path parameter and its derivatives with respect to the parameter of the law.
    pub reparametrization: [f64; 4],
}

/// Derivatives 1 to 3 of the controlled point with respect to the parameter of the law, there.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToolGridpoint {
    /// Its position.
    pub linear: [Vector3<f64>; 3],
    /// Angular velocity and its derivatives.
    pub angular: [Vector3<f64>; 3],
}

/// Joints and tool at one place.
pub(super) type Place<const N: usize> = (Gridpoint<N>, ToolGridpoint);

/// The path at all nodes and middles of a grid.
#[derive(Clone, Debug)]
pub(super) struct Gridpoints<const N: usize> {
    /// The grid.
    pub grid: Grid,
    /// Left end and middle of each cell.
    joints: Vec<[Gridpoint<N>; 2]>,
    /// The tool there; nowhere if nothing limits it.
    tools: Vec<[ToolGridpoint; 2]>,
    /// Nodes on knots as seen from before, and the last.
    before: Vec<Place<N>>,
    /// For each cell whose right end is such a node, its index.
    ends: Vec<Option<usize>>,
}

/// Derivatives with respect to a new parameter, from those with respect to the old one (chain
/// rule).
fn chain<const D: usize>(
    [d1, d2, d3]: [SVector<f64, D>; 3],
    [_, u1, u2, u3]: [f64; 4],
) -> [SVector<f64, D>; 3] {
    [
        d1 * u1,
        d2 * (u1 * u1) + d1 * u2,
        d3 * (u1 * u1 * u1) + d2 * (3.0 * u1 * u2) + d1 * u3,
    ]
}

impl ToolGridpoint {
    /// The derivatives of `point` with respect to a parameter; `reparametrization` has the
    /// derivatives of `u` with respect to it.
    pub(super) fn new(point: &ToolPoint, reparametrization: [f64; 4]) -> Self {
        Self {
            linear: chain(point.linear, reparametrization),
            angular: chain(point.angular, reparametrization),
        }
    }

    /// A tool that nothing limits.
    fn free() -> Self {
        let still = [Vector3::zeros(); 3];
        Self {
            linear: still,
            angular: still,
        }
    }
}

impl<const N: usize> Gridpoints<N> {
    /// Looks at the path at the places of `grid`.
    pub(super) fn new(bounded: Bounded<'_, N>, grid: Grid) -> Self {
        let count = grid.nodes.len() - 1;
        let limited = bounded.tool.limited();
        let mut gridpoints = Self {
            joints: Vec::with_capacity(count),
            tools: Vec::with_capacity(if limited { count } else { 0 }),
            before: Vec::new(),
            ends: Vec::with_capacity(count),
            grid,
        };
        let (path, grid) = (bounded.path, &gridpoints.grid);
        let nodes = &grid.nodes;
        for k in 0..count {
            // The same place from both sides has the same values; only jerks differ.
            let side = if grid.knot[k] { 1.0 } else { 0.0 };
            let left = grid.place(path, nodes[k], side);
            let middle = nodes[k] + 0.5 * (nodes[k + 1] - nodes[k]);
            let middle = grid.place(path, middle, 0.0);
            gridpoints.joints.push([left.0, middle.0]);
            if limited {
                gridpoints.tools.push([left.1, middle.1]);
            }
            let end = grid.knot[k + 1].then_some(gridpoints.before.len());
            if end.is_some() {
                gridpoints.before.push(grid.place(path, nodes[k + 1], -1.0));
            }
            gridpoints.ends.push(end);
        }
        gridpoints
    }

    /// The joints at the left end of cell `k`.
    pub(super) fn left(&self, k: usize) -> &Gridpoint<N> {
        &self.joints[k][0]
    }

    /// The joints in the middle of cell `k`.
    pub(super) fn middle(&self, k: usize) -> &Gridpoint<N> {
        &self.joints[k][1]
    }

    /// The joints at the right end of cell `k`, as the limit from inside the cell.
    pub(super) fn right(&self, k: usize) -> &Gridpoint<N> {
        match self.ends[k] {
            Some(i) => &self.before[i].0,
            None => self.left(k + 1),
        }
    }

    /// The tool at the left end and in the middle of cell `k`.
    pub(super) fn tools(&self, k: usize) -> [ToolGridpoint; 2] {
        let tools = self.tools.get(k).copied();
        tools.unwrap_or_else(|| [ToolGridpoint::free(); 2])
    }

    /// The tool at the right end of cell `k`, as the limit from inside the cell.
    pub(super) fn tool_right(&self, k: usize) -> ToolGridpoint {
        match self.ends[k] {
            Some(i) => self.before[i].1,
            None => self.tools(k + 1)[0],
        }
    }
}

impl Grid {
    /// The path at `w`; its third derivatives from the given side: -1 before, 0 at, 1 after.
    pub(super) fn place<const N: usize>(&self, path: &dyn Path<N>, w: f64, side: f64) -> Place<N> {
        let reparametrization = self.reparametrization.at(w);
        let end = path.end();
        let mut point: PathPoint<N> = path.at(reparametrization[0].clamp(0.0, end));
        if side != 0.0 {
            let aside = path.at((reparametrization[0] + side * ASIDE * end).clamp(0.0, end));
            point.joint.q[3] = aside.joint.q[3];
            point.tool.linear[2] = aside.tool.linear[2];
            point.tool.angular[2] = aside.tool.angular[2];
        }
        let [position, q1, q2, q3] = point.joint.q;
        let gridpoint = Gridpoint {
            position,
            joint: chain([q1, q2, q3], reparametrization),
            reparametrization,
        };
        (
            gridpoint,
            ToolGridpoint::new(&point.tool, reparametrization),
        )
    }
}

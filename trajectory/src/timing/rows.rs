//! The rows of a path and its limits at the gridpoints of a [`Problem`].

use nalgebra::{SVector, Vector3};

use super::block::{LANE, Lane};
use super::grid::Bounded;
use super::gridpoints::{Gridpoint, Gridpoints, ToolGridpoint};
use super::problem::Problem;
use super::reachability::{leading, speed_cap};
use super::rise::speed_ratio;
use super::{Boundary, TimingOptions};
use crate::{JointLimits, ToolLimits};

/// A place on the path with what is known there.
#[derive(Clone, Copy)]
struct Place<'a, const N: usize> {
    gridpoint: &'a Gridpoint<N>,
    tool: ToolGridpoint,
}

/// Where a row is: its slot in the problem, and the lane of its cell.
#[derive(Clone, Copy)]
struct Slot {
    slot: usize,
    lane: usize,
}

/// Limits as factors: what rows are multiplied by.
struct Rows<'a, const N: usize> {
    joint: &'a JointLimits<N>,
    tool: &'a ToolLimits,
    rate_cap: Option<f64>,
    /// One over the acceleration limits of the joints.
    acceleration: SVector<f64, N>,
    /// One over their jerk limits.
    jerk: SVector<f64, N>,
}

impl<const N: usize> Bounded<'_, N> {
    /// The problem over the places of `gridpoints`.
    pub(super) fn problem(&self, gridpoints: &Gridpoints<N>) -> Problem {
        let tool = self.tool;
        let finite = |limits: [f64; 2]| limits.iter().filter(|x| x.is_finite()).count();
        let tools = [
            finite([tool.acceleration, tool.angular_acceleration]),
            finite([tool.jerk, tool.angular_jerk]),
        ];
        let TimingOptions { start, .. } = self.options;
        let moving = matches!(start, Boundary::Moving { .. });
        let nodes = &gridpoints.grid.nodes;
        let leading = self.leading(gridpoints);
        let joints = if leading.is_some() { 1 } else { N };
        let mut problem = Problem::new(nodes, joints, tools, moving);
        problem.leading = leading;
        let rows = Rows {
            joint: self.joint,
            tool,
            rate_cap: self.options.rate_cap,
            acceleration: self.joint.acceleration.map(|x| 1.0 / x),
            jerk: self.joint.jerk.map(|x| 1.0 / x),
        };
        let cells = problem.cells();
        for k in 0..cells {
            self.set_cell(&rows, gridpoints, k, &mut problem);
        }
        let end = Place {
            gridpoint: gridpoints.right(cells - 1),
            tool: gridpoints.tool_right(cells - 1),
        };
        let slot = Slot {
            slot: Problem::value_slot(cells, false),
            lane: cells % LANE,
        };
        rows.values(&mut problem, slot, end);
        problem
    }

    /// The joints nearest to their limits of acceleration and of jerk, if these are the same along the
    /// whole path.
    fn leading(&self, gridpoints: &Gridpoints<N>) -> Option<[usize; 2]> {
        // At an end at rest the path does not move with the parameter.
        let step = gridpoints.middle(gridpoints.grid.nodes.len() / 2 - 1).joint[0];
        let limits = [&self.joint.acceleration, &self.joint.jerk];
        let straight = gridpoints.grid.straight;
        straight.then(|| limits.map(|limit| leading(&step, limit)))
    }

    /// Sets all rows of cell `k`.
    fn set_cell(
        &self,
        rows: &Rows<'_, N>,
        gridpoints: &Gridpoints<N>,
        k: usize,
        problem: &mut Problem,
    ) {
        let at = |gridpoint, tool| Place { gridpoint, tool };
        let [left_tool, middle_tool] = gridpoints.tools(k);
        let left = at(gridpoints.left(k), left_tool);
        let middle = at(gridpoints.middle(k), middle_tool);
        let right = at(gridpoints.right(k), gridpoints.tool_right(k));
        let lane = k % LANE;
        let value = |middle: bool| Slot {
            slot: Problem::value_slot(k, middle),
            lane,
        };
        let jerk = |slot: usize| Slot { slot, lane };
        rows.values(problem, value(false), left);
        rows.values(problem, value(true), middle);
        let slots = problem.jerk_slots(k);
        let (first, last) = (slots.start, slots.end - 1);
        rows.jerks(problem, jerk(first), left);
        rows.jerks(problem, jerk(first + slots.len() / 2), middle);
        rows.jerks(problem, jerk(last), right);
        if problem.dense(k) {
            for (slot, share) in [(first + 1, 0.25), (first + 3, 0.75)] {
                let w = gridpoints.grid.nodes[k] + share * problem.widths[k];
                let (joint, tool) = gridpoints.grid.place(self.path, w, 0.0);
                let place = Place {
                    gridpoint: &joint,
                    tool,
                };
                rows.jerks(problem, jerk(slot), place);
            }
        }
    }
}

impl<const N: usize> Rows<'_, N> {
    /// Sets the rows of a slot of values: those that do not contain the jerk.
    fn values(&self, problem: &mut Problem, to: Slot, place: Place<'_, N>) {
        let Place { gridpoint, tool } = place;
        let Slot { slot, lane: l } = to;
        let [first, second, _] = &gridpoint.joint;
        for i in 0..problem.joints {
            let j = problem.joint_of(0, i);
            let (narrow, row) = (self.acceleration[j], slot * problem.joints + i);
            let row = &mut problem.acceleration[row];
            (row[0][l], row[1][l]) = (first[j] * narrow, second[j] * narrow);
        }
        let tools = [
            (tool.linear, self.tool.acceleration),
            (tool.angular, self.tool.angular_acceleration),
        ];
        let finite = tools.iter().filter(|(_, limit)| limit.is_finite());
        let count = problem.tool_accelerations;
        let rows = problem.norm_acceleration[slot * count..].iter_mut();
        for (row, ([p, q, _], limit)) in rows.zip(finite) {
            set(row, l, [q / *limit, p / *limit]);
        }
        let speeds = [
            speed_ratio(&gridpoint.position, first, self.joint),
            tool.linear[0].norm(),
            tool.angular[0].norm(),
        ];
        let rate = self
            .rate_cap
            .map_or(0.0, |cap| gridpoint.reparametrization[1] / cap);
        // The law of a good motion is near 1, so a high cap does not change it and keeps it
        // bounded.
        problem.value[slot / 2][slot % 2][1][l] =
            (1.0 / speed_cap::<N>(speeds, self.tool, rate)).max(1e-6);
    }

    /// Sets the rows of a jerk slot.
    fn jerks(&self, problem: &mut Problem, to: Slot, place: Place<'_, N>) {
        let Place { gridpoint, tool } = place;
        let Slot { slot, lane: l } = to;
        let [first, second, third] = &gridpoint.joint;
        for i in 0..problem.joints {
            let j = problem.joint_of(1, i);
            let (narrow, row) = (self.jerk[j], slot * problem.joints + i);
            let row = &mut problem.jerk[row];
            row[0][l] = third[j] * narrow;
            row[1][l] = 3.0 * second[j] * narrow;
            row[2][l] = first[j] * narrow;
        }
        let tools = [
            (tool.linear, self.tool.jerk),
            (tool.angular, self.tool.angular_jerk),
        ];
        let finite = tools.iter().filter(|(_, limit)| limit.is_finite());
        let rows = problem.norm_jerk[slot * problem.tool_jerks..].iter_mut();
        for (row, ([p, q, r], limit)) in rows.zip(finite) {
            set(row, l, [r / *limit, q * (3.0 / limit), p / *limit]);
        }
    }
}

/// Sets the dot products of the vectors of one cell.
#[inline]
fn set<const M: usize, const P: usize>(to: &mut [Lane; P], l: usize, vectors: [Vector3<f64>; M]) {
    let mut lanes = to.iter_mut();
    for i in 0..M {
        for (k, lane) in (i..M).zip(&mut lanes) {
            lane[l] = vectors[i].dot(&vectors[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::grid::Grid;
    use crate::timing::interior::{Descent, Interior};
    use crate::timing::reachability::ReachabilityPass;
    use crate::{JointLine, ToolPoint};
    use nalgebra::{Isometry3, vector};

    /// Along a straight line the rows of the joint that is nearest to its limits give the same law as
    /// those of all joints.
    #[test]
    fn one_joint_leads_along_a_straight_line() {
        let still = |_: &crate::JointPoint<3>| ToolPoint::still(Isometry3::identity());
        let line = JointLine::new(vector![0.0, 0.5, 1.0], vector![0.7, -0.9, 1.1], still);
        let joint = JointLimits {
            velocity: vector![1.0, 2.0, 3.0],
            acceleration: vector![4.0, 8.0, 2.0],
            jerk: vector![90.0, 50.0, 60.0],
            ..JointLimits::uniform(1.0, 1.0, 1.0)
        };
        let (tool, options) = (ToolLimits::UNLIMITED, TimingOptions::default());
        let bounded = Bounded {
            path: &line,
            joint: &joint,
            tool: &tool,
            options: &options,
        };
        let pass = ReachabilityPass::new(&line, &joint, &tool, &options).unwrap();
        let straight = Grid::new(&pass, &[0.0, 1.0], 1.0, &options);
        assert!(straight.straight);
        let any = Grid {
            straight: false,
            ..straight.clone()
        };
        let times = [straight, any].map(|grid| {
            let joints = if grid.straight { 1 } else { 3 };
            let problem = bounded.problem(&Gridpoints::new(bounded, grid));
            assert_eq!(problem.joints, joints);
            let mut interior = Interior::new(&problem);
            interior.slow_down(&problem);
            let descent = Descent {
                gap: 1e-9,
                first: 0.3,
                steps: 200,
                limit: f64::INFINITY,
            };
            assert!(interior.solve(&problem, &descent));
            interior.time()
        });
        assert!((times[0] / times[1] - 1.0).abs() < 1e-7, "{times:?}");
    }
}

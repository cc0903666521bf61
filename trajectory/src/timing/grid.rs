//! The cells of a law, and the limits of a path.

use super::reachability::ReachabilityPass;
use super::reparametrization::Reparametrization;
use super::{Boundary, TimingOptions};
use crate::{JointLimits, Path, ToolLimits};

/// Cells over the time in which accelerations build up.
const CELLS_PER_RAMP: f64 = 5.0;

/// Least share of a law in which accelerations build up, for the choice of its cells.
const COARSE: f64 = 0.02;
/// The same of a fine one, where it is longer than [`SHORT`].
const FINE: f64 = 3e-4;
/// A time (s) in which accelerations build up that is short for a fine law.
const SHORT: f64 = 0.01;

/// Finer cells give no better law and a slower search.
const MOST_CELLS_PER_RAMP: f64 = 40.0;
/// Joined cells are that far from switches: times the time in which accelerations build up, two cells and each
/// further one.
const CLEAR: f64 = 2.0;
/// See [`CLEAR`].
const GRADE: f64 = 0.5;
/// A joined cell is at most one in so many of the law.
const LEAST_CELLS: f64 = 60.0;

/// The grid of a law: where its nodes lie.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// The parameter of the law.
    pub reparametrization: Reparametrization,
    /// Nodes, over the parameter of the law (s).
    pub nodes: Vec<f64>,
    /// Whether a node lies on a knot of the path, where derivatives may jump.
    pub knot: Vec<bool>,
    /// Whether the joints move on a straight line, evenly in the path parameter.
    pub straight: bool,
}

/// A path with everything that bounds it.
#[derive(Clone, Copy)]
pub(super) struct Bounded<'a, const N: usize> {
    /// The path. Not a type parameter: all that computes a law is compiled once per joint count.
    pub path: &'a dyn Path<N>,
    /// Limits of the joints.
    pub joint: &'a JointLimits<N>,
    /// Limits of the tool.
    pub tool: &'a ToolLimits,
    /// What is asked.
    pub options: &'a TimingOptions,
}

/// Added to a smooth speed so that it begins like a given moving start; it fades out within the
/// time in which accelerations build up.
#[derive(Clone, Copy, Debug)]
struct LeadIn {
    value: f64,
    slope: f64,
    fade: f64,
}

impl LeadIn {
    fn new(start: Boundary, speed: impl Fn(f64) -> f64, fade: f64) -> Self {
        let Boundary::Moving { rate, acceleration } = start else {
            return Self {
                value: 0.0,
                slope: 0.0,
                fade,
            };
        };
        let step = 0.05 * fade;
        let slope = acceleration - (speed(step) - speed(-step)) / (2.0 * step);
        Self {
            value: rate - speed(0.0),
            slope,
            fade,
        }
    }

    fn at(&self, t: f64) -> f64 {
        let x = t / self.fade;
        let share = if x < 1.0 {
            (1.0 - x).powi(3) * (1.0 + 3.0 * x)
        } else {
            0.0
        };
        (self.value + self.slope * t) * share
    }
}

/// The least time (s) in which accelerations are taken to build up in a law that is so fast (s).
fn least_ramp(fast: f64, fine: bool) -> f64 {
    let coarse = COARSE * fast;
    if fine {
        coarse.min(SHORT).max(FINE * fast)
    } else {
        coarse
    }
}

impl Grid {
    /// The grid for a path with these knots, from the smoothed law of the reachability pass.
    pub(super) fn new(
        reachability: &ReachabilityPass,
        knots: &[f64],
        end: f64,
        options: &TimingOptions,
    ) -> Self {
        let fast = reachability.duration();
        let ramp = reachability
            .ramp
            .clamp(least_ramp(fast, options.fine), fast);
        let (start_rest, end_rest) = (
            options.start == Boundary::Rest,
            options.end == Boundary::Rest,
        );
        let lead = if start_rest { 0.5 * ramp } else { 0.0 };
        let total = fast + lead + if end_rest { 0.5 * ramp } else { 0.0 };
        let wanted = (CELLS_PER_RAMP * total / ramp).ceil().clamp(40.0, 20_000.0);
        let most = (MOST_CELLS_PER_RAMP * total / ramp).ceil() as usize;
        let cells = options
            .cells
            .unwrap_or(wanted as usize)
            .clamp(8, most.max(40));
        let spans = (cells / 2).max(12);
        let span = total / spans as f64;
        let floor = 1e-3 * end / fast;
        let smooth = |t: f64| {
            (reachability.parameter(t + 0.5 * ramp) - reachability.parameter(t - 0.5 * ramp)) / ramp
        };
        let lead_in = LeadIn::new(options.start, smooth, ramp);
        let sample = |i: usize| {
            let t = i as f64 * span - lead;
            (smooth(t) + lead_in.at(t)).max(floor)
        };
        let samples: Vec<f64> = (0..=spans).map(sample).collect();
        let reparametrization =
            Reparametrization::new(&samples, span, end, [options.start, options.end]);
        let reparametrization = if reparametrization.ascends() {
            reparametrization
        } else {
            // A start too far from the law of the reachability pass: constant speed is always
            // valid.
            let even = vec![end / total; spans + 1];
            Reparametrization::new(&even, span, end, [options.start, options.end])
        };
        let mut grid = Self::with_reparametrization(reparametrization, knots, end, cells);
        grid.straight = reachability.straight;
        if options.cells.is_none() && options.widest > 1 {
            let switches: Vec<f64> = reachability.switches.iter().map(|t| t + lead).collect();
            grid.widen(&switches, ramp, options.widest);
        }
        grid
    }

    /// Joins cells that are far from all switches (s), at most `widest`.
    fn widen(&mut self, switches: &[f64], ramp: f64, widest: usize) {
        let last = self.nodes.len() - 1;
        let total = self.nodes[last];
        let far = |i: usize, k: usize| {
            let (from, to) = (self.nodes[i], self.nodes[k]);
            let next = switches.partition_point(|switch| *switch < from);
            let before = next
                .checked_sub(1)
                .map_or(f64::INFINITY, |p| from - switches[p]);
            let after = switches
                .get(next)
                .map_or(f64::INFINITY, |switch| (switch - to).max(0.0));
            before.min(after)
        };
        let fits = |i: usize, m: usize| {
            let k = i + m;
            k <= last
                && !self.knot[i + 1..k].contains(&true)
                && self.nodes[k] - self.nodes[i] <= total / LEAST_CELLS
                && far(i, k) >= ramp * (CLEAR + GRADE * (m - 1) as f64)
        };
        let mut kept = vec![0];
        let mut i = 0;
        while i < last {
            i += (2..=widest).rev().find(|m| fits(i, *m)).unwrap_or(1);
            kept.push(i);
        }
        self.nodes = kept.iter().map(|i| self.nodes[*i]).collect();
        self.knot = kept.iter().map(|i| self.knot[*i]).collect();
    }

    /// The grid of about `cells` cells over `reparametrization`, with nodes on the knots.
    fn with_reparametrization(
        reparametrization: Reparametrization,
        knots: &[f64],
        end: f64,
        cells: usize,
    ) -> Self {
        let total = reparametrization.duration();
        let step = total / cells as f64;
        let mut marks = vec![0.0];
        for &u in knots
            .iter()
            .filter(|u| **u > 1e-9 * end && **u < (1.0 - 1e-9) * end)
        {
            let w = reparametrization.inverse(u);
            let last = marks.last().copied().unwrap_or(0.0);
            if w - last > 0.3 * step && total - w > 0.3 * step {
                marks.push(w);
            }
        }
        marks.push(total);
        let parts = shares(&marks, step, cells);
        let (mut nodes, mut knot) = (Vec::with_capacity(cells + 1), Vec::with_capacity(cells + 1));
        for (pair, &parts) in marks.windows(2).zip(&parts) {
            for i in 0..parts {
                nodes.push(pair[0] + (pair[1] - pair[0]) * (i as f64 / parts as f64));
                knot.push(i == 0);
            }
        }
        nodes.push(total);
        knot.push(true);
        Self {
            reparametrization,
            nodes,
            knot,
            straight: false,
        }
    }
}

/// The number of cells of each part between marks: in proportion, at least one, `cells` in all if
/// possible.
fn shares(marks: &[f64], step: f64, cells: usize) -> Vec<usize> {
    let exact: Vec<f64> = marks
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) / step)
        .collect();
    let mut parts: Vec<usize> = exact.iter().map(|x| (x.floor() as usize).max(1)).collect();
    let used: usize = parts.iter().sum();
    let mut order: Vec<usize> = (0..parts.len()).collect();
    let rest = |i: &usize| exact[*i] - parts[*i] as f64;
    order.sort_by(|i, j| rest(j).total_cmp(&rest(i)));
    for &i in order.iter().take(cells.saturating_sub(used)) {
        parts[i] += 1;
    }
    parts
}

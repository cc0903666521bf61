//! The cells of a law, and the limits of a path.

use super::reachability::ReachabilityPass;
use super::reparametrization::Reparametrization;
use super::{Boundary, TimingOptions};
use crate::{JointLimits, Path, ToolLimits};

/// Finer cells, over the time in which accelerations build up, give no better law and a slower search.
const MOST_CELLS_PER_RAMP: f64 = 40.0;
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

impl Grid {
    /// The grid for a path with these knots, from the smoothed law of the reachability pass.
    pub(super) fn new(
        reachability: &ReachabilityPass,
        knots: &[f64],
        end: f64,
        options: &TimingOptions,
    ) -> Self {
        let fast = reachability.duration();
        let ramp = reachability.ramp.clamp(0.02 * fast, fast);
        let (start_rest, end_rest) = (
            options.start == Boundary::Rest,
            options.end == Boundary::Rest,
        );
        let lead = if start_rest { 0.5 * ramp } else { 0.0 };
        let total = fast + lead + if end_rest { 0.5 * ramp } else { 0.0 };
        let wanted = (options.cells_per_ramp * total / ramp)
            .ceil()
            .clamp(40.0, 20_000.0);
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
        let grid = Self::with_reparametrization(reparametrization, knots, end, cells);
        Self {
            straight: reachability.straight,
            ..grid
        }
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

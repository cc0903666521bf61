//! The fastest law under velocity and acceleration limits alone, by reachability.

use super::block::{LANE, Lane};
use simd::{Build, Four, Op};

/// A path on a grid with its limits, ready for [`ReachGrid::solve`]: `a = (du/dt)^2` and
/// `b = d²u/dt²` have to meet `a <= cap` and `|p b + q a| <= 1` for each row `(p, q)`, at both ends
/// of each cell, over which `b` is constant.
#[derive(Clone, Debug, Default)]
pub struct ReachGrid {
    at: Vec<f64>,
    cap: Vec<f64>,
    /// Groups of rows at a point; as many again follow for the next point, seen from this one.
    width: usize,
    /// `|1 / p|` and `q / p` of each row.
    lines: Vec<[Lane; 2]>,
    /// The rows `(p, q)` of the newest point; zeros where a group is not full.
    newest: Vec<[Lane; 2]>,
}

/// The lines that bound `b` at a given `a`: the least upper and the greatest lower one, each
/// `offset - slope a`.
struct Envelope {
    high: (f64, f64),
    low: (f64, f64),
}

/// Fills a group of lines from rows `(p, q)`, for each `|1 / p|` and `q / p`; returns the largest
/// `|q|` of those without `p`.
#[inline]
fn fill(line: &mut [Lane; 2], [p, q]: &[Lane; 2]) -> f64 {
    let mut flat = 0.0_f64;
    for l in 0..LANE {
        let inverse = 1.0 / p[l];
        // A joint that hardly moves here limits the speed only by its curvature.
        let steep = inverse.abs() < 1e12;
        line[0][l] = if steep { inverse.abs() } else { f64::MAX };
        line[1][l] = if steep { q[l] * inverse } else { 0.0 };
        flat = flat.max(if steep { 0.0 } else { q[l].abs() });
    }
    flat
}

impl ReachGrid {
    /// An empty grid for `rows` rows at each point.
    pub fn new(rows: usize) -> Self {
        Self::with_room(rows, 0)
    }

    /// An empty grid with room for so many points.
    pub(super) fn with_room(rows: usize, points: usize) -> Self {
        let width = rows.div_ceil(LANE);
        Self {
            at: Vec::with_capacity(points),
            cap: Vec::with_capacity(points),
            width,
            lines: Vec::with_capacity(2 * width * points),
            newest: vec![[[0.0; LANE]; 2]; width],
        }
    }

    /// Adds the next point, at `u`, with the cap of `a` and rows `(p, q)`. Rows beyond the number
    /// given to [`ReachGrid::new`] are not taken.
    pub fn push(&mut self, u: f64, cap: f64, rows: impl Iterator<Item = (f64, f64)>) {
        let mut newest = std::mem::take(&mut self.newest);
        newest.fill([[0.0; LANE]; 2]);
        let lanes = newest.iter_mut().flat_map(|[p, q]| p.iter_mut().zip(q));
        for ((p, q), row) in lanes.zip(rows) {
            (*p, *q) = row;
        }
        self.push_groups(u, cap, &newest);
        self.newest = newest;
    }

    /// The same with the rows in groups.
    pub(super) fn push_groups(&mut self, u: f64, cap: f64, groups: &[[Lane; 2]]) {
        let (width, first) = (self.width, self.lines.len());
        if let Some(before) = self.at.last() {
            // At the end of the cell before, a = a_before + 2 h b.
            let twice = 2.0 * (u - before);
            for (line, [p, q]) in self.lines[first - width..].iter_mut().zip(groups) {
                let mut seen = *p;
                for (p, q) in seen.iter_mut().zip(q) {
                    *p += twice * q;
                }
                fill(line, &[seen, *q]);
            }
        }
        let mut flat = 0.0_f64;
        let none = [[f64::MAX; LANE], [0.0; LANE]];
        self.lines.extend(groups.iter().map(|row| {
            let mut line = none;
            flat = flat.max(fill(&mut line, row));
            line
        }));
        self.lines.resize(first + 2 * width, none);
        self.at.push(u);
        self.cap.push(cap.min(1.0 / flat));
    }

    /// Parameter values of the points.
    pub fn at(&self) -> &[f64] {
        &self.at
    }

    /// The largest `a` at each point with `a = first` at the start and at most `last` at the end,
    /// by a backward pass of controllable sets and a greedy forward pass.
    ///
    /// # Source
    /// Pham and Pham, "A new approach to time-optimal path parameterization based on reachability
    /// analysis", IEEE T-RO 34(3), 2018, algorithms 1 and 2. Each linear program has two
    /// unknowns; it is solved by Newton steps on the concave gap between the bounds of `b`.
    pub fn solve(&self, first: f64, last: f64) -> Vec<f64> {
        let mut top = self.cap.clone();
        Build::detect().run(Passes {
            grid: self,
            top: &mut top,
            ends: (first, last),
        });
        top
    }

    /// The largest `a` at point `k` from which some `b` leads to at most `next` at the next.
    #[inline(always)]
    fn controllable(&self, k: usize, half: f64, next: f64) -> f64 {
        let mut a = self.cap[k];
        for _ in 0..30 {
            let mut bounds = self.envelope(k, a);
            let arrive = (next * half, half);
            if arrive.0 - arrive.1 * a < bounds.high.0 - bounds.high.1 * a {
                bounds.high = arrive;
            }
            if -half * a > bounds.low.0 - bounds.low.1 * a {
                bounds.low = (0.0, half);
            }
            let gap = bounds.high.0 - bounds.low.0;
            let closing = bounds.high.1 - bounds.low.1;
            if gap - closing * a >= -1e-12 * gap.abs() || closing <= 0.0 {
                break;
            }
            a = (gap / closing).clamp(0.0, a);
        }
        a
    }

    /// The bounds of `b` at point `k` for `a`.
    #[inline(always)]
    fn envelope(&self, k: usize, a: f64) -> Envelope {
        let rows = 2 * k * self.width..2 * (k + 1) * self.width;
        let mut high = ([f64::MAX; LANE], [f64::MAX; LANE], [0.0; LANE]);
        let mut low = ([f64::MIN; LANE], [f64::MIN; LANE], [0.0; LANE]);
        for [reach, slope] in &self.lines[rows] {
            for l in 0..LANE {
                let shift = slope[l] * a;
                let (up, down) = (reach[l] - shift, -reach[l] - shift);
                let better = up < high.0[l];
                high.0[l] = if better { up } else { high.0[l] };
                high.1[l] = if better { reach[l] } else { high.1[l] };
                high.2[l] = if better { slope[l] } else { high.2[l] };
                let better = down > low.0[l];
                low.0[l] = if better { down } else { low.0[l] };
                low.1[l] = if better { -reach[l] } else { low.1[l] };
                low.2[l] = if better { slope[l] } else { low.2[l] };
            }
        }
        let (mut best_high, mut best_low) = (0, 0);
        for l in 1..LANE {
            if high.0[l] < high.0[best_high] {
                best_high = l;
            }
            if low.0[l] > low.0[best_low] {
                best_low = l;
            }
        }
        Envelope {
            high: (high.1[best_high], high.2[best_high]),
            low: (low.1[best_low], low.2[best_low]),
        }
    }
}

/// Both passes over a grid: `top` holds the caps before, the law after; with its values at the
/// ends.
struct Passes<'a> {
    grid: &'a ReachGrid,
    top: &'a mut [f64],
    ends: (f64, f64),
}

impl Op for Passes<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, _: S) {
        let Self { grid, top, ends } = self;
        let at = &grid.at;
        let count = at.len();
        if count == 0 {
            return;
        }
        top[count - 1] = top[count - 1].min(ends.1);
        for k in (0..count - 1).rev() {
            let half = 0.5 / (at[k + 1] - at[k]);
            top[k] = grid.controllable(k, half, top[k + 1]);
        }
        top[0] = top[0].min(ends.0);
        for k in 0..count - 1 {
            let half = 0.5 / (at[k + 1] - at[k]);
            let (a, next) = (top[k], top[k + 1]);
            let bounds = grid.envelope(k, a);
            let b = (bounds.high.0 - bounds.high.1 * a).min((next - a) * half);
            top[k + 1] = (a + b / half).clamp(0.0, next);
        }
    }
}

/// Time (s) that a law `a` takes over the grid `at` with constant acceleration in each cell.
pub fn duration(at: &[f64], a: &[f64]) -> f64 {
    let cells = at.windows(2).zip(a.windows(2));
    cells
        .map(|(u, a)| 2.0 * (u[1] - u[0]) / (a[0].sqrt() + a[1].sqrt()))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One joint over one radian: bang-bang takes 2 sqrt(d / A).
    #[test]
    fn straight_line_is_bang_bang() {
        let mut grid = ReachGrid::new(1);
        for k in 0..=100 {
            grid.push(f64::from(k) / 100.0, 1e9, std::iter::once((0.1, 0.0)));
        }
        let a = grid.solve(0.0, 0.0);
        let time = duration(grid.at(), &a);
        assert!((time - 2.0 * (0.1_f64).sqrt()).abs() < 1e-12, "{time}");
    }
}

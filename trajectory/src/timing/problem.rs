//! The time law as an optimisation problem over a grid of cells.

use super::block::{LANE, Lane};

/// Jerk places in a cell: both ends and the middle.
const JERK_SLOTS: usize = 3;
/// The same in a block with cells whose jerk rows are closer: the quarters too.
const DENSE_SLOTS: usize = 5;
/// Cells from either end whose jerk rows are closer: the path starts there like the cube of the
/// parameter, for which two rows per cell are too few.
const DENSE: usize = 2;

/// A law `a(w) = (dw/dt)^2`, C1 and quadratic in each cell, is given by its first value, the middle
/// Bézier point of each cell, and its last value. In a cell with `a`, `b = a'/2`, `c = a''/2` at
/// its left end: `d²w/dt² = b` and `d³w/dt³ = c sqrt(a)`.
///
/// Every row is divided by its limit. Four neighbouring cells are a block, whose rows are
/// interleaved. A cell has two slots for values, its left end and its middle, and three for jerks,
/// both ends and the middle; five in blocks at either end of the path. The last node is the left
/// end of a cell of no width. Rows that no cell needs are zero and bound nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    /// Widths of the cells.
    pub widths: Vec<f64>,
    /// Joint rows at a slot.
    pub joints: usize,
    /// The joints that come nearest to their limits of acceleration and of jerk, where each has the
    /// only joint row of its kind.
    pub leading: Option<[usize; 2]>,
    /// Tool rows of acceleration at a slot.
    pub tool_accelerations: usize,
    /// Tool rows of jerk at a slot.
    pub tool_jerks: usize,
    /// The law as a function of the unknowns, in each block.
    pub basis: Vec<Basis>,
    /// Index of the first jerk slot of each block, then their number.
    pub jerk_slots: Vec<usize>,
    /// Acceleration rows `|p b + q a| <= 1` of each slot, as `[p, q]`.
    pub acceleration: Vec<[Lane; 2]>,
    /// Jerk rows `sqrt(a) |x a + y b + z c| <= 1` of each jerk slot, as `[x, y, z]`.
    pub jerk: Vec<[Lane; 3]>,
    /// Of both slots of values in each block: the weight in the time, over `1 / sqrt(a)` (Simpson's
    /// rule in each cell), and the reciprocal of the cap of `a`.
    pub value: Vec<[[Lane; 2]; 2]>,
    /// Acceleration rows of the tool, bounded in norm, `|p b + q a| <= 1`, as the dot products
    /// `[q q, q p, p p]`.
    pub norm_acceleration: Vec<[Lane; 3]>,
    /// Jerk rows of the tool, bounded in norm, `sqrt(a) |x a + y b + z c| <= 1`, as the dot products
    /// `[x x, x y, x z, y y, y z, z z]`.
    pub norm_jerk: Vec<[Lane; 6]>,
    /// Whether the law has to begin with `a = 1`, `b = 0`.
    pub moving: bool,
}

/// The law in the cells of a block: `a = first x[k] + second x[k+1]`, `b = left (x[k+1] - x[k])`
/// at the left end, `c` the gain of `b` from there to the right end times `inverse`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Basis {
    pub first: Lane,
    pub second: Lane,
    pub left: Lane,
    pub right: Lane,
    pub width: Lane,
    pub inverse: Lane,
}

/// The law at one place: `a`, `b` there and `c` of the cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spot {
    /// `(dw/dt)^2`.
    pub a: f64,
    /// `d²w/dt²`.
    pub b: f64,
    /// `(d³w/dt³) / (dw/dt)`.
    pub c: f64,
}

impl Spot {
    /// The law of the same cell `x` further on.
    pub(super) fn moved(self, x: f64) -> Self {
        Self {
            a: self.a + x * (2.0 * self.b + x * self.c),
            b: self.b + x * self.c,
            c: self.c,
        }
    }
}

impl Problem {
    /// A problem over `nodes` with `joints` joint rows and so many tool rows of acceleration and
    /// jerk at each slot, all zero.
    pub(super) fn new(nodes: &[f64], joints: usize, tools: [usize; 2], moving: bool) -> Self {
        let widths: Vec<f64> = nodes.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let cells = widths.len();
        let blocks = (cells + 1).div_ceil(LANE);
        let mut problem = Self {
            widths,
            joints,
            tool_accelerations: tools[0],
            tool_jerks: tools[1],
            acceleration: vec![[[0.0; LANE]; 2]; 2 * blocks * joints],
            value: vec![[[[0.0; LANE]; 2]; 2]; blocks],
            norm_acceleration: vec![[[0.0; LANE]; 3]; 2 * blocks * tools[0]],
            basis: vec![Basis::default(); blocks],
            moving,
            ..Self::default()
        };
        let mut slots = 0;
        for block in 0..blocks {
            problem.jerk_slots.push(slots);
            let dense = (block * LANE..(block + 1) * LANE).any(|k| k < cells && problem.dense(k));
            slots += if dense { DENSE_SLOTS } else { JERK_SLOTS };
        }
        problem.jerk_slots.push(slots);
        problem.jerk = vec![[[0.0; LANE]; 3]; slots * joints];
        problem.norm_jerk = vec![[[0.0; LANE]; 6]; slots * tools[1]];
        for k in 0..blocks * LANE {
            problem.fill_basis(k);
        }
        problem
    }

    /// Fills in the law in cell `k`. Past the end the law is the unknown itself, which stays 1
    /// there.
    fn fill_basis(&mut self, k: usize) {
        let cells = self.cells();
        let width = |k: usize| self.widths.get(k).copied().unwrap_or(0.0);
        let before = if k == 0 { 0.0 } else { width(k - 1) };
        let (h, after) = (width(k), width(k + 1));
        let (i, l) = (k / LANE, k % LANE);
        let (weight, middle) = ((before + h) / 6.0, h * (4.0 / 6.0));
        let basis = &mut self.basis[i];
        basis.second[l] = 1.0;
        if k <= cells {
            let left = 1.0 / (before + h);
            (basis.first[l], basis.second[l], basis.left[l]) = (h * left, before * left, left);
            self.value[i][0][0][l] = weight;
            self.value[i][1][0][l] = middle;
        }
        if k < cells {
            (basis.width[l], basis.inverse[l]) = (h, 1.0 / h);
            basis.right[l] = 1.0 / (h + after);
        }
    }

    /// Number of cells.
    pub(super) fn cells(&self) -> usize {
        self.widths.len()
    }

    /// Rows that count in the mean of multiplier times slack: those of the joints, rounded up to a
    /// multiple of four. The additional rows bound nothing; they keep the mean from falling before
    /// the centring.
    pub(super) fn counted_rows(&self) -> usize {
        let cells = self.cells();
        let values = 2 * cells + 1;
        let dense = (0..cells).filter(|k| self.dense(*k)).count();
        let jerks = JERK_SLOTS * (cells - dense) + DENSE_SLOTS * dense;
        let joints = self.joints.next_multiple_of(4) * (values + jerks);
        joints + values * (1 + self.tool_accelerations) + jerks * self.tool_jerks
    }

    /// Number of unknowns, with those past the end that no row depends on.
    pub(super) fn unknowns(&self) -> usize {
        LANE * self.basis.len() + 2
    }

    /// Whether the jerk rows of cell `k` stand closer.
    pub(super) fn dense(&self, k: usize) -> bool {
        k.min(self.cells() - 1 - k) < DENSE
    }

    /// The row of joint `j` at a slot: of acceleration, or of jerk (1). `None` if it has none, because
    /// another joint is always nearer to its limit.
    pub(super) fn joint_row(&self, kind: usize, j: usize) -> Option<usize> {
        match self.leading {
            Some(leading) => (leading[kind] == j).then_some(0),
            None => Some(j),
        }
    }

    /// The joint of a row.
    pub(super) fn joint_of(&self, kind: usize, row: usize) -> usize {
        self.leading.map_or(row, |leading| leading[kind])
    }

    /// The slot of values of cell `k`: its left end, or its middle.
    pub(super) fn value_slot(k: usize, middle: bool) -> usize {
        2 * (k / LANE) + usize::from(middle)
    }

    /// The jerk slots of the block of cell `k`.
    pub(super) fn jerk_slots(&self, k: usize) -> std::ops::Range<usize> {
        self.jerk_slots[k / LANE]..self.jerk_slots[k / LANE + 1]
    }

    /// The jerk slots of block `i`, each by its fraction of the cell from left to right.
    #[inline(always)]
    pub(super) fn jerk_shares(&self, i: usize) -> &'static [f64] {
        const SHARES: [f64; JERK_SLOTS] = [0.0, 0.5, 1.0];
        const DENSE: [f64; DENSE_SLOTS] = [0.0, 0.25, 0.5, 0.75, 1.0];
        match self.jerk_slots[i..] {
            [first, end, ..] if end - first == JERK_SLOTS => &SHARES,
            _ => &DENSE,
        }
    }

    /// The problem with all limits of speed, acceleration and jerk `factor` times as wide.
    pub(super) fn relaxed(&self, factor: f64) -> Self {
        let mut wide = self.clone();
        let narrow = 1.0 / factor;
        let rows = wide.acceleration.iter_mut().flatten().flatten();
        let rows = rows.chain(wide.jerk.iter_mut().flatten().flatten());
        rows.for_each(|x| *x *= narrow);
        let vectors = wide.norm_acceleration.iter_mut().flatten().flatten();
        let vectors = vectors.chain(wide.norm_jerk.iter_mut().flatten().flatten());
        vectors.for_each(|x| *x *= narrow * narrow);
        for [_, cap] in wide.value.iter_mut().flatten() {
            cap.iter_mut().for_each(|cap| *cap *= narrow * narrow);
        }
        wide
    }

    /// Divides all limits in cell `k` by `factor`; the cell of no width behind the last is one of them.
    pub(super) fn narrow(&mut self, k: usize, factor: f64) {
        let (l, joints) = (k % LANE, self.joints);
        let [accelerations, jerks] = [self.tool_accelerations, self.tool_jerks];
        for slot in [false, true].map(|middle| Self::value_slot(k, middle)) {
            let rows = self.acceleration[slot * joints..][..joints].iter_mut();
            let tools = self.norm_acceleration[slot * accelerations..][..accelerations].iter_mut();
            rows.flatten().for_each(|lane| lane[l] *= factor);
            let squares = tools.flatten();
            squares.for_each(|lane| lane[l] *= factor * factor);
            self.value[slot / 2][slot % 2][1][l] *= factor * factor;
        }
        for slot in self.jerk_slots(k) {
            let rows = self.jerk[slot * joints..][..joints].iter_mut();
            let tools = self.norm_jerk[slot * jerks..][..jerks].iter_mut();
            rows.flatten().for_each(|lane| lane[l] *= factor);
            let squares = tools.flatten();
            squares.for_each(|lane| lane[l] *= factor * factor);
        }
    }

    /// Removes the rows of the first node that a given start state determines.
    pub(super) fn release_start(&mut self) {
        for row in self.acceleration[..self.joints].iter_mut().flatten() {
            row[0] = 0.0;
        }
        let norms = self.norm_acceleration[..self.tool_accelerations].iter_mut();
        for lane in norms.flatten() {
            lane[0] = 0.0;
        }
        self.value[0][0][1][0] = 1e-6;
    }

    /// The law at the left end of cell `k`.
    pub(super) fn spot(&self, k: usize, x: &[f64]) -> Spot {
        let (basis, l) = (&self.basis[k / LANE], k % LANE);
        let b = (x[k + 1] - x[k]) * basis.left[l];
        let next = (x[k + 2] - x[k + 1]) * basis.right[l];
        Spot {
            a: basis.first[l] * x[k] + basis.second[l] * x[k + 1],
            b,
            c: (next - b) * basis.inverse[l],
        }
    }
}

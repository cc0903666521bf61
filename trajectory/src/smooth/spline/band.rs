//! Symmetric positive definite systems with a narrow band.

use std::ops::Range;

use simd::{Build, Four, LANES, Op};

/// A symmetric band matrix, lower half, by columns: entry `[c][k]` is row
/// `c + k`, column `c`. `B` is a multiple of [`LANES`], and the last
/// [`SPARE`] of the `B` diagonals stay zero.
#[derive(Clone, Debug)]
pub(crate) struct Band<const B: usize> {
    pub(crate) columns: Vec<[f64; B]>,
    build: Build,
}

/// Diagonals that stay zero.
pub(crate) const SPARE: usize = 3;

/// Columns eliminated together: each later number is read and written once for
/// all of them, and always at the same place of a register.
pub(crate) const PANEL: usize = LANES;

/// Length of a panel column with zeros after it, for `B` up to 40.
const ROOM: usize = 52;

impl<const B: usize> Band<B> {
    /// A zero matrix of `size` rows.
    pub(crate) fn zeros(size: usize) -> Self {
        const { assert!(B.is_multiple_of(LANES) && B + PANEL + LANES < ROOM) };
        Self {
            columns: vec![[0.0; B]; size],
            build: Build::detect(),
        }
    }

    /// Sets every entry to zero.
    pub(crate) fn clear(&mut self) {
        self.columns.fill([0.0; B]);
    }

    /// Replaces the matrix by its Cholesky factor, with reciprocals of the
    /// diagonal in place of the diagonal. False when the matrix is not positive
    /// definite.
    ///
    /// # Source
    /// G. Golub, C. Van Loan, "Matrix Computations", 4th edition 2013, 4.3.5.
    pub(crate) fn factor(&mut self) -> bool {
        self.build.run(Factor(&mut self.columns))
    }

    /// Solves with the factor and with the transposed one, in place, for `M` right-hand sides, each
    /// followed by `B` zeros or more.
    pub(crate) fn solve<const M: usize>(&self, x: [&mut [f64]; M]) {
        for x in x {
            self.lower([&mut *x], 0..self.columns.len());
            self.upper(x);
        }
    }

    /// Solves with the factor, in place, for `M` right-hand sides at once, each followed by `B` zeros
    /// or more; only the panels with these rows, where all before are zero.
    pub(crate) fn lower<const M: usize>(&self, x: [&mut [f64]; M], rows: Range<usize>) {
        let panels = rows.start / PANEL..rows.end.div_ceil(PANEL);
        self.build.run(Lower(&self.columns, x, panels));
    }

    /// Solves with the transposed factor, in place, for one that is followed by `B` zeros or more.
    pub(crate) fn upper(&self, x: &mut [f64]) {
        self.build.run(Upper(&self.columns, x));
    }
}

/// [`Band::factor`].
struct Factor<'a, const B: usize>(&'a mut [[f64; B]]);

impl<const B: usize> Op for Factor<'_, B> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> bool {
        let mut rest = self.0;
        let mut panel = [[0.0; ROOM]; PANEL];
        while !rest.is_empty() {
            let (columns, after) = rest.split_at_mut(PANEL.min(rest.len()));
            if !eliminate(simd, columns, &mut panel) {
                return false;
            }
            let reach = (B - SPARE - 1).min(after.len());
            for (d, column) in after[..reach].iter_mut().enumerate() {
                subtract(simd, column, &panel, d + 1);
            }
            rest = after;
        }
        true
    }
}

/// Factors the columns of one panel, and copies them into `panel`.
#[inline(always)]
fn eliminate<S: Four, const B: usize>(
    simd: S,
    columns: &mut [[f64; B]],
    panel: &mut [[f64; ROOM]; PANEL],
) -> bool {
    for (j, column) in columns.iter_mut().enumerate() {
        for (i, done) in panel[..j].iter().enumerate() {
            let (factor, done) = (simd.splat(done[j - i]), &done[j - i..]);
            for (to, from) in simd_chunks(column).zip(done.chunks_exact(LANES)) {
                let product = simd.mul(factor, simd.load(from));
                simd.store(simd.sub(simd.load(to), product), to);
            }
        }
        let pivot = column[0];
        if pivot <= 0.0 || !pivot.is_finite() {
            return false;
        }
        let inverse = 1.0 / pivot.sqrt();
        let factor = simd.splat(inverse);
        for (to, copy) in simd_chunks(column).zip(panel[j].chunks_exact_mut(LANES)) {
            simd.store(simd.mul(factor, simd.load(to)), to);
            simd.store(simd.load(to), copy);
        }
        column[0] = inverse;
    }
    true
}

/// Subtracts a panel's part from the column `d` after its last column.
#[inline(always)]
fn subtract<S: Four, const B: usize>(
    simd: S,
    column: &mut [f64; B],
    [a, b, c, e]: &[[f64; ROOM]; PANEL],
    d: usize,
) {
    let count = LANES * (B - SPARE - d).div_ceil(LANES);
    // Slices of one length, so that no group of four is looked at for being whole.
    let done = [&a[d + 3..], &b[d + 2..], &c[d + 1..], &e[d..]].map(|column| &column[..count]);
    let factors = done.map(|column| simd.splat(column[0]));
    let [a, b, c, e] = done.map(|column| column.chunks_exact(LANES));
    let all = column[..count].chunks_exact_mut(LANES);
    for ((((to, a), b), c), e) in all.zip(a).zip(b).zip(c).zip(e) {
        let mut value = simd.load(to);
        value = simd.sub(value, simd.mul(factors[0], simd.load(a)));
        value = simd.sub(value, simd.mul(factors[1], simd.load(b)));
        value = simd.sub(value, simd.mul(factors[2], simd.load(c)));
        value = simd.sub(value, simd.mul(factors[3], simd.load(e)));
        simd.store(value, to);
    }
}

/// A column in groups of four.
#[inline(always)]
fn simd_chunks<const B: usize>(column: &mut [f64; B]) -> std::slice::ChunksExactMut<'_, f64> {
    column.chunks_exact_mut(LANES)
}

/// [`Band::lower`].
struct Lower<'a, const B: usize, const M: usize>(&'a [[f64; B]], [&'a mut [f64]; M], Range<usize>);

impl<const B: usize, const M: usize> Op for Lower<'_, B, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        let Self(columns, mut x, panels) = self;
        let all = columns.chunks(PANEL).enumerate();
        for (p, panel) in all.take(panels.end).skip(panels.start) {
            forward(simd, panel, &mut x, p * PANEL);
        }
    }
}

/// [`Band::upper`].
struct Upper<'a, const B: usize>(&'a [[f64; B]], &'a mut [f64]);

impl<const B: usize> Op for Upper<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        let Self(columns, x) = self;
        for (p, panel) in columns.chunks(PANEL).enumerate().rev() {
            backward(simd, panel, &mut [&mut *x], p * PANEL);
        }
    }
}

/// Solves for the unknowns of one panel and eliminates them from the rows below.
#[inline(always)]
fn forward<S: Four, const B: usize, const M: usize>(
    simd: S,
    panel: &[[f64; B]],
    x: &mut [&mut [f64]; M],
    at: usize,
) {
    for x in x.iter_mut() {
        let mut known = [0.0; PANEL];
        for (j, column) in panel.iter().enumerate() {
            let mut value = x[at + j];
            for i in 0..j {
                value -= panel[i][j - i] * known[i];
            }
            known[j] = value * column[0];
            x[at + j] = known[j];
        }
        let Ok(panel) = <&[[f64; B]; PANEL]>::try_from(panel) else {
            // No rows are left below a panel that is not full.
            continue;
        };
        let factors = known.map(|x| simd.splat(x));
        let below = &mut x[at + PANEL..at + B];
        for (q, to) in below.chunks_exact_mut(LANES).enumerate() {
            let mut value = simd.load(to);
            for j in 0..PANEL {
                let column = &panel[j][PANEL - j + q * LANES..];
                value = simd.sub(value, simd.mul(factors[j], simd.load(column)));
            }
            simd.store(value, to);
        }
    }
}

/// Solves for the unknowns of one panel with those of the rows below.
#[inline(always)]
fn backward<S: Four, const B: usize, const M: usize>(
    simd: S,
    panel: &[[f64; B]],
    x: &mut [&mut [f64]; M],
    at: usize,
) {
    for x in x.iter_mut() {
        let mut sums = [simd.splat(0.0); PANEL];
        if let Ok(panel) = <&[[f64; B]; PANEL]>::try_from(panel) {
            let below = &x[at + PANEL..at + B];
            for (q, from) in below.chunks_exact(LANES).enumerate() {
                let value = simd.load(from);
                for j in 0..PANEL {
                    let column = &panel[j][PANEL - j + q * LANES..];
                    sums[j] = simd.add(sums[j], simd.mul(value, simd.load(column)));
                }
            }
        }
        for j in (0..panel.len()).rev() {
            let mut value = x[at + j] - simd.sum(sums[j]);
            for k in j + 1..panel.len() {
                value -= panel[j][k - j] * x[at + k];
            }
            x[at + j] = value * panel[j][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::linalg::solvers::Solve as _;

    /// The solution of a random banded system solves it, in both builds alike.
    #[test]
    fn solves() {
        solves_with::<8>(5, 40);
        solves_with::<20>(15, 3 * 31);
        solves_with::<20>(15, 3);
        solves_with::<36>(30, 6 * 17);
        assert!(!Band::<8>::zeros(3).factor());
    }

    fn solves_with<const B: usize>(diagonals: usize, size: usize) {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let mut band = Band::<B>::zeros(size);
        for (c, column) in band.columns.iter_mut().enumerate() {
            for value in column.iter_mut().take(diagonals.min(size - c)) {
                *value = random();
            }
            column[0] = diagonals as f64;
        }
        let matrix = band.clone();
        let wanted: [Vec<f64>; 2] = [0, 1].map(|_| (0..size).map(|_| random()).collect());
        let mut sides = [0, 1].map(|_| vec![0.0; size + B]);
        for m in 0..2 {
            for c in 0..size {
                for k in 0..diagonals.min(size - c) {
                    sides[m][c + k] += matrix.columns[c][k] * wanted[m][c];
                    if k > 0 {
                        sides[m][c] += matrix.columns[c][k] * wanted[m][c + k];
                    }
                }
            }
        }
        let solve = |mut band: Band<B>| {
            let [mut x, mut y] = sides.clone();
            assert!(band.factor());
            band.solve([&mut x, &mut y]);
            [x, y]
        };
        let x = solve(band.clone());
        let other = by_faer(&matrix, diagonals, &sides[0]);
        for (got, wanted) in x[0].iter().zip(&other) {
            assert!((got - wanted).abs() < 1e-12, "{got} here, {wanted} by faer");
        }
        band.build = Build::Plain;
        assert_eq!(x, solve(band));
        for m in 0..2 {
            for (got, wanted) in x[m].iter().zip(&wanted[m]) {
                assert!((got - wanted).abs() < 1e-12);
            }
        }
    }
    /// The solution by faer's dense Cholesky factorisation.
    fn by_faer<const B: usize>(band: &Band<B>, diagonals: usize, side: &[f64]) -> Vec<f64> {
        let size = band.columns.len();
        let entry = |i: usize, j: usize| {
            let (row, column) = (i.max(j), i.min(j));
            if row - column < diagonals {
                band.columns[column][row - column]
            } else {
                0.0
            }
        };
        let matrix = faer::Mat::from_fn(size, size, entry);
        let side = faer::Col::from_fn(size, |i| side[i]);
        let x = matrix.llt(faer::Side::Lower).unwrap().solve(&side);
        x.iter().copied().collect()
    }
}

//! Small linear systems on the stack: task rows times joint motion equals a task motion.

use simd::{Build, F4, Four, Op};

/// Rows of a task: six of the tool, then one for each spare joint.
pub(super) type Rows = [[f64; 8]; 8];

/// Smallest pivot, as a fraction of the largest, for which elimination is trusted.
const SMALLEST_PIVOT: f64 = 1e-7;
/// Weight of the prior against the rows where elimination is not trusted.
const PRIOR: f64 = 1e-12;

/// Task rows, ready to be solved for several task motions.
pub(super) struct System<'a, const N: usize> {
    rows: &'a Rows,
    /// Factors of the rows, unless elimination is not trusted.
    factors: Option<Factors<N>>,
}

impl<'a, const N: usize> System<'a, N> {
    /// Factors the rows.
    #[inline]
    pub(super) fn new(rows: &'a Rows) -> Self {
        let factors = if N >= 6 { Factors::new(rows) } else { None };
        Self { rows, factors }
    }

    /// Whether the rows settle all unknowns.
    pub(super) fn is_regular(&self) -> bool {
        self.factors.is_some()
    }

    /// Solves `rows * x = b` for `N` unknowns.
    ///
    /// Where the rows do not settle `x` (singular, or fewer joints than six), the
    /// least-squares solution nearest to `prior`.
    #[inline]
    pub(super) fn solve(&self, b: &[f64; 8], prior: &[f64; 8]) -> [f64; 8] {
        if let Some(factors) = &self.factors {
            return factors.solve(b);
        }
        self.nearest(b, prior)
    }

    /// The least-squares solution nearest to `prior`.
    #[cold]
    fn nearest(&self, b: &[f64; 8], prior: &[f64; 8]) -> [f64; 8] {
        let count = N.max(6);
        let mut x = *prior;
        // The second pass takes out what the first left by rounding.
        for _ in 0..2 {
            let mut rest = *b;
            for (r, row) in self.rows.iter().enumerate().take(count) {
                for j in 0..N {
                    rest[r] -= row[j] * x[j];
                }
            }
            let y = normal::<N>(self.rows, &rest, count);
            for j in 0..N {
                x[j] += y[j];
            }
        }
        x
    }
}

/// Factors of rows by Gaussian elimination with row exchange: the upper one, the multipliers below it, and the
/// row that was taken at each step.
struct Factors<const N: usize> {
    rows: Rows,
    taken: [usize; 8],
}

impl<const N: usize> Factors<N> {
    /// `None` where a pivot is too small.
    fn new(rows: &Rows) -> Option<Self> {
        let (mut m, mut taken) = (*rows, [0; 8]);
        let mut largest = 0.0_f64;
        for k in 0..N {
            let pivot = (k..N).max_by(|i, j| m[*i][k].abs().total_cmp(&m[*j][k].abs()))?;
            m.swap(k, pivot);
            taken[k] = pivot;
            let size = m[k][k].abs();
            largest = largest.max(size);
            if size.is_nan() || size <= SMALLEST_PIVOT * largest {
                return None;
            }
            for i in k + 1..N {
                let factor = m[i][k] / m[k][k];
                m[i][k] = factor;
                for j in k + 1..N {
                    m[i][j] -= factor * m[k][j];
                }
            }
        }
        Some(Self { rows: m, taken })
    }

    fn solve(&self, b: &[f64; 8]) -> [f64; 8] {
        let (m, mut b) = (&self.rows, *b);
        for k in 0..N {
            b.swap(k, self.taken[k]);
        }
        for k in 0..N {
            for i in k + 1..N {
                b[i] -= m[i][k] * b[k];
            }
        }
        let mut x = [0.0; 8];
        for k in (0..N).rev() {
            let sum = (k + 1..N).fold(b[k], |sum, j| sum - m[k][j] * x[j]);
            x[k] = sum / m[k][k];
        }
        x
    }
}

/// Solves `rows * x = b` for the `N` unknowns as [`System::solve`] does with the prior zero, with fewer numbers to
/// move: `b` is one more column of the rows.
pub(super) fn solve_once<const N: usize>(build: Build, rows: &Rows, b: &[f64; 8]) -> [f64; 8] {
    if (N == 6 || N == 7)
        && let Some(x) = build.run(Eliminate::<N> { rows, b })
    {
        return x;
    }
    System::<N>::new(rows).solve(b, &[0.0; 8])
}

/// Gaussian elimination with row exchange of `N` rows and the column `b` beside them; `None` where a pivot is too
/// small. Each number comes from the same sums as in [`Factors`].
struct Eliminate<'a, const N: usize> {
    rows: &'a Rows,
    b: &'a [f64; 8],
}

impl<const N: usize> Op for Eliminate<'_, N> {
    type Output = Option<[f64; 8]>;

    // Loops over indices: iterators would be calls.
    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> Option<[f64; 8]> {
        let mut m = [[0.0; 8]; 8];
        for i in 0..N {
            m[i] = self.rows[i];
            m[i][N & 7] = self.b[i];
        }
        let mut largest = 0.0;
        for k in 0..N {
            let (pivot, size) = pivot::<N>(&m, k);
            let top = halves(simd, &m[pivot]);
            let below = halves(simd, &m[k]);
            put(below, &mut m[pivot]);
            put(top, &mut m[k]);
            if size > largest {
                largest = size;
            }
            // Written so that NaN is refused too.
            let trusted = size > SMALLEST_PIVOT * largest;
            if !trusted {
                return None;
            }
            let first = m[k][k];
            for i in k + 1..N {
                let factor = F4::splat(simd, m[i][k] / first);
                // Whole rows; what becomes of the columns before is of no use.
                let row = halves(simd, &m[i]);
                put(
                    [row[0] - top[0] * factor, row[1] - top[1] * factor],
                    &mut m[i],
                );
            }
        }
        let mut x = [0.0; 8];
        for k in (0..N).rev() {
            let mut sum = m[k][N & 7];
            for j in k + 1..N {
                sum -= m[k][j] * x[j];
            }
            x[k] = sum / m[k][k];
        }
        Some(x)
    }
}

/// The row from `k` on whose number in column `k` is largest, the last of equal ones, and its size.
#[inline(always)]
fn pivot<const N: usize>(m: &Rows, k: usize) -> (usize, f64) {
    let size = |x: f64| if x < 0.0 { -x } else { x };
    let (mut at, mut most) = (k, size(m[k][k]));
    for i in k + 1..N {
        let size = size(m[i][k]);
        if size >= most {
            (at, most) = (i, size);
        }
    }
    (at, most)
}

/// A row in registers.
#[inline(always)]
fn halves<S: Four>(simd: S, row: &[f64; 8]) -> [F4<S>; 2] {
    let [a, b, c, d, e, f, g, h] = *row;
    [F4::new(simd, [a, b, c, d]), F4::new(simd, [e, f, g, h])]
}

/// Writes a row to memory.
#[inline(always)]
fn put<S: Four>(halves: [F4<S>; 2], row: &mut [f64; 8]) {
    let ([a, b, c, d], [e, f, g, h]) = (halves[0].array(), halves[1].array());
    *row = [a, b, c, d, e, f, g, h];
}

/// `(A^T A + PRIOR) y = A^T b`.
fn normal<const N: usize>(rows: &Rows, b: &[f64; 8], count: usize) -> [f64; 8] {
    let mut m: Rows = [[0.0; 8]; 8];
    let mut c = [0.0; 8];
    for (row, value) in rows.iter().zip(b).take(count) {
        for i in 0..N {
            for j in 0..N {
                m[i][j] += row[i] * row[j];
            }
            c[i] += row[i] * value;
        }
    }
    for i in 0..N {
        m[i][i] += PRIOR;
    }
    let mut x = [0.0; 8];
    for k in 0..N {
        for i in k + 1..N {
            let factor = m[i][k] / m[k][k];
            for j in k..N {
                m[i][j] -= factor * m[k][j];
            }
            c[i] -= factor * c[k];
        }
    }
    for k in (0..N).rev() {
        let sum = (k + 1..N).fold(c[k], |sum, j| sum - m[k][j] * x[j]);
        x[k] = sum / m[k][k];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One column more gives the same bits as factors, in both builds.
    #[test]
    fn one_column_more_gives_the_same() {
        for turn in 0..200 {
            let number = |i: usize, j: usize| (1.3 * (9 * turn + 8 * i + j) as f64).sin();
            let rows: Rows = std::array::from_fn(|i| {
                std::array::from_fn(|j| if j < 7 { number(i, j) } else { 0.0 })
            });
            let b: [f64; 8] = std::array::from_fn(|i| number(i, 9));
            let wanted = System::<7>::new(&rows).solve(&b, &[0.0; 8]);
            for build in [Build::detect(), Build::Plain] {
                assert_eq!(solve_once::<7>(build, &rows, &b), wanted);
            }
        }
        let rows: Rows = [[1.0; 8]; 8];
        let x = solve_once::<6>(Build::Plain, &rows, &[1.0; 8]);
        assert!((x.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{x:?}");
    }

    /// A regular system is solved; a singular one gives the solution nearest to the prior.
    #[test]
    fn solves_regular_and_singular_systems() {
        let mut rows: Rows = [[0.0; 8]; 8];
        for i in 0..6 {
            rows[i][i] = 2.0;
        }
        rows[0][5] = 1.0;
        let b = [3.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0];
        let x = System::<6>::new(&rows).solve(&b, &[0.0; 8]);
        assert!(x[..6].iter().all(|value| (value - 1.0).abs() < 1e-15));
        // Columns 4 and 5 alike: only their sum is settled.
        let mut rows: Rows = [[0.0; 8]; 8];
        for i in 0..5 {
            rows[i][i] = 1.0;
        }
        rows[4][5] = 1.0;
        let prior = [0.0, 0.0, 0.0, 0.0, 3.0, -1.0, 0.0, 0.0];
        let x = System::<6>::new(&rows).solve(&[1.0; 8], &prior);
        assert!(
            (x[4] - 2.5).abs() < 1e-9 && (x[5] + 1.5).abs() < 1e-9,
            "{x:?}"
        );
    }
}

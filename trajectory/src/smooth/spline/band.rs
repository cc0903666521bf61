//! Symmetric positive definite systems with a narrow band.

/// A symmetric band matrix, lower half, by columns: entry `[c][k]` is row
/// `c + k`, column `c`. `B` is the number of diagonals of the lower half.
#[derive(Clone, Debug)]
pub(crate) struct Band<const B: usize> {
    pub(crate) columns: Vec<[f64; B]>,
}

impl<const B: usize> Band<B> {
    /// A zero matrix of `size` rows.
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            columns: vec![[0.0; B]; size],
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
    /// Right-looking by columns, so that the inner loop is a sum of vectors and
    /// not a dot product: it runs in vector registers without reordering sums.
    ///
    /// # Source
    /// G. Golub, C. Van Loan, "Matrix Computations", 4th edition 2013, 4.3.5.
    pub(crate) fn factor(&mut self) -> bool {
        let size = self.columns.len();
        for c in 0..size {
            let (done, rest) = self.columns.split_at_mut(c + 1);
            let Some(column) = done.last_mut() else {
                return false;
            };
            let pivot = column[0];
            if pivot <= 0.0 || !pivot.is_finite() {
                return false;
            }
            let inverse = 1.0 / pivot.sqrt();
            column[0] = inverse;
            for value in &mut column[1..] {
                *value *= inverse;
            }
            let reach = (B - 1).min(rest.len());
            for (k, below) in rest[..reach].iter_mut().enumerate() {
                let factor = column[k + 1];
                for (target, value) in below.iter_mut().zip(&column[k + 1..]) {
                    *target -= factor * value;
                }
            }
        }
        true
    }

    /// Solves with the factor, in place, for `M` right-hand sides at once.
    pub(crate) fn solve<const M: usize>(&self, x: &mut [[f64; M]]) {
        let size = self.columns.len().min(x.len());
        for c in 0..size {
            let column = &self.columns[c];
            let (head, tail) = x.split_at_mut(c + 1);
            let pivot = head[c].map(|value| value * column[0]);
            head[c] = pivot;
            for (target, factor) in tail.iter_mut().zip(&column[1..]) {
                for m in 0..M {
                    target[m] -= factor * pivot[m];
                }
            }
        }
        for c in (0..size).rev() {
            let column = &self.columns[c];
            let (head, tail) = x.split_at_mut(c + 1);
            let mut sum = head[c];
            for (value, factor) in tail.iter().zip(&column[1..]) {
                for m in 0..M {
                    sum[m] -= factor * value[m];
                }
            }
            head[c] = sum.map(|value| value * column[0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The solution of a random banded system solves it.
    #[test]
    fn solves() {
        const B: usize = 5;
        let size = 40;
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let mut band = Band::<B>::zeros(size);
        for column in &mut band.columns {
            for value in column.iter_mut() {
                *value = random();
            }
            column[0] = 6.0;
        }
        let matrix = band.clone();
        let wanted: Vec<[f64; 2]> = (0..size).map(|_| [random(), random()]).collect();
        let mut x = vec![[0.0; 2]; size];
        for c in 0..size {
            for k in 0..B.min(size - c) {
                for m in 0..2 {
                    x[c + k][m] += matrix.columns[c][k] * wanted[c][m];
                    if k > 0 {
                        x[c][m] += matrix.columns[c][k] * wanted[c + k][m];
                    }
                }
            }
        }
        assert!(band.factor());
        band.solve(&mut x);
        for (got, wanted) in x.iter().zip(&wanted) {
            assert!((got[0] - wanted[0]).abs() < 1e-12 && (got[1] - wanted[1]).abs() < 1e-12);
        }
        assert!(!Band::<B>::zeros(3).factor());
    }
}

//! Symmetric positive definite systems with two side diagonals.

/// A symmetric matrix: row `i` holds the diagonal entry, then those of columns `i + 1`, `i + 2`.
pub(super) type Band = Vec<[f64; 3]>;

/// Solves `matrix x = rhs` in place: `rhs` becomes `x`, `matrix` its factor `L D Lᵀ`. Pivots that
/// are not positive are raised to a small part of the largest, so the result is always finite.
///
/// # Source
/// Golub and Van Loan, Matrix Computations, 4th edition, section 4.3 (banded systems).
pub(super) fn solve(matrix: &mut [[f64; 3]], rhs: &mut [f64]) {
    let n = rhs.len();
    let largest = matrix.iter().map(|row| row[0].abs()).fold(0.0, f64::max);
    let floor = largest.max(f64::MIN_POSITIVE) * 1e-18;
    // The two rows above: pivot, then the factors one and two places below it.
    let (mut up1, mut up2) = ([0.0; 3], [0.0; 3]);
    let (mut y1, mut y2) = (0.0, 0.0);
    for i in 0..n {
        let [d, e, f] = matrix[i];
        let (l1, l2) = (up1[1], up2[2]);
        let d = (d - l1 * l1 * up1[0] - l2 * l2 * up2[0]).max(floor);
        let e = e - l1 * up1[2] * up1[0];
        let y = rhs[i] - l1 * y1 - l2 * y2;
        let inverse = 1.0 / d;
        rhs[i] = y;
        matrix[i] = [inverse, e * inverse, f * inverse];
        (up2, up1) = (up1, [d, e * inverse, f * inverse]);
        (y2, y1) = (y1, y);
    }
    for i in (0..n).rev() {
        let mut x = rhs[i] * matrix[i][0];
        if i + 1 < n {
            x -= matrix[i][1] * rhs[i + 1];
        }
        if i + 2 < n {
            x -= matrix[i][2] * rhs[i + 2];
        }
        rhs[i] = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::linalg::solvers::Solve as _;

    #[test]
    fn solves_a_banded_system() {
        let n = 9;
        let full = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 5.0 + i as f64,
            1 => 1.0 - 0.3 * i.min(j) as f64,
            2 => 0.7,
            _ => 0.0,
        };
        let wanted: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        let mut rhs: Vec<f64> = (0..n)
            .map(|i| (0..n).map(|j| full(i, j) * wanted[j]).sum())
            .collect();
        let mut band: Band = (0..n)
            .map(|i| [full(i, i), full(i, i + 1), full(i, i + 2)])
            .collect();
        let matrix = faer::Mat::from_fn(n, n, full);
        let side = faer::Col::from_fn(n, |i| rhs[i]);
        let other = matrix.llt(faer::Side::Lower).unwrap().solve(&side);
        solve(&mut band, &mut rhs);
        for (x, other) in rhs.iter().zip(other.iter()) {
            assert!((x - other).abs() < 1e-12, "{x} here, {other} by faer");
        }
        for (x, wanted) in rhs.iter().zip(&wanted) {
            assert!((x - wanted).abs() < 1e-12);
        }
    }
}

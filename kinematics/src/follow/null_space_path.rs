//! The best null-space motion over a whole path.
//!
//! The candidates are polynomials fitted to the cheapest way through a [grid](super::null_space_grid), in the linear function of
//! the joints that measures it best.

use super::null_space::{NullSpace, NullSpacePolynomial};
use super::null_space_grid::{Cell, Grid, SIZES};
use super::trace::Task;
use nalgebra::{SMatrix, SVector};

/// How often the place where a measure is worst gets more weight in it.
const ROUNDS: usize = 40;

/// The null-space motions to try, best fit first; none if the search finds no way.
pub(super) fn search<const N: usize>(
    task: &Task<'_, N>,
    start: &SVector<f64, N>,
    still: &NullSpace<N>,
) -> Vec<NullSpace<N>> {
    let cheapest = |size| Grid { task, still, size }.cheapest(start);
    let Some(way) = SIZES.into_iter().find_map(cheapest) else {
        return Vec::new();
    };
    let direction = measure(&way);
    let base = direction.dot(start);
    let points: Vec<(f64, f64)> = way
        .iter()
        .map(|(x, cell)| (still.progress(*x)[0], direction.dot(&cell.q) - base))
        .collect();
    [5, 4, 3, 2, 1]
        .into_iter()
        .filter_map(|degree| fit(&points, base, degree))
        .map(|polynomial| {
            let mut moving = still.clone();
            moving.directions[0] = direction;
            moving.polynomials[0] = polynomial;
            moving
        })
        .collect()
}

/// The linear function of the joints that measures the null-space motion along a way: its least product with a spare
/// direction is about as large as can be.
fn measure<const N: usize>(way: &[(f64, Cell<N>)]) -> SVector<f64, N> {
    let mut sum: SVector<f64, N> = way.iter().map(|(_, cell)| cell.spare).sum();
    let mut best = (f64::NEG_INFINITY, sum);
    for _ in 0..ROUNDS {
        let direction = sum.normalize();
        let worst = way
            .iter()
            .map(|(_, cell)| (direction.dot(&cell.spare), cell.spare))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((least, spare)) = worst else { break };
        if least > best.0 {
            best = (least, direction);
        }
        sum += spare;
    }
    best.1
}

/// Least-squares polynomial of a degree up to 5 through points `(progress, offset)`, with
/// offset zero at the start, added to `base`.
fn fit(points: &[(f64, f64)], base: f64, degree: usize) -> Option<NullSpacePolynomial> {
    let mut normal = SMatrix::<f64, 5, 5>::identity();
    let mut right = SVector::<f64, 5>::zeros();
    for i in 0..degree {
        for j in 0..degree {
            normal[(i, j)] = points.iter().map(|(x, _)| x.powi((i + j + 2) as i32)).sum();
        }
        right[i] = points.iter().map(|(x, y)| x.powi(i as i32 + 1) * y).sum();
    }
    let c = normal.cholesky()?.solve(&right);
    Some([base, c[0], c[1], c[2], c[3], c[4]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spare direction that turns by more than a right angle is measured along the whole way, by what is about the best measure.
    #[test]
    fn a_turning_self_motion_is_measured() {
        let way: Vec<(f64, Cell<7>)> = (0..=20)
            .map(|i| {
                let angle = f64::from(i) * 0.12;
                let mut spare = SVector::<f64, 7>::zeros();
                (spare[1], spare[4]) = (angle.cos(), angle.sin());
                (f64::from(i) / 20.0, Cell::at(SVector::zeros(), spare))
            })
            .collect();
        let direction = measure(&way);
        let least = way
            .iter()
            .map(|(_, cell)| direction.dot(&cell.spare))
            .fold(f64::INFINITY, f64::min);
        assert!((direction.norm() - 1.0).abs() < 1e-12);
        // The best measure is half way.
        assert!(least > 0.95 * 1.2_f64.cos(), "{least}");
    }
}

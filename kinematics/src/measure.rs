//! How well an arm can move at a joint position.

use crate::chain::Chain;
use nalgebra::{SMatrix, SVector};

/// Length that counts as much as one radian, m.
pub(crate) const LENGTH: f64 = 0.3;
/// Distance from a limit, rad or m, from which a joint counts as well inside.
pub const ROOM: f64 = 0.1;
/// Smallest singular value ([`Dexterity::smallest`]) that counts as well away from singular poses.
pub const NIMBLE: f64 = 0.05;

/// How well an arm can move at one joint position. Lengths are in units of 0.3 m, so that
/// translations and rotations can be compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dexterity {
    /// Product of the singular values.
    pub manipulability: f64,
    /// Smallest singular value: tool motion per unit of joint motion in the worst direction; zero
    /// where the arm is singular.
    pub smallest: f64,
    /// Largest over smallest singular value; infinite where the arm is singular.
    pub condition: f64,
}

/// Dexterity of an arm at `q` (rad, m).
///
/// # Source
/// T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research
/// 4(2), 1985, eq. 15.
#[must_use]
pub fn dexterity<const N: usize>(chain: &Chain<N>, q: &SVector<f64, N>) -> Dexterity {
    let (_, mut jacobian) = chain.jacobian(q);
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
    let values = singular_values(&jacobian);
    // With fewer joints than six the arm moves in fewer directions.
    let used = &values[6 - N.min(6)..];
    let (smallest, largest) = (used[0], values[5]);
    Dexterity {
        manipulability: used.iter().product(),
        smallest,
        condition: if smallest > 0.0 {
            largest / smallest
        } else {
            f64::INFINITY
        },
    }
}

/// Whether the smallest singular value at `q` is at least `least` for sure; false where that takes a closer look. For
/// six joints or more.
pub(crate) fn surely_nimble<const N: usize>(
    chain: &Chain<N>,
    q: &SVector<f64, N>,
    least: f64,
) -> bool {
    let (_, mut jacobian) = chain.jacobian(q);
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / LENGTH);
    let Some(factor) = (jacobian * jacobian.transpose()).cholesky() else {
        return false;
    };
    // The sum of the inverse squares of the singular values; rounding changes it by less where they are larger
    // than CERTAIN.
    let smallest = (1.0 / factor.inverse().trace()).sqrt() * (1.0 - ROUNDING);
    smallest > CERTAIN.max(least)
}

/// Smallest singular value from which on the sum of inverse squares is exact within [`ROUNDING`].
const CERTAIN: f64 = 1e-3;
const ROUNDING: f64 = 1e-6;

/// The six singular values of a Jacobian in rising order.
///
/// Computed by one-sided Jacobi rotations of the rows, which keeps even the small ones exact.
///
/// # Source
/// G. Golub and C. Van Loan, Matrix Computations, 2013, section 8.6.3.
#[must_use]
pub fn singular_values<const N: usize>(jacobian: &SMatrix<f64, 6, N>) -> [f64; 6] {
    let mut rows: [SVector<f64, N>; 6] = std::array::from_fn(|i| jacobian.row(i).transpose());
    for _ in 0..30 {
        let mut turned = false;
        for i in 0..6 {
            for k in i + 1..6 {
                let (a, b) = (rows[i].norm_squared(), rows[k].norm_squared());
                let c = rows[i].dot(&rows[k]);
                if c.abs() <= 1e-15 * (a * b).sqrt() || c.abs() < 1e-300 {
                    continue;
                }
                turned = true;
                let zeta = (b - a) / (2.0 * c);
                // The tangent is at most 1, and is zero where the square overflows.
                let tangent = zeta.signum() / (zeta.abs() + (zeta * zeta + 1.0).sqrt());
                let cos = 1.0 / (tangent * tangent + 1.0).sqrt();
                let sin = cos * tangent;
                let (x, y) = (rows[i], rows[k]);
                rows[i] = x * cos - y * sin;
                rows[k] = x * sin + y * cos;
            }
        }
        if !turned {
            break;
        }
    }
    let mut values = rows.map(|row| row.norm());
    values.sort_unstable_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ik::Restarts;
    use crate::urdf;

    /// What counts as surely nimble is so, and hardly anything nimble is missed by more than the root of six.
    #[test]
    fn surely_nimble_is_nimble() {
        let text = include_str!("../../robots/panda/robot.urdf");
        let chain = urdf::read(text, None).unwrap().chain::<7>().unwrap();
        let places = Restarts::new(&chain);
        let mut sure = 0;
        for index in 0..500 {
            let q = places.at(index);
            let smallest = dexterity(&chain, &q).smallest;
            for share in [0.3, 0.9, 0.999, 1.001, 1.2] {
                let found = surely_nimble(&chain, &q, share * smallest);
                assert!(!found || share < 1.0, "{smallest} {share}");
                sure += usize::from(found);
            }
            let least = smallest > 0.01;
            assert!(
                !least || surely_nimble(&chain, &q, 0.4 * smallest),
                "{smallest}"
            );
        }
        assert!(sure > 400, "{sure}");
    }
}

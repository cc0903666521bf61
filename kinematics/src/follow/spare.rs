//! The spare joint of an arm by one linear function of the joints: given by the caller along a path, or as one more
//! coordinate beside those of the tool.

use super::NullMotion;
use super::differential::task_rows;
use super::linear::System;
use super::null_space::NullSpace;
use super::redundancy::null_space;
use crate::Chain;
use crate::measure::LENGTH;
use nalgebra::{SMatrix, SVector};
use std::rc::Rc;

impl<const N: usize> NullMotion<N> {
    /// The null-space motion along which the linear function `direction . q` of the joints has the values of `course`, which
    /// gives the value at a path parameter and its first three derivatives. Only for arms with seven joints; others have no such function, or two.
    ///
    /// ```
    /// use kinematics::follow::{FollowOptions, NullMotion, TwistPoint, follow_with, spare_direction};
    /// use kinematics::{Solver, urdf};
    /// use nalgebra::{SVector, Vector3};
    /// # let text = include_str!("../../../robots/panda/robot.urdf");
    /// let solver = Solver::new(urdf::read(text, None)?.chain::<7>()?);
    /// let q = SVector::<f64, 7>::from([0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8]);
    /// let pose = solver.chain().forward(&q);
    /// // The tool stands still, and the elbow turns by about 0.2 rad.
    /// let tool = |_: f64| TwistPoint {
    ///     pose, linear: [Vector3::zeros(); 3], angular: [Vector3::zeros(); 3],
    /// };
    /// let direction = spare_direction(solver.chain(), &q).unwrap();
    /// let first = direction.dot(&q);
    /// let course = move |u: f64| [first + 0.2 * u, 0.2, 0.0, 0.0];
    /// let motion = NullMotion::given(direction, course);
    /// let options = FollowOptions::default();
    /// let points = follow_with(&solver, &tool, (&[0.0, 1.0], &q), &options, &motion)?;
    /// let end = points.last().unwrap().q[0];
    /// assert!((direction.dot(&end) - first - 0.2).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn given(direction: SVector<f64, N>, course: impl Fn(f64) -> [f64; 4] + 'static) -> Self {
        let mut motion = NullSpace::none();
        motion.directions[0] = direction;
        motion.course = Some(Rc::new(course));
        Self(motion)
    }
}

/// The direction (of length 1) in which the joints of an arm with seven joints move at `q` without moving its tool; `None`
/// for other arms.
#[must_use]
pub fn spare_direction<const N: usize>(
    chain: &Chain<N>,
    q: &SVector<f64, N>,
) -> Option<SVector<f64, N>> {
    (N == 7).then(|| null_space(&chain.jacobian(q).1)[0])
}

/// By how much each joint (a row; rad, m) moves at `q`, to first order, with the tool along and about x, y and z of the base
/// (per m and rad), and with the linear function `direction . q` of the joints, which six joints do not have.
/// `None` where the arm is singular, or that function does not say where the spare joint is; and for arms of other than
/// six or seven joints.
///
/// ```
/// use kinematics::{follow, urdf};
/// use nalgebra::{SVector, vector};
/// # let text = include_str!("../../../robots/ur5e/robot.urdf");
/// let chain = urdf::read(text, None)?.chain::<6>()?;
/// let q = SVector::<f64, 6>::from([0.1, -1.2, 1.3, -1.6, -1.5, 0.2]);
/// let changes = follow::joint_changes(&chain, &q, &SVector::zeros()).unwrap();
/// let moved = chain.jacobian(&q).1 * changes.column(0);
/// assert!((moved - vector![1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).amax() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn joint_changes<const N: usize>(
    chain: &Chain<N>,
    q: &SVector<f64, N>,
    direction: &SVector<f64, N>,
) -> Option<SMatrix<f64, N, 7>> {
    if N != 6 && N != 7 {
        return None;
    }
    let mut measured = NullSpace::none();
    measured.directions[0] = *direction;
    let rows = task_rows(&chain.jacobian(q).1, &measured);
    let system = System::<N>::new(&rows);
    if !system.is_regular() {
        return None;
    }
    let mut changes = SMatrix::zeros();
    for coordinate in 0..N {
        let mut b = [0.0; 8];
        b[coordinate] = if coordinate < 3 { 1.0 / LENGTH } else { 1.0 };
        let joints = system.solve(&b, &[0.0; 8]);
        for j in 0..N {
            changes[(j, coordinate)] = joints[j];
        }
    }
    Some(changes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::urdf;

    /// The changes undo the Jacobian and the linear function.
    fn check<const N: usize>(text: &str) {
        let chain = urdf::read(text, None).unwrap().chain::<N>().unwrap();
        for k in 0..20 {
            let q = SVector::<f64, N>::from_fn(|i, _| {
                let middle = 0.5 * (chain.lower()[i] + chain.upper()[i]);
                let wide = (chain.upper()[i] - chain.lower()[i]).min(3.0);
                middle + 0.4 * wide * (1.0 + 2.1 * i as f64 + 0.9 * k as f64).sin()
            });
            let direction = spare_direction(&chain, &q);
            assert_eq!(direction.is_some(), N == 7);
            let direction = direction.unwrap_or_else(SVector::zeros);
            let (_, jacobian) = chain.jacobian(&q);
            assert!((jacobian * direction).amax() < 1e-9);
            let changes = joint_changes(&chain, &q, &direction).unwrap();
            let step = SVector::<f64, N>::from_fn(|i, _| 0.3 - 0.1 * i as f64);
            let mut seen = SVector::<f64, 7>::zeros();
            seen.rows_mut(0, 6).copy_from(&(jacobian * step));
            seen[6] = direction.dot(&step);
            assert!((changes * seen - step).amax() < 1e-8, "{N} {k}");
        }
    }

    #[test]
    fn changes_undo_the_jacobian_and_the_linear_function() {
        check::<6>(include_str!("../../../robots/ur5e/robot.urdf"));
        check::<7>(include_str!("../../../robots/panda/robot.urdf"));
        check::<7>(include_str!("../../../robots/iiwa7/robot.urdf"));
    }

    /// A function that is zero does not say where the spare joint is, and other arms have no such changes.
    #[test]
    fn what_does_not_settle_the_joints_is_refused() {
        let text = include_str!("../../../robots/panda/robot.urdf");
        let chain = urdf::read(text, None).unwrap().chain::<7>().unwrap();
        let q = SVector::<f64, 7>::from([0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8]);
        assert!(joint_changes(&chain, &q, &SVector::zeros()).is_none());
    }
}

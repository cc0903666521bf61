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
    ///     pose, linear: [Vector3::zeros(); 3], angular: [Vector3::zeros(); 3], jump: [Vector3::zeros(); 2],
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

/// The direction (of length 1) of the linear function of the joints that tells best where the spare joint of an arm with seven joints
/// is, at positions that follow each other: of its changes with the spare joint at all of them (rad for each rad that all joints move
/// by) the least is largest. At one position it is [`spare_direction`]. `None` without positions, and for other arms.
///
/// # Source
/// E. G. Gilbert, "An iterative procedure for computing the minimum of a quadratic form on a convex set", SIAM J. Control 4(1), 1966:
/// the point nearest to zero of the convex hull of the directions.
///
/// ```
/// use kinematics::{follow, urdf};
/// use nalgebra::SVector;
/// # let text = include_str!("../../../robots/panda/robot.urdf");
/// let chain = urdf::read(text, None)?.chain::<7>()?;
/// let first = SVector::<f64, 7>::from([0.1, -0.8, 0.1, -2.3, 0.1, 1.6, 0.8]);
/// let last = SVector::<f64, 7>::from([0.9, 0.4, -1.2, -1.6, 1.1, 1.2, 0.1]);
/// let both = follow::spare_direction_along(&chain, [first, last]).unwrap();
/// let [from, to] = [first, last].map(|q| follow::spare_direction(&chain, &q).unwrap());
/// // It tells as much at one of them as at the other.
/// assert!((both.dot(&from).abs() - both.dot(&to).abs()).abs() < 1e-3);
/// assert!(both.dot(&to).abs() > from.dot(&to).abs());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn spare_direction_along<const N: usize>(
    chain: &Chain<N>,
    positions: impl IntoIterator<Item = SVector<f64, N>>,
) -> Option<SVector<f64, N>> {
    let mut directions: Vec<SVector<f64, N>> = Vec::new();
    for q in positions {
        let free = spare_direction(chain, &q)?;
        // The null space has no sign: from one position to the next it turns by less than a right angle.
        let turned = directions.last().is_some_and(|last| last.dot(&free) < 0.0);
        directions.push(if turned { -free } else { free });
    }
    let first = *directions.first()?;
    let mut nearest = first;
    for _ in 0..STEPS {
        let told = |direction: &SVector<f64, N>| nearest.dot(direction);
        let least = directions
            .iter()
            .min_by(|a, b| told(a).total_cmp(&told(b)))?;
        let toward = least - nearest;
        let size = toward.norm_squared();
        if size <= 0.0 {
            break;
        }
        nearest += toward * (-nearest.dot(&toward) / size).clamp(0.0, 1.0);
    }
    // Where zero is in the hull no function tells it everywhere.
    Some(nearest.try_normalize(TELLS).unwrap_or(first))
}

/// Steps towards the function that tells best where the spare joint is, and the least change with it that tells anything.
const STEPS: usize = 200;
const TELLS: f64 = 1e-9;

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

    /// Joints on a way on which the spare joint of a Panda turns far.
    fn on_a_way(chain: &Chain<7>, phase: f64) -> Vec<SVector<f64, 7>> {
        let joints = |k: i32| {
            SVector::<f64, 7>::from_fn(|i, _| {
                let middle = 0.5 * (chain.lower()[i] + chain.upper()[i]);
                middle + 1.1 * (phase * (1.0 + i as f64) + 0.03 * f64::from(k)).sin()
            })
        };
        (0..60).map(joints).collect()
    }

    /// No other function tells more of the spare joint where it tells least; at one position it is the direction there.
    #[test]
    fn one_function_tells_best_where_the_spare_joint_is() {
        let text = include_str!("../../../robots/panda/robot.urdf");
        let chain = urdf::read(text, None).unwrap().chain::<7>().unwrap();
        let mut better = 0;
        for case in 1..12 {
            let way = on_a_way(&chain, 0.7 * f64::from(case));
            let one = spare_direction(&chain, &way[30]).unwrap();
            let same = spare_direction_along(&chain, [way[30]]).unwrap();
            assert!((one.dot(&same).abs() - 1.0).abs() < 1e-9);
            let told = |direction: &SVector<f64, 7>| {
                let all = way.iter().map(|q| spare_direction(&chain, q).unwrap());
                all.map(|free| free.dot(direction).abs())
                    .fold(1.0, f64::min)
            };
            let best = spare_direction_along(&chain, way.clone()).unwrap();
            let least = told(&best);
            better += usize::from(least > told(&one) + 0.05);
            for k in 0..14 {
                let mut other = best;
                other[k % 7] += if k < 7 { 0.1 } else { -0.1 };
                let other = told(&other.normalize());
                assert!(other <= least + 0.01, "{case} {k}: {other}, {least}");
            }
        }
        assert!(better > 3, "{better}");
        let none: [SVector<f64, 7>; 0] = [];
        assert!(spare_direction_along(&chain, none).is_none());
        let text = include_str!("../../../robots/ur5e/robot.urdf");
        let chain = urdf::read(text, None).unwrap().chain::<6>().unwrap();
        assert!(spare_direction_along(&chain, [SVector::zeros()]).is_none());
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

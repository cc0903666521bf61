//! Derivatives of the joints along a tool path, up to the third.

use super::TwistPoint;
use super::linear::{Rows, System};
use super::null_space::NullSpace;
use crate::measure::LENGTH;
use nalgebra::{SMatrix, SVector, Vector3};

/// A screw about the tool point: velocity of the body there, and angular velocity.
#[derive(Clone, Copy)]
struct Screw {
    v: Vector3<f64>,
    w: Vector3<f64>,
}

impl Screw {
    const ZERO: Self = Self {
        v: Vector3::new(0.0, 0.0, 0.0),
        w: Vector3::new(0.0, 0.0, 0.0),
    };

    /// How `other` changes when it is carried along with this motion.
    fn carry(&self, other: &Self) -> Self {
        Self {
            v: self.w.cross(&other.v) + self.v.cross(&other.w),
            w: self.w.cross(&other.w),
        }
    }

    fn plus(&self, other: &Self, factor: f64) -> Self {
        Self {
            v: self.v + other.v * factor,
            w: self.w + other.w * factor,
        }
    }
}

/// Task rows of a Jacobian, lengths in units of [`LENGTH`], with those of the null-space motion.
pub(super) fn task_rows<const N: usize>(
    jacobian: &SMatrix<f64, 6, N>,
    null_space: &NullSpace<N>,
) -> Rows {
    let mut rows: Rows = [[0.0; 8]; 8];
    for j in 0..N {
        for i in 0..3 {
            rows[i][j] = jacobian[(i, j)] / LENGTH;
            rows[3 + i][j] = jacobian[(3 + i, j)];
        }
        for k in 0..N.saturating_sub(6) {
            rows[6 + k][j] = null_space.direction(k)[j];
        }
    }
    rows
}

/// How much the third derivative of the joints jumps where that of the tool does: nothing else jumps there.
fn jump<const N: usize>(system: &System<'_, N>, point: &TwistPoint) -> SVector<f64, N> {
    let [v, w] = point.jump;
    if v == Vector3::zeros() && w == Vector3::zeros() {
        return SVector::zeros();
    }
    let mut b = [0.0; 8];
    for i in 0..3 {
        b[i] = v[i] / LENGTH;
        b[3 + i] = w[i];
    }
    let x = system.solve(&b, &[0.0; 8]);
    SVector::from_fn(|i, _| x[i])
}

/// First to third derivative of the joints to the path parameter at a point of the path, and at its value `u`, and how much
/// the third jumps there.
///
/// With `V` the twist of the tool as a screw in the frame that stands still, `S_i` the
/// screw of joint `i` and `V_i` the motion of link `i`, `S_i' = V_i x S_i`; hence
/// `V' = sum S_i q_i'' + V_i x S_i q_i'` and one derivative more for `V''`.
/// `prior` is what the derivatives were expected to be; it decides only where the
/// arm is singular.
///
/// # Source
/// A. Müller, "Screw and Lie group theory in multibody kinematics", Multibody System
/// Dynamics 43, 2018, section 4 (derivatives of the geometric Jacobian).
pub(super) fn derivatives<const N: usize>(
    jacobian: &SMatrix<f64, 6, N>,
    (u, point): (f64, &TwistPoint),
    null_space: &NullSpace<N>,
    prior: &[SVector<f64, N>; 3],
) -> ([SVector<f64, N>; 3], SVector<f64, N>) {
    let rows = task_rows(jacobian, null_space);
    let system = System::<N>::new(&rows);
    let u_rows = null_space.rates(u);
    let solve = |goal: &Screw, order: usize| -> SVector<f64, N> {
        let mut b = [0.0; 8];
        for i in 0..3 {
            b[i] = goal.v[i] / LENGTH;
            b[3 + i] = goal.w[i];
        }
        for k in 0..N.saturating_sub(6) {
            b[6 + k] = u_rows[k][order];
        }
        let mut expected = [0.0; 8];
        expected[..N].copy_from_slice(prior[order].as_slice());
        let x = system.solve(&b, &expected);
        SVector::from_fn(|i, _| x[i])
    };
    let screw = |i: usize| Screw {
        v: Vector3::new(jacobian[(0, i)], jacobian[(1, i)], jacobian[(2, i)]),
        w: Vector3::new(jacobian[(3, i)], jacobian[(4, i)], jacobian[(5, i)]),
    };
    let [v, dv, ddv] = point.linear;
    let [w, dw, ddw] = point.angular;
    // The tool point moves through the frame that stands still, hence the products.
    let twist = Screw { v, w };
    let twist_1 = Screw {
        v: dv - w.cross(&v),
        w: dw,
    };
    let twist_2 = Screw {
        v: ddv - 2.0 * dw.cross(&v) - w.cross(&dv),
        w: ddw,
    };

    let q1 = solve(&twist, 0);
    let mut bias = Screw::ZERO;
    let mut link = Screw::ZERO;
    for i in 0..N {
        link = link.plus(&screw(i), q1[i]);
        bias = bias.plus(&link.carry(&screw(i)), q1[i]);
    }
    let q2 = solve(&twist_1.plus(&bias, -1.0), 1);
    let (mut bias, mut link, mut link_1) = (Screw::ZERO, Screw::ZERO, Screw::ZERO);
    for i in 0..N {
        let s = screw(i);
        link = link.plus(&s, q1[i]);
        let s_1 = link.carry(&s);
        link_1 = link_1.plus(&s, q2[i]).plus(&s_1, q1[i]);
        let s_2 = link_1.carry(&s).plus(&link.carry(&s_1), 1.0);
        bias = bias.plus(&s_1, 2.0 * q2[i]).plus(&s_2, q1[i]);
    }
    let q3 = solve(&twist_2.plus(&bias, -1.0), 2);
    ([q1, q2, q3], jump(&system, point))
}

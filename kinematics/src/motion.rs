//! The tool's motion when the joints move: its time derivatives, and bounds of these over an
//! interval of time.

use nalgebra::{Isometry3, SVector, Vector3};

use crate::Chain;

/// Pose of the tool and its time derivatives, in the frame that poses are given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolMotion {
    /// Pose of the tool.
    pub pose: Isometry3<f64>,
    /// Velocity, acceleration and jerk of its origin (m/s, m/s², m/s³).
    pub linear: [Vector3<f64>; 3],
    /// Angular velocity and its first two derivatives (rad/s, rad/s², rad/s³).
    pub angular: [Vector3<f64>; 3],
}

/// Bounds of the Taylor coefficients of the tool's motion over an interval of time of length `h`,
/// for an expansion at any time of the interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolGrowth {
    /// Of the position: the norm of derivative `k`, times `h^k / k!` (m). The first bounds the
    /// length of the arm, not the position.
    pub linear: [f64; 9],
    /// Of the angular velocity: the norm of its derivative `k`, times `h^(k+1) / k!` (rad).
    pub angular: [f64; 8],
}

impl<const N: usize> Chain<N> {
    /// Pose of the tool and its time derivatives, from position, velocity, acceleration and jerk of
    /// the joints (rad, rad/s, ...; metres for a joint that slides).
    ///
    /// # Source
    /// H. Bruyninckx and J. De Schutter, "Symbolic differentiation of the velocity mapping for a
    /// serial kinematic chain", Mech. Mach. Theory 31(2), 1996: a column of the Jacobian turns with
    /// its link, and its lever changes with the joints after it. Applied here again for the second
    /// derivative, with sums over the joints after it.
    #[must_use]
    pub fn motion(&self, [q, dq, ddq, dddq]: &[SVector<f64, N>; 4]) -> ToolMotion {
        let (pose, jacobian) = self.jacobian(q);
        let column = |i: usize, row: usize| {
            Vector3::new(
                jacobian[(row, i)],
                jacobian[(row + 1, i)],
                jacobian[(row + 2, i)],
            )
        };
        let zero = Vector3::zeros();
        // Angular velocity of each link, its derivatives, and the derivative of its axis.
        let (mut turning, mut axes) = ([[zero; 2]; N], [[zero; 2]; N]);
        let mut angular = [zero; 3];
        for i in 0..N {
            let axis = column(i, 3);
            let first = angular[0].cross(&axis);
            let second = angular[1].cross(&axis) + angular[0].cross(&first);
            angular[2] += axis * dddq[i] + first * (2.0 * ddq[i]) + second * dq[i];
            angular[1] += axis * ddq[i] + first * dq[i];
            angular[0] += axis * dq[i];
            (turning[i], axes[i]) = ([angular[0], angular[1]], [axis, first]);
        }
        // What the joints after the current one contribute to the tool.
        let mut linear = [zero; 3];
        for i in (0..N).rev() {
            let (lever, [axis, axis_change]) = (column(i, 0), axes[i]);
            let [w, w_change] = turning[i];
            let first = w.cross(&lever) + axis.cross(&linear[0]);
            let second = w_change.cross(&lever)
                + w.cross(&first)
                + axis_change.cross(&linear[0])
                + axis.cross(&linear[1]);
            linear[2] += lever * dddq[i] + first * (2.0 * ddq[i]) + second * dq[i];
            linear[1] += lever * ddq[i] + first * dq[i];
            linear[0] += lever * dq[i];
        }
        ToolMotion {
            pose,
            linear,
            angular,
        }
    }

    /// Bounds of the Taylor coefficients of the tool's motion over an interval of time of length
    /// `h`, from those of the joints: `joints[k]` bounds the magnitude of derivative `k` of each
    /// joint at every time of the interval, times `h^k / k!` (rad; metres for a joint that slides).
    /// The joints are polynomials of degree five at most.
    ///
    /// Every link turns with the joints before it, so that coefficient `k` of its direction is at
    /// most coefficient `k` of `exp(sum of the angles)`, with bounds in place of coefficients.
    ///
    /// # Source
    /// Majorant series (E. T. Whittaker and G. N. Watson, A Course of Modern Analysis, 1927,
    /// section 5.22), for the product of exponentials of R. W. Brockett, "Robotic manipulators and
    /// the product of exponentials formula", 1984.
    #[must_use]
    pub fn growth(&self, joints: &[SVector<f64, N>; 6]) -> ToolGrowth {
        let mut growth = ToolGrowth {
            linear: [0.0; 9],
            angular: [0.0; 8],
        };
        // Coefficients of the sum of the angles so far, and of the directions that they turn.
        let (mut angle, mut turned) = ([0.0; 9], [0.0; 9]);
        turned[0] = 1.0;
        for i in 0..N {
            if self.prismatic()[i] {
                for k in 0..9 {
                    for l in 0..=k.min(5) {
                        growth.linear[k] += joints[l][i] * turned[k - l];
                    }
                }
            } else {
                for k in 0..8 {
                    for l in 0..=k.min(4) {
                        let rate = (l + 1) as f64 * joints[l + 1][i];
                        growth.angular[k] += rate * turned[k - l];
                    }
                }
                for (sum, own) in angle[1..].iter_mut().zip(&joints[1..]) {
                    *sum += own[i];
                }
                turned = exponential(&angle);
            }
            let length = self.beyond(i);
            for (sum, own) in growth.linear.iter_mut().zip(turned) {
                *sum += length * own;
            }
        }
        growth
    }
}

/// The power series `exp(x)` of a power series without a constant term: from `y' = x' y`.
fn exponential(x: &[f64; 9]) -> [f64; 9] {
    let mut y = [0.0; 9];
    y[0] = 1.0;
    for k in 1..9 {
        let sum: f64 = (1..=k).map(|j| j as f64 * x[j] * y[k - j]).sum();
        y[k] = sum / k as f64;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// An arm whose second joint slides.
    fn arm() -> Chain<4> {
        let joint = |name: &str, kind: &str, parent: &str, child: &str, xyz: &str, axis: &str| {
            format!(
                r#"<link name="{child}"/><joint name="{name}" type="{kind}"><parent link="{parent}"/>
                <child link="{child}"/><origin xyz="{xyz}" rpy="0.3 -0.2 0.5"/><axis xyz="{axis}"/>
                <limit lower="-3" upper="3" velocity="2" effort="5"/></joint>"#
            )
        };
        let text = format!(
            r#"<robot name="arm"><link name="base"/>{}{}{}{}</robot>"#,
            joint("a", "revolute", "base", "l1", "0 0 0.3", "0 0 1"),
            joint("b", "prismatic", "l1", "l2", "0.1 0 0.2", "1 0 0"),
            joint("c", "revolute", "l2", "l3", "0.2 0.1 0", "0 1 0"),
            joint("d", "revolute", "l3", "l4", "0.3 0 0.1", "0 0.6 0.8"),
        );
        crate::urdf::read(&text, None)
            .unwrap()
            .chain::<4>()
            .unwrap()
            .with_tool(&Isometry3::translation(0.1, 0.05, 0.2))
    }

    /// Quintic joints at a time: position and three derivatives.
    fn joints(c: &[SVector<f64, 4>; 6], t: f64) -> [SVector<f64, 4>; 4] {
        std::array::from_fn(|order| {
            (order..6).rev().fold(SVector::zeros(), |sum, k| {
                let factor: f64 = (k - order + 1..=k).map(|x| x as f64).product();
                sum * t + c[k] * factor
            })
        })
    }

    fn quintic() -> impl Strategy<Value = [SVector<f64, 4>; 6]> {
        prop::array::uniform6(prop::array::uniform4(-1.0..1.0_f64))
            .prop_map(|c| c.map(SVector::from))
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), ..ProptestConfig::default() })]

        /// Each derivative is the difference quotient of the one before.
        #[test]
        fn derivatives_are_derivatives(c in quintic(), t in 0.0..0.8_f64) {
            let (arm, d) = (arm(), 1e-5);
            let at = |t: f64| arm.motion(&joints(&c, t));
            let (before, here, after) = (at(t - d), at(t), at(t + d));
            let place = |m: &ToolMotion| m.pose.translation.vector;
            let near = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-4 * (1.0 + b.norm());
            prop_assert!(near((place(&after) - place(&before)) / (2.0 * d), here.linear[0]));
            let turn = after.pose.rotation * before.pose.rotation.inverse();
            prop_assert!(near(turn.scaled_axis() / (2.0 * d), here.angular[0]));
            for k in 0..2 {
                prop_assert!(near((after.linear[k] - before.linear[k]) / (2.0 * d), here.linear[k + 1]));
                prop_assert!(near((after.angular[k] - before.angular[k]) / (2.0 * d), here.angular[k + 1]));
            }
        }

        /// The bounds hold for the derivatives that can be computed, at every moment.
        #[test]
        fn growth_bounds_derivatives(c in quintic(), h in 0.05..0.6_f64) {
            let arm = arm();
            let mut bounds = [SVector::zeros(); 6];
            for (k, bound) in bounds.iter_mut().enumerate() {
                for l in k..6 {
                    let choose: f64 = (0..k).map(|i| (l - i) as f64 / (i + 1) as f64).product();
                    *bound += c[l].abs() * (choose * h.powi(l as i32));
                }
            }
            let growth = arm.growth(&bounds);
            for step in 0..=20 {
                let m = arm.motion(&joints(&c, h * f64::from(step) / 20.0));
                let factorial = [1.0, 2.0, 6.0];
                for k in 0..3 {
                    let scale = h.powi(k as i32 + 1);
                    let seen = m.linear[k].norm() * scale / factorial[k];
                    prop_assert!(seen <= growth.linear[k + 1] * (1.0 + 1e-12), "{k}: {seen} {growth:?}");
                    let seen = m.angular[k].norm() * scale / [1.0, 1.0, 2.0][k];
                    prop_assert!(seen <= growth.angular[k] * (1.0 + 1e-12), "{k}: {seen} {growth:?}");
                }
            }
        }
    }
}

//! The tool's motion when the joints move: its time derivatives, and bounds of these over an
//! interval of time.

use nalgebra::{Isometry3, SVector, Vector3};

use crate::Chain;
use crate::chain::cross;
use simd::{F4, Four, Op};

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
    /// J. J. Craig, Introduction to Robotics, 2005, section 6.7: velocities and accelerations from
    /// link to link, here once more differentiated.
    #[must_use]
    pub fn motion(&self, joints: &[SVector<f64, N>; 4]) -> ToolMotion {
        self.build().run(Derivatives {
            chain: self,
            joints,
        })
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

/// Pose and derivatives of the tool, from link to link, compiled for both builds.
struct Derivatives<'a, const N: usize> {
    chain: &'a Chain<N>,
    joints: &'a [SVector<f64, N>; 4],
}

impl<const N: usize> Op for Derivatives<'_, N> {
    type Output = ToolMotion;

    #[inline(always)]
    fn run<A: Four>(self, a: A) -> ToolMotion {
        let [q, dq, ddq, dddq] = self.joints;
        let reached = self.chain.reach(a, q);
        let zero = F4::splat(a, 0.0);
        let (mut angular, mut linear) = ([zero; 3], [zero; 3]);
        let mut before = reached.points[0];
        for i in 0..N {
            let [w, dw, ddw] = angular;
            let axis = reached.axes[i];
            let first = cross(w, axis);
            let second = cross(dw, axis) + cross(w, first);
            let (d, dd, ddd) = (dq[i], ddq[i], dddq[i]);
            // What the joint adds to the motion of its point, or of its link.
            let own = [
                axis * d,
                axis * dd + first * d,
                axis * ddd + first * (2.0 * dd) + second * d,
            ];
            let slides = self.chain.slides(i);
            let added = if slides { own } else { [zero; 3] };
            let arm = carried(&angular, reached.points[i] - before, added);
            linear = sums(linear, arm);
            before = reached.points[i];
            if !slides {
                angular = [w + own[0], dw + own[1], ddw + own[2]];
            }
        }
        let arm = carried(&angular, reached.end.p - before, [zero; 3]);
        ToolMotion {
            pose: reached.end.frame().isometry(),
            linear: vectors(sums(linear, arm)),
            angular: vectors(angular),
        }
    }
}

/// The sums of three pairs. Not by `map` of arrays, which would be compiled without SIMD.
#[inline(always)]
fn sums<A: Four>([a, b, c]: [F4<A>; 3], [x, y, z]: [F4<A>; 3]) -> [F4<A>; 3] {
    [a + x, b + y, c + z]
}

/// The first three numbers of each.
#[inline(always)]
fn vectors<A: Four>([a, b, c]: [F4<A>; 3]) -> [Vector3<f64>; 3] {
    let ([ax, ay, az, _], [bx, by, bz, _], [cx, cy, cz, _]) = (a.array(), b.array(), c.array());
    [
        Vector3::new(ax, ay, az),
        Vector3::new(bx, by, bz),
        Vector3::new(cx, cy, cz),
    ]
}

/// The first three derivatives of a vector that turns with a link, and to which derivatives are
/// `added`.
#[inline(always)]
fn carried<A: Four>([w, dw, ddw]: &[F4<A>; 3], r: F4<A>, [s1, s2, s3]: [F4<A>; 3]) -> [F4<A>; 3] {
    let r1 = cross(*w, r) + s1;
    let r2 = cross(*dw, r) + cross(*w, r1) + s2;
    let r3 = cross(*ddw, r) + cross(*dw, r1) * 2.0 + cross(*w, r2) + s3;
    [r1, r2, r3]
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
